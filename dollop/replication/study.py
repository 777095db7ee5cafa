"""The study behind REPLICATION.md: every claim over many seeds, on all cores or a Dask cluster.

Results go into one table, study/results.csv: a line per claim and seed, with its numbers, the
fingerprints of the code and of the criteria that made them, and a checksum. It is added to
whenever an experiment is done, by as many studies at a time as there are, and an interrupted study
goes on where it was. From the table come claims.json, and with it the table of claims in
REPLICATION.md; and study/golden.json, the numbers of one seed that any machine must find again.
"""

import sys
from functools import partial
from itertools import chain
from math import isfinite, isinf, nan
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from dollop.checks import need
from dollop.formats.files import warn_of
from dollop.formats.kinds import Kind
from dollop.formats.writing import check_writable, together, whole_file
from dollop.replication.claims import CLAIMS
from dollop.replication.claims.observing import choose_noises
from dollop.replication.fingerprint import fingerprint, fingerprint_of_text
from dollop.replication.ledger import NOT_DONE, Ledger
from dollop.replication.running import (
    REPORT,
    as_json,
    going_on_in,
    put_between_marks,
    report_beside,
    run_all,
)
from dollop.replication.worlds.survey import command as survey_worlds

__all__ = ["command"]

COLUMNS = ["claim", "seed", "number", "value"]
"""Of the table in memory: a row for each number."""
LINE = ("claim", "seed", "numbers", "code", "criteria")
"""Columns of the file; its lines hold all numbers of a claim and a seed, as name=value."""
SEEDS, QUICK_SEEDS = 100, 3

VERDICTS = Kind("verdicts of claims", rb'\A\[\s*(\]|\{\s*"id":)')
NUMBERS = Kind("golden numbers", rb'\A\{\s*"parameters":')

GOLDEN = {"seed": 0, "tolerance": 0.01}
"""The seed whose numbers any machine must find again, and within what: a share of a number's
standard deviation over the seeds. What differs between processors is far below it (numpy without
AVX and another kernel of the linear algebra left all six digits of the table as they were); a walk
drawn anew is far above it, for fewer than one in a hundred would come that near by chance.
"""


# ---- running


def work(job, claims=CLAIMS):
    """The experiment of one claim for one seed.

    Parameters
    ----------
    job : (str, str)
        Claim and seed.
    claims : dict of Claim, optional
        The paper's by default.

    Returns
    -------
    dict of str
        "numbers", as the table has them.
    """
    id, seed = job
    found = claims[id].experiment(int(seed))
    numbers = {each.number: float(found[each.number]) for each in claims[id].criteria}
    for name, value in numbers.items():
        if isinf(value):
            raise ValueError(f"{name} must be finite or nan, got {value}")
    return {"numbers": " ".join(f"{name}={value:.6g}" for name, value in numbers.items())}


def run_study(ids, seeds, table_path, scheduler=None, claims=CLAIMS, jobs=-1):
    """Fill the table with what is missing in it, claim by claim of a seed.

    Numbers count that code of today has made, which has the same fingerprint; others are made anew.
    They count as well if a criterion has been changed since, as long as all those are there that
    are asked for: then that is said, for a criterion should stand before the numbers it judges.

    Parameters
    ----------
    ids : sequence of str
        Of claims.
    seeds : sequence of int
    table_path : Path
        The table; made if it is not there.
    scheduler : str, optional
        Address of a Dask scheduler; all cores of this machine without it.
    claims : dict of Claim, optional
        The paper's by default.
    jobs : int
        Number of worker processes on this machine, -1 for one per core, 0 for none but this.

    Returns
    -------
    pandas.DataFrame
        The table, a row for each claim, seed and number.

    Raises
    ------
    RuntimeError
        If experiments failed or killed their workers, which are named; or if workers died whatever
        they were at. All that was finished is in the table.
    FormatError
        If the file is something else.
    """
    stamps = {id: stamp(claim) for id, claim in claims.items()}

    def answers(row):
        made = stamps.get(row["claim"], {}).get("code") == row["code"]
        return made and {each.number for each in claims[row["claim"]].criteria} <= set(numbers_of(row))

    asked = [(id, str(seed)) for seed in seeds for id in ids]
    rows = run_all(
        ledger_at(table_path),
        asked,
        answers,
        lambda job: stamps[job[0]],
        partial(work, claims=claims),
        scheduler,
        jobs,
    )
    old = {row["claim"] for row in rows if answers(row) and row["criteria"] != stamps[row["claim"]]["criteria"]}
    if old:
        told = "numbers are older than the criteria that judge them now"
        print(f"{told}, and are kept: {', '.join(sorted(old))}", file=sys.stderr)
    return as_table(chain.from_iterable(map(expanded, rows)))


def stamp(claim):
    """The fingerprints of the code and of the criteria that make a claim's numbers."""
    criteria = ((each.number, each.wanted, each.trials, each.timed) for each in claim.criteria)
    return {
        "code": fingerprint(claim.experiment.__module__),
        "criteria": fingerprint_of_text(*map(repr, criteria)),
    }


def ledger_at(path):
    """The table of results at a path, as it is in the file."""
    return Ledger(path, LINE, keys=2, why="numbers", sound=is_sound)


def is_sound(row):
    """Whether a line's numbers can be read."""
    try:
        return not any(map(isinf, numbers_of(row).values()))
    except ValueError:
        return False


def numbers_of(row):
    """A line's numbers, {name: value}; none if its job was set aside."""
    if row["numbers"].startswith(NOT_DONE):
        return {}
    pairs = (pair.split("=") for pair in row["numbers"].split())
    return {name: float(value) for name, value in pairs}


def expanded(row):
    """The table's rows that a line stands for."""
    return [(row["claim"], row["seed"], number, value) for number, value in numbers_of(row).items()]


def as_table(rows=()):
    """Rows as the table."""
    return pd.DataFrame(list(rows), columns=COLUMNS).astype({"seed": int, "value": float})


def read_table(path):
    """The table at a path, an empty one if there is none.

    Lines that are damaged are left out, with a warning; of each claim and seed the last counts.

    Raises
    ------
    FormatError
        If the file is something else.
    """
    ledger = ledger_at(path)
    rows, damaged = ledger.read()
    if damaged:
        warn_of(path, f"{damaged} lines are damaged and left out")
    return as_table(chain.from_iterable(map(expanded, ledger.latest(rows, numbers_of))))


# ---- summing up


def interval(values, share=False, level=0.95):
    """Mean of values (N,) and its interval: Student's, or for a share Wilson's.

    Examples
    --------
    >>> mean, low, high = interval([0, 1, 1, 1, 1, 1, 1, 1, 1, 1], share=True)
    >>> f"{mean:.2f} [{low:.2f}, {high:.2f}]"
    '0.90 [0.60, 0.98]'
    """
    values, n = np.asarray(values, float), len(values)
    if not n:
        return nan, nan, nan
    mean = values.mean()
    if share:
        if not 0 <= values.min() <= values.max() <= 1:
            raise ValueError(f"a share must be in 0 to 1, got {values.min():g} to {values.max():g}")
        ends = stats.binomtest(int(values.sum()), n).proportion_ci(level, "wilson")
        return mean, ends.low, ends.high
    reach = stats.sem(values) * stats.t.ppf((1 + level) / 2, n - 1) if n > 1 else np.inf
    return mean, mean - reach, mean + reach


def summaries(table):
    """Summaries of all claims in the table, in the paper's order."""
    by_claim = dict(iter(table.groupby("claim")))
    return [summary(claim, by_claim[id]) for id, claim in CLAIMS.items() if id in by_claim]


def summary(claim, rows):
    """One claim's numbers over the seeds, and its verdict, as plain values for JSON.

    Parameters
    ----------
    claim : Claim
    rows : pandas.DataFrame
        Of the table, those of this claim.
    """
    values = [rows.value[rows.number == each.number].dropna() for each in claim.criteria]
    numbers = [measured(*each) for each in zip(claim.criteria, values, strict=True)]
    return {
        "id": claim.id,
        "section": claim.section,
        "quote": claim.quote,
        "experiment": " ".join(claim.experiment.__doc__.split()),
        "seeds": int(rows.seed.nunique()),
        "numbers": numbers,
        "verdict": verdict([each["met"] for each in numbers if each["met"]]),
        "by_construction": claim.constructed,
    }


def measured(criterion, values):
    """One number over the seeds: mean, spread, interval, what is wanted and whether that is met."""
    mean, low, high = interval(values, criterion.trials == 1)
    wanted = criterion.wanted
    return {
        "number": criterion.number,
        "meaning": criterion.meaning,
        "mean": short(mean),
        "sd": short(np.std(values, ddof=1) if len(values) > 1 else nan),
        "low": short(low),
        "high": short(high),
        "seeds": len(values),
        "wanted": wanted and [end if isfinite(end) else None for end in wanted],
        "met": wanted and met(low, high, wanted),
    }


def short(value):
    """A number to four significant digits, None for what is no number."""
    return float(f"{value:.4g}") if isfinite(value) else None


def met(low, high, wanted):
    """Whether an interval lies in what is wanted: "yes", "no" if wholly beside it, else "open"."""
    if wanted[0] < low and high <= wanted[1]:
        return "yes"
    return "no" if high <= wanted[0] or low > wanted[1] else "open"


def verdict(answers):
    """The rule: it holds if all are met, not if none is and one is clearly not, else in part."""
    if all(answer == "yes" for answer in answers):
        return "holds"
    return "does not hold" if "no" in answers and "yes" not in answers else "holds in part"


def golden_numbers(table):
    """The golden seed's numbers but for times, each with its tolerance, by claim and number."""
    values = table.pivot(index=["claim", "number"], columns="seed", values="value")
    numbers = {}
    for id, claim in CLAIMS.items():
        for each in claim.criteria:
            key = (id, each.number)
            if key in values.index and not each.timed:
                numbers.setdefault(id, {})[each.number] = golden(values.loc[key])
    return {"parameters": GOLDEN, "numbers": numbers}


def golden(values):
    """The value of the golden seed, None for nan, and what another machine's may differ by.

    The floor is for numbers without spread, and for the six digits that the table keeps.
    """
    value = values[GOLDEN["seed"]]
    floor = 1e-9 + 1e-6 * np.nan_to_num(abs(value))
    tolerance = max(floor, np.nan_to_num(GOLDEN["tolerance"] * values.std()))
    return {"value": float(value) if isfinite(value) else None, "tolerance": short(tolerance)}


# ---- telling


def claims_table(found):
    """The claims as a Markdown table: words, numbers with intervals, what is wanted, verdict."""
    head = "| claim | Sec. | the paper's words | number: mean [95 % interval] | wanted | verdict |"
    return "\n".join([head, "|" + "---|" * 6, *map(table_row, found)])


def table_row(claim):
    """One claim as a row of the Markdown table."""
    numbers = "<br>".join(f"{n['meaning']}: {amount(n)}" for n in claim["numbers"])
    wanted = "<br>".join(wish(n["wanted"]) for n in claim["numbers"])
    verdict = f"**{claim['verdict']}**" + (", by construction" if claim["by_construction"] else "")
    quote = f"“{claim['quote']}”"
    return f"| `{claim['id']}` | {claim['section']} | {quote} | {numbers} | {wanted} | {verdict} |"


def amount(number):
    """A number with its interval."""
    if number["low"] is None:
        return "no interval"
    return f"{number['mean']:.3g} [{number['low']:.3g}, {number['high']:.3g}]"


def wish(wanted):
    """A range in words."""
    if wanted is None:
        return "(told)"
    low, high = wanted
    if high is None:
        return f"> {low:g}"
    return f"< {high:g}" if low is None else f"{low:g} to {high:g}"


# ---- the command


def command(options):
    """Run the study that the command line asks for, and write what follows from it.

    Parameters
    ----------
    options : argparse.Namespace
        ids (all claims if empty, or "worlds"), seeds (None for the usual number), first_seed, quick,
        folder (None for the usual one), scheduler.

    Raises
    ------
    ValueError
        If a claim is unknown, there are too few seeds, or experiments failed.
    KeyboardInterrupt
        When interrupted, with the words where it goes on.
    ImportError
        If an extra is missing that the experiments need.
    OSError
        If the folder cannot be written to.
    """
    if "worlds" in options.ids:
        if options.ids != ["worlds"]:
            raise ValueError(f"worlds is a study of its own, got {' '.join(options.ids)}")
        survey_worlds(options)
        return
    if options.first_seed:
        raise ValueError(f"the claims are tested from seed 0 on, got --first-seed {options.first_seed}")
    unknown = [id for id in options.ids if id not in CLAIMS]
    if unknown:
        raise ValueError(f"no claim {', '.join(unknown)}; known: {', '.join(CLAIMS)}; or worlds")
    seeds = (QUICK_SEEDS if options.quick else SEEDS) if options.seeds is None else options.seeds
    if seeds < 2:
        raise ValueError(f"an interval needs at least 2 seeds, got {seeds}")
    need("lab")
    folder = options.folder or Path("study-quick" if options.quick else "study")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "results.csv"
    check_writable(path)
    if report_beside(folder) and not path.exists():
        choose_noises()
    with going_on_in(path):
        table = run_study(options.ids or list(CLAIMS), range(seeds), path, options.scheduler)
    publish(table, folder)


def publish(table, folder):
    """Write claims.json into the folder; beside REPLICATION.md if the study is the one told there.

    Its table of claims and the golden numbers are then written as well: all of them, or none. The
    report, which people wrote, comes last, so that it is there at any time.
    """
    found, report = summaries(table), report_beside(folder)
    for claim in found:
        print(f"{claim['id']:17}{claim['verdict']:15}{claim['seeds']:4} seeds")
    written = [(folder.parent if report else folder) / "claims.json"]
    with together():
        write(written[0], VERDICTS, as_json(found))
        if report:
            written += [folder / "golden.json", report]
            write(written[1], NUMBERS, as_json(golden_numbers(table)))
            write(report, REPORT, put_between_marks(report.read_text(), "claims", claims_table(found)))
    print(f"wrote {', '.join(map(str, [folder / 'results.csv', *written]))}")


def write(path, kind, text):
    """Write a text, whole or not at all, over nothing of another kind."""
    with whole_file(path, "w", kind) as stream:
        stream.write(text)
