"""Laser scans from ROS 1 and ROS 2 bags."""

import os
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dollop.formats import ros_bag_bounds
from dollop.formats.files import FormatError
from dollop.formats.logs import read_log, read_odometry
from dollop.gridmap import OccupancyGrid
from dollop.pose import composed

pytest.importorskip("rosbags", reason="the extra ros is not installed")

from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

SCAN, TRANSFORMS = "sensor_msgs/msg/LaserScan", "tf2_msgs/msg/TFMessage"
ODOMETRY, GRID = "nav_msgs/msg/Odometry", "nav_msgs/msg/OccupancyGrid"
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


def write_bag(path, version, topics, beside=()):
    """A bag of the given scans per topic, and others as (topic, type, messages of a store).

    `version` is "1", "2" or "mcap".
    """
    store = get_typestore(Stores.ROS1_NOETIC if version == "1" else Stores.ROS2_HUMBLE)
    if version == "1":  # rosbags has the messages of tf2 for ROS 2 only
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
    plugin = StoragePlugin.MCAP if version == "mcap" else StoragePlugin.SQLITE3
    writer = Writer1(path) if version == "1" else Writer2(path, version=8, storage_plugin=plugin)
    with writer as bag:
        serialize = store.serialize_ros1 if version == "1" else store.serialize_cdr
        for topic, messages in topics.items():
            connection = bag.add_connection(topic, SCAN, typestore=store)
            for i, message in enumerate(messages(store)):
                bag.write(connection, i * 100_000_000, bytes(serialize(message, SCAN)))
        kinds = {topic: kind for topic, kind, _ in beside}
        connections = {topic: bag.add_connection(topic, kind, typestore=store) for topic, kind in kinds.items()}
        for topic, kind, messages in beside:
            for message in messages(store):
                bag.write(connections[topic], 0, bytes(serialize(message, kind)))
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
    assert "12.5% of the readings pile up at 8 m" in log.notes[-1].text


def test_topics_are_listed(tmp_path):
    """With several scan topics one must be named; a wrong name is answered with the right ones."""
    topics = {"/left": scans_of, "/right": lambda store: scans_of(store, [4.0])}
    path = write_bag(tmp_path / "a.bag", "1", topics)
    with pytest.raises(FormatError, match="name one LaserScan topic; the bag has /left, /right"):
        read_log(path)
    with pytest.raises(FormatError, match="no LaserScan topic '/scan'; the bag has /left, /right"):
        read_log(path, topic="/scan")
    assert read_log(path, topic="/right").ranges.tolist() == [[4.0]] * 3


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


def test_what_drivers_send_before_they_are_ready_is_left_out(tmp_path):
    """A first scan without beams, or with beams in one direction, is no reason to refuse three hundred others."""
    for name, ready in (("a", {"ranges": []}), ("b", {"step": 0.0})):

        def messages(store, ready=ready):
            return [*scans_of(store, count=1, **ready), *list(scans_of(store, count=40))[1:]]

        with pytest.warns(UserWarning, match="left out 1 broken of 40 scans, the first on line 1"):
            assert len(read_log(write_bag(tmp_path / f"{name}.bag", "1", {"/scan": messages}))) == 39


def test_a_broken_transform_of_a_frame_that_nobody_uses_does_no_harm(tmp_path):
    """Of the laser's own chain it is refused, of a camera it is not asked for."""
    ours = transforms("/tf", "odom", "laser", poses=[(1.0, 2.0, 0.0)])
    camera = transforms("/tf_static", "elsewhere", "camera", poses=[(np.nan, 0.0, 0.0)])
    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of}, [ours, camera]))
    np.testing.assert_allclose(log.poses, [[1.0, 2.0, 0.0]] * 3)


def test_no_return_may_be_the_largest_number(tmp_path):
    """A driver whose range_max is what a float holds says so where nothing came back, and a sonar has one beam."""
    far = np.finfo(np.float32).max

    def messages(store):
        for scan in scans_of(store, [1.0, far, 2.0, 3.0]):
            scan.range_max = float(far)
            yield scan

    assert read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": messages})).ranges[0].tolist() == [
        1.0,
        np.inf,
        2.0,
        3.0,
    ]
    sonar = write_bag(tmp_path / "b.bag", "1", {"/scan": lambda store: scans_of(store, [1.5], step=0.0)})
    assert read_log(sonar).ranges.tolist() == [[1.5]] * 3


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


# ---- poses

TIMES = 99.5 + 0.3 * np.arange(7)
DRIVE = np.column_stack([0.2 * np.arange(7), 0.1 * np.arange(7) ** 2, np.linspace(3.0, 3.6, 7)])
AT_SCANS = np.column_stack([np.interp(100 + 0.1 * np.arange(3), TIMES, column) for column in DRIVE.T])
MOUNT = (0.2, 0.05, 0.3)


def header(store, t, frame):
    """A header with its stamp in whole nanoseconds."""
    types, ros1 = store.types, "seq" in store.types["std_msgs/msg/Header"].__dataclass_fields__
    second, nanosecond = divmod(round(t * 1e9), 1_000_000_000)
    stamp = types["builtin_interfaces/msg/Time"](sec=second, nanosec=nanosecond)
    return types["std_msgs/msg/Header"](**({"seq": 0} if ros1 else {}), stamp=stamp, frame_id=frame)


def quaternion(store, yaw, roll=0.0):
    """Turned about x first and then about z."""
    c, s, cr, sr = np.cos(yaw / 2), np.sin(yaw / 2), np.cos(roll / 2), np.sin(roll / 2)
    return store.types["geometry_msgs/msg/Quaternion"](c * sr, s * sr, s * cr, c * cr)


def transforms(topic, parent, child, times=(0.0,), poses=(MOUNT,), roll=0.0):
    """A topic of transforms, as `write_bag` takes it beside scans."""

    def messages(store):
        types = store.types
        for t, (x, y, yaw) in zip(times, poses, strict=True):
            place = types["geometry_msgs/msg/Vector3"](x, y, 0.3)
            moved = types["geometry_msgs/msg/Transform"](place, quaternion(store, yaw, roll))
            stamped = types["geometry_msgs/msg/TransformStamped"]
            yield types[TRANSFORMS]([stamped(header(store, t, parent), child, moved)])

    return topic, TRANSFORMS, messages


def odometry(topic="/odom", child="base_link", times=TIMES, poses=DRIVE):
    """A topic of odometry, as `write_bag` takes it beside scans."""

    def messages(store):
        def of(name, *values):
            return store.types[f"geometry_msgs/msg/{name}"](*values)

        none = np.zeros(36)
        for t, (x, y, yaw) in zip(times, poses, strict=True):
            pose = of("PoseWithCovariance", of("Pose", of("Point", x, y, 0.0), quaternion(store, yaw)), none)
            twist = of("Twist", of("Vector3", 0.3, 0.0, 0.0), of("Vector3", 0.0, 0.0, 0.1))
            twist = of("TwistWithCovariance", twist, none)
            yield store.types[ODOMETRY](header(store, t, "odom"), child, pose, twist)

    return topic, ODOMETRY, messages


STATIC = transforms("/tf_static", "base_link", "laser")
DRIVEN = transforms("/tf", "odom", "base_link", TIMES, DRIVE)
BY_ODOMETRY = [("poses", False, "frame 'odom', by odometry, which drifts")]


@pytest.mark.parametrize("version", ["1", "2"])
@pytest.mark.parametrize(
    "beside",
    [
        [STATIC, DRIVEN],
        [STATIC, odometry()],
        [transforms("/tf", "base_link", "laser", TIMES, [MOUNT] * 7), odometry()],
        [STATIC, DRIVEN, odometry(poses=0 * DRIVE)],
        [STATIC, odometry(), odometry("/wheels", poses=0 * DRIVE)],
        [STATIC, transforms("/tf_static", "base_footprint", "base_link", poses=[(9, 9, 0)]), odometry()],
    ],
    ids=["tf", "odom", "mount on tf", "tf before odom", "two odometries", "a frame below the robot's"],
)
def test_poses_by_odometry(tmp_path, version, beside, recwarn):
    """Interpolated at the scan, and the laser's, not the robot's; a note says that they drift."""
    name = "a.bag" if version == "1" else "folder"
    log = read_log(write_bag(tmp_path / name, version, {"/scan": scans_of}, beside))
    np.testing.assert_allclose(log.poses, composed(AT_SCANS, MOUNT), atol=1e-9)
    assert len(recwarn) == 0
    assert_noted(log, BY_ODOMETRY)


def assert_noted(log, expected):
    """The notes are of these kinds, doubts and words."""
    assert [(note.kind, note.doubt) for note in log.notes] == [(kind, doubt) for kind, doubt, _ in expected]
    assert all(words in note.text for note, (_, _, words) in zip(log.notes, expected, strict=True))


@pytest.mark.parametrize("prefix", ["", "/", "robot1/"])
def test_poses_in_the_map(tmp_path, prefix):
    """Where a localisation's transforms lead to the map, the poses are the laser's there, without a note."""
    shift = (5.0, -3.0, 1.0)
    found = transforms("/tf", f"{prefix}map", "odom", TIMES, [shift] * 7)
    world = transforms("/tf_static", "earth", f"{prefix}map", poses=[(99, 99, 1)])
    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of}, [STATIC, DRIVEN, found, world]))
    np.testing.assert_allclose(log.poses, composed(shift, composed(AT_SCANS, MOUNT)), atol=1e-9)
    assert not log.notes


@pytest.mark.parametrize(
    "beside",
    [[], [STATIC], [transforms("/tf", "base_link", "laser")], [transforms("/tf", "odom", "base_link", (), ())]],
)
def test_a_bag_that_tells_no_motion(tmp_path, beside, recwarn):
    """The laser is taken to stand still at the origin, and a note says so."""
    log = read_log(write_bag(tmp_path / "folder", "2", {"/scan": scans_of}, beside))
    assert not log.poses.any() and len(recwarn) == 0
    assert_noted(log, [("poses", False, "tells no motion of 'laser': the laser is taken to stand still")])


def test_a_robot_that_stands_is_where_its_transforms_say(tmp_path):
    """Transforms that lead to the map and never change are no reason for zero."""
    beside = [STATIC, transforms("/tf", "map", "base_link", poses=[(3, 4, 1)])]
    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of}, beside))
    np.testing.assert_allclose(log.poses, [composed((3, 4, 1), MOUNT)] * 3, atol=1e-9)
    assert not log.notes


def test_a_laser_that_hangs(tmp_path):
    """Upside down its first beam is to the left as seen from above: beam 0 is the rightmost again."""
    mount = transforms("/tf_static", "base_link", "laser", roll=np.pi)

    def three(store):
        return scans_of(store, [1.0, 2.0, 3.0])  # at -1, -0.5 and 0 rad

    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": three}, [mount, odometry()]))
    assert log.angles.tolist() == [0.0, 0.5, 1.0] and log.ranges[0].tolist() == [3, 2, 1]
    np.testing.assert_allclose(log.poses, composed(AT_SCANS, MOUNT), atol=1e-9)
    assert_noted(log, BY_ODOMETRY)


def test_what_hangs_from_what_hangs(tmp_path):
    """Behind a frame that hangs left is right, and what hangs from that stands upright again."""
    beside = [transforms("/tf_static", "base_link", "arm", poses=[(1, 0, 0)], roll=np.pi)]
    beside += [transforms("/tf_static", "arm", "laser", poses=[(0, 0.5, 0.2)], roll=np.pi), odometry()]
    log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of}, beside))
    np.testing.assert_allclose(log.poses, composed(AT_SCANS, (1, -0.5, -0.2)), atol=1e-9)
    assert log.angles[0] == -1.0


DOUBTS = {
    "no transform leads from 'laser' to 'base_link'": [odometry()],
    "tilted by 30 degrees": [transforms("/tf_static", "base_link", "laser", roll=np.pi / 6), odometry()],
    "1 of 3 poses are a guess": [STATIC, odometry(times=[98.0, 99.15], poses=DRIVE[:2])],
    "3 of 3 scans are more than 1 s from every": [STATIC, odometry(times=TIMES + 50)],
}


@pytest.mark.parametrize("text", DOUBTS)
def test_poses_in_doubt(tmp_path, text):
    """What is a guess is warned of and noted; poses from another time are none."""
    with pytest.warns(UserWarning, match=text) as record:
        log = read_log(write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of}, DOUBTS[text]))
    assert len(record) == 1
    doubts = [note for note in log.notes if note.doubt]
    assert [note.kind for note in doubts] == ["poses"] and text in doubts[0].text
    assert log.poses.any() == ("3 of 3" not in text)


def test_without_a_clock_there_are_no_poses(tmp_path):
    """Scans that are timed anew cannot be set against the odometry."""

    def standing(store):
        for message in scans_of(store, count=30):
            message.header.stamp.sec, message.header.stamp.nanosec = 100, 0
            yield message

    path = write_bag(tmp_path / "a.bag", "1", {"/scan": standing}, [STATIC, odometry()])
    with pytest.warns(UserWarning, match="timed at 10 Hz|no place in the odometry"):
        log = read_log(path)
    assert not log.poses.any() and [note.kind for note in log.notes] == ["clock", "poses"]


@pytest.mark.parametrize("version", ["1", "2"])
def test_odometry_of_a_bag(tmp_path, version):
    """Time, pose of the robot with wrapped heading, and velocity; /odom where there are several."""
    beside = [odometry("/wheels", poses=0 * DRIVE), odometry()]
    path = write_bag(tmp_path / ("a.bag" if version == "1" else "folder"), version, {"/scan": scans_of}, beside)
    found = read_odometry(path)
    np.testing.assert_allclose(found.t, TIMES)
    np.testing.assert_allclose(found.poses[:, :2], DRIVE[:, :2])
    np.testing.assert_allclose(np.exp(1j * found.poses[:, 2]), np.exp(1j * DRIVE[:, 2]))
    assert np.abs(found.poses[:, 2]).max() <= np.pi
    np.testing.assert_allclose(found.velocities, [[0.3, 0.1]] * 7)
    assert not read_odometry(path, "/wheels").poses.any()


def test_odometry_that_is_not_there(tmp_path):
    """Without it, with a wrong topic, with several or with a useless clock the error says what there is."""
    path = write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of})
    with pytest.raises(FormatError, match="name one Odometry topic; the bag has none"):
        read_odometry(path)
    path = write_bag(tmp_path / "b.bag", "1", {}, [odometry("/left"), odometry("/right")])
    with pytest.raises(FormatError, match="name one Odometry topic; the bag has /left, /right"):
        read_odometry(path)
    with pytest.raises(FormatError, match="no Odometry topic '/odom'; the bag has /left, /right"):
        read_odometry(path, "/odom")
    path = write_bag(tmp_path / "c.bag", "1", {}, [odometry(times=[1.0] * 7)])
    with pytest.raises(FormatError, match="clock is useless: 6 of 7 Odometry messages"):
        read_odometry(path)
    path = write_bag(tmp_path / "d.bag", "1", {}, [odometry(times=[], poses=[])])
    with pytest.raises(FormatError, match="the topic holds no odometry"):
        read_odometry(path)


# ---- maps


def grid(topic="/map", turn=0.0, cells=((0, 100, -1), (40, 60, 50))):
    """A topic with a map that is sent twice, first empty."""

    def messages(store):
        types = store.types
        place = types["geometry_msgs/msg/Pose"](
            types["geometry_msgs/msg/Point"](-1.0, 2.0, 0.0), quaternion(store, turn)
        )
        for data in (np.zeros_like(cells), np.array(cells)):
            stamp = header(store, 5.0, "map")
            size = data.shape[::-1]
            about = types["nav_msgs/msg/MapMetaData"](stamp.stamp, 0.1, *size, place)
            yield types[GRID](stamp, about, data.ravel().astype(np.int8))

    return topic, GRID, messages


@pytest.mark.parametrize("version", ["1", "2"])
def test_the_map_of_a_bag(tmp_path, version):
    """The last one of /map, probabilities from percent, unknown as NaN, row 0 lowest."""
    beside = [grid("/costmap", cells=[[1]]), grid()]
    path = write_bag(tmp_path / ("a.bag" if version == "1" else "folder"), version, {"/scan": scans_of}, beside)
    found = OccupancyGrid.load(path)
    np.testing.assert_array_equal(found.occupancy, [[0, 1, np.nan], [0.4, 0.6, 0.5]])
    assert found.origin == (-1.0, 2.0) and found.resolution == pytest.approx(0.1)


def test_maps_that_cannot_be_taken(tmp_path):
    """A bag without one, with several of other names, and a turned one are refused in words."""
    for beside, text in (
        ([], "name one OccupancyGrid topic; the bag has none"),
        ([grid("/a"), grid("/b")], "name one OccupancyGrid topic; the bag has /a, /b"),
        ([grid(turn=0.5)], "a turned map is not supported, got 0.5 rad"),
    ):
        path = write_bag(tmp_path / f"{len(text)}.bag", "1", {"/scan": scans_of}, beside)
        with pytest.raises(FormatError, match=text):
            OccupancyGrid.load(path)
    with pytest.raises(FormatError, match=r"a map is named \.yaml"):
        found = OccupancyGrid(np.zeros((2, 2)), (0, 0), 0.1)
        found.save(tmp_path / "a.bag")


# ---- bags that lie of themselves


def test_records_that_run_past_the_end_are_refused(tmp_path):
    """What a bag says of its lengths is not believed: rosbags would make room for it first."""
    path = write_bag(tmp_path / "a.bag", "1", {"/scan": scans_of})
    content = path.read_bytes()
    path.write_bytes(content[:13] + b"\xff\xff\xff\x7f" + content[17:])
    with pytest.raises(FormatError, match="a record at byte 13 runs past the end of the file"):
        read_log(path)
    path.write_bytes(content.replace(b"index_pos=", b"index_pos=\1", 1))
    with pytest.raises(FormatError, match="the index must be where a record begins|runs past the end"):
        read_log(path)
    path = next(write_bag(tmp_path / "b", "mcap", {"/scan": scans_of}).glob("*.mcap"))
    content = path.read_bytes()
    path.write_bytes(content[:9] + b"\xff" * 6 + content[15:])
    with pytest.raises(FormatError, match="a record of 281474976710655 bytes at byte 8 runs past the end"):
        read_log(path)
    for lie in (b"\1", b"\0\0\0\0\0\1"):
        path.write_bytes(content[:-28] + lie + content[-28 + len(lie) :])
        with pytest.raises(FormatError, match="the index must be where a record begins, and a footer at the end"):
            read_log(path)


def test_a_packed_chunk_has_bounds(tmp_path, monkeypatch):
    """bzip2 packs a gigabyte into a kilobyte: no more is unpacked than there is room for."""
    import bz2
    from types import SimpleNamespace

    from rosbags.rosbag1.reader import Chunk

    packed = bz2.compress(bytes(ros_bag_bounds.MAX_CHUNK + 1))
    reader = SimpleNamespace(chunks={0: Chunk(len(packed), 0, bz2.decompress)})
    ros_bag_bounds.bound_chunks([reader])
    assert len(packed) < 1000
    with pytest.raises(ValueError, match="a chunk unpacks to more than 67108864 bytes"):
        reader.chunks[0].decompressor(packed)
    assert reader.chunks[0].decompressor(bz2.compress(b"scan")) == b"scan"


@pytest.mark.parametrize("version", ["1", "mcap"])
def test_packed_bags_are_read(tmp_path, monkeypatch, version):
    """Chunks in whatever way they are packed hold the same scans, and none may hold more than its bound."""
    store = get_typestore(Stores.ROS1_NOETIC if version == "1" else Stores.ROS2_HUMBLE)
    if version == "1":
        writer = Writer1(tmp_path / "a.bag")
        writer.set_compression(Writer1.CompressionFormat.BZ2)
    else:
        writer = Writer2(tmp_path / "a", version=8, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    serialize = store.serialize_ros1 if version == "1" else store.serialize_cdr
    with writer as bag:
        connection = bag.add_connection("/scan", SCAN, typestore=store)
        for i, message in enumerate(scans_of(store)):
            bag.write(connection, i, bytes(serialize(message, SCAN)))
    path = tmp_path / ("a.bag" if version == "1" else "a")
    assert len(read_log(path)) == 3
    monkeypatch.setattr(ros_bag_bounds, "MAX_CHUNK", 100)
    with pytest.raises(FormatError, match="a chunk (of .* bytes is larger than|unpacks to more than) 100"):
        read_log(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 3000, "brackets must be at most 20 deep"),
        ("a: &a [x]\nb: *a\n", "there must be no anchors, aliases and tags"),
        ("#" * 1_100_000, "holds more than 1048576 bytes"),
    ],
)
def test_metadata_have_bounds(tmp_path, text, message):
    """rosbags takes ten seconds over a metadata.yaml of 3000 brackets."""
    path = write_bag(tmp_path / "a", "2", {"/scan": scans_of})
    (path / "metadata.yaml").write_text(text)
    with pytest.raises(FormatError, match=rf"metadata\.yaml: {message}"):
        read_log(path)


def test_numbers_that_no_robot_has_are_refused(tmp_path, recwarn):
    """Transforms and odometry beyond a billion metres, beams over more than a turn, ranges of a far galaxy."""
    moving = [transforms("/tf", "odom", "laser", poses=[(1e300, 0.0, 0.0)])]
    for k, (scans, beside, message) in enumerate(
        [
            (scans_of, moving, r"the transforms of 'laser' must be within 1e\+09 m, got nan m"),
            (lambda store: scans_of(store, step=9.0), [], "beams must spread over at most a full turn, got"),
            (lambda store: scans_of(store, ranges=[np.nan] * 40_000, step=1e-4), [], "1 to 36000 beams, got 40000"),
        ]
    ):
        path = write_bag(tmp_path / f"{k}.bag", "1", {"/scan": scans}, beside)
        with pytest.raises(FormatError, match=message):
            read_log(path)
    assert not recwarn


# ---- real bags


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
@pytest.mark.parametrize("name", ["demo_stationary_simple_environment", "walker_1"])
def test_real_bags_without_motion(name):
    """Bags that hold nothing but scans: the laser is taken to stand, and that is all there is to say."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        log = read_log(Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / f"people/{name}.bag")
    assert not log.poses.any()
    assert [(note.kind, note.doubt) for note in log.notes] == [("poses", False)]


@pytest.mark.skipif("DOLLOP_EXTERNAL_DATA" not in os.environ, reason="no recordings")
def test_bag_with_message_types_of_its_own(tmp_path):
    """A bag that also holds messages of unknown types gives its 7,170 scans over 720 s."""
    archive = Path(os.environ["DOLLOP_EXTERNAL_DATA"]) / "people/person_following_outdoor_1.bag.zip"
    with zipfile.ZipFile(archive) as packed:
        name = next(n for n in packed.namelist() if n.endswith(".bag"))
        log = read_log(packed.extract(name, tmp_path), topic="/scan_base2")
    assert log.ranges.shape == (7170, 245)
    assert log.t[-1] - log.t[0] == pytest.approx(720, abs=1)
