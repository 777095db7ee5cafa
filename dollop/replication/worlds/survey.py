"""The study of random worlds behind "Outside the paper's room" in REPLICATION.md: `dollop study worlds`.

One line for each seed goes into study/worlds.csv, with the fingerprint of the code that made it and
a checksum. It is added to after every world, by as many studies at a time as there are, and an
interrupted study goes on where it was. From the table come worlds.json, the summary by kind; a sheet
of pictures of the worst worlds; and the tables in the report.
"""

from collections import Counter
from math import isfinite
from pathlib import Path

import joblib
import numpy as np
import pandas as pd

from dollop.checks import need
from dollop.formats.files import warn_of
from dollop.formats.kinds import PNG, Kind
from dollop.formats.writing import check_writable, together, whole_file
from dollop.replication.fingerprint import fingerprint
from dollop.replication.ledger import NOT_DONE, Ledger
from dollop.replication.running import REPORT, as_json, going_on_in, put_between_marks, report_beside, run_all
from dollop.replication.worlds.chain import CAUSES, COLUMNS, OUTCOMES, judge
from dollop.replication.worlds.draw import KINDS, draw

__all__ = ["FIRST", "command", "read_table", "summary"]

SEEDS, QUICK_SEEDS = 300, 11
NUMBERS = COLUMNS[COLUMNS.index("draws") :]
"""Columns of the table that hold numbers, or nothing."""
WORST = 12
"""How many worlds the sheet of pictures shows."""
FIRST = "worlds_first.csv"
"""The table of the first run, before anything was mended; beside the table if it is there."""
SUMMARY = Kind("a summary of worlds", rb'\A\{\s*"seeds":')


def work(job):
    """The row of a world's seed, a job of its own: every value as it is written."""
    world = draw(int(job[0]))
    row = judge(world).row(world)
    return {name: written(value) for name, value in row.items()}


def written(value):
    """A value as the table has it: numbers to four digits, nothing for what is no number."""
    if isinstance(value, str):
        return value
    return "" if not np.isfinite(value) else f"{value:.4g}" if isinstance(value, float) else str(value)


def read_table(path):
    """Read a table of worlds.

    Lines that are damaged are left out, with a warning; of each seed the last counts.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    pandas.DataFrame
        `COLUMNS`, all of them text but the seed, which is the index as well; empty if there is no
        file.

    Raises
    ------
    FormatError
        If the file is something else.
    """
    ledger = ledger_at(Path(path))
    rows, damaged = ledger.read()
    if damaged:
        warn_of(path, f"{damaged} lines are damaged and left out")
    return as_table(ledger.latest(rows, is_done))


def ledger_at(path):
    """The table of worlds at a path, as it is in the file."""
    return Ledger(path, (*COLUMNS, "code"), keys=1, why="told", sound=is_sound)


def is_sound(row):
    """Whether a line is one that a study writes: with an outcome and numbers, or set aside."""
    if not is_done(row):
        return row["told"].startswith(NOT_DONE)
    try:
        counted = row["draws"].isdecimal() and len(row["draws"]) < 10
        return counted and all(isfinite(float(row[name] or 0)) for name in NUMBERS)
    except ValueError:
        return False


def is_done(row):
    """Whether a line has an outcome, and was not set aside."""
    return row["outcome"] in OUTCOMES


def as_table(rows):
    """Lines as the table, in the order of the seeds, without those that were set aside."""
    table = pd.DataFrame(filter(is_done, rows), columns=list(COLUMNS)).astype(str)
    table.index = table.seed.astype(int)
    return table.sort_index()


def run_survey(seeds, path, scheduler=None, jobs=-1):
    """Fill the table with the worlds that are missing in it; its rows of these seeds.

    Rows count that code of today has made, which has the same fingerprint; others are made anew.

    Parameters
    ----------
    seeds : sequence of int
    path : Path
        The table; made if it is not there.
    scheduler : str, optional
        Address of a Dask scheduler; all cores of this machine without it.
    jobs : int
        Number of worker processes on this machine, -1 for one per core, 0 for none but this.

    Returns
    -------
    pandas.DataFrame

    Raises
    ------
    RuntimeError
        If worlds failed or killed their workers, which are named; or if workers died whatever they
        were at. All that was finished is in the table.
    FormatError
        If the file is something else.
    """
    stamp = {"code": fingerprint(draw.__module__, judge.__module__)}

    def answers(row):
        return is_done(row) and row["code"] == stamp["code"]

    asked = [(str(seed),) for seed in seeds]
    table = as_table(run_all(ledger_at(path), asked, answers, lambda job: stamp, work, scheduler, jobs))
    return table.loc[list(seeds)]


# ---- summing up


def summary(table):
    """How the worlds of a table ended, by kind, and what was wrong.

    Parameters
    ----------
    table : pandas.DataFrame
        As `read_table` has it.

    Returns
    -------
    dict
        "kinds": for each kind, and for "all", worlds, each outcome, and how many of the silently wrong
        ones were refused later; "causes": how many worlds had each, and how many of all had it as the
        first; "refusals": how many at each step; "draws": the mean number of draws of a world.

    Raises
    ------
    ValueError
        If the table has no row.
    """
    if not len(table):
        raise ValueError("a summary needs a world, got a table of none")
    groups = {kind: table[table.kind == kind] for kind in KINDS} | {"all": table}
    return {
        "seeds": [int(table.index.min()), int(table.index.max())],
        "kinds": {kind: counted(rows) for kind, rows in groups.items() if len(rows)},
        "causes": {
            cause: {
                "worlds": int(table.causes.str.split("; ").map(lambda all_, cause=cause: cause in all_).sum()),
                "first": int((table.cause == cause).sum()),
            }
            for cause in CAUSES
        },
        "refusals": dict(Counter(table.stage[table.outcome == "refused"])),
        "draws": round(float(table.draws.astype(int).mean()), 2),
    }


def counted(rows):
    """How some worlds ended."""
    ends = {outcome: int((rows.outcome == outcome).sum()) for outcome in OUTCOMES}
    wrong = rows[rows.outcome == "silently wrong"]
    return {"worlds": len(rows), **ends, "refused later": int((wrong.stage != "").sum())}


def tables(found, first=None):
    """The summary as two Markdown tables, beside the first run's where there is one."""
    head = ["kind of world", "worlds", *OUTCOMES, "refused later"] + (["silently wrong at first"] if first else [])
    lines = [row(head), "|" + "---|" * len(head)]
    for kind, counts in found["kinds"].items():
        name = f"**{kind}**" if kind == "all" else kind
        before = [first["kinds"].get(kind, {}).get("silently wrong", "")] if first else []
        lines.append(row([name, *counts.values(), *before]))
    head = ["what was silently wrong", "worlds", "of these the first thing"] + (["worlds at first"] if first else [])
    lines += ["", row(head), "|" + "---|" * len(head)]
    for cause, counts in found["causes"].items():
        lines.append(row([cause, *counts.values(), *([first["causes"][cause]["worlds"]] if first else [])]))
    steps = ", ".join(f"{count} at {step}" for step, count in sorted(found["refusals"].items()))
    return "\n".join(
        [
            *lines,
            "",
            f"Refused: {steps or 'none'}. Draws of a world until it was fair: {found['draws']}.",
        ]
    )


def row(cells):
    """A row of a Markdown table."""
    return f"| {' | '.join(map(str, cells))} |"


def worst_seeds(table):
    """The seeds of the worst worlds, each kind's worst first.

    They are silently wrong, ordered by the least share of trajectory, walk and law that is right.
    """
    wrong = table[table.outcome == "silently wrong"]
    shares = wrong[["user_right", "covered", "law_covered"]].replace("", "1").astype(float)
    kept = shares.assign(law=1 - wrong.law_astray.replace("", "0").astype(float)).min(axis=1)
    order = kept.sort_values(kind="stable").index
    of_a_kind = wrong.loc[order].groupby("kind").cumcount()
    return of_a_kind.sort_values(kind="stable").index[:WORST].tolist()


def draw_sheet(seeds, path):
    """A sheet of pictures of some worlds, gone through again."""
    import matplotlib.pyplot as plt

    from dollop import plot
    from dollop.replication.worlds.picture import draw_judged

    worlds = [draw(seed) for seed in seeds]
    judgements = joblib.Parallel(-1)(joblib.delayed(judge)(world) for world in worlds)
    with plot.style():
        figure, axes = plt.subplots(3, 4, figsize=(16, 12))
        for ax in axes.flat:
            ax.axis("off")
        for ax, world, judgement in zip(axes.flat, worlds, judgements, strict=False):
            ax.axis("on")
            draw_judged(ax, world, judgement)
        handles = {
            label: handle for ax in axes.flat for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)
        }
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=len(handles) or 1)
        try:
            with whole_file(path, kind=PNG) as stream:
                figure.savefig(stream, format="png", dpi=80)
        finally:
            plt.close(figure)


# ---- the command


def command(options):
    """Run the study of random worlds that the command line asks for, and write what follows from it.

    Parameters
    ----------
    options : argparse.Namespace
        seeds (None for the usual number), first_seed, quick, folder (None for the usual one), scheduler.

    Raises
    ------
    ValueError
        If there is no seed, or workers kept dying.
    KeyboardInterrupt
        When interrupted, with the words where it goes on.
    """
    count = (QUICK_SEEDS if options.quick else SEEDS) if options.seeds is None else options.seeds
    first = options.first_seed or 0
    if count < 1 or not 0 <= first <= 2**31 - count:
        raise ValueError(f"worlds need a seed or more, from 0 on, got {count} from {first} on")
    need("lab")
    folder = options.folder or Path("study-quick" if options.quick else "study")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "worlds.csv"
    check_writable(path)
    with going_on_in(path):
        table = run_survey(range(first, first + count), path, options.scheduler)
    publish(table, folder)


def publish(table, folder):
    """Write the sheet of the worst and the summary, and the tables in REPLICATION.md if it tells of these worlds.

    All of them, or none. The report, which people wrote, comes last, so that it is there at any time.
    """
    found = summary(table)
    first = folder / FIRST
    before = summary(read_table(first)) if first.exists() else None
    before = None if before == found else before
    for kind, counts in found["kinds"].items():
        print(f"{kind:15}" + "".join(f"{name} {count:<5}" for name, count in counts.items()))
    sheet = folder / "worlds_worst.png"
    written_too = [folder / "worlds.csv", folder / "worlds.json", sheet]
    report = report_beside(folder)
    with together():
        draw_sheet(worst_seeds(table), sheet)
        with whole_file(folder / "worlds.json", "w", SUMMARY) as stream:
            stream.write(as_json(found))
        if report and table.index.tolist() == list(range(SEEDS)):
            text = put_between_marks(report.read_text(), "worlds", tables(found, before))
            with whole_file(report, "w", REPORT) as stream:
                stream.write(text)
            written_too.append(report)
    print(f"wrote {', '.join(map(str, written_too))}")
