"""Writing is whole or not at all, and says what could not be written."""

import errno
import gzip
import os
import stat
import time
from contextlib import suppress

import numpy as np
import pytest

from dollop import Demonstration, Environment, LaserLog, OccupancyGrid, Task, write_log
from dollop.formats import writing
from dollop.formats.kinds import CARMEN_LOG, PGM, PNG, TASK, TRAJECTORY
from dollop.formats.writing import Output, check_outputs, check_writable, together, whole_file


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


# ---- what is replaced, and how


def put(path, content=b"new", **what):
    """Write content into a file."""
    with whole_file(path, **what) as stream:
        stream.write(content)


def left(folder):
    """Names of what lies in a folder, in order."""
    return sorted(path.name for path in folder.iterdir())


def test_a_replaced_file_keeps_its_rights(tmp_path):
    """Mode 600 stays 600, and 664 stays 664, whatever the umask."""
    for mode in (0o600, 0o664, 0o640):
        (tmp_path / "a").write_text("old")
        (tmp_path / "a").chmod(mode)
        put(tmp_path / "a")
        assert (tmp_path / "a").read_bytes() == b"new"
        assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == mode


def test_a_new_file_has_the_rights_that_the_umask_leaves(tmp_path):
    """As `open` would give them, and the umask itself is never touched."""
    before = os.umask(0o027)
    try:
        put(tmp_path / "a")
        assert os.umask(0o027) == 0o027
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give files away")
def test_a_replaced_file_keeps_its_owner(tmp_path):
    """Where that is allowed."""
    (tmp_path / "a").write_text("old")
    os.chown(tmp_path / "a", 12345, 23456)
    put(tmp_path / "a")
    status = (tmp_path / "a").stat()
    assert (status.st_uid, status.st_gid) == (12345, 23456)


def test_a_link_stays_a_link(tmp_path):
    """What it points to is replaced, or made, in its own folder."""
    (tmp_path / "far").mkdir()
    for name in ("there", "not_yet"):
        (tmp_path / name).symlink_to(tmp_path / "far" / name)
    (tmp_path / "far" / "there").write_text("old")
    for name in ("there", "not_yet"):
        put(tmp_path / name)
        assert (tmp_path / name).is_symlink() and (tmp_path / "far" / name).read_bytes() == b"new"
    assert left(tmp_path) == ["far", "not_yet", "there"] and left(tmp_path / "far") == ["not_yet", "there"]


def test_only_ordinary_files_are_replaced(tmp_path):
    """A device, a FIFO, a folder, a link that leads to itself and a file with two names stay what they are."""
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "one").write_text("old")
    os.link(tmp_path / "one", tmp_path / "other")
    (tmp_path / "null").symlink_to(os.devnull)
    rules = {"fifo": "no ordinary file", "folder": "a folder", "loop": "no ordinary file", "null": "no ordinary file"}
    before = left(tmp_path)
    for name, rule in (rules | {"one": r"2 names \(hard links\)"}).items():
        for write in (put, check_writable):
            with pytest.raises(OSError, match=f"{name} cannot be written: it .*{rule}"):
                write(tmp_path / name)
    assert left(tmp_path) == before and (tmp_path / "other").read_text() == "old"
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


def test_a_protected_file_is_not_replaced(tmp_path):
    """Without a right to write, which a folder's rights would not ask for."""
    (tmp_path / "a").write_text("old")
    (tmp_path / "a").chmod(0o444)
    with pytest.raises(PermissionError, match="a cannot be written: it may not be written"):
        put(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "old"


@pytest.mark.parametrize(("name", "kind"), [("x" * 300, OSError), ("file/a", NotADirectoryError)])
def test_a_name_that_cannot_be_is_told_in_a_line(tmp_path, name, kind):
    """A name too long, a file in the place of a folder: at most 300 characters, and no neighbour's name."""
    (tmp_path / "file").write_text("")
    for write in (put, check_writable):
        with pytest.raises(kind, match="cannot be written") as caught:
            write(tmp_path / name)
        assert len(str(caught.value)) <= 300 and ".part" not in str(caught.value)
    put(tmp_path / ("x" * 255))


# ---- kinds


def small_task():
    """A task shown once."""
    angle = np.linspace(0, np.pi, 50)
    walk, boxes = np.stack([2 + np.cos(angle), np.sin(angle)], axis=1), [[0, 0, 0.4, 0.4], [4, 0, 4.4, 0.4]]
    return Task.of(Demonstration(walk, Environment(np.array(boxes))))


def small_log():
    """A log of two scans."""
    return LaserLog([0.0, 0.1], np.ones((2, 3)), [-0.5, 0.0, 0.5], np.zeros((2, 3)), max_range=8.0)


def small_map():
    """A map of a few cells."""
    return OccupancyGrid(np.eye(4), (0.0, 0.0), 0.05)


WRITERS = {
    "walk.log": lambda path: write_log(path, small_log()),
    "walk.log.gz": lambda path: write_log(path, small_log()),
    "room.map": small_map().save,
    "room.yaml": small_map().save,
    "task.json": small_task().save,
}


@pytest.mark.parametrize("path", [7, True, b"bytes", None, "zero\0byte", ["a"]])
@pytest.mark.parametrize("name", ["task.json", "walk.log", "room.map"])
def test_a_path_is_a_str_or_a_path(name, path):
    """A number would be a file that is open already."""
    for write in (put, check_writable, WRITERS[name]):
        with pytest.raises(ValueError, match="path must be a str or Path"):
            write(path)


@pytest.mark.parametrize("name", WRITERS)
def test_what_a_writer_wrote_it_may_replace(tmp_path, name):
    """And an empty file too; nothing else is left."""
    (tmp_path / name).touch()
    WRITERS[name](tmp_path / name)
    before = left(tmp_path)
    WRITERS[name](tmp_path / name)
    assert left(tmp_path) == before


@pytest.mark.parametrize("there", WRITERS)
@pytest.mark.parametrize("name", WRITERS)
def test_nothing_is_replaced_by_another_kind(tmp_path, name, there):
    """A task never takes the place of a log, nor a map that of a task."""
    if name.removesuffix(".gz") == there.removesuffix(".gz"):
        return
    WRITERS[there](tmp_path / there)
    (tmp_path / there).replace(tmp_path / name)
    before = (tmp_path / name).read_bytes()
    with pytest.raises(FileExistsError, match=rf"{name} cannot be written: it holds a .* and not a"):
        WRITERS[name](tmp_path / name)
    assert (tmp_path / name).read_bytes() == before


def test_a_task_over_a_log_is_refused_by_name(tmp_path):
    """Both kinds are named, and what to do; the log is as it was, packed or not."""
    for name in ("walk.log", "walk.log.gz"):
        write_log(tmp_path / name, small_log())
        before = (tmp_path / name).read_bytes()
        rule = "it holds a CARMEN log and not a task: remove it first, or choose another name"
        with pytest.raises(FileExistsError, match=rf"{name} cannot be written: {rule}"):
            small_task().save(tmp_path / name)
        assert (tmp_path / name).read_bytes() == before


@pytest.mark.parametrize("content", [b"my diary", b"\x1f\x8bno gzip", gzip.compress(b"t,x,y\n", mtime=0), b"P5"])
def test_what_is_not_known_is_not_replaced(tmp_path, content):
    """Text, damaged or other gzip, a picture cut short."""
    (tmp_path / "a").write_bytes(content)
    for kind in (CARMEN_LOG, TASK, TRAJECTORY, PNG, PGM):
        with pytest.raises(FileExistsError, match=f"holds something else and not {kind.name}"):
            put(tmp_path / "a", kind=kind)
    assert (tmp_path / "a").read_bytes() == content


@pytest.mark.parametrize(
    "text",
    [
        "image: lab.pgm\n",
        "negate: 0\nimage: 'lab.pgm' # mine\n",
        "{image: ./lab.pgm, negate: 0}",
        'image: "lab.pgm"',
    ],
)
def test_the_picture_of_another_map_is_not_replaced(tmp_path, text):
    """lab.yml would have the same picture as lab.yaml; a map of its own may be written again."""
    (tmp_path / "lab.yaml").write_text(text)
    (tmp_path / "lab.pgm").write_bytes(b"P5 1 1 255 a")
    with pytest.raises(FileExistsError, match=r"lab\.pgm cannot be written: it is the picture of the map lab\.yaml"):
        small_map().save(tmp_path / "lab.yml")
    assert left(tmp_path) == ["lab.pgm", "lab.yaml"] and (tmp_path / "lab.pgm").read_bytes() == b"P5 1 1 255 a"
    small_map().save(tmp_path / "lab.yaml")
    small_map().save(tmp_path / "my_lab.yaml")
    small_map().save(tmp_path / "b.yaml")
    assert OccupancyGrid.load(tmp_path / "lab.yaml").occupancy.shape == (4, 4)


def test_a_map_and_its_picture_carry_the_same_mark(tmp_path):
    """Made from what they hold: the same map has the same, another one another; and readers pass it over."""
    marks = {}
    for name, grid in (("a", small_map()), ("b", small_map()), ("c", OccupancyGrid(np.eye(5), (0.0, 0.0), 0.05))):
        grid.save(tmp_path / f"{name}.yaml")
        mark = (tmp_path / f"{name}.yaml").read_bytes().splitlines()[-1]
        assert mark.startswith(b"# dollop pair ") and len(mark) == 30
        assert (tmp_path / f"{name}.pgm").read_bytes().splitlines()[:2] == [b"P5", mark]
        marks[name] = mark
        read = OccupancyGrid.load(tmp_path / f"{name}.yaml")
        np.testing.assert_array_equal(read.occupied, grid.occupied)
    assert len(set(marks.values())) == 3  # the name of the picture is part of what the map holds


# ---- outputs and inputs of a command


def test_an_output_is_never_an_input(tmp_path):
    """By its name, another way to it, a link, a second name, or a file of a folder that is read."""
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "a.db3").touch()
    (tmp_path / "a").touch()
    (tmp_path / "link").symlink_to(tmp_path / "a")
    os.link(tmp_path / "a", tmp_path / "second")
    for name in ("a", "bag/../a", "link", "second"):
        with pytest.raises(ValueError, match="cannot be written: it is .*a, which is read"):
            check_outputs([Output(tmp_path / name)], [tmp_path / "a"])
    with pytest.raises(ValueError, match=r"a\.db3, which is read"):
        check_outputs([Output(tmp_path / "bag" / "a.db3")], [tmp_path / "bag"])
    with pytest.raises(ValueError, match="new, which is written as well"):
        check_outputs([Output(tmp_path / "new"), Output(tmp_path / "bag" / ".." / "new")])
    check_outputs([Output(tmp_path / "new"), Output(tmp_path / "other")], [tmp_path / "a", tmp_path / "none"])
    assert left(tmp_path) == ["a", "bag", "link", "second"]


# ---- groups


def test_files_written_together_appear_together(tmp_path):
    """None before the end, whatever becomes of it; one group within another is part of it."""
    with pytest.raises(RuntimeError), together():
        put(tmp_path / "a")
        raise RuntimeError
    assert left(tmp_path) == []
    with together():
        put(tmp_path / "a")
        with together():
            put(tmp_path / "b")
        assert not (tmp_path / "a").exists() and not (tmp_path / "b").exists()
    assert left(tmp_path) == ["a", "b"]


def test_an_interrupt_while_names_are_taken_waits_for_the_last(tmp_path, monkeypatch):
    """Ctrl-C between two renames: the group is whole, and the interrupt is not lost."""
    for name in "abc":
        (tmp_path / name).write_text("old")
    calls, real = [], os.replace

    def interrupted(*names):
        calls.append(names)
        if len(calls) == 2:
            raise KeyboardInterrupt
        real(*names)

    monkeypatch.setattr(os, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt), together():
        for name in "abc":
            put(tmp_path / name)
    assert [(tmp_path / name).read_text() for name in "abc"] == ["new"] * 3 and left(tmp_path) == ["a", "b", "c"]


def test_everything_is_on_the_disk_before_it_has_its_name(tmp_path, monkeypatch):
    """The file is flushed, then renamed, then the folder is flushed."""
    done = []
    for name in ("fsync", "replace"):
        call = getattr(os, name)
        monkeypatch.setattr(os, name, lambda *args, name=name, call=call: (done.append(name), call(*args)))
    put(tmp_path / "a")
    assert done[0] == "fsync" and done[-2:] == ["replace", "fsync"]


# ---- neighbours


def orphan(folder, age=0.0):
    """A neighbour that a killed run left."""
    path = folder / f".dollop-{age:016.0f}.part"
    path.write_text("half")
    os.utime(path, (time.time() - age,) * 2)
    return path


def test_the_next_run_sweeps_up_what_a_killed_one_left(tmp_path):
    """Only what bears such a name, and nobody holds."""
    orphan(tmp_path)
    others = [".dollop-1.part", "dollop-0123456789abcdef.part", ".other-0123456789abcdef.part"]
    for name in others:
        (tmp_path / name).write_text("")
    with whole_file(tmp_path / "a") as stream:
        (held,) = (path for path in tmp_path.iterdir() if writing.PART.fullmatch(path.name))
        put(tmp_path / "b") if writing.fcntl else None
        assert held.exists()
        stream.write(b"new")
    assert set(left(tmp_path)) == {*others, "a", "b"}


def test_without_locks_only_what_is_old_is_swept_up(tmp_path, monkeypatch):
    """On a system that cannot lock files, a neighbour of today may be somebody's."""
    monkeypatch.setattr(writing, "fcntl", None)
    young, old = orphan(tmp_path, 3600), orphan(tmp_path, 2 * writing.STALE)
    check_writable(tmp_path / "a")
    assert young.exists() and not old.exists()
    put(tmp_path / "a")
    assert left(tmp_path) == [young.name, "a"]


@pytest.mark.skipif(writing.fcntl is None, reason="folders are locked")
def test_nobody_waits_for_ever_for_a_folder(tmp_path, monkeypatch):
    """Who finds it held for long says so, and leaves everything as it was."""
    monkeypatch.setattr(writing, "PATIENCE", 0.05)
    handle = os.open(tmp_path, os.O_RDONLY)
    writing.fcntl.flock(handle, writing.fcntl.LOCK_EX)
    with pytest.raises(TimeoutError, match="a cannot be written: another process has held the folder"):
        put(tmp_path / "a")
    os.close(handle)
    assert left(tmp_path) == []
    put(tmp_path / "a")


def test_looking_whether_a_file_can_be_written_leaves_nothing(tmp_path):
    """Not even where something is there already."""
    check_writable(tmp_path / "a")
    assert left(tmp_path) == []
    (tmp_path / "a").write_text("old")
    check_writable(tmp_path / "a")
    assert left(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "old"


@pytest.mark.skipif(not hasattr(os, "fork") or writing.fcntl is None, reason="processes are forked, and files locked")
def test_processes_that_write_at_once_do_not_mix_nor_remove_each_others(tmp_path):
    """Four of them write the same group over and over: all of them end well, and what is left is of one."""

    def write(k):
        for _ in range(15):
            with together():
                put(tmp_path / "b", b"%d" % k)
                put(tmp_path / "a", b"%d" % k)

    children = []
    for k in range(4):
        children.append(os.fork())
        if not children[-1]:
            with suppress(BaseException):
                write(k)
                os._exit(0)
            os._exit(1)
    assert [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children] == [0] * 4
    assert left(tmp_path) == ["a", "b"] and (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="a process of its own has no room on the disk")
def test_a_disk_that_is_full_is_told_of_the_file_that_was_asked_for(tmp_path):
    """No room for all of it: the old file is as it was, the error names it, and nothing is left."""
    (tmp_path / "a").write_text("old")
    child = os.fork()
    if not child:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
        try:
            put(tmp_path / "a", b"x" * 2000)
        except OSError as error:
            os._exit(0 if str(error).startswith(f"{tmp_path}/a cannot be written: ") else 2)
        os._exit(1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert left(tmp_path) == ["a"] and (tmp_path / "a").read_text() == "old"


def test_companions_come_back_where_the_main_file_cannot_take_its_name(tmp_path):
    """As where somebody else has made a folder of that name meanwhile."""
    (tmp_path / "a.png").write_bytes(b"old")
    with pytest.raises(OSError, match="a.csv cannot be written"), together():
        for name in ("a.png", "a.csv"):
            with whole_file(tmp_path / name) as stream:
                stream.write(b"new")
        (tmp_path / "a.csv").mkdir()
    assert (tmp_path / "a.png").read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.png"]


def test_a_picture_elsewhere_is_not_this_one(tmp_path):
    """Maps name pictures of the same name in other folders, and other programs name things that are called so."""
    (tmp_path / "nav.yaml").write_text("image: ../other/lab.pgm\n")
    (tmp_path / "docker-compose.yaml").write_text("services:\n  nav:\n    image: registry/lab.pgm\n")
    check_writable(tmp_path / "lab.pgm", PGM, tmp_path / "lab.yaml")
    (tmp_path / "nav.yaml").write_text(f"image: ../{tmp_path.name}/lab.pgm\n")
    with pytest.raises(OSError, match="it is the picture of the map nav.yaml"):
        check_writable(tmp_path / "lab.pgm", PGM, tmp_path / "lab.yaml")
