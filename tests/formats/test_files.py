"""Files at the edge: what cannot be read is refused, with the name of the file."""

import codecs
import gzip
import pickle
from pathlib import Path

import numpy as np
import pytest

from dollop.formats.files import FormatError, from_file, read_bytes, warn_of


def test_error_names_file_and_line():
    """A FormatError is a ValueError whose text starts with the file and the line."""
    error = FormatError("range must be positive, got -1", "walk.log", 7)
    assert str(error) == "walk.log, line 7: range must be positive, got -1"
    assert isinstance(error, ValueError)


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


def test_unreadable_files_are_refused(tmp_path):
    """Empty, cut short, damaged and oversized files each give a FormatError that says so."""
    packed = gzip.compress(np.random.default_rng(0).bytes(1000))
    contents = {
        "empty": b"",
        "cut short": packed[:500],
        "damaged": packed[:100] + b"\0\1\2" + packed[103:],
        "more than 2000 bytes": gzip.compress(b"a" * 3000),
    }
    for message, content in contents.items():
        (tmp_path / "f").write_bytes(content)
        with pytest.raises(FormatError, match=message):
            read_bytes(tmp_path / "f", 2000)


def test_what_a_check_refuses_is_the_fault_of_the_file():
    """A ValueError gets the file's name; what is right passes, and other errors keep their type."""
    assert from_file("a.txt", float, "1.5") == 1.5
    with pytest.raises(FormatError, match=r"^a\.txt: could not convert string to float: 'x'$"):
        from_file("a.txt", float, "x")
    with pytest.raises(TypeError):
        from_file("a.txt", float, [])


def test_a_warning_points_at_who_asked_for_the_file():
    """However deep in the library it arises, the place is outside of it."""
    with pytest.warns(UserWarning, match=r"^a\.txt: odd$") as record:
        warn_of("a.txt", "odd")
    assert record[0].filename == __file__


def test_an_error_survives_the_way_between_processes():
    """Pickled and unpickled, as by a worker, it says the same."""
    for error in (FormatError("too short", "a.log"), FormatError("too short", Path("a.log"), 3)):
        assert str(pickle.loads(pickle.dumps(error))) == str(error)
    assert str(error) == "a.log, line 3: too short"


@pytest.mark.parametrize("path", ["walk.log", "deep/" * 300 + "walk.log"])
@pytest.mark.parametrize("message", ["x must be 1", "x must be 1, got " + "9\n" * 10**6 + " of y"])
def test_a_message_has_at_most_300_characters(path, message):
    """Whatever came in: it is one line, which begins with the rule and ends with what was wrong."""
    told = str(FormatError(message, path, 10**7))
    assert len(told) <= 300 and "\n" not in told
    assert "walk.log, line 10000000: x must be 1" in told and told[-4:] == message[-4:]
