"""The study: resumed, retried, on a cluster, summed up by rule; and the experiments' measures."""

import json
import os
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from places import ROOT

from dollop.checks import EXTRAS
from dollop.cli import main
from dollop.formats.files import FormatError
from dollop.lds import LDS
from dollop.replication import judging, ledger, report, running, study
from dollop.replication.claims import (
    Claim,
    Criterion,
    environment,
    law,
    learning,
    measures,
    observing,
    robot,
)
from dollop.sequenced_lds import SequencedLDS
from dollop.tracking import Tracker


def claim_of(experiment):
    """A claim that wants a positive number of an experiment."""
    criterion = Criterion("number", "a number", (0, np.inf), matters=1.0)
    return Claim("fake", "I", "words", (criterion,), experiment)


def counting(folder):
    """An experiment that leaves a file for every time it is run."""

    def experiment(seed):
        (folder / f"{seed}-{len(list(folder.glob(f'{seed}-*')))}").touch()
        return {"number": np.random.default_rng(seed).normal(5.0)}

    return {"fake": claim_of(experiment)}


def dying(folder, times):
    """An experiment whose worker dies at seed 1, so many times."""

    def experiment(seed):
        deaths = len(list(folder.glob("died-*")))
        if seed == 1 and deaths < times:
            (folder / f"died-{deaths}").touch()
            os._exit(1)
        return {"number": float(seed)}

    return {"fake": claim_of(experiment)}


def stumbling(folder):
    """An experiment that fails at seed 1, the first time."""
    counted = counting(folder)["fake"].experiment

    def experiment(seed):
        if seed == 1 and not (folder / "stumbled").exists():
            (folder / "stumbled").touch()
            raise ValueError("a stone")
        return counted(seed)

    return {"fake": claim_of(experiment)}


@pytest.fixture
def runs(tmp_path):
    """Folder in which experiments leave their marks."""
    (tmp_path / "runs").mkdir()
    return tmp_path / "runs"


def test_a_study_goes_on_where_it_was(tmp_path, runs):
    """Seeds that are in the table are kept as they are and not run again."""
    table = tmp_path / "results.csv"
    first = study.run_study(["fake"], range(2), table, claims=counting(runs), jobs=0)
    both = study.run_study(["fake"], range(4), table, claims=counting(runs), jobs=0)
    assert sorted(path.name for path in runs.iterdir()) == ["0-0", "1-0", "2-0", "3-0"]
    assert sorted(both.seed) == [0, 1, 2, 3]
    old, kept = (table.sort_values("seed").value.tolist() for table in (first, both[both.seed < 2]))
    assert kept == old


def test_a_number_that_is_new_is_filled_in(tmp_path, runs):
    """A claim that tells another number is run again for it, and no number stands twice."""
    claim = counting(runs)["fake"]
    study.run_study(["fake"], [0], tmp_path / "results.csv", claims={"fake": claim}, jobs=0)
    more = replace(claim, criteria=(*claim.criteria, Criterion("other", "a number that is told")))
    more = replace(more, experiment=lambda seed: {"number": 1.0, "other": 2.0})
    table = study.run_study(["fake"], [0], tmp_path / "results.csv", claims={"fake": more}, jobs=0)
    assert dict(zip(table.number, table.value, strict=True)) == {"number": 1.0, "other": 2.0}


def test_an_interrupted_study_loses_nothing(tmp_path, runs, monkeypatch):
    """What was done before Ctrl-C is in the table, and only the rest is run after it."""
    table, append, written = tmp_path / "results.csv", ledger.Shared.append, []

    def interrupted(*arguments):
        append(*arguments)
        written.append(1)
        if len(written) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(ledger.Shared, "append", interrupted)
    with pytest.raises(KeyboardInterrupt):
        study.run_study(["fake"], range(5), table, claims=counting(runs), jobs=0)
    assert len(study.read_table(table)) == 2
    monkeypatch.undo()
    study.run_study(["fake"], range(5), table, claims=counting(runs), jobs=0)
    assert sorted(study.read_table(table).seed) == [0, 1, 2, 3, 4]
    assert len([path for path in runs.iterdir() if path.name.startswith(("0-", "1-"))]) == 2


def test_a_failed_experiment_is_named_and_run_again(tmp_path, runs):
    """The others are kept, claim, seed and reason are named, the next call runs that seed alone."""
    table, stumble = tmp_path / "results.csv", stumbling(runs)
    with pytest.raises(RuntimeError, match="claim fake, seed 1: ValueError: a stone"):
        study.run_study(["fake"], range(3), table, claims=stumble, jobs=0)
    assert sorted(study.read_table(table).seed) == [0, 2]
    again = study.run_study(["fake"], range(3), table, claims=stumble, jobs=0)
    assert sorted(again.seed) == [0, 1, 2]
    assert not list(runs.glob("*-1"))


def test_a_worker_that_dies_is_retried_and_reported(tmp_path, runs, capsys):
    """The study finishes, and says over what the worker died."""
    path = tmp_path / "results.csv"
    table = study.run_study(["fake"], range(4), path, claims=dying(runs, 1), jobs=2)
    assert sorted(table.seed) == [0, 1, 2, 3] and (table.seed == table.value).all()
    assert "a worker died over claim fake, seed 1" in capsys.readouterr().err


def test_what_kills_its_worker_again_and_again_is_set_aside(tmp_path, runs, capsys):
    """After three deaths, two of them alone, it is named and has a line of its own; all others are done.

    When the study is run again, so is that seed, and its line gives way to its number.
    """
    path = tmp_path / "results.csv"
    with pytest.raises(RuntimeError, match="1 jobs were set aside: claim fake, seed 1: killed its worker 3 times"):
        study.run_study(["fake"], range(6), path, claims=dying(runs, 3), jobs=2)
    assert study.read_table(path).seed.tolist() == [0, 2, 3, 4, 5]
    assert path.read_text().count("fake,1,not done: killed its worker 3 times") == 1
    assert "set aside: claim fake, seed 1" in capsys.readouterr().err
    assert study.run_study(["fake"], range(6), path, claims=dying(runs, 3), jobs=0).seed.tolist() == list(range(6))
    assert "not done" not in path.read_text()


@pytest.fixture(scope="module")
def cluster():
    """A Dask cluster of two workers on this machine, which gives a job up after its second death."""
    distributed = pytest.importorskip("distributed", reason="needs the extra cluster")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.run_on_scheduler(lambda dask_scheduler: setattr(dask_scheduler, "allowed_failures", 1))
        yield cluster


def test_a_dask_cluster_gives_the_same_numbers(tmp_path, cluster):
    """Naming a scheduler moves the work there and changes nothing else."""
    tables = []
    for name, scheduler in (("here", None), ("there", cluster.scheduler_address)):
        path = tmp_path / name
        tables.append(study.run_study(["ceiling"], range(3), path, scheduler, jobs=1))
    here, there = (table.sort_values(["seed", "number"]).reset_index(drop=True) for table in tables)
    pd.testing.assert_frame_equal(here, there)


def test_what_dask_gives_up_is_set_aside(tmp_path, runs, cluster):
    """The study does not wait for what a cluster has given up; the other seeds are kept."""
    path = tmp_path / "results.csv"
    with pytest.raises(RuntimeError, match="1 jobs were set aside: claim fake, seed 1"):
        study.run_study(["fake"], range(4), path, cluster.scheduler_address, dying(runs, 99))
    assert study.read_table(path).seed.tolist() == [0, 2, 3]


def test_the_command_writes_table_and_claims(tmp_path, capsys):
    """From the command line to results.csv and claims.json; a second call adds nothing."""
    arguments = ["study", "ceiling", "--seeds", "4", "--folder", str(tmp_path / "s")]
    main(arguments)
    table = (tmp_path / "s" / "results.csv").read_text()
    (found,) = json.loads((tmp_path / "s" / "claims.json").read_text())
    assert found["id"] == "ceiling" and found["seeds"] == 4
    assert "ceiling" in capsys.readouterr().out
    main(arguments)
    assert (tmp_path / "s" / "results.csv").read_text() == table


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nonsense"], "no claim nonsense; known: single, settings, alike"),
        (["combined", "--seeds", "1"], "an interval needs at least 2 seeds, from 0 on, got 1 from 1000 on"),
    ],
)
def test_bad_calls_end_with_a_message(arguments, message, tmp_path, monkeypatch):
    """An unknown claim lists the known ones; nothing is written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["study", *arguments])
    assert message in str(end.value) and list(tmp_path.iterdir()) == []


def test_an_unwritable_folder_is_said_before_the_work(tmp_path, monkeypatch):
    """A file in the folder's place ends the call before any experiment."""
    (tmp_path / "taken").write_text("")
    monkeypatch.setattr(study, "run_study", lambda *_: pytest.fail("work was begun"))
    with pytest.raises(SystemExit) as end:
        main(["study", "combined", "--folder", str(tmp_path / "taken")])
    assert "taken" in str(end.value)


def test_a_missing_laboratory_is_said_before_the_work(tmp_path, monkeypatch):
    """One line says how to install it, and nothing is written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(EXTRAS, "lab", "no_such_module")
    with pytest.raises(SystemExit) as end:
        main(["study", "combined"])
    assert 'pip install "dollop[lab]"' in str(end.value) and "\n" not in str(end.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", ["", "a,b\n1,2\n", "claim,seed,number,value\nloss,1,lost_per_lap,2\n"])
def test_a_table_of_something_else_is_refused(content, tmp_path):
    """A file that holds no results is named, not overwritten."""
    path = tmp_path / "results.csv"
    path.write_text(content)
    with pytest.raises(FormatError, match=r"results\.csv"):
        study.run_study(["fake"], range(2), path)
    assert path.read_text() == content


def test_numbers_of_other_code_are_made_anew(tmp_path, runs, monkeypatch, capsys):
    """They are counted on the error stream, the new number takes the place of the old; what nobody asks for stays."""
    path, claims = tmp_path / "results.csv", counting(runs)
    monkeypatch.setattr(study, "fingerprint", lambda module: "rule" if module == study.RULE else "0" * 12)
    study.run_study(["fake"], range(3), path, claims=claims, jobs=0)
    monkeypatch.setattr(study, "fingerprint", lambda module: "rule" if module == study.RULE else "1" * 12)
    study.run_study(["fake"], range(2), path, claims=claims, jobs=0)
    assert sorted(each.name for each in runs.iterdir()) == ["0-0", "0-1", "1-0", "1-1", "2-0"]
    assert [line.split(",")[3] for line in path.read_text().splitlines()[1:]] == ["1" * 12, "1" * 12, "0" * 12]
    told = capsys.readouterr().err
    assert f"2 rows of {path} are of other code" in told and f"1 rows of {path} are of other code and stay" in told


@pytest.mark.parametrize("change", [{"wanted": (4, np.inf)}, {"matters": 0.5}, {"trials": 1}])
def test_seeds_judge_by_no_other_criteria(change, tmp_path, runs):
    """Once a seed has judged a claim, another range, effect or interval is refused, and the table stays as it is."""
    path, claims = tmp_path / "results.csv", counting(runs)
    study.run_study(["fake"], range(3), path, claims=claims, jobs=0)
    before, claim = path.read_text(), claims["fake"]
    other = {"fake": replace(claim, criteria=(replace(claim.criteria[0], **change),))}
    with pytest.raises(ValueError, match="seeds 1 to 2 have judged fake under other criteria.*--first-seed 3"):
        study.run_study(["fake"], range(1, 5), path, claims=other, jobs=0)
    assert path.read_text() == before
    assert study.run_study(["fake"], range(3, 5), path, claims=other, jobs=0).seed.tolist() == [3, 4]


def test_what_is_told_may_change(tmp_path, runs):
    """How a number is described, and what is told beside it, are no criteria."""
    path, claims = tmp_path / "results.csv", counting(runs)
    study.run_study(["fake"], range(2), path, claims=claims, jobs=0)
    claim = claims["fake"]
    other = {"fake": replace(claim, criteria=(replace(claim.criteria[0], meaning="in other words"),))}
    assert len(study.run_study(["fake"], range(2), path, claims=other, jobs=0)) == 2
    assert len(list(runs.iterdir())) == 2


def test_the_first_study_s_seeds_are_used_up(tmp_path, runs):
    """They stand in a table of their own beside the study's."""
    study.run_study(["fake"], range(3), tmp_path / study.FIRST, claims=counting(runs), jobs=0)
    claim = counting(runs)["fake"]
    other = {"fake": replace(claim, quote="other words")}
    with pytest.raises(ValueError, match="seeds 0 to 1 have judged fake"):
        study.run_study(["fake"], range(2), tmp_path / "results.csv", claims=other, jobs=0)


def test_criteria_are_frozen_before_a_report_is_judged(tmp_path, monkeypatch):
    """Beside REPLICATION.md nothing is judged without them, by others, or on other seeds than theirs."""
    place = ["--folder", str(tmp_path / "study")]
    (tmp_path / "REPLICATION.md").write_text("# Report\n")
    monkeypatch.setattr(study, "run_study", lambda *_: pytest.fail("work was begun"))
    with pytest.raises(SystemExit, match=r"no criteria are frozen in .*criteria\.json: dollop study criteria"):
        main(["study", "combined", *place])
    main(["study", "criteria", "--first-seed", "5000", "--seeds", "50", *place])
    kept = json.loads((tmp_path / "study" / "criteria.json").read_text())
    assert kept["seeds"] == [5000, 5049] and set(kept["claims"]) == set(study.CLAIMS)
    with pytest.raises(SystemExit, match="judged on seeds 5000 to 5049, got 1000 to 1199"):
        main(["study", "combined", *place])
    other = replace(study.CLAIMS["combined"], quote="other words")
    monkeypatch.setitem(study.CLAIMS, "combined", other)
    with pytest.raises(SystemExit, match="the criteria of combined are not those frozen"):
        main(["study", "combined", "--first-seed", "5000", "--seeds", "2", *place])


def test_numbers_come_back_to_six_digits(tmp_path):
    """Whatever they are, nan included; an infinite one is refused, as no mean can have it."""
    values = [0.0, -1.0, 12345.678, 1.23456789e-12, 1 / 3, float("nan"), 1e300]
    claims = {"fake": claim_of(lambda seed: {"number": values[seed]})}
    table = study.run_study(["fake"], range(len(values)), tmp_path / "results.csv", claims=claims, jobs=0)
    expected = [float(f"{value:.6g}") for value in values]
    assert np.array_equal(table.value, expected, equal_nan=True)
    assert np.array_equal(study.read_table(tmp_path / "results.csv").value, expected, equal_nan=True)
    values.append(float("inf"))
    with pytest.raises(RuntimeError, match="number must be finite or nan, got inf"):
        study.run_study(["fake"], [len(values) - 1], tmp_path / "results.csv", claims=claims, jobs=0)


def test_every_line_of_the_study_is_sound_and_of_one_code_for_each_claim():
    """The committed table has a line for each claim and seed, in order, none of them damaged or set aside.

    All of a claim's lines are of one code.
    """
    rows, damaged = study.ledger_at(ROOT / "study" / "results.csv").read()
    jobs = [(row["claim"], int(row["seed"])) for row in rows]
    assert damaged == 0 and jobs == sorted(set(jobs)) and all(map(study.numbers_of, rows))
    assert len({(row["claim"], row["code"]) for row in rows}) == len({row["claim"] for row in rows})


def test_intervals_cover_the_truth():
    """Of 1000 intervals of twenty values 93 to 98 % hold the true mean, of shares too."""
    rng = np.random.default_rng(0)
    for drawn, truth, share in (
        (rng.normal(3.0, 1.0, (1000, 20)), 3.0, False),
        (rng.random((1000, 20)) < 0.3, 0.3, True),
    ):
        ends = [judging.interval(values, share, 0.95)[1:] for values in drawn]
        assert 0.93 < np.mean([low <= truth <= high for low, high in ends]) < 0.98


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        (("yes", "yes"), "holds"),
        (("yes", "no"), "holds in part"),
        (("yes", "open"), "holds in part"),
        (("open",), "holds in part"),
        (("open", "no"), "does not hold"),
        (("no",), "does not hold"),
    ],
)
def test_the_verdict_follows_the_rule(answers, words):
    """All criteria met; some, or none and none clearly not; none, and one clearly not."""
    assert judging.verdict(answers) == words


def test_a_criterion_is_met_only_by_the_whole_interval():
    """A mean above zero whose interval reaches below leaves it open; no number at all does too."""
    criterion = Criterion("number", "a number", (0, np.inf), matters=0.1)
    for values, answer in (
        ([1.0, 1.001, 0.999], "yes"),
        ([1.0, -0.8, 0.5], "open"),
        ([-1.0, -1.001, -0.999], "no"),
        ([], "open"),
    ):
        assert report.measured(criterion, np.array(values))["met"] == answer
    assert report.measured(criterion, np.zeros(5))["met"] == "no"
    assert report.measured(criterion, np.array([]))["mean"] is None


def test_only_what_stands_between_the_marks_is_replaced():
    """The report's own words stay; a report without marks is refused."""
    text = "before\n<!-- claims: begin -->\nold\n<!-- claims: end -->\nafter\n"
    assert running.put_between_marks(text, "claims", "new") == text.replace("old", "new")
    with pytest.raises(ValueError, match="once each"):
        running.put_between_marks("no marks", "claims", "new")


# ---- the experiments' own measures


def test_windings_count_turns():
    """Twice round counter-clockwise is +2, a point outside is 0, and clockwise is negative."""
    turn = np.linspace(0, 4 * np.pi, 100, endpoint=False)
    path = np.column_stack([np.cos(turn), np.sin(turn)])
    assert measures.windings(path, [[0.2, 0.1], [3, 0]]).tolist() == [2, 0]
    assert measures.windings(path[::-1], [[0.2, 0.1]]).tolist() == [-2]


def test_segments_hand_over_where_their_responses_end():
    """Of two equal straight segments the second is in force from the middle of the way on, by either response."""
    ways = np.linspace([0.0, 0.0], [2.0, 0.0], 40), np.linspace([2.0, 0.0], [4.0, 0.0], 40)
    straight = SequencedLDS(tuple(LDS.fit(way) for way in ways), ways[0][0], np.ones(2))
    half = measures.SHARES // 2
    for method in ("paper", "held"):
        found = measures.segments_along(straight, method)
        assert (found[: half - 2] == 0).all() and (found[half + 2 :] == 1).all()
        assert measures.error_of(straight, ways, method) < 1e-3
        assert measures.error_of(straight, [way + [0.0, 0.3] for way in ways], method) == pytest.approx(0.3, abs=1e-3)


def test_predictions_of_a_straight_walk_are_right():
    """A walker at constant velocity is predicted through a gap, one taken to stand is not."""
    t = np.arange(0, 6, 0.1)
    truth = np.column_stack([1.0 * t, 0.5 * t])
    shown = truth.copy()
    shown[40:55] = np.nan
    for motion in map(observing.motion, ("velocity", "acceleration")):
        assert np.abs(observing.causal_states(t, shown, motion)[:, 0] - truth)[40:55].max() < 0.05
    motion = observing.motion("velocity")
    standing = observing.causal_states(t, shown, motion, observing.standing_still)[:, 0]
    assert np.allclose(standing[40:55], standing[40])


def test_hiding_takes_away_one_second_in_four():
    """Only what was visible is counted as hidden, and it is not shown."""
    t, places = np.arange(0, 20, 0.1), np.ones((200, 2))
    occluded = t < 5
    user = type("Track", (), {"t": t, "measurements": places, "occluded": occluded})
    shown, hidden = observing.now_and_then(user)
    assert np.isnan(shown[hidden]).all() and not (hidden & occluded).any()
    assert 30 <= hidden.sum() <= 42


@pytest.mark.parametrize("matching", ["greedy", "joint"])
def test_walkers_far_apart_are_never_switched(matching):
    """Two walkers on parallel lines keep their tracks; swapped by hand, each counts one switch."""
    t = np.arange(0, 6.05, 0.1)
    objects = [np.array([[x, 0.0], [x, 4.0]]) for x in t]
    alone = np.tile([0, 1], (len(t), 1))
    assert observing.switches(t, objects, alone, Tracker(matching=matching)) == 0
    alone[30:] = [1, 0]
    assert observing.switches(t, objects, alone, Tracker(matching=matching)) == pytest.approx(10.0)


def test_walkers_that_coincide_are_one_centroid():
    """There are as many centroids as groups, and a walker alone has the index of its own."""
    t, objects, alone = observing.crossing_walkers(12, np.random.default_rng(3))
    assert len(t) == len(objects) == len(alone)
    assert any(len(each) < 12 for each in objects)
    for centroids, names in zip(objects, alone, strict=True):
        own = names[names >= 0]
        assert len(own) == len(set(own)) and len(centroids) <= 12 - (12 - len(own)) // 2


def test_the_user_is_who_is_nearest_to_the_expected_place():
    """A choice counts as right where the chosen track is within half a metre, and nowhere else."""
    t = np.arange(0, 3, 0.1)
    straight = np.column_stack([t, np.zeros_like(t)])
    tracks = [type("Track", (), {"t": t, "positions": straight + [0, off]}) for off in (0.1, 2.0)]
    users = np.where(t < 1, 0, 1)
    assert observing.named_right(users, tracks, t, straight).tolist() == (t < 1).tolist()


def test_a_bend_is_the_distance_from_the_chord():
    """Half a circle of 1 m bends by 1 m, a straight line not at all."""
    turn = np.linspace(0, np.pi, 101)
    assert observing.bend(np.column_stack([np.cos(turn), np.sin(turn)])) == pytest.approx(1.0)
    assert observing.bend(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])) == pytest.approx(0.0)
    spans = observing.spans_of(np.array([0, 1, 1, 0, 1], bool))
    assert [rows.tolist() for rows in spans] == [[1, 2], [4]]


def test_speeds_are_told_by_shares_of_the_way():
    """A walk at 0.5 m/s and then at 1 m/s is at 0.5 m/s in the first half of its way."""
    x = np.concatenate([np.arange(0, 5, 0.05), np.arange(5, 10, 0.1)])
    speeds = law.speeds_along(np.column_stack([x, np.zeros_like(x)]))
    assert np.allclose(speeds[5:90], 0.5) and np.allclose(speeds[110:-5], 1.0)


def test_a_run_counts_until_its_first_collision():
    """Who is back only after having hit something does not count as back."""
    run = SimpleNamespace(t=np.arange(5) * 0.1, clearance=np.array([1, 1, -0.1, 1, 1]), collisions=1)
    assert robot.first_hit(run) == pytest.approx(0.2)
    run.collisions = 0
    assert robot.first_hit(run) == np.inf


def test_one_transformation_is_found_again():
    """A turn, a factor and a shift of points are found; without a turn, what is nearest."""
    points = np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 2.0]])
    moved = points @ np.array([[0.0, 2.0], [-2.0, 0.0]]) + [1.0, 3.0]
    factor, shift = environment.similarity(points, moved)
    assert factor == pytest.approx(2j) and shift == pytest.approx(1 + 3j)
    factor, shift = environment.similarity(points, 2 * points + [1.0, 3.0], turning=False)
    assert factor == pytest.approx(2) and shift == pytest.approx(1 + 3j)


def test_the_linear_program_finds_the_best_bijection():
    """On random costs it costs what the best of all bijections does, and its shares are whole."""
    costs = np.random.default_rng(5).integers(0, 1000, (6, 6))
    found = environment.assignment_program(costs)
    all_costs = costs[np.arange(6), environment.bijections(6)].sum(axis=1)
    assert found.fun == pytest.approx(all_costs.min())
    assert np.allclose(found.x, found.x.round())


def test_heavy_tails_have_the_told_scale():
    """Half of the errors are within 0.765 scales, as Student's t of three degrees has it."""
    truth = np.zeros((6, 2))
    drawn = learning.drawn_with_tails(truth, 2000, 1)
    off = np.concatenate([each for each in drawn if len(each) == 6])
    assert np.median(np.abs(off)) == pytest.approx(0.765 * learning.SPREAD, rel=0.03)


def test_passing_places_are_in_turn_left_and_right():
    """Of a row along x they lie 0.75 m above and below."""
    cones = np.array([[0.0, 0.0], [1.5, 0.0], [3.0, 0.0]])
    assert learning.intended_places(cones)[:, 1].tolist() == [0.75, -0.75, 0.75]


def test_golden_numbers_are_those_of_the_first_seed():
    """Times are left out, nan becomes None; tolerances are a share of the spread, or the floor."""
    rows = [("time", 5, "seconds", 0.1)]
    rows += [("loss", 5 + k, "lost_per_lap", value) for k, value in enumerate((np.nan, 1.0))]
    rows += [("scaled", 5 + k, "off_percent", value) for k, value in enumerate((2.0, 4.0, 6.0))]
    rows += [("parameters", 5 + k, "numbers", 44.0) for k in range(3)]
    golden = report.golden_numbers(study.as_table(rows))
    assert golden["parameters"]["seed"] == 5
    assert golden["numbers"] == {
        "loss": {"lost_per_lap": {"value": None, "tolerance": 1e-9}},
        "parameters": {"numbers": {"value": 44.0, "tolerance": 4.4e-5}},
        "scaled": {"off_percent": {"value": 2.0, "tolerance": 0.02}},
    }


@pytest.mark.parametrize(
    ("low", "high", "wanted", "answer", "edge"),
    [
        (0.03, 0.05, (0.01, np.inf), "yes", False),
        (0.015, 0.05, (0.01, np.inf), "yes", True),
        (0.002, 0.008, (0.01, np.inf), "no", True),
        (-0.03, -0.01, (0.01, np.inf), "no", False),
        (0.96, 1.0, (0.9, 1), "yes", False),
        (0.96, 1.02, (0.9, 1), "yes", False),
        (0.905, 0.94, (0.9, 1), "yes", True),
        (0.02, 0.03, (0, 0.1), "yes", False),
        (0.02, 0.095, (0, 0.1), "yes", True),
        (0.5, 0.6, (-np.inf, 0.1), "no", False),
        (-0.62, -0.58, (-0.7, -0.3), "yes", False),
    ],
)
def test_edges_are_where_the_smallest_effect_would_change_the_answer(low, high, wanted, answer, edge):
    """Ends that nothing can be beyond, 0 of what is never less and 1 of a share, are no edges."""
    matters = 0.05 if wanted[1] == 1 else 0.01
    assert judging.met(low, high, wanted) == answer
    assert judging.at_edge(low, high, wanted, matters) == edge


def test_all_intervals_hold_together():
    """Of forty families of a hundred intervals nearly all hold all their means; of single ones hardly any would."""
    rng, whole, alone = np.random.default_rng(3), 0, 0
    for _ in range(40):
        families = rng.normal(0, 1, (judging.FAMILY, 200))
        whole += all(low <= 0 <= high for _, low, high in map(judging.interval, families))
        alone += all(low <= 0 <= high for _, low, high in (judging.interval(each, level=0.95) for each in families))
    assert whole >= 35 and alone <= 3


FOUND = [{"id": "luck", "numbers": [{"number": "hit", "mean": -0.23456}]}]


@pytest.mark.parametrize(
    ("was", "now"),
    [("20 %", "23 %"), ("-0.1", "-0.2"), ("5.0 mm", "234.6 mm"), ("1", "0"), ("3.12 m", "0.23 m"), ("1°", "0°")],
)
def test_quoted_numbers_are_written_anew_as_exactly_as_before(was, now):
    """Unit and decimals stay; the sign is that of the words, unless it stands there."""
    text = f'It is [{was}](CLAIMS.md#luck "hit") there.'
    assert report.with_numbers(text, FOUND) == text.replace(was, now)


@pytest.mark.parametrize("text", ['[a lot](CLAIMS.md#luck "hit")', '[1](CLAIMS.md#luck "other")'])
def test_a_quotation_of_nothing_is_refused(text):
    """Words that are no number, and numbers that no claim has."""
    with pytest.raises(ValueError, match=r"digits and a unit|no claim tells"):
        report.with_numbers(text, FOUND)


def test_the_noise_is_chosen_among_the_candidates(tmp_path, monkeypatch):
    """Each model gets the one of least error, and motions have what the file says."""
    monkeypatch.setattr(observing, "CHOSEN", tmp_path / "chosen.json")
    models, noises = list(observing.MODELS), observing.NOISES
    errors = np.ones((len(models), len(noises)))
    errors[range(len(models)), range(len(models))] = [0.0] * len(models)
    monkeypatch.setattr(observing, "errors_by_noise", lambda seed: seed * errors)
    observing.choose_noises(seeds=(1, 2), jobs=1)
    assert [observing.motion(name).noise for name in models] == list(noises[: len(models)])


def test_what_is_chosen_is_kept_with_its_parameters():
    """One noise of the candidates for each model, found on seeds that the study does not use."""
    kept = json.loads(observing.CHOSEN.read_text())
    assert set(kept["noises"]) == set(observing.MODELS)
    assert set(kept["noises"].values()) <= set(observing.NOISES)
    assert kept["parameters"]["candidates"] == list(observing.NOISES)
    assert min(kept["parameters"]["seeds"]) >= study.FIRST_SEED + study.SEEDS


def test_errors_depend_on_the_noise():
    """A seed gives every model an error at every noise, least between the ends of the range."""
    pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")
    errors = observing.errors_by_noise(10_000)
    assert errors.shape == (len(observing.MODELS), len(observing.NOISES))
    assert (errors.min(axis=1) < 0.9 * errors[:, [0, -1]].max(axis=1)).all()


def test_noise_is_chosen_anew_with_the_study_itself(tmp_path, monkeypatch):
    """Beside REPLICATION.md and without a table, and in no other case."""
    monkeypatch.setattr(study, "run_study", lambda *_: study.as_table())
    header = ",".join([*study.LINE, "check"]) + "\n"
    chosen = []
    monkeypatch.setattr(study, "choose_noises", lambda: chosen.append(1))
    marks = "<!-- claims: begin -->\n<!-- claims: end -->\n"
    for folder, told, table, times in (
        ("study", True, False, 1),
        ("study", True, True, 0),
        ("study", False, False, 0),
        ("other", True, False, 0),
    ):
        chosen.clear()
        place = tmp_path / f"{folder}-{told}-{table}" / folder
        place.mkdir(parents=True)
        if told:
            (place.parent / "REPLICATION.md").write_text(marks)
        if table:
            (place / "results.csv").write_text(header)
        main(["study", "criteria", "--folder", str(place)])
        main(["study", "combined", "--folder", str(place)])
        assert len(chosen) == times
