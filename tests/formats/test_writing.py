"""Writing is whole or not at all, and says what could not be written."""

import errno

import pytest

from dollop.formats.writing import check_writable, whole_file


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


@pytest.mark.parametrize(
    ("name", "kind"),
    [("none/a.txt", FileNotFoundError), ("folder", IsADirectoryError)],
)
def test_what_cannot_be_written_is_named(tmp_path, name, kind):
    """Before the work and while writing, the error names the target.

    No temporary file is named or left.
    """
    (tmp_path / "folder").mkdir()
    for write in (check_writable, lambda path: whole_file(path).__enter__()):
        with pytest.raises(kind) as caught:
            write(tmp_path / name)
        said = str(caught.value)
        assert said.startswith(f"{tmp_path / name} cannot be written: ") and "/." not in said
    assert [p.name for p in tmp_path.iterdir()] == ["folder"]
    assert check_writable(tmp_path / "a.txt") is None


def test_a_full_disk_is_told_with_the_name(tmp_path):
    """An error of writing has no name of its own, and gets the target's.

    One about another file keeps its own.
    """
    text = r"a\.txt cannot be written: No space left"
    with pytest.raises(OSError, match=text), whole_file(tmp_path / "a.txt"):
        raise OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(FileNotFoundError, match="other"), whole_file(tmp_path / "a.txt"):
        (tmp_path / "other").read_bytes()
    assert not list(tmp_path.iterdir())


def test_written_files_can_be_read_by_others(tmp_path):
    """The temporary file is private; what takes its place has the usual rights."""
    with whole_file(tmp_path / "a.txt") as stream:
        stream.write(b"new")
    (tmp_path / "plain.txt").write_text("new")
    assert (tmp_path / "a.txt").stat().st_mode == (tmp_path / "plain.txt").stat().st_mode
