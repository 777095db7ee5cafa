"""Bags of ROS looked through before they are opened: lengths that fit, chunks of bounded size.

rosbags believes what a bag says of its own lengths, and unpacks whatever a chunk holds.
"""

import bz2
import struct
from collections import deque
from functools import partial
from importlib import import_module
from pathlib import Path

from dollop.formats.files import FormatError, from_file, read_bytes

__all__ = ["MAX_CHUNK", "bound_chunks", "check_bag"]

MAX_CHUNK = 1 << 26
"""Bytes that a chunk may unpack to: rosbag writes 768 KiB, ROS 2 4 MiB; bzip2 packs a gigabyte."""
MAX_METADATA, MAX_NODES = 1 << 20, 100_000
"""Bytes and nodes of a bag's metadata.yaml: a thousand topics with their settings."""
BAG, MCAP = b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n"
CHUNK = 6
"""What a record of an mcap file begins with that is a chunk."""


def check_bag(path):
    """Refuse a bag that says of itself what cannot be.

    Parameters
    ----------
    path : str or Path
        A `.bag`, an `.mcap`, or a folder with a `metadata.yaml`; nothing is asked of what else it is.

    Raises
    ------
    FormatError
        Where a record runs past the end of the file, a chunk of an mcap file unpacks to more than
        64 MiB, or the metadata are larger than 1 MiB, have more than 100,000 nodes, or are refused
        by `dollop.formats.plain_yaml.plain_nodes`.
    """
    path = Path(path)
    if path.is_dir():
        if (path / "metadata.yaml").exists():
            _check_metadata(path / "metadata.yaml")
        for each in sorted(path.glob("*.mcap")):
            check_bag(each)
    elif path.is_file():
        with open(path, "rb") as stream:
            if path.suffix == ".bag" and stream.read(len(BAG)) == BAG:
                _check_records(path, stream, path.stat().st_size)
            elif path.suffix == ".mcap" and stream.read(len(MCAP)) == MCAP:
                _check_mcap(path, stream, path.stat().st_size)


def bound_chunks(readers):
    """Let no chunk of a ROS 1 bag unpack to more than there is room for.

    Parameters
    ----------
    readers : sequence of rosbags' readers
        Open; they are changed.
    """
    lz4 = import_module("lz4.frame")  # which rosbags brings
    kinds = {bz2.decompress: bz2.BZ2Decompressor, lz4.decompress: lz4.LZ4FrameDecompressor}
    for reader in readers:
        chunks = getattr(reader, "chunks", {})
        for place, chunk in chunks.items():
            kind = kinds.get(getattr(chunk, "decompressor", None))
            if kind:
                chunks[place] = chunk._replace(decompressor=partial(_unpacked, kind))


def _unpacked(kind, packed):
    """A chunk unpacked by a decompressor of a kind, as long as it is no longer than `MAX_CHUNK`."""
    content = kind().decompress(packed, MAX_CHUNK + 1)
    if len(content) > MAX_CHUNK:
        raise ValueError(f"a chunk unpacks to more than {MAX_CHUNK} bytes, the most that is read")
    return content


def _check_metadata(path):
    from dollop.formats.plain_yaml import plain_nodes

    from_file(path, deque, plain_nodes(read_bytes(path, MAX_METADATA), MAX_NODES), 0)


def _check_records(path, stream, size):
    """Records of a ROS 1 bag: head and content, each after its length; the index is where one begins."""
    places = {0, size}  # of a bag that was not closed, of which rosbags says what to do
    while (place := stream.tell()) < size:
        places.add(place)
        for _ in range(2):
            length = int.from_bytes(stream.read(4), "little")
            if stream.seek(length, 1) > size:
                raise FormatError(f"a record at byte {place} runs past the end of the file", path)
    stream.seek(len(BAG))
    _, _, index = stream.read(200).partition(b"index_pos=")
    if int.from_bytes(index[:8], "little") not in places:
        raise FormatError("the index must be where a record begins", path)


def _check_mcap(path, stream, size):
    """Records of an mcap file: what they are, their length and their content; the index is where some begin."""
    stream.seek(max(size - len(MCAP) - 20, 0))
    footer, summary = size - len(MCAP) - 29, int.from_bytes(stream.read(8), "little")
    stream.seek(len(MCAP))
    missed = {footer, summary} - {0}  # of a file without a summary
    while (place := stream.tell()) + 9 <= size - len(MCAP):
        missed.discard(place)
        kind, length = struct.unpack("<BQ", stream.read(9))
        if length > size - stream.tell():
            found = f"a record of {length} bytes at byte {place}"
            raise FormatError(f"{found} runs past the end of the file", path)
        if kind == CHUNK:
            _check_chunk(path, stream.read(length))
        else:
            stream.seek(length, 1)
    if missed:
        raise FormatError("the index must be where a record begins, and a footer at the end", path)


def _check_chunk(path, chunk):
    """A chunk of an mcap file: times, sizes, how it is packed, and what it holds."""
    if len(chunk) < 40:
        raise FormatError(f"a chunk must have 40 bytes at least, got {len(chunk)}", path)
    (unpacked,), (named,) = struct.unpack_from("<Q", chunk, 16), struct.unpack_from("<I", chunk, 28)
    if unpacked > MAX_CHUNK:
        rule = f"is larger than {MAX_CHUNK}, the most that is read"
        raise FormatError(f"a chunk of {unpacked} bytes {rule}", path)
    kind = _mcap_kinds().get(chunk[32 : 32 + min(named, 40)])
    try:
        if kind:
            _unpacked(kind, chunk[32 + named + 8 :])
    except Exception as error:  # whatever the decompressors happen to raise
        raise FormatError(f"a chunk cannot be unpacked ({error})", path) from None


def _mcap_kinds():
    """Decompressors by the name that mcap has for them; rosbags brings their modules."""
    from rosbags.rosbag2.storage_mcap import zstd

    lz4 = import_module("lz4.frame")
    return {b"lz4": lz4.LZ4FrameDecompressor, b"zstd": zstd.ZstdDecompressor}
