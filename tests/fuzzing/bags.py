"""Small ROS bags to damage, written by rosbags: scans with odometry and transforms, and a map."""

import tempfile
from pathlib import Path

import numpy as np

SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
GRID, TRANSFORMS = "nav_msgs/msg/OccupancyGrid", "tf2_msgs/msg/TFMessage"


def stored(version):
    """The messages' types of ROS 1 or 2."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if version == "1" else Stores.ROS2_HUMBLE)
    if version == "1":  # rosbags has the messages of tf2 for ROS 2 only
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS))
    return store


def written(version, messages, spoiled=bytes):
    """Files of a bag, {name: content}, of what a function makes of a store: (topic, type, message) in order.

    What a message is as bytes may be spoiled; the bag round it is right.
    """
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    store = stored(version)
    plugin = StoragePlugin.MCAP if version == "mcap" else StoragePlugin.SQLITE3
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.bag" if version == "1" else "bag")
        with Writer1(path) if version == "1" else Writer2(path, version=8, storage_plugin=plugin) as bag:
            serialize = store.serialize_ros1 if version == "1" else store.serialize_cdr
            connections = {}
            for i, (topic, kind, message) in enumerate(messages(store)):
                if topic not in connections:
                    connections[topic] = bag.add_connection(topic, kind, typestore=store)
                bag.write(connections[topic], i * 50_000_000, spoiled(bytes(serialize(message, kind))))
        files = [path] if version == "1" else sorted(path.iterdir(), reverse=True)
        return {str(each.relative_to(folder)): each.read_bytes() for each in files}


def header(store, i, frame):
    """The header of a message, a tenth of a second after the one before."""
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=100 + i // 10, nanosec=i % 10 * 100_000_000)
    number = {"seq": i} if "seq" in types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return types["std_msgs/msg/Header"](**number, stamp=stamp, frame_id=frame)


def geometry(store, name, *values):
    """A message of geometry_msgs."""
    return store.types[f"geometry_msgs/msg/{name}"](*values)


def scan_bag(version, log, turned=False, spoiled=bytes):
    """A log with odometry, and with the laser's place on the robot, or with its place on the map."""

    def messages(store):
        upright = geometry(store, "Quaternion", 0.0, 0.0, np.sin(0.8), np.cos(0.8))
        child, parent = ("laser", "map") if turned else ("laser", "base_link")
        moved = geometry(store, "Transform", geometry(store, "Vector3", 0.2, 0.05, 0.3), upright)
        link = geometry(store, "TransformStamped", header(store, 0, parent), child, moved)
        yield "/tf_static", TRANSFORMS, store.types[TRANSFORMS]([link])
        for i, ranges in enumerate(log.ranges):
            step = float(log.angles[1] - log.angles[0])
            bearings = float(log.angles[0]), float(log.angles[-1]), step
            values, none = ranges.astype(np.float32), np.array([], np.float32)
            yield (
                "/scan",
                SCAN,
                store.types[SCAN](header(store, i, "laser"), *bearings, 0.0, 0.1, 0.1, 8.0, values, none),
            )
            place = geometry(store, "Point", 0.1 * i, 0.0, 0.0)
            pose = geometry(store, "PoseWithCovariance", geometry(store, "Pose", place, upright), np.zeros(36))
            speeds = (geometry(store, "Vector3", *each) for each in ((0.3, 0.0, 0.0), (0.0, 0.0, 0.1)))
            twist = geometry(store, "TwistWithCovariance", geometry(store, "Twist", *speeds), np.zeros(36))
            yield "/odom", ODOMETRY, store.types[ODOMETRY](header(store, i, "odom"), "base_link", pose, twist)

    return written(version, messages, spoiled)


def map_bag(version, grid, spoiled=bytes):
    """A map on /map."""

    def messages(store):
        height, width = grid.occupancy.shape
        upright = geometry(store, "Quaternion", 0.0, 0.0, 0.0, 1.0)
        origin = geometry(store, "Pose", geometry(store, "Point", *map(float, grid.origin), 0.0), upright)
        time = store.types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
        frame = store.types["nav_msgs/msg/MapMetaData"](time, grid.resolution, width, height, origin)
        percent = np.where(grid.unknown, -1, np.rint(100 * np.nan_to_num(grid.occupancy))).astype(np.int8)
        yield "/map", GRID, store.types[GRID](header(store, 0, "map"), frame, percent.ravel())

    return written(version, messages, spoiled)
