"""What the study's table says: verdicts, golden numbers, and the pages that tell of them.

claims.json has every number over the seeds. CLAIMS.md has a row for each, under its claim's words;
REPLICATION.md has the verdicts, beside those of the first study, and quotes numbers as links to
their rows, `[0.204](CLAIMS.md#luck "hit")`: what stands in the brackets is written anew with the
study, as exactly as it stood there.
"""

import json
import re
from math import isfinite, nan
from pathlib import Path

import numpy as np

from dollop.formats.kinds import PNG, Kind
from dollop.formats.writing import together, whole_file
from dollop.replication.claims import CLAIMS
from dollop.replication.judging import LEVEL, at_edge, interval, met, verdict
from dollop.replication.running import REPORT, as_json, put_between_marks, report_beside

__all__ = [
    "GOLDEN", "claims_page", "golden_numbers", "measured", "publish", "quoted", "stale", "summaries",
    "told_anew", "first_verdicts", "verdicts_table", "with_numbers",
]  # fmt: skip

VERDICTS = Kind("verdicts of claims", rb'\A\[\s*(\]|\{\s*"id":)')
NUMBERS = Kind("golden numbers", rb'\A\{\s*"parameters":')
PAGE = Kind("the page of claims", rb"\A# The claims")

FIRST_VERDICTS = "claims_first.json"
"""claims.json of the first study, in the study's folder: seeds 0 to 99, other criteria."""

GOLDEN = {"tolerance": 0.01}
"""Within what any machine must find the numbers of the first seed again: a share of a number's
standard deviation over the seeds. What differs between processors is far below it nearly always
(numpy without AVX and another kernel of the linear algebra left all six digits of the table as they
were); a walk drawn anew is far above it, for fewer than one in a hundred would come that near by
chance. But a reading of the laser that lies between two millimetres may be rounded otherwise, and a
cut that is as good at two places then moves: on a second processor five of the 300 numbers did
so, by a fifth of a standard deviation at most.
"""


# ---- summing up


def summaries(table):
    """Summaries of all claims in the table, in the paper's order.

    Parameters
    ----------
    table : pandas.DataFrame
        A row for each claim, seed and number.

    Returns
    -------
    list of dict
        Plain values for JSON.
    """
    by_claim = dict(iter(table.groupby("claim")))
    return [summary(claim, by_claim[id]) for id, claim in CLAIMS.items() if id in by_claim]


def summary(claim, rows):
    """One claim's numbers over the seeds, and its verdict."""
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
        "at_edge": any(each["at_edge"] for each in numbers),
        "by_construction": claim.constructed,
    }


def measured(criterion, values):
    """One number over the seeds: mean, spread, interval, what is wanted and whether that is met.

    Parameters
    ----------
    criterion : Criterion
    values : (N,) array_like
        One of each seed.

    Returns
    -------
    dict
        Plain values for JSON.
    """
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
        "matters": criterion.matters,
        "met": wanted and met(low, high, wanted),
        "at_edge": bool(wanted) and at_edge(low, high, wanted, criterion.matters),
    }


def short(value):
    """A number to four significant digits, None for what is no number."""
    return float(f"{value:.4g}") if isfinite(value) else None


def golden_numbers(table):
    """The first seed's numbers but for times, each with its tolerance, by claim and number.

    Parameters
    ----------
    table : pandas.DataFrame

    Returns
    -------
    dict
        Plain values for JSON.
    """
    values = table.pivot(index=["claim", "number"], columns="seed", values="value")
    seed, numbers = int(min(values.columns, default=0)), {}
    for id, claim in CLAIMS.items():
        for each in claim.criteria:
            key = (id, each.number)
            if key in values.index and not each.timed:
                numbers.setdefault(id, {})[each.number] = golden(values.loc[key], seed)
    return {"parameters": {"seed": seed} | GOLDEN, "numbers": numbers}


def golden(values, seed):
    """The value of the golden seed, None for nan, and what another machine's may differ by.

    The floor is for numbers without spread, and for the six digits that the table keeps.
    """
    value = values[seed]
    floor = 1e-9 + 1e-6 * np.nan_to_num(abs(value))
    tolerance = max(floor, np.nan_to_num(GOLDEN["tolerance"] * values.std()))
    return {"value": float(value) if isfinite(value) else None, "tolerance": short(tolerance)}


# ---- pages


def verdicts_table(found, first=()):
    """The verdicts as a narrow Markdown table, beside those of the first study where they differ.

    Parameters
    ----------
    found : list of dict
        From `summaries`.
    first : list of dict, optional
        The same of the first study.

    Returns
    -------
    str
    """
    then = {claim["id"]: claim["verdict"] for claim in first}
    rows = [verdict_row(claim, then.get(claim["id"], "not asked")) for claim in found]
    return "\n".join(["| claim | Sec. | verdict | at first |", "|---|---|---|---|", *rows, "", counted(found)])


def verdict_row(claim, then):
    """One claim's row of that table."""
    notes = ", by construction" * claim["by_construction"] + ", at the edge" * claim["at_edge"]
    before = "" if then == claim["verdict"] else then
    return f"| [`{claim['id']}`](CLAIMS.md#{claim['id']}) | {claim['section']} | {claim['verdict']}{notes} | {before} |"


def counted(found):
    """How many claims hold, hold in part and do not, in words."""
    verdicts = [claim["verdict"] for claim in found]
    counts = [f"{verdicts.count(each)} {words}" for each, words in WORDS.items()]
    seeds = max([claim["seeds"] for claim in found], default=0)
    judged = sum(bool(each["wanted"]) for claim in found for each in claim["numbers"])
    return f"Of {len(found)} claims over {seeds} seeds {', '.join(counts)}; {judged} criteria were judged."


WORDS = {"holds": "hold", "holds in part": "hold in part", "does not hold": "do not hold"}


def claims_page(found):
    """CLAIMS.md: under each claim's words a row for each number.

    Parameters
    ----------
    found : list of dict
        From `summaries`.

    Returns
    -------
    str
    """
    return HEAD + "\n".join(map(claim_block, found))


HEAD = f"""\
# The claims

Every claim of the paper that [REPLICATION.md](REPLICATION.md) judges: its words, what was measured, and a row for each
number: the mean over the seeds, and in brackets an interval. All intervals that are judged hold their true means
together with {LEVEL:.0%}. A number is **met** if the whole interval lies in what is wanted, **not met** if it lies
wholly beside it, else **open**; ~ says that the answer would be another were an end of the range moved by the smallest
difference that matters, which stands beside it. Numbers for which nothing is wanted are told. Where fewer seeds gave a
number than were asked, how many is said. This page is written by `dollop study`.

![The criteria of all claims, each beside its range](study/claims.png)

"""


def claim_block(claim):
    """One claim: heading, words, verdict, what was measured, table."""
    notes = ", by construction" * claim["by_construction"] + ", at the edge" * claim["at_edge"]
    head = f"## {claim['id']}\n\n> {claim['quote']}\n\nSec. {claim['section']}. It **{claim['verdict']}**{notes}."
    table = [
        "| number | mean [interval] | wanted |",
        "|---|---|---|",
        *(number_row(each, claim["seeds"]) for each in claim["numbers"]),
    ]
    return "\n".join([f"{head} {claim['experiment']}\n", *table, ""])


def number_row(number, seeds):
    """One number's row; of how many seeds it is, if some gave none."""
    wanted = wish(number["wanted"])
    if number["wanted"]:
        answer = {"yes": "**met**", "no": "**not met**", "open": "**open**"}[number["met"]] + " ~" * number["at_edge"]
        wanted = f"{wanted} (± {number['matters']:g}): {answer}"
    among = f" ({number['seeds']} seeds)" * (number["seeds"] < seeds)
    return f"| {number['meaning']} | {amount(number)}{among} | {wanted} |"


def amount(number):
    """A number with its interval."""
    if number["low"] is None:
        return "no interval"
    return f"{number['mean']:.3g} [{number['low']:.3g}, {number['high']:.3g}]"


def wish(wanted):
    """A range in words."""
    if wanted is None:
        return ""
    low, high = wanted
    if high is None:
        return f"> {low:g}"
    return f"≤ {high:g}" if low is None else f"{low:g} to {high:g}"


# ---- numbers that the report quotes

QUOTED = re.compile(r'\[([^\]]+)\]\(CLAIMS\.md#(\w+) "(\w+)"\)')
AMOUNT = re.compile(r"-?(\d[\d,]*)(?:\.(\d+))?(\s?(?:%|cm|mm|°|degrees|m|s|mm/s)?)$")
SCALES = {"%": 100, "cm": 100, "mm": 1000}


def quoted(text):
    """The numbers that a text quotes.

    Parameters
    ----------
    text : str

    Returns
    -------
    list of (str, str, str)
        What stands there, the claim and the number.

    Examples
    --------
    >>> quoted('Some [20 %](CLAIMS.md#luck "hit") hit something.')
    [('20 %', 'luck', 'hit')]
    """
    return QUOTED.findall(text)


def with_numbers(text, found):
    """A text with the numbers that it quotes as they are now, each with as many decimals as before.

    Parameters
    ----------
    text : str
    found : list of dict
        From `summaries`.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        It quotes a number that no claim has, or in other words than digits and a unit.

    Examples
    --------
    >>> luck = {"id": "luck", "numbers": [{"number": "hit", "mean": 0.2345}]}
    >>> with_numbers('Some [20 %](CLAIMS.md#luck "hit") hit something.', [luck])
    'Some [23 %](CLAIMS.md#luck "hit") hit something.'
    """
    means = {(claim["id"], each["number"]): each["mean"] for claim in found for each in claim["numbers"]}

    def anew(match):
        was, id, number = match.groups()
        if (id, number) not in means:
            raise ValueError(f"the report quotes {id}, {number}, which no claim tells")
        return f'[{as_exact(means[id, number], was)}](CLAIMS.md#{id} "{number}")'

    return QUOTED.sub(anew, text)


def as_exact(mean, was):
    """A mean with as many decimals, and in the same unit, as a text such as "20 %"."""
    if not (found := AMOUNT.match(was)):
        raise ValueError(f"a quoted number must be digits and a unit, got {was!r}")
    _, decimals, unit = found.groups()
    if mean is None:
        return f"no number{unit}"
    value = mean * SCALES.get(unit.strip(), 1)
    if value < 0 and not was.startswith("-"):  # "5 mm nearer": the words say which way
        value = -value
    return f"{value:,.{len(decimals or '')}f}{unit}"


def stale(text, root):
    """The numbers that a text quotes out of files, `[59](figures/metrics.json "08/margin")`, and are others there.

    Parameters
    ----------
    text : str
    root : Path
        The folder that the files' paths begin in: that of the text.

    Returns
    -------
    list of (str, str, str)
        File, way to the number in it, and the link as it should stand.

    Raises
    ------
    KeyError
        There is no such number.
    """
    found = []
    for was, name, way in REFERRED.findall(text):
        value = json.loads((root / name).read_text())
        for key in way.split("/"):
            value = value[int(key) if isinstance(value, list) else key]
        if (now := as_exact(value, was)) != was:
            found.append((name, way, now))
    return found


REFERRED = re.compile(r'\[([^\]]+)\]\(((?:\.\./)?(?:study|figures)/\w+\.json) "([^"]+)"\)')


# ---- writing it all


def publish(table, folder):
    """Write claims.json into the folder; beside REPLICATION.md if the study is the one told there.

    CLAIMS.md, the forest plot, the golden numbers and what REPLICATION.md quotes are then written as
    well: all of them, or none. The report, which people wrote, comes last, so that it is there at any
    time.

    Parameters
    ----------
    table : pandas.DataFrame
        A row for each claim, seed and number.
    folder : Path
        Of the study.
    """
    found, report = summaries(table), report_beside(folder)
    for claim in found:
        edge = " at the edge" * claim["at_edge"]
        print(f"{claim['id']:17}{claim['verdict']:15}{claim['seeds']:4} seeds{edge}")
    texts = [((folder.parent if report else folder) / "claims.json", VERDICTS, as_json(found))]
    if report:
        texts += [
            (folder / "golden.json", NUMBERS, as_json(golden_numbers(table))),
            (folder.parent / "CLAIMS.md", PAGE, claims_page(found)),
            (report, REPORT, told_anew(report.read_text(), found, first_verdicts(folder))),
        ]
    with together():
        if report:
            draw_forest(found, folder / "claims.png")
        for path, kind, text in texts:
            with whole_file(path, "w", kind) as stream:
                stream.write(text)
    written = [*[folder / "claims.png"] * bool(report), *(path for path, _, _ in texts)]
    print(f"wrote {folder / 'results.csv'}, {', '.join(map(str, written))}")


def first_verdicts(folder):
    """What the first study found, nothing if its file is not there."""
    path = Path(folder) / FIRST_VERDICTS
    return json.loads(path.read_text()) if path.exists() else []


def told_anew(text, found, first):
    """The report with its table of verdicts and all that it quotes as they are now."""
    return with_numbers(put_between_marks(text, "claims", verdicts_table(found, first)), found)


def draw_forest(found, path):
    """The forest plot as a picture."""
    import matplotlib.pyplot as plt

    from dollop.replication.forest import forest

    figure = forest(found)
    with whole_file(path, "wb", PNG) as stream:
        figure.savefig(stream, format="png")
    plt.close(figure)
