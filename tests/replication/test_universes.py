"""Many universes: every choice is in enough of them, what does not matter is not run again, and it goes on."""

import json
import re
from collections import Counter
from dataclasses import fields, replace
from math import inf
from types import SimpleNamespace

import numpy as np
import pytest
from places import ROOT

from dollop.cdhmm import SubgoalHMM
from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.lab.tasks import draw_layouts, draw_task, walked
from dollop.replication import choosing, universes
from dollop.replication.claims import CLAIMS, law
from dollop.replication.claims.claim import Claim, Criterion
from dollop.replication.reconstruction import LEVELS, TOLD, Reconstruction
from dollop.task import Demonstration, Task, learn
from dollop.trajectory import distance_to_polyline, resample

ALL = universes.universes()
CALLS = []


def share(seed, how=TOLD):
    """High where laps are laid as told, low where not; nothing for swaying walkers."""
    CALLS.append((seed, how))
    if how.walker == "legs":
        raise ValueError("two legs are no torso")
    return {"high": float(how.laid == TOLD.laid), "side": float("nan")}


def plain(seed):
    """What depends on nothing."""
    return {"high": 1.0}


HIGH = Criterion("high", "a share", (0.5, inf), 0.05)
FAKES = {
    "share": Claim("share", "I", "words", (HIGH, Criterion("side", "told")), share, choices=("laid", "walker")),
    "plain": Claim("plain", "I", "words", (HIGH,), plain),
}


@pytest.fixture(scope="module")
def shown():
    """Two demonstrations of a drawn task among objects that stand elsewhere each time."""
    rng = np.random.default_rng(1)
    task, layouts = draw_task(3, rng), draw_layouts(3, 2, rng, "moved")
    return [Demonstration(walked(task, each, rng), task.environment(each)) for each in layouts]


# ---- the universes


def test_the_first_universe_is_told_and_none_is_there_twice():
    """At least a hundred, all different; after the first each alternative alone."""
    assert ALL[0] == TOLD and len(set(ALL)) == len(ALL) >= 100
    alone = sum(len(levels) - 1 for levels in LEVELS.values())
    assert [len(how.changed()) for how in ALL[1 : 1 + alone]] == [1] * alone
    assert min(len(how.changed()) for how in ALL[1 + alone :]) > 2


def test_levels_are_those_of_the_fields():
    """Every field has levels, the told one first, none twice."""
    assert set(LEVELS) == {each.name for each in fields(Reconstruction)}
    for name, levels in LEVELS.items():
        assert levels[0] == getattr(TOLD, name) and len(set(levels)) == len(levels) > 1


@pytest.mark.parametrize("name", LEVELS)
def test_every_level_is_in_enough_universes(name):
    """In twenty-five at least, and in the combinations as often as any other but for one."""
    alone = sum(len(levels) - 1 for levels in LEVELS.values())
    counts = Counter(getattr(how, name) for how in ALL)
    combined = Counter(getattr(how, name) for how in ALL[1 + alone :])
    assert min(counts[level] for level in LEVELS[name]) >= 25
    assert max(combined.values()) - min(combined.values()) <= 1


def test_names_tell_universes():
    """Every universe is found again by its name; a level that is none is refused."""
    assert [universes.how_of(universes.name_of(how)) for how in ALL] == list(ALL)
    for name in ("walker=robot", "nothing=1", "walker"):
        with pytest.raises(ValueError, match="fields and their levels"):
            universes.how_of(name)


# ---- running


def test_universes_that_do_not_differ_for_a_claim_are_one_job():
    """Of each claim and seed no universe twice; every universe's own is among them."""
    jobs = universes.jobs_of(universes.choosy(CLAIMS), ALL, [7, 8])
    assert len(set(jobs)) == len(jobs)
    assert [job[:2] for job in jobs if job[2] == "7"] == [job[:2] for job in jobs if job[2] == "8"]
    for id, claim in universes.choosy(CLAIMS).items():
        names = {name for other, name, _ in jobs if other == id}
        assert names == {universes.name_of(how.only(claim.choices)) for how in ALL}


def test_what_is_not_declared_does_not_matter(monkeypatch):
    """The numbers of a whole universe are those of what is left of it, and those of what is declared are not."""
    shown = SimpleNamespace(laps=law.walked_eights(1, count=3))
    monkeypatch.setattr(law.recordings, "figure_eights", lambda seed, how: shown)
    how = Reconstruction(tolerance=0.08, weights=4.0, corners=4, learning="anchored", reach=0.4, spread=0.25)
    left = how.only(CLAIMS["laps"].choices)
    assert left != how and law.laps(0, how) == law.laps(0, left) != law.laps(0)


def test_a_study_goes_on_where_it_was(tmp_path):
    """What is in the table is not run again, another seed is added, and a universe may refuse."""
    path, hows = tmp_path / "universes.csv", ALL[:30]
    distinct = {how.only(("laid", "walker")) for how in hows}
    CALLS.clear()
    rows = universes.run_universes(hows, [3], path, claims=FAKES, jobs=0)
    assert len(rows) == len(distinct) == len(CALLS)
    universes.run_universes(hows, [3], path, claims=FAKES, jobs=0)
    assert len(CALLS) == len(distinct)
    rows = universes.run_universes(hows, [3, 4], path, claims=FAKES, jobs=0)
    assert len(CALLS) == 2 * len(distinct) == len(rows)
    refused = [row for row in rows if "legs" in row["universe"]]
    assert all(row["numbers"] == "raised ValueError: two legs are no torso" for row in refused) and refused


# ---- summing up


def test_the_verdict_is_that_of_the_means():
    """A mean in its range, of half of the seeds or more; told numbers play no part."""
    claim = FAKES["share"]
    assert universes.verdict_of(claim, [{"high": 0.4}, {"high": 0.8}]) == "holds"
    assert universes.verdict_of(claim, [{"high": 0.4}, {"high": 0.5}]) == "does not hold"
    assert universes.verdict_of(claim, [{"high": 1.0}, {}]) == "holds"
    assert universes.verdict_of(claim, [{"high": 1.0}, {}, {}]) == "not decided"
    both = replace(claim, criteria=(HIGH, Criterion("side", "another", (-inf, 0.0), 0.1)))
    assert universes.verdict_of(both, [{"high": 1.0, "side": 1.0}]) == "holds in part"


def test_the_summary_names_what_flips_a_verdict(tmp_path):
    """Known truth: evenly laid laps flip it, legs leave it undecided, swaying does nothing."""
    rows = universes.run_universes(ALL, [3], tmp_path / "universes.csv", claims=FAKES, jobs=0)
    found = universes.summary(rows, ALL, FAKES)
    told = found["claims"]["share"]
    as_told = [how for how in ALL if how.laid == "warped" and how.walker != "legs"]
    assert told["same"] == pytest.approx(len(as_told) / len(ALL), abs=1e-4)
    assert told["distinct"] == 6 and "plain" not in found["claims"] and told["by_chance"] is None
    choices = told["choices"]
    assert choices["laid"]["even"]["flips"] == "does not hold" and choices["laid"]["even"]["same"] == 0
    assert choices["walker"]["legs"]["flips"] == "not decided"
    assert choices["walker"]["swaying"]["flips"] is None
    assert universes.markdown(found).splitlines()[-1].endswith("| laid even, walker legs |")
    universes.draw_figure(found, tmp_path / "universes.png")
    assert (tmp_path / "universes.png").read_bytes().startswith(b"\x89PNG")


def test_chance_alone_is_told():
    """Of numbers that are all alike no draw differs; of such about the edge about half do."""
    rng, claim = np.random.default_rng(0), FAKES["share"]
    assert universes.by_chance(claim, [{"high": 1.0}] * 40, 10) == {"of_all_seeds": "holds", "by_chance": 1.0}
    edge = [{"high": value} for value in rng.normal(0.5, 1.0, 200)]
    assert 0.3 < universes.by_chance(claim, edge, 10)["by_chance"] < 0.8
    assert universes.by_chance(claim, edge[:12], 10) == {"of_all_seeds": None, "by_chance": None}


def test_what_is_published_follows_from_the_table():
    """A hundred universes of ten seeds, all lines sound and of one code a claim; summary and report follow by rule."""
    rows, damaged = universes.ledger_at(ROOT / "study" / "universes.csv").read()
    found = universes.summary(rows, ALL, results=ROOT / "study" / "results.csv")
    assert damaged == 0 and len({(row["claim"], row["code"]) for row in rows}) == len(found["claims"])
    assert found == json.loads((ROOT / "study" / "universes.json").read_text())
    assert found["universes"] >= 100 and found["seeds"] == [1000, 1009]
    assert set(found["raised"]) == {"ValueError"}  # what a universe does not allow, and no mistake of ours
    assert universes.markdown(found) in (ROOT / "REPLICATION.md").read_text()


def test_what_the_report_says_of_the_universes_in_words():
    """Which claims keep their verdict in nine of ten, what turns the other ones, and why `layouts` is other."""
    text = " ".join((ROOT / "REPLICATION.md").read_text().split())
    told = json.loads((ROOT / "study" / "universes.json").read_text())["claims"]
    sentence = re.search(r"stands whatever is chosen \((.*?)sixteen of the claims", text)[1]
    assert set(re.findall(r"`(\w+)`", sentence)) == {id for id, each in told.items() if each["same"] >= 0.9}
    assert sum(each["same"] >= 0.9 for each in told.values()) == 16
    legs = {id for id, each in told.items() if each["choices"].get("walker", {}).get("legs", {}).get("flips")}
    assert legs == {"loss", "interpolation", "fastest", "kept", "prediction"}
    literal = {id for id, each in told.items() if each["choices"].get("matching", {}).get("literal", {}).get("flips")}
    assert literal == {"moved", "generalize", "shared", "layouts"}
    uncut = [how for how in ALL if how == TOLD or how.tolerance == 0.01 or how.cuts == "largest"]
    rows, _ = universes.ledger_at(ROOT / "study" / "universes.csv").read()
    verdicts = universes.summary(rows, uncut, {"layouts": CLAIMS["layouts"]})["claims"]["layouts"]["verdicts"]
    assert verdicts["not decided"] > 0.5 * (1 - told["layouts"]["same"]) * len(ALL)


def test_seeds_that_are_none_are_refused(tmp_path):
    """Before anything is made."""
    options = SimpleNamespace(seeds=0, first_seed=0, quick=True, folder=tmp_path / "new", scheduler=None)
    with pytest.raises(ValueError, match="a seed or more"):
        universes.command(options)
    assert not options.folder.exists()


@pytest.mark.parametrize(("seeds", "first", "quick"), [(3, None, False), (None, 7, False), (None, None, True)])
def test_the_report_tells_of_its_own_seeds_alone(seeds, first, quick, tmp_path):
    """Others are refused beside it."""
    (tmp_path / "REPLICATION.md").touch()
    options = SimpleNamespace(seeds=seeds, first_seed=first, quick=quick, folder=tmp_path / "study", scheduler=None)
    with pytest.raises(ValueError, match="tells of seeds 1000 to 1009, got .*; with --folder others"):
        universes.command(options)
    assert not options.folder.exists()


# ---- what is chosen


def test_as_told_is_the_library(shown):
    """Law, task and learning as told are what the library does, and so is the path of other weights."""
    assert choosing.shown_as(shown[0]) is shown[0]
    task, same = choosing.task_of(shown[0]), Task.of(shown[0], "paper")
    for mine, usual in ((task, same), [each.adapt(shown[1].environment) for each in (task, same)]):
        assert np.array_equal(mine.law.response(method="paper"), usual.law.response(method="paper"))
    by_library = learn(shown, method="paper", spread=0.15)
    for learned in (choosing.learned(shown), choosing.learned_as_paper(tuple(shown), TOLD, None)):
        assert np.allclose(learned.law.subgoals, by_library.law.subgoals, atol=1e-12)
        assert np.allclose(learned.association.weights, by_library.association.weights)


@pytest.mark.parametrize("name", ["lds", "tolerance", "cuts", "laid", "weights", "corners", "learning"])
def test_choices_are_obeyed(shown, name):
    """Another level gives another task, and one that is learned from, and adapted to where objects stand."""
    for level in LEVELS[name][1:]:
        how = Reconstruction(**{name: level})
        laps = [choosing.shown_as(each, how) for each in shown]
        task, usual = choosing.learned(laps, how), choosing.learned(shown)
        if name != "laid":  # of one walk there is nothing to lay together
            assert not np.array_equal(anchors_of(task), anchors_of(usual))
        adapted = choosing.adapted(task, shown[1].environment, how)
        off = adapted.law.errors(shown[1].walks[0])["mean"]
        assert off < 0.6


def anchors_of(task):
    """What tells two tasks apart: how the law answers, and what it is tied to."""
    return np.concatenate([task.law.subgoals[:2].ravel(), task.law.segments[0].A.ravel(), task.association.weights[0]])


def test_the_largest_error_keeps_its_tolerance(shown):
    """Brute force: no place of the walk is farther from the response of its segment than is allowed."""
    walk, how = shown[0].walks[0], Reconstruction(cuts="largest", tolerance=0.03)
    found = choosing.law_of([walk], how)
    places, start = resample(walk, 60), found.start
    for segment in found.segments:
        first, last = (np.linalg.norm(places - at, axis=1).argmin() for at in (start, segment.goal))
        response = np.vstack([segment.response(start, 200), segment.goal])
        assert distance_to_polyline(places[first : last + 1], response).max() <= 0.03 + 1e-6
        start = segment.goal
    usual = choosing.law_of([walk], replace(how, cuts="mean"))
    assert len(found.segments) > len(usual.segments)


def test_merging_by_nearness_finds_what_is_in_common():
    """Five demonstrations of a known task without strays: its states, and nothing else."""
    truth = np.array(TASKS["slalom"])
    drawn = draw_demonstrations(truth, 5, 0.10, seed=3)
    exact = [each for each in drawn if len(each) == len(truth)]
    model = choosing.model_of(exact, Reconstruction(merging="spread"))
    assert isinstance(model, SubgoalHMM) and len(model.means) == len(truth)
    assert np.abs(model.means[model.most_likely_path()] - truth).max() < 0.2
    apart = choosing.model_of([truth, truth + [0.0, 20.0]], Reconstruction(merging="spread"))
    assert len(apart.means) == 2 * len(truth)
