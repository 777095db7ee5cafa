"""The study behind REPLICATION.md: every claim over many seeds, on all cores or a Dask cluster.

What is asked of every claim is frozen first, in study/criteria.json. Results then go into one table,
study/results.csv: a line per claim and seed, with its numbers, the fingerprints of the code that
made them and of the criteria that judge them, and a checksum. It is added to whenever an experiment
is done, by as many studies at a time as there are, and an interrupted study goes on where it was.
Seeds that have judged a claim judge it under no other criteria. What follows from the table is
written by `dollop.replication.report`.
"""

import json
from dataclasses import asdict
from functools import partial
from itertools import chain
from math import isfinite, isinf
from pathlib import Path

import pandas as pd

from dollop.checks import need
from dollop.formats.files import warn_of
from dollop.formats.kinds import Kind
from dollop.formats.writing import check_writable, whole_file
from dollop.replication.claims import CLAIMS
from dollop.replication.claims.observing import choose_noises
from dollop.replication.fingerprint import fingerprint, fingerprint_of_text
from dollop.replication.judging import FAMILY, LEVEL
from dollop.replication.ledger import NOT_DONE, Ledger
from dollop.replication.people import command as measure_people
from dollop.replication.report import publish
from dollop.replication.running import as_json, going_on_in, report_beside, run_all
from dollop.replication.universes import command as survey_universes
from dollop.replication.worlds.survey import command as survey_worlds

__all__ = ["command", "read_table"]

COLUMNS = ["claim", "seed", "number", "value"]
"""Of the table in memory: a row for each number."""
LINE = ("claim", "seed", "numbers", "code", "criteria")
"""Columns of the file; its lines hold all numbers of a claim and a seed, as name=value."""
FIRST_SEED, SEEDS, QUICK_SEEDS = 1000, 200, 3
"""Seeds of the study, which nobody had looked at when the criteria were frozen; those of a look."""

FIRST = "results_first.csv"
"""The table of the first study, seeds 0 to 99, whose criteria were changed since; beside the table."""

FROZEN = "criteria.json"
"""What every claim is judged by, beside the table."""

CRITERIA = Kind("criteria of claims", rb'\A\{\s*"rule":')


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
    A seed that has judged a claim under other criteria is refused.

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
    ValueError
        If seeds have judged a claim under other criteria.
    RuntimeError
        If experiments failed or killed their workers, which are named; or if workers died whatever
        they were at. All that was finished is in the table.
    FormatError
        If the file is something else.
    """
    stamps = {id: stamp(claim) for id, claim in claims.items()}
    refuse_judged(ids, seeds, table_path, {id: each["criteria"] for id, each in stamps.items()})

    def answers(row):
        made = all(row[key] == value for key, value in stamps.get(row["claim"], NEVER).items())
        return made and {each.number for each in claims[row["claim"]].criteria} <= set(numbers_of(row))

    rows = run_all(
        ledger_at(table_path),
        [(id, str(seed)) for seed in seeds for id in ids],
        answers,
        lambda job: stamps[job[0]],
        partial(work, claims=claims),
        scheduler,
        jobs,
    )
    return as_table(chain.from_iterable(map(expanded, filter(answers, rows))))


NEVER = {"code": None}
"""The stamp of a claim that is none any more: no line has it."""


def refuse_judged(ids, seeds, table_path, criteria):
    """Refuse seeds that have judged one of these claims under other criteria, in this study or the first."""
    rows = chain.from_iterable(ledger_at(path).read()[0] for path in (table_path, table_path.with_name(FIRST)))
    asked = {(id, str(seed)) for id in ids for seed in seeds}
    judged = [row for row in rows if (row["claim"], row["seed"]) in asked and numbers_of(row)]
    other = [row for row in judged if row["criteria"] != criteria[row["claim"]]]
    if other:
        names, used = sorted({row["claim"] for row in other}), [int(row["seed"]) for row in other]
        told = f"seeds {min(used)} to {max(used)} have judged {', '.join(names)} under other criteria"
        raise ValueError(f"{told}; judge on seeds never used, such as --first-seed {max(used) + 1}")


def stamp(claim):
    """The fingerprints of the code that makes a claim's numbers, and of what they are judged by."""
    return {"code": fingerprint(claim.experiment.__module__), "criteria": criteria_stamp(claim)}


def criteria_stamp(claim):
    """The fingerprint of what a claim is judged by: its words, what is wanted, what matters, and the rule."""
    judged = asked_of(claim) | {"criteria": [each for each in asked_of(claim)["criteria"] if each["wanted"]]}
    for each in judged["criteria"]:
        del each["meaning"]
    return fingerprint_of_text(repr(judged), fingerprint(RULE))


RULE = "dollop.replication.judging"


def asked_of(claim):
    """What is asked of a claim, as plain values for JSON; an end that is infinite is None."""
    criteria = [asdict(each) for each in claim.criteria]
    for each in criteria:
        each["wanted"] = each["wanted"] and [end if isfinite(end) else None for end in each["wanted"]]
    return {"section": claim.section, "quote": claim.quote, "criteria": criteria}


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
    """The numbers in the table at a path that today's criteria judge; empty if there is no table.

    Lines that are damaged are left out, with a warning; of each claim and seed the last counts.

    Parameters
    ----------
    path : Path

    Returns
    -------
    pandas.DataFrame
        A row for each claim, seed and number.

    Raises
    ------
    FormatError
        If the file is something else.
    """
    ledger, criteria = ledger_at(path), {id: criteria_stamp(claim) for id, claim in CLAIMS.items()}
    rows, damaged = ledger.read()
    if damaged:
        warn_of(path, f"{damaged} lines are damaged and left out")
    latest = ledger.latest(rows, lambda row: row["criteria"] == criteria.get(row["claim"]) and numbers_of(row))
    return as_table(chain.from_iterable(map(expanded, latest)))


# ---- the command


def command(options):
    """Run the study that the command line asks for, and write what follows from it.

    Parameters
    ----------
    options : argparse.Namespace
        ids (all claims if empty; or "criteria", "worlds"), seeds and first_seed (None for the
        usual ones), quick, folder (None for the usual one), scheduler.

    Raises
    ------
    ValueError
        If a claim is unknown, there are too few seeds, seeds have judged under other criteria,
        criteria are not those that were frozen, or experiments failed.
    KeyboardInterrupt
        When interrupted, with the words where it goes on.
    ImportError
        If an extra is missing that the experiments need.
    OSError
        If the folder cannot be written to.
    """
    for name, other in OTHERS.items():
        if name in options.ids:
            if options.ids != [name]:
                raise ValueError(f"{name} is a study of its own, got {' '.join(options.ids)}")
            other(options)
            return
    unknown = [id for id in options.ids if id not in CLAIMS]
    if unknown:
        known = ", ".join(CLAIMS)
        raise ValueError(f"no claim {', '.join(unknown)}; known: {known}; or {', '.join(OTHERS)}")
    seeds = seeds_of(options)
    need("lab")
    folder = options.folder or Path("study-quick" if options.quick else "study")
    ids, path = options.ids or list(CLAIMS), folder / "results.csv"
    if report_beside(folder):
        check_frozen(ids, seeds, folder / FROZEN)
    folder.mkdir(parents=True, exist_ok=True)
    check_writable(path)
    if report_beside(folder) and not path.exists():
        choose_noises()
    with going_on_in(path):
        table = run_study(ids, seeds, path, options.scheduler)
    publish(table, folder)


def seeds_of(options):
    """The seeds that the command line asks for."""
    first = (0 if options.quick else FIRST_SEED) if options.first_seed is None else options.first_seed
    count = (QUICK_SEEDS if options.quick else SEEDS) if options.seeds is None else options.seeds
    if count < 2 or not 0 <= first <= 2**31 - count:
        raise ValueError(f"an interval needs at least 2 seeds, from 0 on, got {count} from {first} on")
    return range(first, first + count)


def freeze(options):
    """Write what every claim is judged by into criteria.json, before the numbers are there.

    Parameters
    ----------
    options : argparse.Namespace
        As `command` takes them.
    """
    folder, seeds = options.folder or Path("study"), seeds_of(options)
    criteria = {id: criteria_stamp(claim) for id, claim in CLAIMS.items()}
    refuse_judged(list(CLAIMS), seeds, folder / "results.csv", criteria)
    folder.mkdir(parents=True, exist_ok=True)
    with whole_file(folder / FROZEN, "w", CRITERIA) as stream:
        stream.write(as_json(frozen(seeds)))
    print(f"wrote {folder / FROZEN}: {len(CLAIMS)} claims, to be judged on seeds {seeds[0]} to {seeds[-1]}")


def frozen(seeds):
    """What every claim is judged by, and on which seeds, as plain values for JSON."""
    rule = {"fingerprint": fingerprint(RULE), "level": LEVEL, "family": FAMILY}
    claims = {id: {"fingerprint": criteria_stamp(claim)} | asked_of(claim) for id, claim in CLAIMS.items()}
    return {"rule": rule, "seeds": [seeds[0], seeds[-1]], "claims": claims}


def check_frozen(ids, seeds, path):
    """Refuse criteria that are not those frozen in a file, and seeds for which they were not frozen."""
    if not path.exists():
        raise ValueError(f"no criteria are frozen in {path}: dollop study criteria writes them")
    known = json.loads(path.read_text())
    other = [id for id in ids if known["claims"].get(id, {}).get("fingerprint") != criteria_stamp(CLAIMS[id])]
    if other:
        told = f"the criteria of {', '.join(other)} are not those frozen in {path}"
        raise ValueError(f"{told}; freeze them for seeds never used: dollop study criteria --first-seed N")
    first, last = known["seeds"]
    if seeds[0] < first or seeds[-1] > last:
        told = f"REPLICATION.md is judged on seeds {first} to {last}, got {seeds[0]} to {seeds[-1]}"
        raise ValueError(f"{told}; with --folder others can be looked at")


OTHERS = {
    "criteria": freeze,
    "universes": survey_universes,
    "people": measure_people,
    "worlds": survey_worlds,
}
"""What `dollop study` does beside the claims, each a study of its own."""
