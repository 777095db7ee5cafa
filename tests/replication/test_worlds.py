"""Random worlds: drawn as written down, judged by their truth, and a study that goes on where it was."""

import ast
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from places import ROOT

from dollop.checks import Note
from dollop.cli import main
from dollop.environment import Environment
from dollop.formats.files import FormatError
from dollop.lab.people import walk_of, walks_of
from dollop.lab.scenes import Scene
from dollop.lab.things import Object, Person
from dollop.replication.worlds import chain, survey
from dollop.replication.worlds.chain import Judgement, judge, judge_objects, judge_user, side
from dollop.replication.worlds.draw import FAIR, KINDS, draw
from dollop.replication.worlds.picture import draw_judged
from dollop.replication.worlds.rooms import draw_room
from dollop.replication.worlds.view import in_view, objects_in_view

SEEDS = range(90_046, 90_046 + len(KINDS))
SHORT = (90_056,)
"""A world that is soon lived through, and ends right."""


@pytest.fixture(scope="module")
def worlds():
    """A world of every kind."""
    return [draw(seed) for seed in SEEDS]


# ---- the distribution


def test_a_seed_is_a_world(worlds):
    """The same seed draws the same scenes, another one others."""
    again = draw(SEEDS[0])
    assert again.later.to_dict() == worlds[0].later.to_dict() != worlds[1].later.to_dict()
    assert [each.to_dict() for each in again.demonstrations] == [each.to_dict() for each in worlds[0].demonstrations]
    assert np.array_equal(again.tour, worlds[0].tour)


def test_any_run_of_seeds_has_as_many_of_each_kind(worlds):
    """Kinds follow each other, so that a study of any seeds compares them evenly."""
    assert all([world.kind for world in worlds].count(kind) == 1 for kind in KINDS)


def test_kinds_are_what_they_say(worlds):
    """Numbers of objects and people, bodies, noise, rates and events are those of the kind."""
    numbers = {"no object": 0, "one object": 1, "ten objects": 10}
    for world in worlds:
        for scene in world.demonstrations:
            assert len(scene.objects) == numbers.get(world.kind, len(scene.objects))
            assert len(scene.people) == 1 + (world.kind == "second person")
            assert (scene.people[0].body == "legs") == (world.kind == "legs")
            assert (scene.robot.scanner.noise == 0.030) == (world.kind == "noise")
            assert (scene.robot.scanner.rate <= 5) == (world.kind == "slow scanner")
            assert bool(scene.robot.way) == (world.kind == "moving robot")
            assert bool(scene.moves) == (world.kind == "object moved")


def test_every_world_is_fair(worlds):
    """The walk is in view as far as promised; half of the objects are, or not where few are to be."""
    for world in worlds:
        assert all(in_view(scene, walks_of(scene)) >= FAIR for scene in world.demonstrations)
        scene = world.demonstrations[0]
        if len(scene.objects) > 1:
            few = objects_in_view(scene).sum() <= len(scene.objects) / 2
            assert few == (world.kind == "few in view")


def test_rooms_are_of_every_shape():
    """Among a few dozen worlds there are rectangles, L shapes, corridors and two rooms with a door."""
    rooms = [draw_room(0.5, np.random.default_rng(seed)) for seed in range(60)]
    assert {shape for shape, _ in rooms} == {"rectangle", "L", "corridor", "two rooms"}
    assert all(len(room.corners) == (6 if shape == "L" else 4) for shape, room in rooms)
    assert any(part.turn for _, room in rooms for part in room.parts)


def test_the_generator_knows_nothing_of_the_observer():
    """It draws from the laboratory and geometry alone: no threshold of what is measured can be in it."""
    for name in ("draw", "rooms", "view"):
        tree = ast.parse((ROOT / f"dollop/replication/worlds/{name}.py").read_text(encoding="utf-8"))
        taken = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)} - {"dataclasses"}
        known = ("dollop.lab.", "dollop.pose", "dollop.trajectory", "dollop.replication.worlds.")
        assert all(each.startswith(known) and "chain" not in each for each in taken)


def test_what_is_hidden_is_not_in_view():
    """Of two objects in a row the laser sees the nearer, and the other where it stands beside it."""
    near, far = Object("box", (4.5, 2.6), (0.9, 0.3), 1.0), Object("cylinder", (4.5, 5.0), (0.3, 0.3), 1.0)
    assert objects_in_view(Scene([near, far])).tolist() == [True, False]
    assert objects_in_view(Scene([near, far.at((7.0, 5.0))])).tolist() == [True, True]


# ---- the judge


def truth_of(positions, rate=10.0):
    """A truth table of one person."""
    t = np.arange(len(positions)) / rate
    return pd.DataFrame({"t": t, "x": positions[:, 0], "y": positions[:, 1], "heading": 0.0})


STRAIGHT = np.column_stack([np.linspace(0, 10, 101), np.zeros(101)])
WALKED = truth_of(STRAIGHT)


def judged(positions, truth, rows=slice(None)):
    """What is blamed when a trajectory is compared with a truth."""
    user, judgement = SimpleNamespace(t=truth.t.to_numpy()[rows], positions=positions[rows]), Judgement()
    judge_user(user, truth, judgement)
    return judgement.causes


@pytest.mark.parametrize(
    ("shift", "rows", "causes"),
    [
        ((0.0, 0.2), slice(None), []),
        ((0.0, 0.5), slice(None), ["user wrong", "part of the walk missing"]),
        ((0.0, 0.0), slice(0, 70), ["part of the walk missing"]),
    ],
)
def test_the_user_is_judged_in_metres_and_shares(shift, rows, causes):
    """Near is right, far is wrong, and a part is a part."""
    assert judged(STRAIGHT + shift, truth_of(STRAIGHT), rows) == causes


def test_a_trajectory_of_two_people_is_the_user_in_part():
    """Where a fifth of the trajectory is somebody else's, that is said, and that the rest is missing."""
    mixed = STRAIGHT.copy()
    mixed[:20] += (0.0, 3.0)
    assert judged(mixed, truth_of(STRAIGHT)) == ["user in part", "part of the walk missing"]


def looked_at(scene, boxes, truth=WALKED):
    """What is blamed when boxes are what was found of a scene."""
    log = SimpleNamespace(poses=np.array([scene.robot.laser_pose]))
    judgement = Judgement()
    judge_objects(Environment(boxes), SimpleNamespace(scene=scene, truth=truth, log=log), judgement)
    return judgement.causes


def test_objects_are_judged_by_where_they_stand():
    """True boxes are right, one too few is missed, one elsewhere is false; what is out of view may be missing."""
    scene = Scene([Object.trash_can((2.5, 3.6)), Object.trash_can((6.5, 3.6))])
    elsewhere = [4.0, 5.0, 4.4, 5.4]
    assert looked_at(scene, scene.boxes) == []
    assert looked_at(scene, scene.boxes[:1]) == ["object missed"]
    assert looked_at(scene, [*scene.boxes, elsewhere]) == ["false object"]
    further = replace(scene.robot, pose=(4.5, 2.4, np.pi / 2))
    standing = truth_of(STRAIGHT).assign(x_1=4.2, y_1=5.2, heading_1=0.0)
    assert looked_at(scene, [*scene.boxes, elsewhere], standing) == []
    behind = Scene([*scene.objects, Object.trash_can((4.5, 1.2))], robot=further)
    assert looked_at(behind, scene.boxes) == []


def test_sides_are_those_of_the_path():
    """Left is +1, right -1; what is far off, passed twice, or only turned back from, is on no side."""
    back = np.vstack([STRAIGHT[:50], STRAIGHT[:50][::-1] + (0.0, 0.05)])
    assert side(back, np.array([5.2, 0.5])) == 0
    assert side(STRAIGHT, np.array([5.0, 0.5])) == 1
    assert side(STRAIGHT, np.array([5.0, -0.5])) == -1
    assert side(STRAIGHT, np.array([5.0, 2.0])) == 0
    there_and_back = np.vstack([STRAIGHT, STRAIGHT[::-1] + (0.0, -0.1)])
    assert side(there_and_back, np.array([5.0, 0.5])) == 0


def test_a_note_makes_what_is_wrong_doubtful():
    """What a note says beforehand is not silent, and what was silent stays wrong though it is refused later."""
    doubtful, wrong = Judgement(), Judgement()
    doubtful.listen([], {"observation": SimpleNamespace(notes=(Note("people", "two people walk"),))})
    for each in (doubtful, wrong):
        each.blame("user wrong", True)
    wrong.refused = "adapt", "no matching"
    assert (doubtful.outcome, wrong.outcome, Judgement().outcome) == ("doubtful", "silently wrong", "right")
    assert Judgement(refused=("learn", "no")).outcome == "refused"


def test_what_is_left_out_as_unsure_is_no_mistake(worlds):
    """Of pairs that adapting took, one of two different objects is wrong; one that it did not take is not."""
    scene = worlds[0].demonstrations[0]
    boxes = chain.true_boxes(scene, chain.moved_objects(scene))
    later = chain.true_boxes(worlds[0].later, worlds[0].later.objects)
    one, other = np.arange(len(boxes)), np.full(len(boxes), -1)
    one[:2], other[2:] = [1, 0], one[2:]
    blamed = []
    for objects in (np.arange(len(boxes)), one, other):
        judgement = Judgement()
        judgement.results = {
            "task": SimpleNamespace(environment=Environment(boxes)),
            "now": SimpleNamespace(environment=Environment(later)),
            "adapted": SimpleNamespace(objects=objects),
        }
        chain.judge_adapted(worlds[0], judgement)
        blamed.append(judgement.causes)
    assert blamed == [[], ["matching wrong"], []]


def test_notes_of_learning_and_adapting_are_listened_to_once():
    """A task's notes with doubt make what follows doubtful; those that are only good to know do not."""
    sure, unsure = Note("matching", "left out", False), Note("objects", "hangs on what is gone")
    judgement = Judgement()
    for name, notes in (("task", (sure,)), ("adapted", (sure, unsure)), ("again", (unsure,))):
        judgement.listen([], {name: SimpleNamespace(notes=notes)})
        assert judgement.outcome == ("right" if name == "task" else "doubtful")
    assert judgement.doubts == [str(unsure)]


def test_an_error_ends_the_chain_and_is_told(monkeypatch, worlds):
    """A refusal is told with its step; an error that is not of the library's own with its name."""
    refusing = {"map": (lambda world, results: {}["nothing"], chain.judge_nothing), **chain.STEPS}
    refusing["map"] = (lambda world, results: {}["nothing"], chain.judge_nothing)
    monkeypatch.setattr(chain, "STEPS", refusing)
    row = judge(worlds[0]).row(worlds[0])
    assert (row["outcome"], row["stage"], row["told"]) == ("refused", "map", "KeyError: 'nothing'")


# ---- the study


def fake_work(job):
    """A row without a world."""
    seed = int(job[0])
    row = dict.fromkeys(survey.COLUMNS, "") | {"seed": str(seed), "kind": KINDS[seed % len(KINDS)], "draws": "1"}
    ends = {0: ("right", ""), 1: ("refused", ""), 2: ("silently wrong", "user in part; collision")}
    outcome, causes = ends[seed % 3]
    stage = {"refused": "adapt"}.get(outcome, "")
    shares = {"user_right": f"{0.5 + seed / 1000}", "covered": "1", "law_covered": "1", "law_astray": "0"}
    return row | shares | {
        "outcome": outcome, "causes": causes, "cause": causes.split(";")[0], "stage": stage
    }  # fmt: skip


@pytest.fixture
def fake(monkeypatch):
    """The study without its worlds."""
    monkeypatch.setattr(survey, "work", fake_work)


def test_a_study_of_worlds_goes_on_where_it_was(tmp_path, fake, monkeypatch):
    """What is in the table is kept as it is, only the rest is run, and the table is in the order of seeds."""
    path, seen = tmp_path / "worlds.csv", []
    first = survey.run_survey(range(4, 8), path, jobs=0)
    monkeypatch.setattr(survey, "work", lambda job: (seen.append(int(job[0])), fake_work(job))[1])
    both = survey.run_survey(range(10), path, jobs=0)
    assert sorted(seen) == [0, 1, 2, 3, 8, 9]
    assert both.index.tolist() == list(range(10)) == survey.read_table(path).index.tolist()
    assert both.loc[4:7].equals(first)


def test_a_world_without_its_numbers_is_not_believed(tmp_path, fake):
    """Nor one with an outcome that there is not; a summary of none is refused."""
    ledger = survey.ledger_at(tmp_path / "worlds.csv")
    row = survey.run_survey(range(1), ledger.path, jobs=0).iloc[0].to_dict() | {"code": ""}
    wrongs = {"draws": ""}, {"draws": "9" * 5000}, {"covered": "much"}, {"collisions": "inf"}, {"outcome": "lost"}
    for wrong in wrongs:
        with ledger.shared() as table:
            table.append(row | {"seed": "7"} | wrong)
    assert ledger.read()[1] == 5
    with pytest.raises(ValueError, match="a summary needs a world"):
        survey.summary(survey.as_table([]))


def test_the_summary_counts_by_kind_and_cause(tmp_path, fake):
    """Ends add up to the worlds of each kind, causes are counted in every world that has them, the first apart."""
    table = survey.run_survey(range(33), tmp_path / "worlds.csv", jobs=0)
    found = survey.summary(table)
    assert found["kinds"]["all"] == {
        "worlds": 33, "right": 11, "refused": 11, "doubtful": 0, "silently wrong": 11, "refused later": 0
    }  # fmt: skip
    assert all(counts["worlds"] == 3 for kind, counts in found["kinds"].items() if kind != "all")
    assert found["causes"]["collision"] == {"worlds": 11, "first": 0}
    assert found["causes"]["user in part"] == {"worlds": 11, "first": 11}
    assert found["refusals"] == {"adapt": 11} and found["draws"] == 1.0
    text = survey.tables(found, found)
    assert "| **all** | 33 | 11 | 11 | 0 | 11 | 0 | 11 |" in text and "11 at adapt" in text


def test_the_worst_come_first(tmp_path, fake):
    """The sheet shows silently wrong worlds: of each kind the one with the least share right, then the next."""
    table = survey.run_survey(range(60), tmp_path / "worlds.csv", jobs=0)
    worst = survey.worst_seeds(table)
    assert len({seed % len(KINDS) for seed in worst[: len(KINDS)]}) == len(KINDS)
    assert sorted(worst[: len(KINDS)]) == list(range(2, 2 + 3 * len(KINDS), 3)) and worst[len(KINDS)] == 35


@pytest.mark.parametrize(
    ("text", "message"), [("seed,kind\n1,plain\n", "begins with the line seed,kind"), ("", "the file is empty")]
)
def test_a_table_that_is_none_is_refused(tmp_path, text, message):
    """A damaged table is told with its name, and nothing is written over it."""
    path = tmp_path / "worlds.csv"
    path.write_text(text)
    with pytest.raises(FormatError, match=message):
        survey.read_table(path)
    assert path.read_text() == text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["worlds", "--seeds", "0"], "a seed or more"),
        (["worlds", "--first-seed", "-1"], "a seed or more"),
        (["worlds", "filter"], "a study of its own"),
        (["filter", "--first-seed", "-1"], "at least 2 seeds, from 0 on"),
    ],
)
def test_a_study_that_cannot_be_is_refused(tmp_path, arguments, message):
    """Too few seeds, or worlds mixed with claims, are refused before anything is made."""
    with pytest.raises(SystemExit, match=message):
        main(["study", *arguments, "--folder", str(tmp_path / "study")])
    assert not (tmp_path / "study").exists()


# ---- the whole of it


def test_the_chain_ends_alike_twice_and_on_a_cluster(tmp_path):
    """A world gives the same table in this process and on a cluster named by its scheduler."""
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    here = survey.run_survey(SHORT, tmp_path / "here.csv", jobs=0)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        there = survey.run_survey(SHORT, tmp_path / "there.csv", cluster.scheduler_address)
    assert here.equals(there)
    assert (tmp_path / "here.csv").read_bytes() == (tmp_path / "there.csv").read_bytes()


def test_every_world_can_be_drawn(worlds):
    """A picture of each demonstration, and of what stood where later, whatever became of the world."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    judgement = judge(worlds[0])
    figure, axes = plt.subplots(1, 3)
    for world in worlds:
        for ax, k in zip(axes, (0, len(world.demonstrations) - 1, -1), strict=True):
            draw_judged(ax, world, judgement if world is worlds[0] else Judgement(), k)
            assert ax.get_title().startswith(str(world.seed)) and ax.patches
            ax.clear()
    plt.close(figure)


def test_an_easy_world_ends_right():
    """Two cans, one person who walks past them, nothing else: map, observe, learn, adapt and perform all succeed."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    cans = [Object.trash_can((2.5, 3.6)), Object.trash_can((6.5, 3.6))]
    person = Person([(1.6, 2.6), (4.0, 4.4), (6.0, 2.6), (7.6, 3.2)])
    scene = Scene(cans, people=[person])
    later = scene.with_objects_at(scene.positions + [(0.2, 0.1), (-0.1, 0.2)])
    tour = np.array([(4.5, 2.6), (7.6, 2.6), (4.5, 5.0), (1.6, 4.6), (1.6, 2.4)])
    empty = replace(scene, objects=(), people=())
    world = SimpleNamespace(seed=1, kind="plain", shape="rectangle", empty=empty, tour=tour,
                            demonstrations=(scene,), later=later, draws=1)  # fmt: skip
    assert walk_of(person, scene).t[-1] > 5
    row = judge(world).row(world)
    assert row["outcome"] == "right", row
    assert row["user_right"] > 0.98 and row["found"] == 2 and row["finished"] == 1


def test_the_command_writes_table_summary_and_pictures(tmp_path, fake, monkeypatch, capsys):
    """All four files are there and named; the report is told of seeds 0 to 299 and of no others."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    monkeypatch.setattr(survey, "draw_sheet", lambda seeds, path: path.touch())
    monkeypatch.setattr(survey, "SEEDS", 12)
    monkeypatch.setattr(survey, "run_survey", partial(survey.run_survey, jobs=0))
    report, folder = tmp_path / "REPLICATION.md", tmp_path / "study"
    report.write_text("<!-- worlds: begin -->\n<!-- worlds: end -->\n")
    main(["study", "worlds", "--seeds", "3", "--folder", str(folder)])
    assert report.read_text().count("|") == 0
    main(["study", "worlds", "--folder", str(folder)])
    assert "| **all** | 12 | 4 | 4 | 0 | 4 | 0 |\n" in report.read_text()
    told = capsys.readouterr().out
    for name in ("REPLICATION.md", "study/worlds.csv", "study/worlds.json", "study/worlds_worst.png"):
        assert (tmp_path / name).exists() and str(tmp_path / name) in told
    rows, _ = survey.ledger_at(folder / "worlds.csv").read()
    with survey.ledger_at(folder / survey.FIRST).shared() as table:
        table.append(rows[0] | {"outcome": "silently wrong"}, *rows[1:])
    main(["study", "worlds", "--folder", str(folder)])
    assert "| **all** | 12 | 4 | 4 | 0 | 4 | 0 | 5 |\n" in report.read_text()
