"""CARMEN's map files, the occupancy grids of the paper's toolkit [6] (`map_io.h`, CARMEN 0.7)."""

import re
import struct

import numpy as np

from dollop.checks import told
from dollop.formats.files import (
    MAX_CELLS,
    FormatError,
    check_cells,
    from_file,
    read_bytes,
    written_number,
)
from dollop.formats.kinds import CARMEN_MAP
from dollop.formats.writing import Output, packed, whole_file

__all__ = ["OCCUPIED_FROM", "SUFFIXES", "outputs", "read_map", "write_map"]

SUFFIXES = (".map", ".map.gz")

OCCUPIED_FROM = 0.5
"""Probability from which a cell is occupied (`occupied_prob` in CARMEN's parameters)."""

MAP_LABEL = b"CARMENMAPFILEv020"
GRIDMAP_CHUNK, NAMED_CHUNK = 1, 128

MAX_HEAD, MAX_CHUNKS = 1 << 16, 1000
"""Bytes of the comment lines, and chunks that are looked through: CARMEN writes ten and five."""


def read_map(path):
    """Occupancy of a CARMEN map file, plain or gzipped.

    The version is v020 (`map_io.h`). After comment lines and the label the file is a sequence of
    chunks: one byte of type, four of size, then ten of description. The gridmap chunk holds two
    int32 sizes, a float32 resolution and the float32 probabilities, x-major; -1 is unknown. Index
    times resolution is the world coordinate of a cell's *centre* (`carmen_map_to_world`).

    Parameters
    ----------
    path : str or Path
        The map, of at most 20 million cells, its comment lines in the first 64 KiB.

    Returns
    -------
    occupancy : (H, W) float array
        Indexed [y, x], NaN where unknown.
    origin : (float, float)
        Lower left cell's corner, in m: half a cell below zero, unless the map was written by
        `write_map`.
    resolution : float
        Metres per cell.

    Raises
    ------
    FormatError
        If label, chunks, sizes or probabilities are not what they should be.
    """
    content = read_bytes(path, 4 * MAX_CELLS + (1 << 20))
    head = re.match(rb"((#.*)?\n)*" + MAP_LABEL, content[:MAX_HEAD])
    if not head:
        raise FormatError(f"no {MAP_LABEL.decode()} after the comment lines", path)
    body = _gridmap_chunk(path, content, head.end())
    width, height, resolution = struct.unpack_from("<iif", body.ljust(12, b"\0"))
    fits = len(body) == 12 + 4 * width * height
    if not (fits and width > 0 and height > 0 and 0 < resolution < np.inf):
        cells = f"{width} x {height} cells of {resolution} m"
        raise FormatError(f"{cells} do not fit a chunk of {len(body)} bytes", path)
    from_file(path, check_cells, width, height)
    # float32 turns 0.1 into 0.10000000149; seven digits are all it holds.
    resolution = float(f"{resolution:.7g}")
    with np.errstate(invalid="ignore"):  # a NaN that signals is found below
        occupancy = np.frombuffer(body, "<f4", offset=12).reshape(width, height).T.astype(float)
    wrong = ~((occupancy == -1) | ((occupancy >= 0) & (occupancy <= 1)))
    if wrong.any():
        raise FormatError(f"an occupancy must be in [0, 1], or -1 where unknown, got {occupancy[wrong][0]}", path)
    occupancy[occupancy == -1] = np.nan
    return occupancy, _map_origin(path, head[0], resolution), resolution


def _gridmap_chunk(path, content, place):
    """Content of the first gridmap chunk, without its description and name."""
    for _ in range(MAX_CHUNKS):
        if place + 5 > len(content):
            raise FormatError("no gridmap chunk in the file", path)
        kind, size = struct.unpack_from("<Bi", content, place)
        if size < 0 or place + 5 + size > len(content):
            raise FormatError(f"a chunk of {size} bytes at byte {place} runs past the end of the file", path)
        chunk = content[place + 15 : place + 5 + size]
        if kind & ~NAMED_CHUNK == GRIDMAP_CHUNK:
            return chunk.partition(b"\0")[2] if kind & NAMED_CHUNK else chunk
        place += 5 + size
    rule = f"among the first {MAX_CHUNKS}, the most that are looked through"
    raise FormatError(f"no gridmap chunk {rule}", path)


def _map_origin(path, head, resolution):
    """Lower left corner in m, which `write_map` keeps in a comment."""
    found = re.search(rb"^# Lower left    : (.*)$", head, re.MULTILINE)
    if not found:
        return -resolution / 2, -resolution / 2
    name, corner = "the lower left corner", found[1].decode(errors="replace").split()
    if len(corner) != 2:
        raise FormatError(f"{name} must be two numbers, got {told(found[1])}", path)
    return tuple(from_file(path, written_number, name, each) for each in corner)


def outputs(path):
    """What `write_map` writes.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of Output
    """
    return [Output(path, CARMEN_MAP)]


def write_map(path, occupancy, origin, resolution):
    """Write an occupancy grid as a CARMEN map file; see `read_map`.

    CARMEN's map frame begins at the centre of the lower left cell. Where the grid lies otherwise,
    its place is kept in a comment line of the head, which `read_map` honours and CARMEN passes
    over.

    Parameters
    ----------
    path : str or Path
        The file, gzipped if named `.gz`; it appears whole or not at all.
    occupancy : (H, W) float array
        Probabilities in [0, 1], NaN where unknown.
    origin : (float, float)
        Lower left cell's corner, in m.
    resolution : float
        Metres per cell.
    """
    height, width = occupancy.shape
    cells = np.where(np.isnan(occupancy), -1, occupancy).T.astype("<f4").tobytes()
    chunk = b"GRIDMAP   " + struct.pack("<iif", width, height, resolution) + cells
    head = f"# Map size      : {width} x {height}\n# Resolution    : {resolution:g}\n"
    head += f"# Lower left    : {float(origin[0])!r} {float(origin[1])!r}\n"
    with whole_file(path, kind=CARMEN_MAP) as file, packed(file, path) as stream:
        stream.write(b"# Carnegie Mellon Robot Toolkit (CARMEN) map file\n")
        stream.write(head.encode() + MAP_LABEL)
        stream.write(struct.pack("<Bi", GRIDMAP_CHUNK, len(chunk)) + chunk)
