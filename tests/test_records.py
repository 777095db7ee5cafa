"""Records: each prints itself in a line or two, and refuses what it is not."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from places import DATA

import dollop
from dollop.association import FrameAssociation
from dollop.environment import Seen
from dollop.formats.odometry import Odometry
from dollop.lab import Recording
from dollop.lds import Statistics
from dollop.robot import PIONEER_LIMITS
from dollop.trajectory import align, resample


@pytest.fixture(scope="module")
def records():
    """One of each kind, from two recordings of the laboratory."""
    background = dollop.OccupancyGrid.load(DATA / "lab.yaml")
    recording = Recording.load(DATA / "figure_eights.log.gz")
    observation = dollop.observe(recording.log, background)
    shown = dollop.Demonstration.of(observation)
    task, law = dollop.learn([shown, shown]), shown.law
    frames = dollop.Frames(task.environment.centres, np.zeros(2))
    tied = dollop.associate_with_frames([law.subgoals], [frames])
    robot = dollop.Unicycle((*law.start, 0.0))
    matching = dollop.match(task.environment, task.environment)
    run = dollop.perform(task, robot, background=background)
    seen = (recording, recording.log, recording.scene, background, observation, observation.user)
    learned = (shown, task, law, law.segments[0], task.model, task.association)
    return (*seen, *learned, frames, tied, matching, task.environment, robot, run)


def test_every_record_prints_in_a_line_or_two(records):
    """Its kind comes first; no arrays in full."""
    for record in records:
        text = repr(record)
        assert text.startswith(type(record).__name__)
        assert len(text) < 200 and "array(" not in text and "\n" not in text, text


def test_what_is_told_is_what_is_there(records):
    """Counts and places in the words are those of the record."""
    told = {type(record).__name__: repr(record) for record in records}
    assert "929 scans" in told["LaserLog"] and "181 beams" in told["LaserLog"]
    assert "6 segments" in told["SequencedLDS"] and "shown 2 x" in told["Task"]
    assert "cylinder (2.50, 3.60)" in told["Scene"] and "finished" in told["Run"]
    assert repr(dollop.Environment([])) == "Environment of 0 objects"


# ---- every record checks itself


BOXES = np.array([[0.0, 0.0, 0.4, 0.4], [4.0, 0.0, 4.5, 0.4], [2.0, 3.0, 2.4, 3.9]])
WALK = np.stack([2 + np.cos(np.linspace(0, np.pi, 60)), np.sin(np.linspace(0, np.pi, 60))], axis=1)
FLOOR = Seen(np.ones((3, 4), bool), (0.0, 0.0), 0.1)
TASK = dollop.Task.of(dollop.Demonstration(WALK, dollop.Environment(BOXES, FLOOR, directions=np.zeros(3))))
LAW = TASK.law
SHORT = dollop.SequencedLDS.fit(np.linspace([0.0, 0.0], [3.0, 0.0], 30), n_segments=5)
PAPERS = dollop.Task.of(TASK.demonstrations[0], method="paper")
N = 5
WALKED = np.column_stack([np.arange(N), np.zeros(N)]) / 10
TRACK = dollop.Track(np.arange(N) / 10, WALKED, np.ones((N, 2)), np.zeros(N, bool), WALKED)
POSES = np.column_stack([WALKED, np.zeros(N)])
RUN = (np.arange(N) / 10, POSES, POSES, np.zeros(N, int), np.ones(N, bool), np.ones(N), True, "", 0, np.empty(0))
RECORDS = {
    "LDS": LAW.segments[0], "Statistics": LAW.segments[0].statistics, "SequencedLDS": LAW, "Task": TASK,
    "Environment": TASK.environment, "Seen": FLOOR, "Demonstration": TASK.demonstrations[0], "Track": TRACK,
    "Association": PAPERS.association, "Matching": dollop.match(TASK.environment, TASK.environment),
    "Frames": dollop.Frames(BOXES[:, :2], np.zeros(3)), "SubgoalHMM": dollop.SubgoalHMM.fit([LAW.subgoals] * 2),
    "LaserLog": dollop.LaserLog(np.arange(3.0), np.ones((3, 4)), np.arange(4) / 10, np.zeros((3, 3)), 8.0),
    "OccupancyGrid": dollop.OccupancyGrid(np.eye(3), (0.0, 0.0), 0.1), "Run": dollop.Run(*RUN),
    "Odometry": Odometry(np.arange(3.0), np.zeros((3, 3)), np.zeros((3, 2))),
    "Observation": dollop.Observation((TRACK,), TRACK, TASK.environment, 0, (TRACK,)),
    "FrameAssociation": FrameAssociation(np.zeros((2, 3, 2)), np.full((2, 3), 0.5)),
}  # fmt: skip
FIELDS = [(name, each.name) for name, record in RECORDS.items() for each in fields(record)]
ARRAYS = [(name, field) for name, field in FIELDS if isinstance(getattr(RECORDS[name], field), np.ndarray)]
HOSTILE = {
    "text": "abc", "bytes": b"x", "a dictionary": {}, "complex": 1j, "400 digits": 10**400, "a set": {1.5},
    "masked": np.ma.masked_array(np.ones((3, 3)), True), "objects": np.array([[object()]]), "a span": np.timedelta64(1),
    "many axes": np.ones((1,) * 40), "a list of text": ["a", "b"], "minus": -1e300, "ragged": [[1.0], [1.0, 2.0]],
}  # fmt: skip
TEXTS = {("Run", "reason")}


@pytest.mark.parametrize(("name", "field"), FIELDS)
def test_no_field_takes_what_it_is_not(name, field):
    """Text, bytes, complex, masked, ragged and the like: ValueError that says so in a line of 300 characters."""
    for said, value in HOSTILE.items():
        if (name, field) in TEXTS and isinstance(value, str):
            continue
        with pytest.raises(ValueError) as refused:
            replace(RECORDS[name], **{field: value})
        assert len(str(refused.value)) <= 300 and "\n" not in str(refused.value), said


@pytest.mark.parametrize(("name", "field"), ARRAYS)
def test_arrays_of_records_are_copies_and_stay(name, field):
    """Who changes what a record was made of does not change the record, nor can the record be changed."""
    given = np.array(getattr(RECORDS[name], field))
    record = replace(RECORDS[name], **{field: given})
    held = getattr(record, field)
    assert not np.shares_memory(held, given) and not held.flags.writeable
    np.testing.assert_array_equal(held, given)
    assert held.dtype == getattr(RECORDS[name], field).dtype


@pytest.mark.parametrize(("name", "field"), ARRAYS)
def test_one_number_of_an_array_that_is_none_is_found(name, field):
    """True, text, None or a huge number among good ones, in a list or in an array of objects."""
    given = np.array(getattr(RECORDS[name], field)).astype(object)
    for value in (None, "1", 1j, 10**400, np.datetime64("2004-04-26")):
        bad = given.copy()
        bad.flat[:1] = value
        for values in (bad, bad.tolist()):
            if bad.size:
                with pytest.raises(ValueError):
                    replace(RECORDS[name], **{field: values})


BAD = [  # a record, a change, and what it breaks
    ("Association", {"weights": np.full(PAPERS.association.weights.shape, 1e308)}, "weights must be in 0 to 1"),
    ("Association", {"weights": np.full(PAPERS.association.weights.shape, 0.5)}, "must sum to 1 at most, got 6"),
    ("Association", {"corners": PAPERS.association.corners + 0.9}, "corners must be .*, got"),
    ("Association", {"corners": PAPERS.association.corners + 1}, "corners must be in 0 to 11"),
    ("Environment", {"boxes": [[0, 0, -1, 1]], "assumed": None, "directions": None}, "xmin <= xmax"),
    ("Environment", {"boxes": BOXES * 1e9}, r"boxes must lie within 1e\+09 m"),
    ("Environment", {"directions": [0.0, 1e300, np.nan]}, "directions must be in"),
    ("Environment", {"seen": "abc"}, "seen must be a Seen, got 'abc'"),
    ("Seen", {"resolution": 0.0}, "resolution must be in 1e-06 to 1000, got 0.0"),
    ("LDS", {"goal": [1e17, 0.0]}, r"goal must lie within 1e\+09 m of the origin, got 1e\+17 m"),
    ("LDS", {"statistics": Statistics(np.array([[1.0, 2.0], [2.0, 1.0]]), np.eye(2))}, "G0 must be a sum of x x"),
    ("LDS", {"statistics": Statistics(np.eye(3), np.eye(3))}, r"G0 must have shape \(2, 2\)"),
    ("Statistics", {"G0": np.full((2, 2), 1e308)}, r"G0 must be in -1e\+30 to 1e\+30"),
    ("SequencedLDS", {"segments": ()}, "must have a segment, got none"),
    ("SequencedLDS", {"speeds": np.zeros(len(LAW.segments))}, "speeds must be in"),
    ("SequencedLDS", {"pauses": [-1.0] * (len(LAW.segments) + 1)}, "pauses must be in 0 to"),
    ("Matching", {"indices": np.array([0, 1, 2, 3] * 3)}, "must not send two corners to one"),
    ("Matching", {"indices": np.arange(12) + 0.5}, "indices must be whole numbers"),
    ("Matching", {"probability": 1.5}, "probability must be in 0 to 1"),
    ("Matching", {"confident": "abc"}, "confident must be True or False, got 'abc'"),
    ("Task", {"environment": "abc"}, "environment must be an Environment, got 'abc'"),
    ("Task", {"law": None}, "law must be a SequencedLDS, got None"),
    ("Task", {"association": PAPERS.association.carried(TASK.environment), "law": SHORT}, "association must be of"),
    ("Task", {"objects": [0, 1, 7]}, "objects must be in -1 to 2"),
    ("Demonstration", {"trajectory": [[0.0, 0.0], [1.0, True], [2.0, 0.0]]}, "must be numbers"),
    ("Demonstration", {"trajectory": WALK * 1e-300}, "must move"),
    ("Demonstration", {"sample_period": 0.0}, "sample_period must be in"),
    ("Demonstration", {"notes": ["all is well"]}, r"notes\[0\] must be a Note, got 'all is well'"),
    ("Track", {"t": np.arange(N)[::-1]}, "times of a track must rise"),
    ("LaserLog", {"angles": np.arange(4.0) * 9}, "angles must be in"),
    ("LaserLog", {"t": np.array([0.0, 1e17, 2e17])}, "t must be in"),
    ("OccupancyGrid", {"resolution": 1e300}, "resolution must be"),
    ("SubgoalHMM", {"states": tuple(np.zeros(len(LAW.subgoals), int) - 1 for _ in range(2))}, "states must be"),
    ("Run", {"localised": ["yes"] * N}, "localised must be"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change", "rule"), BAD)
def test_what_contradicts_is_refused(name, change, rule):
    """Each record knows what its numbers must be to each other, and says which are not."""
    with pytest.raises(ValueError, match=rule):
        replace(RECORDS[name], **change)


def test_numbers_of_every_kind_make_the_same_record():
    """Lists, tuples, whole numbers, single precision and tables: the same boxes, the same matching."""
    whole = [[0, 0, 1, 1], [3, 0, 4, 2]]
    first = dollop.Environment(whole)
    for given in (
        np.array(whole, np.uint8),
        np.array(whole, np.float32),
        pd.DataFrame(whole),
        tuple(map(tuple, whole)),
    ):
        np.testing.assert_array_equal(dollop.Environment(given).boxes, first.boxes)


# ---- robots, and what performing asks for


@pytest.mark.parametrize("period", [0, 0.0, np.nan, 1e-9, 60.0, "0.1", True, None])
def test_time_passes_for_a_robot(period):
    """Of a period of nothing no time-out ever comes."""
    with pytest.raises(ValueError, match="^period must be "):
        dollop.Unicycle((0.0, 0.0, 0.0), period=period)
    still = SimpleNamespace(pose=(1.0, 0.0, 0.0), localised=True, limits=PIONEER_LIMITS, period=period, drive=print)
    with pytest.raises(ValueError, match="^the robot's period must be "):
        dollop.perform(TASK, still)


@pytest.mark.parametrize(
    "limits", [(0.5, 0.8, 0.5, 0.0), (0.5, 0.8, 0.5), "fast", None, (np.inf, 1, 1, 1), (True, 1, 1, 1)]
)
def test_limits_are_four_positive_numbers(limits):
    """However they are given; `_replace` asks as well."""
    with pytest.raises(ValueError):
        dollop.Unicycle((0.0, 0.0, 0.0), limits)
    with pytest.raises(ValueError, match="^turn must be in 1e-06 to 1e.06, got -1"):
        PIONEER_LIMITS._replace(turn=-1)


@pytest.mark.parametrize("missing", ["pose", "localised", "limits", "period", "drive"])
def test_a_robot_that_lacks_something_is_told_what(missing):
    """Before anything moves."""
    robot = {"pose": (1.0, 0.0, 0.0), "localised": True, "limits": PIONEER_LIMITS, "period": 0.1, "drive": print}
    del robot[missing]
    with pytest.raises(ValueError, match=f"^robot must have {missing}, got namespace"):
        dollop.perform(TASK, SimpleNamespace(**robot))


PERFORMED = [
    ({"avoid": "no"}, "avoid must be True or False, got 'no'"),
    ({"timeout": np.nan}, "timeout must be in 1e-06 to inf, got nan"),
    ({"localise_within": "long"}, "localise_within must be a finite number, got 'long'"),
    ({"kidnap": [(1.0, 2.0, 3.0)]}, "a kidnapping must be a time and a pose, got"),
    ({"kidnap": [(1.0, "there")]}, "pose of the kidnapping at 1 s must be numbers"),
    ({"kidnap": 7}, "kidnap must be several"),
    ({"background": "lab"}, "background must be an OccupancyGrid, got 'lab'"),
    ({"task": "abc"}, "task must have law and environment, got 'abc'"),
    ({"task": SimpleNamespace(law=LAW, environment="abc")}, "environment must be an Environment, got 'abc'"),
]


@pytest.mark.parametrize(("change", "rule"), PERFORMED)
def test_what_perform_cannot_do_is_named(change, rule):
    """The argument, the rule, and what was given."""
    with pytest.raises(ValueError, match=rule):
        dollop.perform(**{"task": TASK, "robot": dollop.Unicycle((3.0, 0.0, 1.0))} | change)


def test_a_robot_is_driven_by_numbers():
    """Nothing that is no number moves it, and it stays where it was."""
    robot = dollop.Unicycle((0.0, 0.0, 0.0))
    for speed in ("fast", np.nan, None, True, 10**400, [0.5]):
        with pytest.raises(ValueError, match="^speed must be a finite number"):
            robot.drive(speed, 0.0)
        with pytest.raises(ValueError, match="^the pose of a robot must "):
            robot.place((0.0, speed, 0.0))
    assert robot.pose == (0.0, 0.0, 0.0)


# ---- the public functions


def given(value):
    """A value for an argument that may be left out: None would be that."""
    return "none" if value is None else value


CALLS = {
    "match": lambda value: dollop.match(TASK.environment, value),
    "match, moved": lambda value: dollop.match(TASK.environment, TASK.environment, moved=value),
    "associate": lambda value: dollop.associate(value, TASK.environment),
    "associate, m": lambda value: dollop.associate(LAW.subgoals, TASK.environment, m=value),
    "relocate": PAPERS.association.relocate, "carried": PAPERS.association.carried, "adapt": TASK.adapt,
    "relocate, matching": lambda value: PAPERS.association.relocate(TASK.environment, given(value)),
    "add": TASK.add, "learn": dollop.learn, "align": align,
    "learn, spread": lambda value: dollop.learn([TASK.demonstrations[0]] * 2, spread=given(value)),
    "fit": dollop.SequencedLDS.fit, "LDS.fit": dollop.LDS.fit, "step": LAW.segments[0].step,
    "turned": LAW.segments[0].turned,
    "lyapunov": LAW.segments[0].lyapunov, "response, n": lambda value: LAW.segments[0].response([0.0, 0.0], value),
    "response": lambda value: LAW.response(given(value)), "timed": LAW.timed, "error": LAW.error, "lines": LAW.lines,
    "with_subgoals": LAW.with_subgoals, "SubgoalHMM.fit": dollop.SubgoalHMM.fit,
    "laps": lambda value: dollop.laps(value, WALK),
    "observe": lambda value: dollop.observe(value, RECORDS["OccupancyGrid"]),
    "Demonstration.of": dollop.Demonstration.of,
    "localise": lambda value: dollop.localise(value, None, RECORDS["OccupancyGrid"]),
    "write_log": lambda value: dollop.write_log("never.log", value), "from_log": dollop.OccupancyGrid.from_log,
    "of_partners": dollop.Matching.of_partners, "identity": dollop.Matching.identity, "at": FLOOR.at,
    "distance_at": RECORDS["OccupancyGrid"].distance_at, "world_to_cell": RECORDS["OccupancyGrid"].world_to_cell,
    "resample": lambda value: resample(WALK, value),
}  # fmt: skip
WRONG = {
    "text": "abc", "nothing": None, "complex": 1j, "bytes": b"x", "400 digits": 10**400, "true": True,
    "nan": np.nan, "far": 1e308, "many": np.ones((1,) * 60), "objects": np.array([None] * 9),
    "masked": np.ma.masked_array(np.ones((9, 2)), True), "a dictionary": {"a": 1},
    "one truth value": [[0.0, 0.0], [1.0, 1.0], [2.0, True]], "dates": np.array(["2004-04-26"] * 9, "datetime64[D]"),
}  # fmt: skip


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_hostile_calls_are_refused_in_a_line(call, tmp_path, monkeypatch):
    """Nothing raw from the depth, no warning, no endless loop; nothing is written."""
    monkeypatch.chdir(tmp_path)
    for said, value in WRONG.items():
        with pytest.raises(ValueError) as refused:
            call(value)
        assert len(str(refused.value)) <= 300 and "\n" not in str(refused.value), said
    assert not list(tmp_path.iterdir())


def test_what_hostile_calls_found_stays_mended():
    """A range of 1e308 m, boxes that are one number, more candidates than there is time for, and a billion walks."""
    grid = dollop.OccupancyGrid(np.pad(np.zeros((9, 9)), 1, constant_values=1.0), (0.0, 0.0), 0.1)
    with pytest.raises(ValueError, match=r"a range must be within 1e\+09 m, or inf, got 1e\+308"):
        dollop.Observer(grid, [0.0, 0.1]).step(0.0, [1.0, 1e308], [0.5, 0.5, 0.0])
    with pytest.raises(ValueError, match=r"boxes must have shape \(N, 4\), got \(\)"):
        dollop.Environment(np.array(1.0))
    with pytest.raises(ValueError, match="candidates must be a whole number, 3 to 400, got 1000"):
        dollop.SequencedLDS.fit(WALK, candidates=1000)
    with pytest.raises(ValueError, match="user must be numbers"):
        dollop.Observer(grid, [0.0, 0.1], np.timedelta64(3, "s"))
    lost = SimpleNamespace(pose=1.0, localised=False, limits=PIONEER_LIMITS, period=0.1, drive=print)
    with pytest.raises(ValueError, match=r"the robot's pose must have shape \(3,\), got \(\)"):
        dollop.perform(TASK, lost)
    with pytest.raises(ValueError, match="demonstration 0 must hold at most 1000 subgoals, got 20000"):
        dollop.SubgoalHMM.fit([np.zeros((20_000, 2))])
    with pytest.raises(ValueError, match="sequences must be at most 100000"):
        dollop.SubgoalHMM.fit(np.broadcast_to(1.0, (10**9, 2)))


def test_a_walk_that_leaps_has_a_speed_of_this_world():
    """Over a part of the way that took no time it was 1e305 m/s."""
    law = dollop.SequencedLDS.fit([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]], retimed=False)
    assert law.profile.max() < 1e12 and np.isfinite(law.timed()[1]).all()


def test_a_refused_matching_of_many_objects_is_told_in_a_line():
    """However many there are."""
    rng = np.random.default_rng(0)
    here, there = (dollop.Environment(np.tile(rng.uniform(0, 6, (40, 2)), 2) + [0, 0, 0.4, 0.4]) for _ in range(2))
    with pytest.raises(ValueError, match="cannot be matched with confidence: 0 .* move the objects apart$") as refused:
        dollop.associate(LAW.subgoals, here).relocate(there)
    assert len(str(refused.value)) <= 300
