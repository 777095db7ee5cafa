"""Files at the edge: reading safely, forgiving little, writing whole or not at all."""

import codecs
import errno
import gzip
import warnings
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dollop.formats import files
from dollop.formats.files import (
    FormatError,
    check_writable,
    forgive,
    longest_rise,
    read_bytes,
    usable_clock,
    whole_file,
)


def test_error_names_file_and_line():
    """A FormatError is a ValueError whose text starts with the file and the line."""
    error = FormatError("range must be positive, got -1", "walk.log", 7)
    assert str(error) == "walk.log, line 7: range must be positive, got -1"
    assert isinstance(error, ValueError) and error.line == 7


def test_whole_file_keeps_the_old_content_on_failure(tmp_path):
    """A failure while writing leaves the old file as it was and no temporary file beside it."""
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), whole_file(path) as stream:
        stream.write(b"half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_whole_file_replaces(tmp_path):
    """After success the file holds the new content and nothing else is left."""
    path = tmp_path / "a.txt"
    path.write_text("a longer old text")
    with whole_file(path) as stream:
        stream.write(b"new")
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


@pytest.mark.parametrize(("name", "kind"), [("none/a.txt", FileNotFoundError), ("folder", IsADirectoryError)])
def test_what_cannot_be_written_is_named(tmp_path, name, kind):
    """Before the work and while writing, the error names the target, never a temporary file, and leaves nothing."""
    (tmp_path / "folder").mkdir()
    for write in (check_writable, lambda path: whole_file(path).__enter__()):
        with pytest.raises(kind) as caught:
            write(tmp_path / name)
        assert str(caught.value).startswith(f"{tmp_path / name} cannot be written: ") and "/." not in str(caught.value)
    assert [p.name for p in tmp_path.iterdir()] == ["folder"] and check_writable(tmp_path / "a.txt") is None


def test_a_full_disk_is_told_with_the_name(tmp_path):
    """An error of writing has no name of its own, and gets the target's; one about another file keeps its own."""
    with pytest.raises(OSError, match=r"a\.txt cannot be written: No space left"), whole_file(tmp_path / "a.txt"):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(FileNotFoundError, match="other"), whole_file(tmp_path / "a.txt"):
        (tmp_path / "other").read_bytes()
    assert not list(tmp_path.iterdir())


def test_a_byte_order_mark_is_left_out(tmp_path):
    """What an editor put before the text is no part of it, packed or not."""
    (tmp_path / "a").write_bytes(codecs.BOM_UTF8 + b"text")
    (tmp_path / "b").write_bytes(gzip.compress(codecs.BOM_UTF8 + b"text"))
    assert read_bytes(tmp_path / "a") == read_bytes(tmp_path / "b") == b"text"


def test_gzip_is_told_by_content(tmp_path):
    """A gzipped file is unpacked and a plain one is not, whatever they are called."""
    (tmp_path / "a.log").write_bytes(gzip.compress(b"text"))
    (tmp_path / "b.gz").write_bytes(b"text")
    assert read_bytes(tmp_path / "a.log") == read_bytes(tmp_path / "b.gz") == b"text"


def test_unreadable_files_are_refused(tmp_path, monkeypatch):
    """Empty, cut short, damaged and oversized files each give a FormatError that says so."""
    packed = gzip.compress(np.random.default_rng(0).bytes(1000))
    contents = {
        "empty": b"",
        "cut short": packed[:500],
        "damaged": packed[:100] + b"\0\1\2" + packed[103:],
        "more than 2000 bytes": gzip.compress(b"a" * 3000),
    }
    monkeypatch.setattr(files, "MAX_BYTES", 2000)
    for message, content in contents.items():
        (tmp_path / "f").write_bytes(content)
        with pytest.raises(FormatError, match=message):
            read_bytes(tmp_path / "f")


@given(st.lists(st.integers(0, 5), max_size=8))
def test_longest_rise_is_as_long_as_brute_force(values):
    """The chosen values increase, and no longer choice does."""
    chosen = longest_rise(values)
    picked = [values[i] for i in chosen]
    assert all(a < b for a, b in zip(picked, picked[1:], strict=False))
    rises = (
        len(c)
        for n in range(len(values) + 1)
        for c in combinations(values, n)
        if all(a < b for a, b in zip(c, c[1:], strict=False))
    )
    assert len(chosen) == max(rises)


def test_one_broken_scan_in_a_long_log_is_forgiven():
    """One of 20, or three of 300, are left out with a single warning that counts them and names the first line."""
    with pytest.warns(UserWarning, match="left out 1 broken of 20 scans, the first on line 3: odd") as record:
        forgive("a.log", [(3, "odd")], 20)
    assert len(record) == 1
    with pytest.warns(UserWarning, match="left out 3 broken of 300"):
        forgive("a.log", [(3, "odd"), (5, "odd"), (9, "odd")], 300)


@pytest.mark.parametrize(("bad", "total"), [(1, 19), (2, 100), (4, 300), (50, 100)])
def test_many_broken_scans_are_not_forgiven(bad, total):
    """More than one scan in a hundred, or any in a short log, is an error with the first broken line."""
    with pytest.raises(FormatError, match=rf"a.log, line 3: odd \({bad} of {total}"):
        forgive("a.log", [(3 + i, "odd") for i in range(bad)], total)


def test_a_good_clock_is_left_alone():
    """An increasing clock loses nothing, changes nothing and warns of nothing."""
    t = np.array([5.0, 5.1, 5.3])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        keep, kept = usable_clock("a.log", t)
    assert keep.tolist() == [0, 1, 2] and np.array_equal(kept, t)


def test_a_stray_time_costs_one_scan():
    """One time far in the future near the beginning takes only itself away."""
    t = np.arange(100) * 0.1
    t[3] = 1e9
    with pytest.warns(UserWarning, match="left out 1 of 100 scans"):
        keep, kept = usable_clock("a.log", t)
    assert len(keep) == 99 and 3 not in keep and np.all(np.diff(kept) > 0)


@pytest.mark.parametrize(("stray", "time"), [(99, 1e300), (0, -1e6), (50, 1e6), (50, -1e6)])
def test_a_scan_far_from_both_neighbours_is_left_out(stray, time):
    """Forwards or backwards, within the log or at its end: one such scan takes only itself away."""
    t = np.arange(100) * 0.1
    t[stray] = time
    with pytest.warns(UserWarning, match="left out 1 of 100 scans, which the clock puts out of order") as record:
        keep, kept = usable_clock("a.log", t)
    assert keep.tolist() == [i for i in range(100) if i != stray] and np.array_equal(kept, t[keep])
    assert len(record) == 1


def test_a_lasting_jump_is_told():
    """A clock that is set forwards for good leaves every scan in order, with a warning of the jump."""
    t = np.arange(100) * 0.1 + 1e6 * (np.arange(100) >= 50)
    with pytest.warns(UserWarning, match="the clock jumps by 1e.06 s") as record:
        keep, kept = usable_clock("a.log", t)
    assert len(keep) == 100 and np.array_equal(kept, t) and len(record) == 1


@pytest.mark.parametrize("t", [np.zeros(50), -np.arange(50.0), np.tile(np.arange(25.0), 2)])
def test_a_useless_clock_is_replaced_and_said_so(t):
    """All zero, running backwards or reset in the middle: every scan is kept, at the nominal rate, with a warning."""
    with pytest.warns(UserWarning, match="timed at 10 Hz; speeds mean nothing"):
        keep, kept = usable_clock("a.log", t)
    assert len(keep) == 50
    np.testing.assert_allclose(kept, np.arange(50) * 0.1)


@pytest.mark.parametrize(("scans", "kept"), [(20, 19), (19, 19)])
def test_one_scan_in_twenty_may_be_out_of_order(scans, kept):
    """Exactly one in twenty is left out and the times stay; one in nineteen makes the clock worthless."""
    t = 5 + np.arange(scans) * 0.5
    t[3] = 1e9
    with pytest.warns(UserWarning):
        keep, times = usable_clock("a.log", t)
    assert len(keep) == kept and times[-1] == (t[-1] if scans == 20 else 1.8)


def test_written_files_can_be_read_by_others(tmp_path):
    """The temporary file is private; what takes its place has the usual rights."""
    with whole_file(tmp_path / "a.txt") as stream:
        stream.write(b"new")
    (tmp_path / "plain.txt").write_text("new")
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode
