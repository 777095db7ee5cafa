"""Reading and writing by file name."""

import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from places import DATA

from dollop import OccupancyGrid, observe
from dollop.formats.files import FormatError
from dollop.formats.logs import read_log, read_odometry, write_log
from dollop.laser import LaserLog

LOG = LaserLog([0.0, 0.1], [[1.0, np.inf], [2.0, 3.0]], [-0.5, 0.5], [[0, 0, 0], [1, 0, 0]], 8.191)


@pytest.mark.parametrize("name", ["a.log", "a.log.gz", "a.clf", "with space.v2.clf.gz"])
def test_carmen_by_suffix(tmp_path, name):
    """A log written under any CARMEN suffix is read back, and packed exactly if it ends in .gz."""
    write_log(tmp_path / name, LOG)
    np.testing.assert_array_equal(read_log(str(tmp_path / name)).ranges, LOG.ranges)
    assert (tmp_path / name).read_bytes().startswith(b"\x1f\x8b") == name.endswith(".gz")


def test_other_suffixes_are_refused(tmp_path):
    """A name that says no known format is an error that lists the known ones.

    Nothing is written.
    """
    with pytest.raises(FormatError, match=r"a\.bin: a CARMEN log is named \.log.*\.bag"):
        write_log(tmp_path / "a.bin", LOG)
    with pytest.raises(FormatError, match="a ROS bag"):
        write_log(tmp_path / "a.bag", LOG)
    assert not list(tmp_path.iterdir())
    (tmp_path / "a.txt").write_text("x")
    with pytest.raises(FormatError, match="a CARMEN log is named"):
        read_log(tmp_path / "a.txt")


def test_missing_file(tmp_path):
    """A file that is not there is named."""
    for name in ("a.log", "a.bag", "a"):
        for read in (read_log, read_odometry):
            with pytest.raises(FileNotFoundError, match=name):
                read(tmp_path / name)


def test_odometry_by_suffix(tmp_path):
    """Of a CARMEN log it is the ODOM messages, and there is no topic to name."""
    lines = [f"ODOM {i} 0 0 0.5 0 0 {i} host 0" for i in range(30)]
    (tmp_path / "a.log").write_text("\n".join(lines))
    assert len(read_odometry(tmp_path / "a.log")) == 30
    with pytest.raises(ValueError, match="no topics, got topic='/odom'"):
        read_odometry(tmp_path / "a.log", topic="/odom")
    (tmp_path / "a.txt").write_text("x")
    with pytest.raises(FormatError, match="a CARMEN log is named"):
        read_odometry(tmp_path / "a.txt")


def test_carmen_logs_have_no_topics(tmp_path):
    """Asking a CARMEN log for a topic is an error and not silently passed over."""
    write_log(tmp_path / "a.log", LOG)
    with pytest.raises(ValueError, match="no topics, got topic='/scan'"):
        read_log(tmp_path / "a.log", topic="/scan")


def test_the_field_of_view_is_told_where_it_is_not_stated(tmp_path):
    """Of FLASER lines it is taken; what a file states itself is not said again."""
    (tmp_path / "a.log").write_text("FLASER 3 1 2 3 0 0 0 0 0 0 5 host 5\n")
    np.testing.assert_allclose(read_log(tmp_path / "a.log", fov=2.0).angles, [-1, 0, 1])
    write_log(tmp_path / "b.log", LOG)
    (tmp_path / "c.bag").write_bytes(b"#ROSBAG V2.0\n")
    for name in ("b.log", "c.bag"):
        with pytest.raises(ValueError, match=rf"{name[0]}\.{name[2:]}: .* field of view, got fov=2"):
            read_log(tmp_path / name, fov=2.0)


def test_bags_without_rosbags_say_what_to_install(tmp_path, monkeypatch):
    """Without the extra, a bag gives the command that installs it."""
    monkeypatch.setitem(sys.modules, "rosbags", None)
    (tmp_path / "a.bag").write_bytes(b"#ROSBAG V2.0\n")
    with pytest.raises(ImportError, match=r'pip install "dollop\[ros\]"'):
        read_log(tmp_path / "a.bag")


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
@pytest.mark.parametrize(
    ("name", "shape", "max_range", "warning", "kinds"),
    [
        ("carmen_logs/intel-corrected.log.gz", (906, 180), 80.0, "left out 4 of 910", []),
        ("carmen_logs/edmonton-corrected.log.gz", (340, 180), 51.09, None, ["sensor"]),
        ("carmen_logs/csail-corrected.log.gz", (406, 361), 80.0, "404 of 406 scans are out", ["clock"]),
        ("carmen_logs/orebro-corrected.log.gz", (237, 181), 32.759, "236 of 237 scans are out", ["clock"]),
        ("people/demo_stationary_simple_environment.bag", (1265, 512), 5.6, None, ["poses"]),
        ("people/walker_1.bag", (400, 768), 11.0, None, ["poses"]),
    ],
)
def test_real_logs(name, shape, max_range, warning, kinds, recwarn):
    """Every real recording is read whole, its no-returns found, and a bad clock is warned of and noted."""
    log = read_log(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / name)
    assert log.ranges.shape == shape
    assert log.max_range == pytest.approx(max_range, rel=1e-6)
    assert [note.kind for note in log.notes] == kinds
    assert [note.doubt for note in log.notes] == [kind == "clock" for kind in kinds]
    assert 0.01 < np.isinf(log.ranges).mean() < 0.7
    assert all(warning.filename == __file__ for warning in recwarn)
    messages = [str(w.message) for w in recwarn]
    assert len(messages) == (warning is not None)
    assert all(warning in message for message in messages)


def test_the_times_of_everybody_are_those_of_the_log(tmp_path):
    """Written, read and observed, a log of Unix time keeps its stamps: none is cut, shifted or rounded."""
    log = read_log(DATA / "slalom_0.log.gz")
    log = replace(log, t=1_700_000_000.123456789 + log.t)
    write_log(tmp_path / "a.log", log)
    found = observe(read_log(tmp_path / "a.log"), OccupancyGrid.load(DATA / "lab.yaml"))
    assert found.user is not None and all(np.isin(who.t, log.t).all() for who in (found.user, *found.people))
