"""The claims: rerunnable, repeatable, reproducible; every number as the study recorded it."""

import json
import sys
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest
from places import ROOT
from scipy.stats import binom
from scipy.stats import t as student

import dollop
from dollop.replication import recordings, study
from dollop.replication.claims import CLAIMS, environment, learning, observing

GOLDEN = json.loads((ROOT / "study" / "golden.json").read_text())
PUBLISHED = {claim["id"]: claim for claim in json.loads((ROOT / "claims.json").read_text())}
NUMBERS = [(claim, criterion) for claim in CLAIMS.values() for criterion in claim.criteria]
NAMES = [f"{claim.id}-{criterion.number}" for claim, criterion in NUMBERS]
CHANCE = 1e-4
"""The probability that a number is refused though nothing has changed: of the hundred and more
numbers together, one in about a hundred times.
"""

pytest.importorskip("pybullet", reason="the laboratory needs the extra lab")


def forget():
    """Empty every cache of the package, and return how many held something."""
    modules = [module for name, module in sys.modules.items() if name.split(".")[0] == "dollop"]
    cached = {f for module in modules for f in vars(module).values() if hasattr(f, "cache_clear")}
    held = sum(function.cache_info().currsize > 0 for function in cached)
    for function in cached:
        function.cache_clear()
    return held


def as_numbers(rows):
    """{(claim, number): value} of one seed's rows without times, None for nan."""
    timed = {(claim.id, each.number) for claim, each in NUMBERS if each.timed}
    found = {(id, number): value for id, _, number, value in rows}
    told = {key: value for key, value in found.items() if key not in timed}
    return {key: value if np.isfinite(value) else None for key, value in told.items()}


def recorded(claim, criterion):
    """What claims.json says of a number."""
    return number_of(PUBLISHED[claim.id], criterion)


def number_of(summary, criterion):
    """A criterion's number in a claim's summary."""
    (found,) = (each for each in summary["numbers"] if each["number"] == criterion.number)
    return found


def made_now(seed):
    """Rows of every claim for one seed, as the table has them."""
    rows = ({"claim": id, "seed": seed} | study.work((id, str(seed))) for id in CLAIMS)
    return list(chain.from_iterable(map(study.expanded, rows)))


@pytest.fixture(scope="module")
def fresh():
    """Rows of every claim for three seeds, made now."""
    return {seed: made_now(seed) for seed in range(study.QUICK_SEEDS)}


def test_rerunnable(fresh):
    """Every experiment runs from its seed alone and gives all the numbers that its claim names."""
    for seed, rows in fresh.items():
        assert [(row[0], row[2]) for row in rows] == [(c.id, each.number) for c, each in NUMBERS]
        assert {row[1] for row in rows} == {seed}


def test_repeatable(fresh):
    """The same seed twice, everything made anew, gives the same numbers to the last digit."""
    assert forget() >= 8  # recordings, observations, laps, task, slaloms, runs, looks, background
    assert as_numbers(made_now(0)) == as_numbers(fresh[0])


def test_reproducible(fresh):
    """Fresh numbers of one seed are the golden ones within their tolerance, on any processor."""
    numbers = as_numbers(fresh[GOLDEN["parameters"]["seed"]])
    assert len(numbers) == sum(map(len, GOLDEN["numbers"].values()))
    for (id, number), value in numbers.items():
        golden = GOLDEN["numbers"][id][number]
        assert value == pytest.approx(golden["value"], rel=0, abs=golden["tolerance"]), (id, number)


@pytest.mark.parametrize(("claim", "criterion"), NUMBERS, ids=NAMES)
def test_a_hundred_seeds_are_behind_every_claim(claim, criterion):
    """Of every number half of them at least: where a matching is ambiguous there is none."""
    assert PUBLISHED[claim.id]["seeds"] >= 100 and recorded(claim, criterion)["seeds"] >= 50


@pytest.mark.parametrize(("claim", "criterion"), NUMBERS, ids=NAMES)
def test_fresh_numbers_are_as_recorded(claim, criterion, fresh):
    """The mean over three seeds made now is as near to the recorded mean as its spread has it.

    It is farther off with the probability `CHANCE`: by Student's t for the difference of two means;
    for a share of trials, by the binomial at both ends of the recorded interval. How long something
    takes depends on the machine: there it is only asked that it takes time.
    """
    key, then = (claim.id, criterion.number), recorded(claim, criterion)
    rows = list(chain.from_iterable(fresh.values()))
    made = [value for id, _, number, value in rows if (id, number) == key]
    values = np.array(made)[np.isfinite(made)]
    if criterion.timed:
        assert values.min() > 0
    elif criterion.trials and len(values):
        low, high = np.clip([then["low"], then["high"]], 0, 1)
        trials, right = criterion.trials * len(values), round(criterion.trials * values.sum())
        assert binom.cdf(right, trials, low) > CHANCE / 2
        assert binom.sf(right - 1, trials, high) > CHANCE / 2
    elif len(values):
        spread = then["sd"] * np.sqrt(1 / len(values) + 1 / then["seeds"])
        reach = student.ppf(1 - CHANCE / 2, then["seeds"] - 1) * spread
        assert values.mean() == pytest.approx(then["mean"], rel=1e-3, abs=max(reach, 1e-9))


def test_what_is_published_follows_from_the_table():
    """claims.json, golden.json and the table in REPLICATION.md are made of the results by rule."""
    table = study.read_table(ROOT / "study" / "results.csv")
    found = study.summaries(table)
    assert found == list(PUBLISHED.values())
    assert [claim["id"] for claim in found] == list(CLAIMS)
    assert study.claims_table(found) in (ROOT / "REPLICATION.md").read_text()
    assert study.golden_numbers(table) == GOLDEN


def test_another_table_changes_files_of_results_and_no_code(tmp_path):
    """Whatever the numbers are, what is published follows from them: none stands in the code."""
    rng = np.random.default_rng(1)
    rows = [(c.id, seed, each.number, rng.integers(2)) for c, each in NUMBERS for seed in range(5)]
    table, folder = study.as_table(rows), tmp_path / "study"
    folder.mkdir()
    (tmp_path / "REPLICATION.md").write_text((ROOT / "REPLICATION.md").read_text())
    study.publish(table, folder)
    written = {path.name for path in tmp_path.rglob("*") if path.is_file()}
    assert written == {"REPLICATION.md", "claims.json", "golden.json"}
    found = json.loads((tmp_path / "claims.json").read_text())
    published = {each["id"]: each for each in found}
    golden = json.loads((folder / "golden.json").read_text())["numbers"]
    assert study.claims_table(found) in (tmp_path / "REPLICATION.md").read_text()
    for claim, criterion in NUMBERS:
        values = table.value[(table.claim == claim.id) & (table.number == criterion.number)]
        number = number_of(published[claim.id], criterion)
        assert number["mean"] == pytest.approx(values.mean(), rel=1e-3)
        assert number["sd"] == pytest.approx(values.std(), rel=1e-3)
        if not criterion.timed:
            assert golden[claim.id][criterion.number]["value"] == values.iloc[0]


def test_verdicts_are_on_the_paper_s_own_method():
    """What Dollop does by default is told beside it, wanted by no criterion and by no verdict."""
    ours = [criterion for _, criterion in NUMBERS if "ours" in criterion.number.split("_")]
    assert len(ours) > 15 and all(criterion.wanted is None for criterion in ours)


@pytest.mark.parametrize("id", ["shared", "generalize", "subgoals"])
def test_claims_of_section_v_learn_as_the_paper_does(id, monkeypatch):
    """Without our learning the paper's numbers are the same, and only those that are told as ours go."""
    forget()
    whole = CLAIMS[id].experiment(0)
    learned = learning.slaloms

    def as_paper(seed, how):
        return learned(seed, replace(how, learning="paper"))

    monkeypatch.setattr(learning, "slaloms", as_paper)
    alone = CLAIMS[id].experiment(0)
    changed = {name for name, value in whole.items() if not np.isclose(value, alone[name], equal_nan=True)}
    assert all("ours" in name.split("_") for name in changed)
    assert changed or id == "generalize"
    forget()


def test_every_verdict_is_told():
    """REPLICATION.md discusses each claim that does not hold as it stands."""
    text = (ROOT / "REPLICATION.md").read_text().split("<!-- claims: end -->")[1]
    for claim in PUBLISHED.values():
        if claim["verdict"] != "holds":
            assert f"`{claim['id']}`" in text, claim["id"]


@pytest.mark.parametrize("of_paper", [True, False], ids=["Sec. II", "later"])
def test_what_the_paper_says_of_observing_is_measured_on_its_own_method(of_paper, monkeypatch):
    """Claims of Sec. II observe with method="paper" alone, those of all other sections never do."""
    asked = set()

    def observe(*arguments, **options):
        asked.add(options.get("method", "people"))
        return dollop.observe(*arguments, **options)

    forget()
    for module in (recordings, observing, environment):
        monkeypatch.setattr(module, "observe", observe)
    ids = [claim.id for claim in CLAIMS.values() if (claim.section == "II") == of_paper]
    assert len(ids) > 6 and all(study.work((id, "0"))["numbers"] for id in ids)
    assert asked == {"paper" if of_paper else "people"}
    forget()
