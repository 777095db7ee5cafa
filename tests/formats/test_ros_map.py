"""Maps of ROS map_server: what their YAML and picture mean, as others write them and as we do."""

import io

import numpy as np
import pytest
from PIL import Image

from dollop.formats.files import FormatError
from dollop.gridmap import OccupancyGrid

MAP_SERVER = """# written by map_server
image: "floor.pgm"
resolution: 0.050000
origin: [-10.0, 5.5, 0.000000]  # x, y, yaw
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""
PGM = b"P5\n# CREATOR: map_saver\n3 2\n255\n" + bytes([0, 205, 254, 254, 100, 80])


def load_ros(folder, text=MAP_SERVER, picture=PGM):
    """Load a ROS map of these contents."""
    (folder / "floor.pgm").write_bytes(picture)
    (folder / "floor.yaml").write_text(text)
    return OccupancyGrid.load(folder / "floor.yaml")


def test_map_server_map(tmp_path):
    """A map as map_server saves it.

    First row of the picture on top, dark is occupied, grey between is unknown.
    """
    grid = load_ros(tmp_path)
    assert grid.origin == (-10.0, 5.5) and grid.resolution == 0.05
    assert grid.occupied.tolist() == [[False, False, True], [True, False, False]]
    assert grid.unknown.tolist() == [[False, True, False], [False, True, False]]


@pytest.mark.parametrize(
    ("old", "new", "occupied"),
    [
        ("negate: 0", "negate: 1", [[True, False, False], [False, True, True]]),
        ("negate: 0", "negate: yes", [[True, False, False], [False, True, True]]),
        ("negate: 0", "negate: FALSE", [[False, False, True], [True, False, False]]),
        ("0.65", "0.5", [[False, True, True], [True, False, False]]),
        ("free_thresh", "mode: scale\nfree_thresh", [[False, True, True], [True, False, False]]),
        ("free_thresh", "mode: raw\nfree_thresh", [[False, True, True], [False, False, False]]),
    ],
)
def test_map_server_options(tmp_path, old, new, occupied):
    """Negation, thresholds and modes mean what map_server says."""
    assert load_ros(tmp_path, MAP_SERVER.replace(old, new)).occupied.tolist() == occupied


@pytest.mark.parametrize(
    "origin",
    [
        "origin:\n- -10.0\n- 5.5\n- 0.0",  # as PyYAML dumps it
        "origin:\n  - -10.0  # x\n  - 5.5\n\n  - 1e-9",
        "origin: [-10.0,\n  5.5, 0.0]",
        "origin: [-10.0,\n5.5,\n0.0\n]",
        "origin: [-10.0, 5.5, -1.0e-9]\r",
    ],
)
def test_lists_of_yaml(tmp_path, origin):
    """An origin is read however YAML lays out its three numbers.

    A heading of a rounding error is none.
    """
    text = MAP_SERVER.replace("origin: [-10.0, 5.5, 0.000000]  # x, y, yaw", origin)
    assert load_ros(tmp_path, text).origin == (-10.0, 5.5)


@pytest.mark.parametrize(
    "name",
    [
        *("my room #2", " room", "bob's", 'a "b" #c', "- a"),
        *("b: c", "caf\u00e9", "\\", "\n", "%x"),
    ],
)
def test_every_name_reads_back(tmp_path, name):
    """Whatever the map is called, its YAML names the picture beside it."""
    OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05).save(tmp_path / f"{name}.yaml")
    assert OccupancyGrid.load(tmp_path / f"{name}.yaml").occupied.tolist() == [[False, True]]


@pytest.mark.parametrize(
    "image",
    [
        *("'floor #1.pgm'", '"floor #1.pgm"  # the first'),
        *('"floor \\u00231.pgm"', '"floor \\x231.pgm"', "floor\n  #1.pgm"),
    ],
)
def test_names_in_yaml(tmp_path, image):
    """A name in either kind of quotes is what stands between them.

    Only outside does # begin a comment.
    """
    (tmp_path / "floor #1.pgm").write_bytes(PGM)
    text = MAP_SERVER.replace('"floor.pgm"', image)
    if image.startswith("floor"):
        with pytest.raises(FormatError, match="its picture 'floor' is missing"):
            load_ros(tmp_path, text)
    else:
        assert load_ros(tmp_path, text).occupancy.shape == (2, 3)


@pytest.mark.parametrize("mode", ["L", "1", "P", "LA", "RGB", "RGBA", "I;16"])
def test_png_maps(tmp_path, mode):
    """A PNG of any colour mode is the same map as the PGM.

    See-through pixels and broken files are refused.
    """
    grey = np.array([[0, 255, 255], [255, 0, 0]], np.uint8)
    sixteen_bits = Image.fromarray(grey.astype(np.uint16) * 257)
    picture = sixteen_bits if mode == "I;16" else Image.fromarray(grey).convert(mode)
    packed = io.BytesIO()
    picture.save(packed, "png")
    grid = load_ros(tmp_path, picture=packed.getvalue())
    np.testing.assert_array_equal(
        grid.occupancy, load_ros(tmp_path, picture=b"P5 3 2 255\n" + grey.tobytes()).occupancy
    )
    with pytest.raises(FormatError, match=r"floor\.pgm: not a readable picture"):
        load_ros(tmp_path, picture=packed.getvalue()[:40])
    if mode == "RGBA":
        picture.putpixel((1, 1), (0, 0, 0, 0))
        picture.save(tmp_path / "clear.png")
        with pytest.raises(FormatError, match="no transparent pixels"):
            load_ros(tmp_path, picture=(tmp_path / "clear.png").read_bytes())


def test_a_map_is_replaced_whole(tmp_path):
    """If the YAML cannot be written, the picture stays as it was."""
    (tmp_path / "a.yaml").mkdir()
    (tmp_path / "a.pgm").write_bytes(PGM)
    with pytest.raises(IsADirectoryError, match=r"a\.yaml cannot be written"):
        OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05).save(tmp_path / "a.yaml")
    assert (tmp_path / "a.pgm").read_bytes() == PGM and len(list(tmp_path.iterdir())) == 2


def test_a_map_is_replaced_only_when_both_files_are_written(tmp_path):
    """If the picture cannot be written, the YAML stays as it was."""
    (tmp_path / "a.pgm").mkdir()
    (tmp_path / "a.yaml").write_text("old")
    with pytest.raises(IsADirectoryError, match=r"a\.pgm cannot be written"):
        OccupancyGrid([[0.0, 1.0]], (0.0, 0.0), 0.05).save(tmp_path / "a.yaml")
    assert (tmp_path / "a.yaml").read_text() == "old" and len(list(tmp_path.iterdir())) == 2


def test_plain_pgm(tmp_path):
    """A picture in plain text and with fewer steps of grey is read the same."""
    grid = load_ros(tmp_path, picture=b"P2 3 2 # three by two\n5\n0 4 5\n5 2 1\n")
    assert grid.occupied.tolist() == [[False, False, True], [True, False, False]]


@pytest.mark.parametrize(
    ("text", "picture", "message"),
    [
        ("image: floor.pgm\nresolution: 0.05\n", PGM, "origin must be .x, y, 0. .*, got None"),
        (MAP_SERVER.replace("0.050000", "fine"), PGM, "resolution must be a number, got 'fine'"),
        (MAP_SERVER.replace("0.050000", "yes"), PGM, "resolution must be a number, got 'yes'"),
        (MAP_SERVER.replace("0.050000", "-1"), PGM, "resolution must be .*, got -1"),
        (MAP_SERVER.replace("0.000000", "0.3"), PGM, r"a turned map is not supported"),
        (MAP_SERVER.replace("5.5, ", ""), PGM, r"origin must be \[x, y, 0\]"),
        (MAP_SERVER.replace("5.5", "nan"), PGM, "origin must be"),
        (MAP_SERVER.replace("0.000000", "nan"), PGM, "origin must be a number, got 'nan'"),
        (MAP_SERVER.replace("negate: 0", "negate: banana"), PGM, "negate must be .*, got 'banana'"),
        (
            MAP_SERVER.replace("negate: 0", "negate:"),
            PGM,
            "negate must be one of 0, false, .*, on, got ''",
        ),
        (MAP_SERVER.replace("0.65", "nan"), PGM, "occupied_thresh must be a number, got 'nan'"),
        (MAP_SERVER.replace("0.65", "5"), PGM, "<= 1, got free_thresh 0.196 and occupied_thresh 5"),
        (MAP_SERVER.replace("0.65", "0.1"), PGM, "free_thresh 0.196 and occupied_thresh 0.1"),
        (MAP_SERVER.replace("0.196", "-1"), PGM, "got free_thresh -1"),
        (MAP_SERVER.replace('"floor.pgm"', '"\\x"'), PGM, "not YAML: .*line 2"),
        (MAP_SERVER + "mode: best\n", PGM, "mode must be one of 'trinary', .*, got 'best'"),
        (MAP_SERVER + "nonsense\n", PGM, "not YAML: .*line 8"),
        ("[1, 2]", PGM, "expected 'key: value' in each line, got b'.1, 2.'"),
        (MAP_SERVER, PGM[:-1], "not a readable picture .*truncated"),
        (MAP_SERVER, b"no picture", "floor.pgm: not a readable picture"),
        (MAP_SERVER, b"P5 0 2 255\n", "not a readable picture"),
        (MAP_SERVER, b"P2 1 1 5\nx", "not a readable picture .*b'x'"),
        (MAP_SERVER, b"P2 1 1 5\n7", "too large.*7"),
        (MAP_SERVER, b"P2 1 1 5\n-7", "negative: -7"),
        (MAP_SERVER, b"P2 1 1 5\n", "not enough image data"),
        (MAP_SERVER, b"", r"floor.pgm: the file is empty"),
        (MAP_SERVER.replace('"floor.pgm"', "none.pgm"), PGM, "its picture 'none.pgm' is missing"),
    ],
)
def test_broken_ros_maps(tmp_path, text, picture, message):
    """A map_server map that is not in order gives a FormatError with the file and the reason."""
    with pytest.raises(FormatError, match=message):
        load_ros(tmp_path, text, picture)


def test_every_probability_keeps_its_side_in_a_ros_map(tmp_path):
    """A cell comes back free, occupied or unknown as it was; however near to a half."""
    near = np.append(np.linspace(0, 1, 2001), [np.nextafter(0.5, 0), 0.5, 0.498, 0.502, np.nan])
    grid = OccupancyGrid(near[None], (0.0, 0.0), 0.05)
    grid.save(tmp_path / "a.yaml")
    loaded = OccupancyGrid.load(tmp_path / "a.yaml")
    for kind in ("occupied", "free", "unknown"):
        np.testing.assert_array_equal(getattr(loaded, kind), getattr(grid, kind))


@pytest.mark.parametrize(
    "picture",
    [
        *(b"P2 2 1 5\n0 7\n", b"P2 2 1 5\n-1 0\n"),
        *(b"P5 2 1 300\n" + bytes(2), b"P5 2 1 256\n\0\1"),
    ],
)
def test_one_bad_pixel_is_enough(tmp_path, picture):
    """A single pixel out of range among good ones, or more than 255 steps of grey, is refused."""
    with pytest.raises(FormatError, match="not a readable picture"):
        load_ros(tmp_path, picture=picture)
