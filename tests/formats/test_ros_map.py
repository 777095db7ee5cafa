"""Maps of ROS map_server: what their YAML and picture mean, as others write them and as we do."""

import io
import struct
import subprocess
import zlib

import numpy as np
import pytest
import yaml
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


# ---- bombs, and what is no map


LAUGHS = "a0: &a0 [x, x]\n" + "".join(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]\n" for k in range(1, 10))
MERGED = "a0: &a0 {x: 1}\n" + "".join(f"a{k}: &a{k} {{<<: [{', '.join([f'*a{k - 1}'] * 9)}]}}\n" for k in range(1, 10))
NO_TAGS = "there must be no anchors, aliases and tags, got one on line"


@pytest.fixture(params=["C", "Python"])
def either_parser(request, monkeypatch):
    """YAML is read by libyaml where PyYAML has it, and by Python where not."""
    if request.param == "Python":
        monkeypatch.delattr(yaml, "CSafeLoader", raising=False)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LAUGHS + MAP_SERVER, f"{NO_TAGS} 1"),
        (MERGED + MAP_SERVER, f"{NO_TAGS} 1"),
        (LAUGHS + MAP_SERVER.replace("0.050000", "*a9"), NO_TAGS),
        (MAP_SERVER + "a: &a [*a]\n", f"{NO_TAGS} 8"),
        (MAP_SERVER.replace("negate: 0", "negate: !!bool foo"), f"{NO_TAGS} 5"),
        (MAP_SERVER + "a: !!timestamp x\n", f"{NO_TAGS} 8"),
        (MAP_SERVER + "a: !!python/object/apply:os.system [ls]\n", f"{NO_TAGS} 8"),
        (MAP_SERVER + "<<: {negate: 1}\n", "a key must be a text, given once, got '<<' on line 8"),
        (MAP_SERVER + "negate: 1\n", "a key must be a text, given once, got 'negate' on line 8"),
        (MAP_SERVER + "[1]: 2\n", "a key must be a text, given once, got .'1'. on line 8"),
        (MAP_SERVER + "a: " + "[" * 2000 + "]" * 2000, "brackets must be at most 20 deep within each other"),
        ("#" + "]" * 30 + "\n" + MAP_SERVER + "a: " + "[" * 30, "brackets must be at most 20 deep"),
        ("{" * 5000, "brackets must be at most 20 deep within each other"),
        (MAP_SERVER + "".join(f"k{k}: 0\n" for k in range(600)), "holds more than 1000 nodes"),
        (MAP_SERVER + "#" * 70_000, "holds more than 65536 bytes, the most that is read"),
        (MAP_SERVER + "---\na: 1\n", "expected one document, got another after it"),
        ("# nothing\n", "expected 'key: value' in each line"),
        (MAP_SERVER.replace("0.050000", "9" * 400), r"resolution must be a number within 1e\+09, got '999"),
        (MAP_SERVER.replace("0.050000", "9" * 5000), r"resolution must be a number within 1e\+09, got '999"),
        (MAP_SERVER.replace("0.050000", "1_0"), "resolution must be a number, got '1_0'"),
        (MAP_SERVER.replace("0.050000", "1:30"), "resolution must be a number, got '1:30'"),
        (MAP_SERVER.replace("0.050000", "[1]"), "resolution must be a number, got .'1'."),
        (MAP_SERVER.replace("0.050000", "{a: 1}"), "resolution must be a number, got None"),
        (MAP_SERVER.replace("0.050000", "1e300"), r"resolution must be a number within 1e\+09, got '1e300'"),
        (MAP_SERVER.replace("5.5", "1e10"), r"origin must be a number within 1e\+09, got '1e10'"),
        (MAP_SERVER.replace("5.5", "[5.5]"), "origin must be a number, got None"),
        (MAP_SERVER.replace("negate: 0", "negate: 0.0"), "negate must be one of 0, false, no, .*, got '0.0'"),
        (MAP_SERVER.replace("negate: 0", "negate: tRue"), "negate must be one of .*, got 'tRue'"),
        (MAP_SERVER.replace('image: "floor.pgm"', "image: [a]"), "image must be the name of its picture, got .'a'."),
        (MAP_SERVER.replace('image: "floor.pgm"\n', ""), "image must be the name of its picture, got None"),
    ],
)
def test_nothing_is_built_of_a_yaml(tmp_path, either_parser, text, message):
    """Aliases, tags, nests and numbers that are bombs, or mean something else in Python, are refused by rule."""
    with pytest.raises(FormatError, match=message) as error:
        load_ros(tmp_path, text)
    assert len(str(error.value)) <= 300


def test_keys_of_others_are_passed_over(tmp_path, either_parser):
    """Whatever they hold, dates that are none included; only that they are few is asked."""
    others = "when: 2001-99-99\nwho: {name: [a, {b: c}], of: 0o8}\ncost: .inf\n"
    assert load_ros(tmp_path, others + MAP_SERVER).occupied.tolist() == [[False, False, True], [True, False, False]]


def chunk(kind, content):
    """A chunk of a PNG."""
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def png(width, height, between=b"", rows=b"\0\0\0\0\0\0\0\0"):
    """A grey PNG that says to be of some size."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + between + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


MIB = zlib.compress(bytes(8 << 20))


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (png(17_000, 17_000), "17000 x 17000 cells are more than 20000000, the most that a map has"),
        (png(2**31 - 1, 2**31 - 1), "cells are more than 20000000"),
        (b"P5\n100000 100000\n255\n", "100000 x 100000 cells are more than 20000000"),
        (b"P5\n" + b"9" * 4000 + b" 1\n255\n", "cells are more than 20000000"),
        (png(3, 2, chunk(b"IHDR", struct.pack(">IIBBBBB", 9_999, 9_999, 8, 0, 0, 0, 0))), "two sizes"),
        (png(3, 2, chunk(b"zTXt", b"a\0\0" + MIB)), "not a readable picture .*too large"),
        (png(3, 2, chunk(b"iCCP", b"a\0\0" + MIB)), "not a readable picture .*too large"),
        (png(3, 2, chunk(b"acTL", struct.pack(">II", 0, 0))), "not a readable picture .*APNG"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\nshowpage\n", "neither PNG nor PGM"),
        (b"GIF89a" + bytes(100), "neither PNG nor PGM"),
        (b"Pf\n3 2\n-1.0\n" + bytes(24), "neither PNG nor PGM"),
        (b"P5\n" + b"#\n" * 4000 + b"3 2\n255\n123456", "neither PNG nor PGM with its size in 4096 bytes"),
        (b"P5\n-3 -2\n255\n123456", "neither PNG nor PGM"),
        (b"P2 3 2 255\n" + b"1" * 100_000, "not a readable picture"),
    ],
)
def test_pictures_that_are_no_map_are_refused_by_their_head(tmp_path, monkeypatch, recwarn, picture, message):
    """Too many pixels, packed comments and other formats, for which no program is started, and nothing warns."""
    for name in ("Popen", "run", "call", "check_call", "check_output"):
        monkeypatch.setattr(subprocess, name, lambda *_, **__: pytest.fail("a program was started"))
    with pytest.raises(FormatError, match=message) as error:
        load_ros(tmp_path, picture=picture)
    assert len(str(error.value)) <= 300 and not recwarn


def test_a_picture_is_an_ordinary_file(tmp_path):
    """A folder is none; one of more than 128 MiB is refused by its size."""
    (tmp_path / "floor.yaml").write_text(MAP_SERVER)
    (tmp_path / "floor.pgm").mkdir()
    with pytest.raises(FormatError, match=r"floor\.pgm: must be an ordinary file, and is a folder"):
        OccupancyGrid.load(tmp_path / "floor.yaml")
    (tmp_path / "floor.pgm").rmdir()
    with open(tmp_path / "floor.pgm", "wb") as stream:
        stream.write(PGM)
        stream.truncate(3 << 30)
    with pytest.raises(FormatError, match=r"floor\.pgm: holds more than 134217728 bytes"):
        OccupancyGrid.load(tmp_path / "floor.yaml")


def test_a_link_is_read_with_the_picture_beside_either_end(tmp_path):
    """Beside the link first, then beside the file that it points to."""
    (tmp_path / "far").mkdir()
    assert load_ros(tmp_path / "far").occupied.sum() == 2
    (tmp_path / "near.yaml").symlink_to(tmp_path / "far" / "floor.yaml")
    assert OccupancyGrid.load(tmp_path / "near.yaml").occupied.sum() == 2
    (tmp_path / "floor.pgm").write_bytes(PGM[:-6] + bytes(6))
    assert OccupancyGrid.load(tmp_path / "near.yaml").occupied.sum() == 6


@pytest.mark.parametrize(("mark", "other", "fits"), [("0" * 16, "0" * 16, True), ("0" * 16, "f" * 16, False)])
def test_half_of_another_run_is_refused(tmp_path, mark, other, fits):
    """Where YAML and picture carry a mark they must carry the same; where one has none, it was edited by hand."""
    text, picture = (
        f"{MAP_SERVER}# dollop pair {mark}\n",
        b"P5\n# dollop pair %s\n3 2\n255\n" % other.encode() + PGM[-6:],
    )
    for some, of in ((text, PGM), (MAP_SERVER, picture), (text, picture if fits else PGM)):
        assert load_ros(tmp_path, some, of).occupied.sum() == 2
    if not fits:
        rule = rf"floor\.pgm: is one half of another run: it is of pair {other}, and floor\.yaml of pair {mark}"
        with pytest.raises(FormatError, match=rule):
            load_ros(tmp_path, text, picture)


def test_a_grey_that_is_see_through_is_refused(tmp_path):
    """Also where a grey picture names one of its greys as such."""
    packed = io.BytesIO()
    Image.fromarray(np.array([[0, 255, 255]], np.uint8)).save(packed, "png", transparency=255)
    with pytest.raises(FormatError, match="no transparent pixels"):
        load_ros(tmp_path, picture=packed.getvalue())
