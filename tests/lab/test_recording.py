"""Recordings on disk: log, truth and scene come back, and what is damaged is named."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from dollop.formats.files import FormatError
from dollop.lab.recording import MOVED_COLUMNS, ROBOT_COLUMNS, TRUTH_COLUMNS, Recording
from dollop.lab.scenes import figure_eight_scene
from dollop.lab.things import Move, Person, Robot
from dollop.laser import LaserLog


def small_recording():
    """Two scans of three beams, while two walk, a can is moved and the robot drives."""
    ranges = np.array([[1.0, 2.5, np.inf], [1.001, 2.5, 3.0]])
    t, poses = np.array([0.0, 0.1]), np.tile([4.5, 0.617, 1.5], (2, 1))
    log = LaserLog(t, ranges, np.deg2rad([-90.0, 0.0, 90.0]), poses, 8.191)
    others = [f"{name}_1" for name in TRUTH_COLUMNS[1:]] + [f"{name}_1" for name in MOVED_COLUMNS]
    names = [*TRUTH_COLUMNS[1:], *others, *ROBOT_COLUMNS]
    truth = pd.DataFrame({"t": t, **{name: [k + 0.25, k + 0.5] for k, name in enumerate(names)}})
    people = [Person([(1.0, 2.0), (4.5, 2.0)]), Person([(6.0, 5.0)])]
    moving = {"people": people, "moves": [Move(1, 0.0, (6.0, 3.0))], "robot": Robot(way=[(4.5, 1.0)])}
    return Recording(log, truth, replace(figure_eight_scene(), **moving))


@pytest.mark.parametrize("name", ["eights.log", "eights.log.gz"])
def test_a_recording_reads_back_what_it_wrote(tmp_path, name):
    """Log, truth and scene come back equal."""
    recording = small_recording()
    recording.save(tmp_path / name)
    assert (tmp_path / "eights_truth.csv").exists() and (tmp_path / "eights_scene.json").exists()
    back = Recording.load(tmp_path / name)
    assert np.array_equal(back.log.ranges, recording.log.ranges)
    assert np.allclose(back.log.poses, recording.log.poses, atol=1e-3)
    pd.testing.assert_frame_equal(back.truth, recording.truth)
    assert back.scene.to_dict() == recording.scene.to_dict()


def test_a_recording_in_which_nothing_moves_reads_back(tmp_path):
    """Its truth has columns and no rows."""
    still = replace(small_recording(), truth=pd.DataFrame({name: [] for name in TRUTH_COLUMNS}, dtype=float))
    still.save(tmp_path / "still.log")
    back = Recording.load(tmp_path / "still.log")
    pd.testing.assert_frame_equal(back.truth, still.truth)
    assert back.truth.empty and len(back.log) == 2


DAMAGED_TRUTHS = {
    "a row too few": (
        "t,x,y,heading\n0.0,1.0,2.0,0.0\n",
        "rows 2, one for each scan, .* got .* heading and 1",
    ),
    "no number": (
        "t,x,y,heading\n0.0,1.0,2.0,0.0\n0.1,one,2.0,0.0\n",
        "not a table of numbers: x must be a number, got 'one'",
    ),
    "empty": ("", "the file is empty"),
    "no time": ("x,y,heading\n1.0,2.0,0.0\n1.0,2.0,0.0\n", "columns must be t and of"),
    "a column more": (
        "t,x,y,heading,age\n0,1,2,0,30\n0,1,2,0,30\n",
        "columns must be t and of .* got .* heading, age",
    ),
}


@pytest.mark.parametrize(("text", "rule"), DAMAGED_TRUTHS.values(), ids=DAMAGED_TRUTHS)
def test_a_damaged_truth_is_named(tmp_path, text, rule):
    """A truth of wrong length or content raises FormatError that names file and rule."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / "eights_truth.csv").write_text(text)
    with pytest.raises(FormatError, match=f"eights_truth.csv.*: .*{rule}"):
        Recording.load(tmp_path / "eights.log")


def with_scanner(content, **parts):
    """The same scene with another scanner."""
    scanner = content["robot"]["scanner"] | parts
    return content | {"robot": content["robot"] | {"scanner": scanner}}


DAMAGED_SCENES = {
    "another version": (lambda scene: scene | {"version": 7}, "the version of a scene must be 1, got 7"),
    "another format": (lambda scene: scene | {"format": "map"}, "not a scene: format must be 'dollop scene'"),
    "an older time's": (lambda scene: {"kinds": ["cone"], "positions": [[4, 3]], "robot": [4, 1, 0]}, "not a scene"),
    "a missing part": (lambda scene: {k: v for k, v in scene.items() if k != "moves"}, "a scene lacks moves"),
    "an unknown part": (lambda scene: scene | {"ghosts": []}, "a scene cannot have ghosts"),
    "another mode": (
        lambda scene: with_scanner(scene, resolution=0.25),
        "fov/resolution must be one of .*180/0.25",
    ),
    "another rate": (lambda scene: with_scanner(scene, rate=75.0), "rate of a SICK LMS 200 must be 10 .*, got 75"),
    "NaN": (
        lambda scene: scene | {"robot": scene["robot"] | {"speed": float("nan")}},
        "not a scene: a number must be finite, .*, got NaN",
    ),
    "no room": (lambda scene: scene | {"objects": 2 * scene["objects"]}, "objects must not stand in each other"),
    "a list": (lambda scene: [scene], "not a scene"),
    "too large": (
        lambda scene: scene | {"room": scene["room"] | {"height": 10**400}},
        "not a scene: a number must be finite, .*, got 1000000",
    ),
    "text": (
        lambda scene: scene | {"robot": scene["robot"] | {"radius": "0.25"}},
        "the robot: the robot's radius must be a finite number, got '0.25'",
    ),
    "true": (
        lambda scene: scene | {"objects": [scene["objects"][0] | {"height": True}]},
        r"objects\[0\]: height must be a finite number, got True",
    ),
}


@pytest.mark.parametrize(("damage", "rule"), DAMAGED_SCENES.values(), ids=DAMAGED_SCENES)
def test_a_damaged_scene_is_named(tmp_path, damage, rule):
    """A scene of another format or version, or one that cannot be, raises FormatError that names file and rule."""
    small_recording().save(tmp_path / "eights.log")
    path = tmp_path / "eights_scene.json"
    path.write_text(json.dumps(damage(json.loads(path.read_text()))))
    with pytest.raises(FormatError, match=f"eights_scene.json: .*{rule}"):
        Recording.load(tmp_path / "eights.log")


@pytest.mark.parametrize("text", ["", "{", "[" * 100_000, '{"format": "dollop scene"', "nothing", "\x00"])
def test_what_is_no_json_is_named(tmp_path, text):
    """Anything else than JSON in the scene's place raises FormatError that names the file."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / "eights_scene.json").write_text(text)
    with pytest.raises(FormatError, match="eights_scene.json: (not a scene|the file is empty)"):
        Recording.load(tmp_path / "eights.log")


@pytest.mark.parametrize("name", ["eights_truth.csv", "eights_scene.json"])
def test_what_is_missing_beside_the_log_is_named(tmp_path, name):
    """A recording is three files; without one of them it is none."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / name).unlink()
    with pytest.raises(FormatError, match=f"{name}: a recording has its truth and its scene beside its log"):
        Recording.load(tmp_path / "eights.log")


@pytest.mark.parametrize("value", ["nan", "inf", "1_0", "0x1", "", "1e300", "1;2", "\u0661"])
def test_the_truth_is_made_of_numbers(tmp_path, value):
    """What pandas would take for one, or for none, is refused with its line."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / "eights_truth.csv").write_text(f"t,x\n0.0,1.0\n0.1,{value}\n")
    with pytest.raises(FormatError, match="eights_truth.csv, line 3: not a table of numbers: x must be a number"):
        Recording.load(tmp_path / "eights.log")


@pytest.mark.parametrize("text", ["t,t\n0,0\n1,1\n", "t,x\n0,1,2\n1,1,2\n", "t,x\n0\n1\n"])
def test_the_truth_has_columns(tmp_path, text):
    """None twice, and as many in each line as in the first."""
    small_recording().save(tmp_path / "eights.log")
    (tmp_path / "eights_truth.csv").write_text(text)
    with pytest.raises(FormatError, match="columns must be t and of|a line must hold one for each of 2 columns"):
        Recording.load(tmp_path / "eights.log")
