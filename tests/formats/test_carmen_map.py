"""CARMEN maps."""

import gzip
import os
import struct
from pathlib import Path

import numpy as np
import pytest

from dollop.formats import carmen_map
from dollop.formats.files import FormatError

external = pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")


def map_file(cells, chunks=b"", kind=1, name=b"", size=None):
    """A map file as CARMEN writes it, of (width, height) cells of 0.1 m."""
    width, height = cells.shape
    chunk = b"GRIDMAP   " + name + struct.pack("<iif", width, height, 0.1)
    chunk += cells.astype("<f4").tobytes()
    head = b"# Map size : 2 x 3\n#\nCARMENMAPFILEv020"
    return head + chunks + struct.pack("<Bi", kind, len(chunk) if size is None else size) + chunk


CELLS = np.array([[0.0, 0.5, -1.0], [1.0, 0.25, 0.75]])


def test_map_is_read_by_rows_of_y(tmp_path):
    """Cell [x][y] of the file is row y, column x.

    -1 is unknown; other chunks and the chunk's name are passed over.
    """
    other = struct.pack("<Bi", 32, 4) + b"abcd"
    packed = gzip.compress(map_file(CELLS, kind=129, name=b"floor\0"))
    for content in (map_file(CELLS, other), packed):
        (tmp_path / "a.map").write_bytes(content)
        occupancy, origin, resolution = carmen_map.read_map(tmp_path / "a.map")
        np.testing.assert_array_equal(occupancy, [[0.0, 1.0], [0.5, 0.25], [np.nan, 0.75]])
        assert resolution == 0.1 and origin == (-0.05, -0.05)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (map_file(CELLS)[:-3], "runs past the end"),
        (map_file(CELLS, size=20), "cut short|do not fit"),
        (map_file(CELLS, size=-20), "runs past the end"),
        (map_file(CELLS, kind=2), "no gridmap chunk"),
        (map_file(CELLS + 1), r"must be in \[0, 1\]"),
        (map_file(CELLS * np.nan), r"must be in \[0, 1\]"),
        (b"# a comment\nP5 3 3 255\n", "no CARMENMAPFILEv020"),
        (b"FLASER 1\nCARMENMAPFILEv020", "no CARMENMAPFILEv020"),
        (b"CARMENMAPFILEv020", "no gridmap chunk"),
    ],
)
def test_what_is_no_map(tmp_path, content, message):
    """Cut off, mislabelled and impossible maps give a FormatError that says what is wrong."""
    (tmp_path / "a.map").write_bytes(content)
    with pytest.raises(FormatError, match=message):
        carmen_map.read_map(tmp_path / "a.map")


@external
@pytest.mark.parametrize(("name", "shape"), [("wean5300", (326, 657)), ("thickwean", (170, 477))])
def test_real_maps(name, shape):
    """The maps of the paper's own era are read.

    Decimetre cells, mostly unknown, a few per cent occupied.
    """
    path = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / f"carmen_maps/{name}.map"
    occupancy, _, resolution = carmen_map.read_map(path)
    assert occupancy.shape == shape and resolution == 0.1
    assert 0.7 < np.isnan(occupancy).mean() < 0.9 and 0.02 < (occupancy >= 0.5).mean() < 0.1


def test_a_written_map_is_read_back_in_place(tmp_path):
    """Rows stay rows, and the corner of a map that is wider than high comes back x before y."""
    occupancy = np.array([[0.0, 0.5, np.nan], [1.0, 0.25, 0.75]])
    carmen_map.write_map(tmp_path / "a.map", occupancy, (1.5, -2.0), 0.1)
    read, origin, resolution = carmen_map.read_map(tmp_path / "a.map")
    np.testing.assert_array_equal(read, occupancy)
    assert origin == (1.5, -2.0) and resolution == 0.1


def test_a_packed_map_is_the_plain_one(tmp_path):
    """What `.map.gz` holds is `.map` to the last byte, without name and time, whenever it is written."""
    occupancy = np.where(np.eye(40) > 0, 1.0, np.nan)
    for name in ("a.map", "a.map.gz", "b.map.gz"):
        carmen_map.write_map(tmp_path / name, occupancy, (1.5, -2.0), 0.1)
    plain, packed, again = ((tmp_path / name).read_bytes() for name in ("a.map", "a.map.gz", "b.map.gz"))
    assert gzip.decompress(packed) == plain and len(packed) < len(plain) / 4
    assert packed == again and packed[3:8] == bytes(5)  # no name in it, and no time


CORNER = b"# Lower left    : %s\n"


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (CORNER % b"1_0 2" + map_file(CELLS), "the lower left corner must be a number, got '1_0'"),
        (CORNER % b"1e300 2" + map_file(CELLS), r"the lower left corner must be a number within 1e\+09, got"),
        (CORNER % (b"1 " * 1000) + map_file(CELLS), "the lower left corner must be two numbers, got"),
        (b"\n" * 70_000 + map_file(CELLS), "no CARMENMAPFILEv020 after the comment lines"),
        (map_file(CELLS, struct.pack("<Bi", 9, 0) * 2000), "no gridmap chunk among the first 1000"),
        (gzip.compress(map_file(CELLS)[:-1] + bytes(102 << 20), 1), "holds more than 81048576 bytes"),
        (gzip.compress(map_file(CELLS))[:-9], "gzip data cut short or damaged"),
    ],
)
def test_maps_that_would_take_too_long_or_lie(tmp_path, content, message):
    """Corners that only Python reads, heads and chunks without end, and more cells than there is room for."""
    for name in ("a.map", "a.map.gz"):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(FormatError, match=message) as error:
            carmen_map.read_map(tmp_path / name)
        assert len(str(error.value)) <= 300


def test_a_nan_that_signals_does_not_warn(tmp_path, recwarn):
    """It is no probability, like any other."""
    content = map_file(CELLS)
    (tmp_path / "a.map").write_bytes(content[:-4] + bytes.fromhex("0100a07f"))
    with pytest.raises(FormatError, match=r"an occupancy must be in \[0, 1\], .*, got nan"):
        carmen_map.read_map(tmp_path / "a.map")
    assert not recwarn
