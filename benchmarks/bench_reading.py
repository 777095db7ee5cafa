"""Reading: logs and maps per second, beside a plain reader that believes every byte of them.

python -m benchmarks reading
"""

import gzip
import tempfile
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from benchmarks.timing import row, seconds
from dollop import OccupancyGrid, read_log, write_log
from dollop.formats import carmen_map

DATA = Path(__file__).parents[1] / "data"
LOG, MAP = DATA / "figure_eights.log.gz", DATA / "lab.yaml"


def plain_log(path):
    """Ranges, poses and times of a log of ROBOTLASER1 messages, as somebody reads them who knows that they are good."""
    ranges, endings = [], []
    with gzip.open(path) if str(path).endswith(".gz") else open(path, "rb") as stream:
        for line in stream:
            fields = line.split()
            if fields and fields[0] == b"ROBOTLASER1":
                count = int(fields[8])
                ranges.append(np.array(fields[9 : 9 + count], float))
                endings.append(np.array(fields[10 + count : 22 + count], float))
    endings = np.array(endings)
    return np.array(ranges), endings[:, :3], endings[:, -1]


def plain_map(path):
    """Probabilities of a map of map_server, and its place."""
    keys = yaml.load(path.read_bytes(), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    grey = np.asarray(Image.open(path.parent / keys["image"]).convert("L"), float)[::-1]
    probability = (255 - grey) / 255
    between = (probability >= keys["free_thresh"]) & (probability <= keys["occupied_thresh"])
    return np.where(between, np.nan, probability), keys["origin"][:2], keys["resolution"]


def plain_carmen_map(path):
    """Probabilities of a CARMEN map as `write_map` writes it."""
    content = path.read_bytes()
    place = content.index(b"GRIDMAP   ") + 10
    width, height = np.frombuffer(content, "<i4", 2, place)
    cells = np.frombuffer(content, "<f4", width * height, place + 12).reshape(width, height).T.astype(float)
    return np.where(cells < 0, np.nan, cells)


def run(repeats=15):
    """Time reading the longest recording in data/, packed and not, and the map of the laboratory in both formats.

    Returns
    -------
    list of dict
        Seconds for each file. The bounds are three times the plain reader's time in the same run
        for logs, and five times for the maps, which are read in a millisecond.
    """
    with tempfile.TemporaryDirectory() as folder:
        unpacked, carmen = Path(folder, "a.log"), Path(folder, "a.map")
        write_log(unpacked, read_log(LOG))
        OccupancyGrid.load(MAP).save(carmen)
        pairs = [
            ("a packed log", lambda: read_log(LOG), lambda: plain_log(LOG), 3),
            ("the log unpacked", lambda: read_log(unpacked), lambda: plain_log(unpacked), 3),
            ("a ROS map", lambda: OccupancyGrid.load(MAP), lambda: plain_map(MAP), 5),
            ("a CARMEN map", lambda: carmen_map.read_map(carmen), lambda: plain_carmen_map(carmen), 5),
        ]
        rows = [_row(name, *pair, repeats) for name, *pair in pairs]
    log, (ranges, poses, t) = read_log(LOG), plain_log(LOG)
    found = np.isfinite(log.ranges)
    assert (
        (log.ranges[found] == ranges[found]).all() and (log.t == t).all() and (log.poses[:, :2] == poses[:, :2]).all()
    )
    return rows


def _row(name, ours, plain, bound, repeats):
    """Both readers of one file."""
    fast, _ = seconds(ours, repeats)
    baseline, _ = seconds(plain, repeats)
    return row(f"{name}: {1 / fast:.0f} a second", fast, baseline, bound * baseline)
