"""What people wrote about the numbers: every one of them stands in a file, or is a setting that is named here."""

import json
import re
from itertools import accumulate

import pytest
from places import ROOT

from dollop.replication import report, study, universes
from dollop.replication.claims import CLAIMS

NOTEBOOKS = sorted((ROOT / "notebooks").glob("[0-9]*.ipynb"))
PAGES = (
    *("README.md", "REPLICATION.md", "CONTRIBUTING.md"),
    *("book/own_log.md", "book/own_robot.md", "book/method.md", "book/notebooks.md", "book/index.md"),
)
README_SETTINGS = """\
ICRA 2004
6 LDS, 20 mm.
42 claims
BSD 3-Clause
"""
"""Numerals of the README that nobody measured, each in the words that it stands in, one a line."""

LOG_SETTINGS = """\
| 0 | done
| 1 | refused
| 2 | no such
| 3 | done
| 130 | interrupted
come into sight, from 0.
ends with status 3.
What is 95 % sure
-1 where it is gone
at (0, 0, 0)
20 million cells (200 m x 200 m at 5 cm)
rows of 0 and 1
of version 2
version 1 still loads
"""
"""The same of the page on one's own log, where tests/test_own_log.py does not compare it."""

ROBOT_SETTINGS = """\
0.25 m, with a note
else 0.05 m
a box 0.8 m long and 0.5 m wide
an axle 0.2 m before
hypot(0.6, 0.25) = 0.65 m
farther from it than 1 cm
every 5 cm
within 1 mm
0 to 1;
0.5 m on a note
(1 m by default)
(0.1 to 0.5 m)
16 km from the origin
(0 the one shown most often)
(0 at the end)
exit status 3.
"""
"""The same of the page on one's own robot."""

METHOD_SETTINGS = """\
80 places along the way
version 2 holds
version 1 still loads
"""
"""The same of the page on the paper's way and ours."""

REPORT_SETTINGS = """\
of version 0.1
the paper's 20 mm
judged 31 claims on seeds 0 to 99
the 95 % interval of an anecdote
from 2 mm on
against 0.95
20 cm and 100 cm²
the 0.30 m spare
30 frames a second
28 mm of noise are added
ICRA 2015
a stretch of 10 s
a range of 0.1 m
walkers 0.30 m from
LDS at 20 mm
below 20 mm because
*noise* (30 mm,
an LMS 200
from 4 m by 4 m to 15 m by 12 m
of 0.2 to 1 m
0.4 to 1.8 m/s
for 92 % of the walk
within 0.40 m
less than 50 %
less than 95 %
less than 85 %
than 0.20 m from
more than 5 %
farther than 0.40 m
seeds 0 to 299
110 worlds
in more than 30 scans
sure at 95 %
181 to 1,081 beams and 5 to 40 Hz
if 95 % of it
within 0.4 m
up to 4 s
Seeds from 400000 on
in 50 more worlds a kind (from seed 420000)
Seeds from 560000
40 tasks a cell
with its 95 % interval
a tolerance of 20 mm
seeds from 561000, 22 tasks a cell
cut to 30 to 90 % of its way
differ by 0.7 m somewhere
of 300 random worlds
keeps 0.30 m from the background
"""
"""The same of what REPLICATION.md tells of its results."""

SETTINGS = {
    "README.md": README_SETTINGS.splitlines(),
    "REPLICATION.md": REPORT_SETTINGS.splitlines(),
    "book/own_log.md": LOG_SETTINGS.splitlines(),
    "book/own_robot.md": ROBOT_SETTINGS.splitlines(),
    "book/method.md": METHOD_SETTINGS.splitlines(),
    "book/notebooks.md": ["Linux x86-64 and Python up to 3.11", "newer than 3.11,"],
    "book/index.md": ["ICRA 2004"],
}

# ---- what nothing compares

UNREAD = (  # what is no prose, in the order in which it is taken out, and what is put there
    (r"(?s)<!-- (\w+): begin -->.*?<!-- \1: end -->", ""),
    (r"(?ms)^```.*?^```$", ""),
    (r"(?m)^(    |#+ ).*$", ""),
    (report.REFERRED.pattern, "…"),
    (report.QUOTED.pattern, "…"),
    (r"`(?:[^`\n]|\n(?!\n))+`", "…"),
    (r"<[a-z!/][^>]*>", ""),
    (r"!?\[[^\]]*\]\((?:\.\./)?(figures/fig_|notebooks/|study/\w+\.png)[^)]*\)", "…"),
    (r"\bFig\. ?[0-9]+[ab]?\b|\b([Ff]igure|[Nn]otebook|Python) [0-9.]+[ab]?\b|\bx[0-9]\b", "…"),
    (r"\]\([^)]*\)", "]"),
    (r"(?ms)^\| figure \|.*?(?=^(?!\|))", lambda table: re.sub(r"(?m)^\|[^|]*\|", "| … |", table[0])),
)
NUMERAL = re.compile(r"(?<![\w.,])[0-9]+(?:,[0-9]{3})*(?:\.[0-9]+)?")


def prose(text):
    """The blocks of a text that people read, each in a line of its own: paragraphs, items, rows of tables."""
    for pattern, instead in UNREAD:
        text = re.sub(pattern, instead, text)
    blocks = re.split(r"\n\s*\n|\n(?=\||- )", text)
    return [" ".join(block.split()) for block in blocks if block.strip()]


def unexplained(text, settings):
    """Numerals of a text that are neither quoted nor within one of these phrases, each with its sentence."""
    return [found for block in prose(text) for found in unexplained_in(block, settings)]


def unexplained_in(block, settings):
    """The same of one block."""
    explained = [each.span() for phrase in settings for each in re.finditer(re.escape(phrase), block)]
    for found in NUMERAL.finditer(block):
        if not any(begin <= found.start() and found.end() <= end for begin, end in explained):
            yield found[0], sentence_at(block, found.start())


def sentence_at(block, place):
    """The sentence that begins last before a place."""
    ends = accumulate(map(len, sentences_of(block)))
    return next(each.strip() for each, end in zip(sentences_of(block), ends, strict=True) if end > place)


def sentences_of(block):
    """A block's sentences, half sentences and cells, each with the white space after it."""
    return re.findall(r".+?(?:[.:;!?|](?:\s|$)|$)", block)


def told(text, settings):
    """That a text has none; else a line for each, to be read."""
    lines = [f"  {numeral:>8}  in: {sentence}" for numeral, sentence in unexplained(text, settings)]
    advice = 'quote it, [47 mm](figures/metrics.json "7a/..."), or name the setting in SETTINGS'
    return "\n".join([f"{len(lines)} numerals that no test compares; {advice}:", *lines]) if lines else None


TEXT = """\
# Results of 7

A walk of 20 mm
width has [3.1 mm](CLAIMS.md#luck "hit") of error. Of [10](study/people.json "0/mean")
runs in Fig. 6b 9 finish: `x = 4` and [Sec. 5](other.md#a-3). See x2.

| figure | shows |
|---|---|
| 11 | 12 runs, [5 %](CLAIMS.md#luck hit) |

<!-- luck: begin -->
| 13 |
<!-- luck: end -->
- 1,681.5 items
"""


def test_a_numeral_that_nothing_explains_is_told_with_its_sentence():
    """Quotations, code, headings, targets, names and marked tables have none; a misspelt quotation has."""
    found = unexplained(TEXT, ("20 mm width",))
    assert [numeral for numeral, _ in found] == ["9", "5", "12", "5", "1,681.5"]
    assert found[0][1] == "Of … runs in … 9 finish:"
    assert found[-1][1] == "- 1,681.5 items"
    assert "     9  in: Of … runs in … 9 finish:" in told(TEXT, ())


def test_a_setting_explains_a_numeral_only_in_its_own_words():
    """The same digits elsewhere are told, and so is a longer number with the same beginning."""
    assert not unexplained("Twice 20 mm.", ("20 mm",))
    assert [n for n, _ in unexplained("20 cm, 20.5 mm and 120 mm", ("20 mm",))] == ["20", "20.5", "120"]
    assert [n for n, _ in unexplained("A lone ` mark.\n\nIf x < 3 and y > 4` here.", ())] == ["3", "4"]
    assert told("No number.", ()) is None


# ---- the pages


def page(name):
    """The text of a page."""
    return (ROOT / name).read_text(encoding="utf-8")


def results(text):
    """What is told of the results: from their heading to how to make them again."""
    return text[text.index("\n## Results") : text.index("\n## Reproducing")]


def commands_and_more(text):
    """The page on one's own log without what tests/test_own_log.py and book/pictures.py answer for."""
    return text[: text.index("\n## How long to look")] + text[text.index("\n## What else there is to know") :]


READ = {**dict.fromkeys(SETTINGS, str), "REPLICATION.md": results, "book/own_log.md": commands_and_more}
"""What of each page is read for numerals."""


@pytest.mark.parametrize("name", PAGES)
def test_what_is_quoted_out_of_files_is_as_it_stands_there(name):
    """Figures' numbers and those of the other studies; a number that is gone fails."""
    assert report.stale(page(name), (ROOT / name).parent) == []


@pytest.mark.parametrize("name", PAGES)
def test_what_is_quoted_of_the_claims_is_as_the_study_has_it(name):
    """Each number has a row in CLAIMS.md, and is as exact as it was written."""
    published = json.loads(page("claims.json"))
    assert report.with_numbers(page(name), published) == page(name)


@pytest.mark.parametrize("name", READ)
def test_no_numeral_is_without_a_file_or_a_setting(name):
    """Whoever writes a measured number quotes it, or this fails and says where."""
    unread = told(READ[name](page(name)), SETTINGS[name])
    assert unread is None, unread


@pytest.mark.parametrize("name", READ)
def test_every_setting_is_in_use(name):
    """What a page no longer says is no longer named, so that it excuses nothing else."""
    blocks = prose(READ[name](page(name)))
    assert [phrase for phrase in SETTINGS[name] if not any(phrase in block for block in blocks)] == []


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_send_their_readers_to_the_study_and_quote_none_of_it(path):
    """A notebook's numbers are those of its own recordings; the study's would be stale with the next study."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    sentences = [each for block in prose(text.replace("REPLICATION.md", "STUDY")) for each in sentences_of(block)]
    quoting = [each for each in sentences if "STUDY" in each and re.search("[0-9]|hundred", each)]
    assert quoting == []


def test_counts_of_the_study_are_as_told():
    """Claims, seeds and universes, in figures or in words."""
    text = " ".join(page("README.md").split())
    assert f"{len(CLAIMS)} claims" in text
    assert (study.SEEDS, universes.COUNT) == (200, 100)
    assert "two hundred seeds each" in text and "a hundred universes" in text


IN_WORDS = [
    (
        "so that half of the way is made",
        "single",
        "left_more_cones_m",
        ("left_more_cones_m", "adapted_more_cones_m"),
        0.5,
    ),
    ("one demonstration in five of a minute is", "greedy", "sparse_greedy_per_min", (), 0.2),
    ("needs only half as many numbers again", "parameters", "share_of_polyline", (), 1 / 1.5),
    (", more than a fifth, with", "layouts", "one_more_than_six_m", ("error_1_m",), 0.23),
    ("Ours takes nearly half of it away", "layouts", "error_6_ours_m", ("error_1_ours_m",), 0.55),
    ("touches a cone in four layouts of ten", "generalize", "plain_clear", (), 0.6),
]
"""Words, the claim, a number of it, those whose sum it is a share of (none: of 1), and that share within 0.03."""


@pytest.mark.parametrize(("words", "id", "number", "whole", "told"), IN_WORDS, ids=lambda value: str(value)[:30])
def test_shares_told_in_words_are_those_of_the_study(words, id, number, whole, told):
    """A half, a fifth, four of ten."""
    (claim,) = (each for each in json.loads(page("claims.json")) if each["id"] == id)
    means = {each["number"]: each["mean"] for each in claim["numbers"]}
    assert words in " ".join(page("REPLICATION.md").split())
    assert means[number] / (sum(means[each] for each in whole) or 1) == pytest.approx(told, abs=0.03)
