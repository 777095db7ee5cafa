"""Laser scans from ROS 1 and ROS 2 bags."""

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dollop.formats.files import FormatError
from dollop.formats.logs import read_log

pytest.importorskip("rosbags", reason="the extra ros is not installed")

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

SCAN = "sensor_msgs/msg/LaserScan"
RANGES = [0.05, 1.0, 2.0, np.nan, np.inf, 9.0]


def scans_of(store, ranges=RANGES, step=0.5, count=3):
    """Messages a tenth of a second apart, of beams from -1 rad on."""
    types, ros1 = store.types, "seq" in store.types["std_msgs/msg/Header"].__dataclass_fields__
    for i in range(count):
        stamp = types["builtin_interfaces/msg/Time"](sec=100 + i // 10, nanosec=i % 10 * 100_000_000)
        number = {"seq": i} if ros1 else {}
        header = types["std_msgs/msg/Header"](**number, stamp=stamp, frame_id="laser")
        values, none = np.array(ranges, np.float32), np.array([], np.float32)
        bearings = -1.0, -1.0 + step * (len(ranges) - 1), step
        yield types[SCAN](header, *bearings, 0.0, 0.1, 0.1, 8.0, values, none)


def write_bag(path, version, topics, beside=None):
    """A bag of the given scans per topic, and maybe another (topic, type).

    `version` is "1", "2" or "mcap".
    """
    store = get_typestore(Stores.ROS1_NOETIC if version == "1" else Stores.ROS2_HUMBLE)
    plugin = StoragePlugin.MCAP if version == "mcap" else StoragePlugin.SQLITE3
    writer = Writer1(path) if version == "1" else Writer2(path, version=8, storage_plugin=plugin)
    with writer as bag:
        serialize = store.serialize_ros1 if version == "1" else store.serialize_cdr
        for topic, messages in topics.items():
            connection = bag.add_connection(topic, SCAN, typestore=store)
            for i, message in enumerate(messages(store)):
                bag.write(connection, i * 100_000_000, bytes(serialize(message, SCAN)))
        if beside:
            bag.add_connection(*beside, typestore=store)
    return path


@pytest.mark.parametrize(("name", "version"), [("a.bag", "1"), ("folder", "2"), ("folder", "mcap")])
def test_scans_of_every_kind_of_bag(tmp_path, name, version):
    """ROS 1, ROS 2 (sqlite) and mcap give the same log.

    Too near, too far and NaN are no returns, the pose is zero.
    """
    log = read_log(write_bag(tmp_path / name, version, {"/scan": scans_of}))
    np.testing.assert_array_equal(log.ranges, [[np.inf, 1, 2, np.inf, np.inf, np.inf]] * 3)
    np.testing.assert_allclose(log.angles, -1 + 0.5 * np.arange(6))
    np.testing.assert_allclose(log.t, [100, 100.1, 100.2])
    assert not log.poses.any() and log.max_range == 8.0


def test_single_mcap_file(tmp_path):
    """A file of a ROS 2 bag is read without its folder."""
    folder = write_bag(tmp_path / "folder", "mcap", {"/scan": scans_of})
    assert len(read_log(next(folder.glob("*.mcap")))) == 3


def test_laser_turning_clockwise(tmp_path):
    """Beam 0 is the rightmost also where the laser reports the leftmost first."""

    def clockwise(store):
        return scans_of(store, [1.0, 2.0, 3.0], step=-0.5)

    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": clockwise}))
    assert log.angles.tolist() == [-2.0, -1.5, -1.0] and log.ranges[0].tolist() == [3, 2, 1]


def test_a_driver_that_reports_its_maximum_range(tmp_path):
    """Where nothing came back some drivers say the largest range that they allow: it is no distance."""
    rng = np.random.default_rng(0)
    rows = rng.uniform(1.0, 4.0, (60, 8))
    rows[np.arange(60), np.arange(60) % 8] = 8.0

    def messages(store):
        for i, message in enumerate(scans_of(store, [1.0] * 8, count=60)):
            message.ranges[:] = rows[i]
            yield message

    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": messages}))
    assert np.array_equal(np.isinf(log.ranges), rows == 8.0) and log.max_range == 8.0
    assert "12.5% of the readings pile up at 8 m" in log.notes[0].text


def test_topics_are_listed(tmp_path):
    """With several scan topics one must be named; a wrong name is answered with the right ones."""
    topics = {"/left": scans_of, "/right": lambda store: scans_of(store, [4.0])}
    path = write_bag(tmp_path / "a.bag", "1", topics)
    with pytest.raises(FormatError, match="name one LaserScan topic; the bag has /left, /right"):
        read_log(path)
    with pytest.raises(FormatError, match="no LaserScan topic '/scan'; the bag has /left, /right"):
        read_log(path, topic="/scan")
    assert read_log(path, topic="/right").ranges.tolist() == [[4.0]] * 3


TRANSFORMS = "tf2_msgs/msg/TFMessage"


@pytest.mark.parametrize(
    ("topic", "kind", "warns"),
    [
        ("/odom", "nav_msgs/msg/Odometry", True),
        ("/tf", TRANSFORMS, True),
        ("/tf_static", TRANSFORMS, False),
    ],
)
def test_a_bag_of_a_robot_that_may_have_moved(tmp_path, topic, kind, warns, recwarn):
    """Odometry or moving transforms give a warning that the poses are none and how to set them.

    A fixed mount none.
    """
    path = write_bag(tmp_path / "folder", "2", {"/scan": scans_of}, (topic, kind))
    assert not read_log(path).poses.any()
    said = [str(warning.message) for warning in recwarn]
    assert len(said) == warns
    text = f"{topic} of the bag is not read and every pose is (0, 0, 0)"
    assert all(text in each and "poses=poses" in each for each in said)


def test_one_odd_scan_is_left_out(tmp_path):
    """A scan with another beam count is left out of a long log, with a warning.

    A short log is refused.
    """

    def odd(count):
        def messages(store):
            return [*scans_of(store, [1.0], count=1), *list(scans_of(store, count=count))[1:]]

        return messages

    text = "left out 1 broken of 40 scans, the first on line 1: 1 beams from"
    with pytest.warns(UserWarning, match=text):
        assert len(read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": odd(40)}))) == 39
    with pytest.raises(FormatError, match="beams"):
        read_log(write_bag(tmp_path / "b.bag", "1", {"/scan": odd(5)}))


@pytest.mark.parametrize("version", ["1", "mcap"])
def test_damaged_bags(tmp_path, version):
    """Empty, cut off, overwritten and foreign files give a FormatError; never another error."""
    name = "a.bag" if version == "1" else "folder"
    path = write_bag(tmp_path / name, version, {"/scan": scans_of})
    path = path if version == "1" else next(path.glob("*.mcap"))
    content, rng = path.read_bytes(), np.random.default_rng(0)
    damaged = [b"", b"#ROSBAG V2.0\n", b"\0" * 100, content[: len(content) // 2]]
    for _ in range(30):
        place = rng.integers(len(content) - 8)
        damaged.append(content[:place] + rng.bytes(8) + content[place + 8 :])
    refused = 0
    for data in damaged:
        path.write_bytes(data)
        try:
            assert read_log(path).ranges.shape[1] == 6
        except FormatError as error:
            assert str(path) in str(error)
            refused += 1
    assert refused >= 4


def test_empty_bag_and_folder(tmp_path):
    """A bag without scans and a folder that is no bag say so."""
    with pytest.raises(FormatError, match="the bag has none"):
        read_log(write_bag(tmp_path / "a.bag", "1", {}))
    with pytest.raises(FormatError, match="not a readable ROS bag"):
        read_log(tmp_path)


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
def test_bag_with_message_types_of_its_own(tmp_path):
    """A bag that also holds messages of unknown types gives its 7,170 scans over 720 s."""
    archive = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "people/person_following_outdoor_1.bag.zip"
    with zipfile.ZipFile(archive) as packed:
        name = next(n for n in packed.namelist() if n.endswith(".bag"))
        log = read_log(packed.extract(name, tmp_path), topic="/scan_base2")
    assert log.ranges.shape == (7170, 245)
    assert log.t[-1] - log.t[0] == pytest.approx(720, abs=1)
