"""The study behind REPLICATION.md: every claim over many seeds, on all cores or a Dask cluster.

Results go into one tidy table, study/results.csv: a row per claim, seed and number. It is replaced
whole after every seed that is done, so that an interrupted study goes on where it was. From the
table come claims.json, and with it the table of claims in REPLICATION.md; and study/golden.json,
the numbers of one seed that any machine must find again.
"""

from functools import partial
from math import isfinite, nan
from pathlib import Path

import numpy as np
import pandas as pd
from scipy import stats

from dollop.checks import need
from dollop.formats.files import FormatError
from dollop.formats.writing import check_writable, whole_file
from dollop.replication.claims import CLAIMS
from dollop.replication.claims.observing import choose_noises
from dollop.replication.running import as_json, going_on_in, put_between_marks, report_beside, run_all
from dollop.replication.worlds.survey import command as survey_worlds

__all__ = ["command"]

COLUMNS = ["claim", "seed", "number", "value"]
SEEDS, QUICK_SEEDS = 100, 3

GOLDEN = {"seed": 0, "tolerance": 0.01}
"""The seed whose numbers any machine must find again, and within what: a share of a number's
standard deviation over the seeds. What differs between processors is far below it (numpy without
AVX and another kernel of the linear algebra left all six digits of the table as they were); a walk
drawn anew is far above it, for fewer than one in a hundred would come that near by chance.
"""


# ---- running


def work(seed, ids, claims=CLAIMS):
    """The experiments of some claims for one seed.

    Parameters
    ----------
    seed : int
    ids : sequence of str
        Of claims.
    claims : dict of Claim, optional
        The paper's by default.

    Returns
    -------
    seed : int
    rows : list of (str, int, str, float)
        As in the table.
    failures : list of str
        What went wrong, by claim; the others go on.
    """
    rows, failures = [], []
    for id in ids:
        try:
            found = claims[id].experiment(seed)
        except Exception as error:  # whatever it is, the other claims' results are not lost
            failures.append(f"claim {id}, seed {seed}: {type(error).__name__}: {error}")
            continue
        numbers = [each.number for each in claims[id].criteria]
        rows += [(id, seed, number, float(f"{found[number]:.6g}")) for number in numbers]
    return seed, rows, failures


def run_study(ids, seeds, table_path, scheduler=None, claims=CLAIMS, jobs=-1):
    """Fill the table with what is missing in it, seed by seed.

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
        Number of worker processes on this machine, -1 for one per core.

    Returns
    -------
    pandas.DataFrame
        The table.

    Raises
    ------
    RuntimeError
        If experiments failed, or workers kept dying; all that was finished is in the table.
    """
    table, failures = read_table(table_path), []

    def keep(found):
        nonlocal table
        _, rows, failed = found
        table = pd.concat([table, as_table(rows)]).drop_duplicates(COLUMNS[:3], keep="last")
        write_table(table, table_path)
        failures.extend(failed)

    run_all(missing(table, claims, ids, seeds), partial(work, claims=claims), keep, scheduler, jobs)
    if failures:
        raise RuntimeError(f"{len(failures)} experiments failed: {'; '.join(failures)}")
    return table


def missing(table, claims, ids, seeds):
    """The claims that a seed still lacks a number of, {seed: list of ids}, in the order given."""
    done = set(zip(table.claim, table.seed, table.number, strict=True))
    todo = {}
    for seed in seeds:
        for id in ids:
            if any((id, seed, each.number) not in done for each in claims[id].criteria):
                todo.setdefault(seed, []).append(id)
    return todo


def as_table(rows=()):
    """Rows as the table."""
    return pd.DataFrame(list(rows), columns=COLUMNS).astype({"seed": int, "value": float})


def read_table(path):
    """The table at a path, an empty one if there is none.

    Raises
    ------
    FormatError
        If the file is something else.
    """
    if not path.exists():
        return as_table()
    try:
        table = pd.read_csv(path).astype({"seed": int, "value": float})
    except (KeyError, ValueError) as error:
        raise FormatError(f"not a table of results: {error}", path) from error
    if list(table.columns) != COLUMNS:
        raise FormatError(f"columns must be {COLUMNS}, got {list(table.columns)}", path)
    return table


def write_table(table, path):
    """Write the table in order, whole or not at all."""
    with whole_file(path, "w") as stream:
        table.sort_values(["claim", "seed"], kind="stable").to_csv(stream, index=False)


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

    Its table of claims and the golden numbers are then written as well.
    """
    found, report = summaries(table), report_beside(folder)
    for claim in found:
        print(f"{claim['id']:17}{claim['verdict']:15}{claim['seeds']:4} seeds")
    written = {(folder.parent if report else folder) / "claims.json": as_json(found)}
    if report:
        written[report] = put_between_marks(report.read_text(), "claims", claims_table(found))
        written[folder / "golden.json"] = as_json(golden_numbers(table))
    for path, text in written.items():
        with whole_file(path, "w") as stream:
            stream.write(text)
    print(f"wrote {', '.join(map(str, [folder / 'results.csv', *written]))}")
