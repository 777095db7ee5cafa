"""The table that is only added to: what is written comes back, what is damaged does not, locks hold and go."""

import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.formats.files import FormatError
from dollop.replication.ledger import MOST_DAMAGED, Ledger


def ledger_in(folder):
    """A table with two columns that name a job and two of other text."""
    return Ledger(folder / "table.csv", ("claim", "seed", "text", "code"), 2, "text")


def row(claim="a", seed=0, text="x=1", code="new"):
    """A line's values."""
    return {"claim": claim, "seed": str(seed), "text": text, "code": code}


def is_new(row):
    """Whether a line answers."""
    return row["code"] == "new"


@pytest.fixture
def ledger(tmp_path):
    """A table of eight lines."""
    ledger = ledger_in(tmp_path)
    with ledger.shared() as table:
        table.append(*(row(seed=seed, text=f"x={seed}") for seed in range(8)))
    return ledger


@given(texts=st.lists(st.text(st.characters(codec="utf-8")), max_size=5))
def test_what_is_added_comes_back(texts, tmp_path_factory):
    """Any text, but for its line ends, which become spaces; in the order in which it was added."""
    ledger = ledger_in(tmp_path_factory.mktemp("ledger"))
    rows = [row(seed=k, text=text) for k, text in enumerate(texts)]
    with ledger.shared() as table:
        for each in rows:
            table.append(each)
    expected = [each | {"text": " ".join(each["text"].splitlines())} for each in rows]
    assert ledger.read() == (expected, 0)


def test_a_value_that_was_altered_is_not_believed(ledger):
    """Every change of one byte in a line costs that line, or the two that it joins, and no other."""
    content, before = ledger.path.read_bytes(), ledger.read()[0]
    begin = content.index(b"\n") + 1
    for place in range(begin, len(content)):
        changed = bytearray(content)
        changed[place] ^= 1
        ledger.path.write_bytes(bytes(changed))
        rows, damaged = ledger.read()
        assert all(each in before for each in rows) and 1 <= damaged <= 2 and len(rows) >= 6


def test_a_table_cut_short_keeps_its_whole_lines(ledger):
    """Wherever it is cut; the next line that is added begins on a line of its own."""
    content = ledger.path.read_bytes()
    begin = content.index(b"\n") + 1
    for end in range(begin, len(content)):
        ledger.path.write_bytes(content[:end])
        whole = content[begin:end].count(b"\n") + (content[end : end + 1] == b"\n")
        with ledger.shared() as table:
            table.append(row(seed=9))
        rows, damaged = ledger.read()
        assert [int(each["seed"]) for each in rows] == [*range(whole), 9]
        assert damaged == (end > begin and content[end - 1 : end] != b"\n" and content[end : end + 1] != b"\n")


@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe" * 99, b"claim,seed,number,value\na,0,x,1\n", b"claim,seed"])
def test_what_is_no_such_table_is_refused(tmp_path, content):
    """Empty, binary, of an older version, cut in its first line: named, and left as it is."""
    ledger = ledger_in(tmp_path)
    ledger.path.write_bytes(content)
    with pytest.raises(FormatError, match=r"table\.csv"):
        ledger.read()
    with ledger.shared() as table, pytest.raises(FormatError, match="no longer the table"):
        table.append(row())
    assert ledger.path.read_bytes() == content


def test_a_table_of_a_header_alone_is_empty(tmp_path):
    """It is what is there before the first job is done."""
    ledger = ledger_in(tmp_path)
    ledger.path.write_text("claim,seed,text,code,check\n")
    assert ledger.read() == ([], 0)
    ledger.path.write_text("claim,seed,text,code,check\r\n")
    assert ledger.read() == ([], 0)


def test_hundreds_of_damaged_lines_are_no_accident(ledger):
    """A table that something else has rewritten is refused, not begun anew."""
    with ledger.path.open("a") as stream:
        stream.write("damaged\n" * MOST_DAMAGED)
    assert ledger.read()[1] == MOST_DAMAGED
    with ledger.path.open("a") as stream:
        stream.write("damaged\n")
    with pytest.raises(FormatError, match="101 of 109 lines"):
        ledger.read()


def test_what_is_no_file_is_refused(tmp_path):
    """A pipe would be waited for without an end."""
    ledger = ledger_in(tmp_path)
    os.mkfifo(ledger.path)
    with pytest.raises(FormatError, match="ordinary file"):
        ledger.read()


def test_the_last_line_that_answers_counts(tmp_path):
    """Before the last of others; and of others the last."""
    ledger = ledger_in(tmp_path)
    rows = [row(text="1"), row(text="2"), row(text="3", code="old"), row(seed=10, code="old"), row(seed=9, text="4")]
    rows.append(row(seed=10, text="5", code="old"))
    assert [each["text"] for each in ledger.latest(rows, is_new)] == ["2", "4", "5"]


def test_tidying_keeps_what_counts_and_what_others_have_added(ledger):
    """A line for each job, by claim and number of the seed; of other code what came meanwhile stays."""
    before = [row(seed=3, code="old"), row("b", 10, code="old"), row("b", 9)]
    meanwhile = [row(seed=2, code="other"), row(seed=3, text="x=33")]
    with ledger.shared() as table:
        table.append(*before)
        known, _ = table.read()
        table.append(*meanwhile)
        latest = table.tidy(is_new, known)
    assert [(each["claim"], int(each["seed"])) for each in latest] == [
        *(("a", k) for k in range(8)),
        ("b", 9),
        ("b", 10),
    ]
    rows, damaged = ledger.read()
    assert damaged == 0 and [each for each in rows if each != meanwhile[0]] == latest and meanwhile[0] in rows
    assert latest[3]["text"] == "x=33" and before[0] not in rows
    content = ledger.path.read_bytes()
    with ledger.shared() as table:
        table.tidy(is_new, rows)
    assert ledger.path.read_bytes().count(b"\n") == content.count(b"\n") - 1  # nobody is at it now


OTHER = """
import sys
from pathlib import Path
from dollop.replication.ledger import Ledger
with Ledger(Path(sys.argv[1]), ("claim", "seed", "text", "code"), 2, "text").shared() as table:
    print(table.claim(5), table.claim(6), flush=True)
    sys.stdin.read()
"""


def test_a_seed_is_one_study_s_until_that_ends_or_dies(ledger):
    """Another process cannot have it; when it is killed, the seed is free at once, and nothing is left."""
    lock = ledger.path.with_name("table.csv.lock")
    with ledger.shared() as table:
        assert table.claim(5)
        call = [sys.executable, "-c", OTHER, ledger.path]
        other = subprocess.Popen(call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert other.stdout.readline() == "False True\n"
        assert not table.claim(6) and table.claim(7)
        other.kill()
        other.communicate()
        assert table.claim(6) and lock.exists()
    assert not lock.exists()


def test_the_last_one_takes_the_lock_file_along(ledger):
    """As long as anybody takes part it stays, or two would hold locks on different files."""
    lock = ledger.path.with_name("table.csv.lock")
    with ledger.shared():
        call = [sys.executable, "-c", OTHER, ledger.path]
        other = subprocess.Popen(call, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        other.stdout.readline()
    assert lock.exists()
    other.communicate("")
    assert other.returncode == 0 and not lock.exists()
