"""Files at the edge: what cannot be read is refused, with the name of the file."""

import codecs
import gzip
import json
import os
import pickle
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from dollop.formats.files import (
    FormatError,
    check_fields,
    from_file,
    read_bytes,
    read_json,
    read_lines,
    warn_of,
    written_number,
)


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


# ---- no more than there is room for


def peak(call):
    """Most bytes that a call has in use at once, and what it raises."""
    tracemalloc.start()
    try:
        with pytest.raises(FormatError) as error:
            call()
        return tracemalloc.get_traced_memory()[1], str(error.value)
    finally:
        tracemalloc.stop()


def test_a_packed_file_is_not_unpacked_beyond_what_is_read(tmp_path):
    """64 kB that hold 64 MiB are refused with a few hundred kilobytes, whole or line by line."""
    (tmp_path / "zeros.gz").write_bytes(gzip.compress(b"0" * (64 << 20)))
    used, told = peak(lambda: read_bytes(tmp_path / "zeros.gz", 100_000))
    assert told.endswith("holds more than 100000 bytes, the most that is read") and used < 2_000_000
    used, told = peak(lambda: list(read_lines(tmp_path / "zeros.gz")))
    assert "line 1: longer than 1048576 bytes" in told and used < 5_000_000


def test_a_large_file_is_refused_by_its_size(tmp_path):
    """A file of 3 GiB, of which nothing is written, is refused before anything of it is read."""
    with open(tmp_path / "a", "wb") as stream:
        stream.truncate(3 << 30)
    used, told = peak(lambda: read_bytes(tmp_path / "a"))
    assert "holds more than 1073741824 bytes" in told and used < 1_000_000


def test_lines_are_counted(tmp_path):
    """Two million are the most."""
    (tmp_path / "newlines").write_bytes(b"\n" * 2_000_001)
    with pytest.raises(FormatError, match="holds more than 2000000 lines, the most that is read"):
        sum(1 for _ in read_lines(tmp_path / "newlines"))


def test_lines_are_those_of_the_file(tmp_path):
    """Packed or not, the last one without an end, the byte order mark left out."""
    lines = [b"a b\n", b"\n", b"c\r\n", b"d"]
    (tmp_path / "a").write_bytes(codecs.BOM_UTF8 + b"".join(lines))
    (tmp_path / "b").write_bytes(gzip.compress(b"".join(lines)))
    assert list(read_lines(tmp_path / "a")) == list(read_lines(tmp_path / "b")) == lines
    for content, message in ((b"", "the file is empty"), (b"ab\0\n", "binary data, where text is expected")):
        (tmp_path / "c").write_bytes(content)
        with pytest.raises(FormatError, match=message):
            list(read_lines(tmp_path / "c"))


@pytest.mark.parametrize("kind", ["folder", "pipe", "device"])
def test_what_is_no_ordinary_file_is_refused(tmp_path, kind):
    """A folder, a pipe, which would be waited for for ever, and a device, which never ends."""
    path = tmp_path / "a"
    if kind == "device":
        path = Path("/dev/zero")
        if not path.exists():
            pytest.skip("no such device")
    elif kind == "pipe":
        if not hasattr(os, "mkfifo"):
            pytest.skip("no pipes")
        os.mkfifo(path)
    else:
        path.mkdir()
    for read in (read_bytes, lambda path: list(read_lines(path)), lambda path: read_json(path, "a task")):
        with pytest.raises(FormatError, match="must be an ordinary file, and is a (folder|device or a pipe)"):
            read(path)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "nothing")


@pytest.mark.skipif(not os.path.exists("/proc/self/mem"), reason="a file of Linux")
def test_a_file_that_breaks_off_in_reading_is_named():
    """As a map whose picture is /proc/self/mem, or a file on a failing disk."""
    with pytest.raises(FormatError, match="^/proc/self/mem: cannot be read to its end"):
        read_bytes("/proc/self/mem")


# ---- JSON by its letter, and numbers as they are written


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"{", "not a task: Expecting property name"),
        (b"[" * 100_000, "not a task: .*recursion"),
        (b'{"a": NaN}', "a number must be finite, and no more than a float holds, got NaN"),
        (b"[-Infinity]", "a number must be finite, .*, got -Infinity"),
        (b"[1e999]", "a number must be finite, .*, got 1e999"),
        (b"[1%s]" % (b"0" * 400), "a number must be finite, .*, got 10000"),
        (b"[-1%s]" % (b"0" * 5000), "a number must be finite, .*, got -10000"),
        (b'{"a": 1, "b": {"c": 1, "c": 2}}', "a name must be given once, got 'c' again"),
        (b'["\xff"]', "not a task: .*utf-8"),
        (b"[%s[]]" % (b"[]," * 2_100_000), "4000000 values are the most that is read, got 6300004 and 4200002"),
        (b"[]" + b" " * (64 << 20), "holds more than 67108864 bytes, the most that is read"),
    ],
)
def test_json_is_read_by_its_letter(tmp_path, content, message):
    """What Python's own reader lets through, or has words of its own for, is refused with the file's name."""
    (tmp_path / "a.json").write_bytes(content)
    with pytest.raises(FormatError, match=rf"a\.json: .*{message}"):
        read_json(tmp_path / "a.json", "a task")


def test_json_keeps_its_numbers(tmp_path):
    """To the last digit, whole ones as such."""
    content = {"a": [1, -2.5e-300, 0.1, 10**300, True, None], "b": {"c": "\u00e9"}}
    (tmp_path / "a.json").write_text(json.dumps(content))
    assert read_json(tmp_path / "a.json", "a task") == content


@pytest.mark.parametrize("text", ["1", "-1.5", "+.5", "5.", "1e-9", "1E+5", "010", "0.05"])
def test_numbers_are_those_of_c(text):
    """Decimal digits, a point and an exponent make a number."""
    assert written_number("x", text) == float(text)


@pytest.mark.parametrize("text", ["1_0", "0x1p3", "1:30", "nan", "inf", "\u0661", " 1", "1 ", "", "-", "1e", "yes"])
def test_what_python_or_yaml_would_take_is_no_number(text):
    """Underscores, hexadecimal and sexagesimal numbers, other digits, blanks and words are refused."""
    with pytest.raises(ValueError, match="^x must be a number, got '"):
        written_number("x", text)


@pytest.mark.parametrize("text", ["1e10", "9" * 400, "-1e999"])
def test_a_number_has_bounds(text):
    """Beyond a billion metres nothing is a place; the message is short whatever the number."""
    with pytest.raises(ValueError, match=r"^x must be a number within 1e\+09, got '") as error:
        written_number("x", text)
    assert len(str(error.value)) < 100


def test_fields_are_named():
    """What lacks, is unknown or is no dict at all."""
    check_fields("a box", {"a": 1}, ["a"], optional=["b"])
    for content, message in (([], "a box must have a, got list"), ({}, "a box lacks a"), ({"a": 1, "c": 2}, "have c")):
        with pytest.raises(ValueError, match=message):
            check_fields("a box", content, ["a"], optional=["b"])
