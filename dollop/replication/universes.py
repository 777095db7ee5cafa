"""A replication of many universes: what each verdict would be had something else been chosen.

A universe is a `Reconstruction`. The first is the one that is told; then each alternative comes
alone; then combinations drawn at random, in which every level of a choice is as frequent as any
other. A claim runs once for all universes that do not differ in what it depends on. Results go into
one table, study/universes.csv, as those of the study do (`dollop.replication.study`).

A verdict in a universe is that of the means: a number is as the claim wants it if the mean over the
seeds lies in its range. Intervals of ten seeds would be open nearly everywhere, and tell of the
number of seeds and not of the universe. So a verdict can change by chance alone; how often it does
is told beside it, from draws of as many seeds out of those of the study.
"""

import csv
from collections import Counter
from dataclasses import fields, replace
from functools import cache, partial
from math import isfinite, nan
from pathlib import Path

import numpy as np

from dollop.checks import need, shortened
from dollop.formats.kinds import PNG, Kind
from dollop.formats.writing import check_writable, together, whole_file
from dollop.replication.claims import CLAIMS
from dollop.replication.fingerprint import fingerprint
from dollop.replication.ledger import NOT_DONE, Ledger
from dollop.replication.reconstruction import LEVELS, TOLD, Reconstruction
from dollop.replication.running import (
    REPORT,
    as_json,
    going_on_in,
    put_between_marks,
    report_beside,
    run_all,
)

__all__ = [
    "command", "draw_figure", "how_of", "markdown", "name_of", "run_universes", "summary", "universes",
    "verdict_of", "work",
]  # fmt: skip

COUNT, FIRST_SEED, SEEDS = 100, 1000, 10
QUICK_COUNT, QUICK_SEEDS = 31, 2
SEED = 2004
"""Of the combinations, and of the draws that tell what chance does."""
DRAWS = 2000
COLUMNS = ("claim", "universe", "seed", "numbers", "code")
RAISED = "raised "
"""How the numbers begin of an experiment that its universe does not allow; what follows is why."""
ORDER = ("laser_noise", "walker", "motion_noise", "lds", "tolerance", "cuts", "laid")
"""By these the jobs of a seed are sorted first: recordings and laws that are shared are made once."""
LOWERS = 0.3
"""A choice is named if it lowers the share of equal verdicts by so much, and none flips it alone.
Among seventy-five combinations one without effect lowers it by 0.14 (standard deviation).
"""
SUMMARY = Kind("a summary of universes", rb'\A\{\s*"universes":')


# ---- the universes


@cache
def universes(count=COUNT):
    """All universes: as told, each alternative alone, and combinations.

    Parameters
    ----------
    count : int

    Returns
    -------
    tuple of count Reconstruction
    """
    pairs = [(name, level) for name, levels in LEVELS.items() for level in levels[1:]]
    alone = [replace(TOLD, **{name: level}) for name, level in pairs]
    return (TOLD, *alone, *combined(COUNT - 1 - len(alone)))[:count]


def combined(count):
    """So many combinations, every level of a choice in as many as any other, but for one."""
    rng = np.random.default_rng(SEED)
    orders = [rng.permutation(np.resize(np.arange(len(each)), count)) for each in LEVELS.values()]
    pairs = zip(LEVELS.values(), orders, strict=True)
    rows = zip(*(map(levels.__getitem__, order) for levels, order in pairs), strict=True)
    return [Reconstruction(**dict(zip(LEVELS, row, strict=True))) for row in rows]


def name_of(how):
    """A universe in words, as the table has it.

    Parameters
    ----------
    how : Reconstruction

    Returns
    -------
    str
        What is other than told, as field=value.

    Examples
    --------
    >>> name_of(Reconstruction(walker="legs", tolerance=0.04))
    'tolerance=0.04 walker=legs'
    """
    return " ".join(f"{name}={value}" for name, value in how.changed().items()) or "told"


def how_of(name):
    """The universe of a name.

    Parameters
    ----------
    name : str
        As `name_of` has it.

    Returns
    -------
    Reconstruction

    Raises
    ------
    ValueError
        For another field or level.
    """
    if name == "told":
        return TOLD
    pairs = [pair.partition("=")[::2] for pair in name.split()]
    levels = {(field, str(level)): level for field, each in LEVELS.items() for level in each}
    for pair in pairs:
        if pair not in levels:
            raise ValueError(f"a universe is told by fields and their levels, got {'='.join(pair)}")
    return replace(TOLD, **{field: levels[field, level] for field, level in pairs})


# ---- running


def work(job, claims=CLAIMS):
    """The judged numbers of one claim in one universe for one seed.

    Parameters
    ----------
    job : (str, str, str)
        Claim, universe and seed.
    claims : dict of Claim, optional
        The paper's by default.

    Returns
    -------
    dict of str
        "numbers": name=value, or why there are none.
    """
    id, name, seed = job
    try:
        found = claims[id].experiment(int(seed), how_of(name))
    except Exception as error:  # an outcome of its own, as a tolerance that cannot be kept
        return {"numbers": f"{RAISED}{type(error).__name__}: {shortened(str(error), 200)}"}
    values = ((each.number, float(found[each.number])) for each in judged(claims[id]))
    return {"numbers": " ".join(f"{name}={value:.6g}" for name, value in values)}


def judged(claim):
    """A claim's criteria with a wanted range, but for times."""
    return [each for each in claim.criteria if each.wanted and not each.timed]


def choosy(claims):
    """The claims whose judged numbers depend on a choice."""
    return {id: claim for id, claim in claims.items() if claim.choices and judged(claim)}


def jobs_of(claims, hows, seeds):
    """The jobs of a study, (claim, universe, seed), so ordered that neighbours share the most."""
    names = (*ORDER, *(each.name for each in fields(TOLD) if each.name not in ORDER))
    pairs = {(how.only(claim.choices), id) for id, claim in claims.items() for how in hows}
    places = list(claims)

    def key(pair):
        how, id = pair
        return [str(getattr(how, name)) for name in names], places.index(id)

    ordered = [(id, name_of(how)) for how, id in sorted(pairs, key=key)]
    return [(*pair, str(seed)) for seed in seeds for pair in ordered]


def ledger_at(path):
    """The table of universes at a path, as it is in the file."""
    return Ledger(path, COLUMNS, keys=3, why="numbers", sound=is_sound)


def is_sound(row):
    """Whether a line's universe is one and its numbers can be read."""
    try:
        how_of(row["universe"])
        return all(name.isidentifier() for name in numbers_of(row))
    except ValueError:
        return False


def numbers_of(row):
    """A line's numbers, {name: value}; none if its universe gives none."""
    if row["numbers"].startswith((NOT_DONE, RAISED)):
        return {}
    pairs = (pair.split("=") for pair in row["numbers"].split())
    return {name: float(value) for name, value in pairs}


def run_universes(hows, seeds, path, scheduler=None, claims=CLAIMS, jobs=-1):
    """Fill the table with what is missing in it, seed by seed; its lines that are asked for.

    Lines count that code of today has made, which has the same fingerprint; others are made anew.

    Parameters
    ----------
    hows : sequence of Reconstruction
    seeds : sequence of int
    path : Path
        The table; made if it is not there.
    scheduler : str, optional
        Address of a Dask scheduler; all cores of this machine without it.
    claims : dict of Claim, optional
        The paper's by default; those without choices are left out.
    jobs : int
        Number of worker processes on this machine, -1 for one per core, 0 for none but this.

    Returns
    -------
    list of dict of str
        A line for each claim, universe and seed.

    Raises
    ------
    RuntimeError
        If experiments killed their workers, or had no end. All that was finished is in the table.
    FormatError
        If the file is something else.
    """
    claims = choosy(claims)
    codes = {id: fingerprint(claim.experiment.__module__) for id, claim in claims.items()}
    asked = jobs_of(claims, hows, seeds)

    def answers(row):
        if codes.get(row["claim"]) != row["code"] or row["numbers"].startswith(NOT_DONE):
            return False
        names = {each.number for each in judged(claims[row["claim"]])}
        return row["numbers"].startswith(RAISED) or names <= set(numbers_of(row))

    ledger, wanted = ledger_at(path), set(asked)
    rows = run_all(
        ledger,
        asked,
        answers,
        lambda job: {"code": codes[job[0]]},
        partial(work, claims=claims),
        scheduler,
        jobs,
    )
    return [row for row in rows if ledger.job(row) in wanted]


# ---- summing up


def verdict_of(claim, numbers):
    """The verdict of the means of some seeds' numbers.

    Parameters
    ----------
    claim : Claim
    numbers : list of dict
        Value by number, of each seed; empty where there is none.

    Returns
    -------
    {"holds", "holds in part", "does not hold", "not decided"}
        Not decided where a number is there for fewer than half of the seeds.
    """
    met = []
    for each in judged(claim):
        values = [found.get(each.number, nan) for found in numbers]
        values = [value for value in values if isfinite(value)]
        if 2 * len(values) < len(numbers) or not values:
            return "not decided"
        met.append(each.wanted[0] <= np.mean(values) <= each.wanted[1])
    if all(met):
        return "holds"
    return "holds in part" if any(met) else "does not hold"


def summary(rows, hows, claims=CLAIMS, results=None):
    """How far the verdict of each claim depends on what was chosen.

    Parameters
    ----------
    rows : list of dict of str
        As `run_universes` has them.
    hows : sequence of Reconstruction
        The universes, that which is told first.
    claims : dict of Claim, optional
    results : Path, optional
        The study's table, which tells what chance does.

    Returns
    -------
    dict
        "universes", "seeds", "raised" (the number of experiments without an answer by the kind of
        their errors) and "claims": for each claim what `of_claim` tells.
    """
    claims, found = choosy(claims), {}
    for row in rows:
        found.setdefault((row["claim"], row["universe"]), []).append(numbers_of(row))
    study = study_numbers(results) if results and results.exists() else {}
    seeds = sorted({int(row["seed"]) for row in rows})
    told = {}
    for id, claim in claims.items():
        verdicts = [verdict_of(claim, found[id, name_of(how.only(claim.choices))]) for how in hows]
        told[id] = of_claim(claim, hows, verdicts)
        told[id] |= by_chance(claim, study.get(id, []), len(seeds))
    return {
        "universes": len(hows),
        "seeds": [seeds[0], seeds[-1]],
        "raised": dict(Counter(filter(None, map(raised, rows)))),
        "claims": told,
    }


def raised(row):
    """The kind of error that a line's universe ended in; nothing if it gave numbers."""
    _, found, why = row["numbers"].partition(RAISED)
    return why.partition(":")[0] if found else ""


def of_claim(claim, hows, verdicts):
    """What the verdicts (N,) of a claim in N universes tell.

    The verdict as told and how often there is any; the share that is the same; in how many
    different universes it was tried; for each other level of a choice the share of the combinations
    with it that is the same, that share as told minus it, and the verdict if it alone flips it.
    """
    same, choices = np.array([each == verdicts[0] for each in verdicts]), {}
    combined = np.array([len(how.changed()) > 1 for how in hows])  # single changes are mostly as told
    for name in claim.choices:
        levels = np.array([LEVELS[name].index(getattr(how, name)) for how in hows])
        usual = float(same[combined & (levels == 0)].mean()) if combined.any() else nan
        for k, level in enumerate(LEVELS[name][1:], start=1):
            here, alone = same[combined & (levels == k)], replace(TOLD, **{name: level})
            share = float(here.mean()) if len(here) else nan
            found = verdicts[hows.index(alone)] if alone in hows else verdicts[0]
            choices.setdefault(name, {})[str(level)] = {
                "same": short(share),
                "lowers": short(usual - share),
                "flips": None if found == verdicts[0] else found,
            }
    return {
        "verdict": verdicts[0],
        "same": short(same.mean()),
        "verdicts": dict(Counter(verdicts)),
        "distinct": len({how.only(claim.choices) for how in hows}),
        "choices": choices,
    }


def short(value):
    """A number to four significant digits, None for what is no number."""
    return float(f"{value:.4g}") if isfinite(value) else None


def study_numbers(path):
    """Numbers of the study's table at a path, {claim: a dict for each seed}."""
    found = {}
    with path.open(newline="") as stream:
        for row in csv.DictReader(stream):
            found.setdefault(row["claim"], []).append(numbers_of(row))
    return found


def by_chance(claim, numbers, count):
    """The verdict by the means of all seeds, and the share of draws of so many seeds that agree; None if too few."""
    names = {each.number for each in judged(claim)}
    numbers = [each for each in numbers if names <= set(each)]
    if len(numbers) < 2 * count or not count:
        return {"of_all_seeds": None, "by_chance": None}
    rng, whole = np.random.default_rng(SEED), verdict_of(claim, numbers)
    alike = 0
    for _ in range(DRAWS):
        some = [numbers[k] for k in rng.choice(len(numbers), count, replace=False)]
        alike += verdict_of(claim, some) == whole
    return {"of_all_seeds": whole, "by_chance": short(alike / DRAWS)}


# ---- telling


def markdown(found):
    """The summary as a Markdown table, a row for each claim.

    Parameters
    ----------
    found : dict
        As `summary` has it.

    Returns
    -------
    str
    """
    lines = ["| claim | verdict of ten seeds | by chance | universes with the same | flipped by |", "|" + "---|" * 5]
    for id, told in found["claims"].items():
        whole = told["of_all_seeds"]
        verdict = told["verdict"] + f" (of all: {whole})" * (whole not in (None, told["verdict"]))
        cells = f"`{id}`", verdict, percent(told["by_chance"]), percent(told["same"]), flipped_by(told)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def percent(share):
    """A share in words."""
    return "" if share is None else f"{100 * share:.0f} %"


def flipped_by(told):
    """Which choices flip a verdict alone, or else which lower the share of equal verdicts most."""
    every = []
    for name, levels in told["choices"].items():
        every += [(each["lowers"] or 0.0, f"{name} {level}", each["flips"]) for level, each in levels.items()]
    alone = [level for _, level, flips in every if flips]
    most = sorted((each for each in every if each[0] >= LOWERS), reverse=True)[:2]
    return ", ".join(alone or [f"({level})" for _, level, _ in most])


def draw_figure(found, path):
    """How much each choice lowers the agreement on each claim, and the share of equal verdicts.

    Parameters
    ----------
    found : dict
        As `summary` has it.
    path : Path
        Of the PNG.
    """
    import matplotlib.pyplot as plt

    from dollop import plot

    claims, names = found["claims"], [each.name for each in fields(TOLD)]
    grid = np.full((len(claims), len(names)), np.nan)
    for row, told in enumerate(claims.values()):
        for name, levels in told["choices"].items():
            falls = [each["lowers"] or 0.0 for each in levels.values()]
            grid[row, names.index(name)] = max(0.0, *falls)
    with plot.style():
        size = {"figsize": (9.0, 1.6 + 0.24 * len(claims))}
        figure, (left, right) = plt.subplots(1, 2, sharey=True, width_ratios=(3, 1), **size)
        draw_grid(figure, left, grid, names, found)
        draw_shares(right, claims)
        try:
            with whole_file(path, kind=PNG) as stream:
                figure.savefig(stream, format="png", dpi=110)
        finally:
            plt.close(figure)


def draw_grid(figure, ax, grid, names, found):
    """The map: how much each choice lowers the share; a dot where it flips a verdict alone."""
    ax.set_facecolor("0.85")
    image = ax.imshow(grid, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    labels = [name.replace("_", " ") for name in names]
    ax.set_xticks(range(len(names)), labels, rotation=60, ha="right")
    ax.set_yticks(range(len(grid)), list(found["claims"]))
    ax.tick_params(length=0)
    ax.grid(False)
    for row, told in enumerate(found["claims"].values()):
        for name, levels in told["choices"].items():
            if any(level["flips"] for level in levels.values()):
                ax.plot(names.index(name), row, "o", color="white", mec="black", ms=5)
    label = "lowers the share of equal verdicts by (dot: flips it alone)"
    figure.colorbar(image, ax=ax, location="top", shrink=0.8, label=label)


def draw_shares(ax, claims):
    """Bars: the share of universes with the same verdict; a line where chance has it."""
    rows = range(len(claims))
    ax.barh(rows, [told["same"] for told in claims.values()], color="#0072b2", height=0.7)
    chance = [told["by_chance"] or nan for told in claims.values()]
    ax.plot(chance, rows, "|", color="#d55e00", ms=9, mew=2.5, label="other seeds alone")
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1))
    ax.set_xlim(0, 1)
    ax.set_xlabel("share with the same verdict")
    ax.grid(False, axis="y")


# ---- the command


def command(options):
    """Run the study of universes that the command line asks for, and write what follows from it.

    Parameters
    ----------
    options : argparse.Namespace
        seeds (None for the usual number), first_seed, quick, folder (None for the usual one),
        scheduler.

    Raises
    ------
    ValueError
        If there is no seed, if REPLICATION.md tells of other ones, or experiments failed.
    KeyboardInterrupt
        When interrupted, with the words where it goes on.
    """
    seeds = (QUICK_SEEDS if options.quick else SEEDS) if options.seeds is None else options.seeds
    first = FIRST_SEED if options.first_seed is None else options.first_seed
    if seeds < 1 or not 0 <= first <= 2**31 - seeds:
        raise ValueError(f"universes need a seed or more, from 0 on, got {seeds} from {first} on")
    need("lab")
    folder = options.folder or Path("study-quick" if options.quick else "study")
    if report_beside(folder) and (first, seeds) != (FIRST_SEED, SEEDS):
        told = f"REPLICATION.md tells of seeds {FIRST_SEED} to {FIRST_SEED + SEEDS - 1}"
        raise ValueError(f"{told}, got {first} to {first + seeds - 1}; with --folder others can be looked at")
    folder.mkdir(parents=True, exist_ok=True)
    path, hows = folder / "universes.csv", universes(QUICK_COUNT if options.quick else COUNT)
    check_writable(path)
    with going_on_in(path):
        rows = run_universes(hows, range(first, first + seeds), path, options.scheduler)
    publish(summary(rows, hows, results=folder / "results.csv"), folder)


def publish(found, folder):
    """Write the summary and the figure, and the table in REPLICATION.md if it has one."""
    for id, told in found["claims"].items():
        same = f"{percent(told['same']):>6} the same"
        print(f"{id:17}{told['verdict']:15}{same}, flipped by: {flipped_by(told) or 'none'}")
    written = [folder / "universes.csv", folder / "universes.json", folder / "universes.png"]
    report = report_beside(folder)
    with together():
        draw_figure(found, written[2])
        with whole_file(written[1], "w", SUMMARY) as stream:
            stream.write(as_json(found))
        if report and "<!-- universes: begin -->" in report.read_text():
            text = put_between_marks(report.read_text(), "universes", markdown(found))
            with whole_file(report, "w", REPORT) as stream:
                stream.write(text)
            written.append(report)
    print(f"wrote {', '.join(map(str, written))}")
