"""The page on one's own log agrees with the code, and with the numbers that its pictures were made with."""

import ast
import json
import re

import pytest
from places import ROOT

BOOK = ROOT / "book"
PAGE = (BOOK / "own_log.md").read_text(encoding="utf-8")
ROBOT_PAGE = (BOOK / "own_robot.md").read_text(encoding="utf-8")
NUMBERS = json.loads((BOOK / "own_log" / "numbers.json").read_text(encoding="utf-8"))
MAKERS = {"Note": 0, "doubtful": 1}
"""Who makes a note, and which argument is its kind."""


def rows_of(name):
    """Cells of each row of a table of the page, without its head."""
    table = re.search(rf"<!-- {name} -->\n(.+?)<!-- end -->", PAGE, re.DOTALL)[1]
    return [[cell.strip() for cell in line.strip("|\n ").split("|")] for line in table.splitlines()[2:]]


def notes_made():
    """Kind and doubt of every note that the library makes; doubt is None where it depends."""
    for path in sorted((ROOT / "dollop").rglob("*.py")):
        if "replication" not in path.parts:
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and getattr(node.func, "id", "") in MAKERS:
                    yield from note_of(node)


def note_of(call):
    """Kind and doubt of a call that makes a note, if it names a kind."""
    at = MAKERS[call.func.id]
    if len(call.args) > at and isinstance(call.args[at], ast.Constant):
        told = [each.value for each in call.keywords if each.arg == "doubt"] or call.args[at + 2 :]
        doubt = ast.Constant(True) if not told else told[0]
        yield call.args[at].value, doubt.value if isinstance(doubt, ast.Constant) else None


def test_the_page_tells_of_every_kind_of_note_and_of_no_other():
    """The table of notes has a row for each kind that stands in the code, once."""
    kinds = [row[0].strip("`") for row in rows_of("notes")]
    assert len(kinds) == len(set(kinds))
    assert set(kinds) == {kind for kind, _ in notes_made()}


def test_the_page_tells_which_notes_put_a_result_in_doubt():
    """Yes where all of a kind do, no where none does, else sometimes."""
    doubts = {}
    for kind, doubt in notes_made():
        doubts.setdefault(kind, set()).add(doubt)
    words = {frozenset({True}): "yes", frozenset({False}): "no"}
    told = {row[0].strip("`"): row[3] for row in rows_of("notes")}
    assert told == {kind: words.get(frozenset(some), "sometimes") for kind, some in doubts.items()}


def test_the_page_quotes_the_numbers_that_were_measured():
    """How many objects were found after how long, in how many rooms."""
    look = NUMBERS["look"]
    found = rows_of("looked")[0]
    assert list(map(int, found[1:])) == look["found"]
    head = re.search(r"<!-- looked -->\n\| s \| (.+) \|", PAGE)[1]
    assert list(map(float, head.split("|"))) == look["seconds"]
    assert f"In {look['rooms']} random rooms" in PAGE and f"had {look['objects']} objects in view" in PAGE
    assert not any(look["strange"])


def test_every_case_of_what_goes_wrong_is_in_doubt():
    """Each recording of the picture carries a note that says so; what is well walked carries none."""
    assert all(any(doubt for _, _, doubt in notes) for notes in NUMBERS["wrong"].values())
    assert NUMBERS["walk"]["five laps"] == {"laps": 5, "dropped": 0.0, "notes": []}


@pytest.mark.parametrize("name", re.findall(r"\]\((own_log/\w+\.png)\)", PAGE))
def test_the_pictures_are_there_and_small(name):
    """Each that the page shows, of at most 100 kB."""
    assert 0 < (BOOK / name).stat().st_size <= 100_000


def test_what_python_needs_a_running_nav2_is_python():
    """So it is only read; what else there is of Python, tests/test_readme.py runs."""
    blocks = re.findall(r"^```python\n(.+?)^```$", ROBOT_PAGE, re.MULTILINE | re.DOTALL)
    blocks = [block for block in blocks if "nav2_simple_commander" in block]
    assert len(blocks) == 2
    for block in blocks:
        ast.parse(block)
