"""Maps of ROS map_server: a YAML of flat keys that names a picture.

Grey v of the picture, whose first row is the highest y, means the probability (255 - v) / 255,
unless `negate`; see http://wiki.ros.org/map_server.
"""

import hashlib
import os
from contextlib import suppress

import numpy as np
import yaml
from PIL import Image

from dollop.checks import check_choice
from dollop.formats.carmen_map import OCCUPIED_FROM
from dollop.formats.files import FormatError, from_file, read_bytes
from dollop.formats.kinds import PGM, ROS_MAP
from dollop.formats.writing import Output, together, whole_file

__all__ = ["outputs", "picture_of", "read_map", "write_map"]

UNKNOWN_GREY = (127, 128)
"""Written maps have thresholds that make these two greys, and no other, the unknown."""

RIGHT_ANGLED = 1e-6
"""A turn in rad that counts as none: it moves what is a hundred metres away by a tenth of a
millimetre.
"""

USUAL = {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
"""What those keys mean that a map need not have."""


def outputs(path):
    """What `write_map` writes: the YAML, and its picture.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of Output
        The picture lies beside the YAML, or where that is a link, beside the file it points to.
    """
    picture = os.path.splitext(os.path.realpath(path) if os.path.islink(path) else path)[0] + ".pgm"
    return [Output(path, ROS_MAP), Output(picture, PGM, of=path)]


def picture_of(path):
    """The picture that a map names.

    Parameters
    ----------
    path : str or Path
        The YAML.

    Returns
    -------
    str or None
        Its path; None where the map cannot be read, or names none that is there.
    """
    with suppress(OSError, ValueError):
        # If the YAML is a link, beside either.
        folders = map(os.path.dirname, (path, os.path.realpath(path)))
        places = [os.path.join(folder, str(_read_keys(path).get("image"))) for folder in folders]
        return next(filter(os.path.exists, places), None)


def write_map(path, occupancy, origin, resolution):
    """Write a map as YAML with a PGM of the same name beside it; both appear, or neither.

    Occupied, free and unknown cells come back as they were, in trinary mode of map_server
    (http://wiki.ros.org/map_server); probabilities come back to a 255th. Both files carry the same
    mark, made from what they hold, as a comment: one of another map is told by it.

    Parameters
    ----------
    path : str or Path
        The YAML.
    occupancy : (H, W) float array
        Probabilities, NaN where unknown; row 0 has the lowest y.
    origin : (float, float)
        Lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.
    """
    image = outputs(path)[1].path
    grey, (low, high) = np.rint(255 * (1 - occupancy)), UNKNOWN_GREY
    occupied, free = occupancy >= OCCUPIED_FROM, occupancy < OCCUPIED_FROM
    sides = np.minimum(grey, low - 1), np.maximum(grey, high + 1)
    grey = np.select([occupied, free], sides, low).astype(np.uint8)
    place = {"resolution": float(resolution), "origin": [*map(float, origin), 0.0]}
    meaning = {"negate": 0, "occupied_thresh": 0.505, "free_thresh": 0.495}
    keys = {"image": os.path.basename(image), "mode": "trinary", **place, **meaning}
    layout = {"sort_keys": False, "default_flow_style": None, "allow_unicode": True}
    text, cells = yaml.safe_dump(keys, **layout).encode(), grey[::-1].tobytes()
    mark = f"# dollop pair {hashlib.sha256(text + cells).hexdigest()[:16]}\n".encode()
    with together():
        with whole_file(image, kind=PGM, of=path) as stream:
            stream.write(b"P5\n%s%d %d\n255\n" % (mark, *grey.T.shape) + cells)
        with whole_file(path, kind=ROS_MAP) as stream:
            stream.write(text + mark)


def read_map(path):
    """Read a map as map_server does (http://wiki.ros.org/map_server).

    Parameters
    ----------
    path : str or Path
        The YAML; its picture may be any that Pillow reads, such as PGM and PNG.

    Returns
    -------
    occupancy : (H, W) float array
        Probabilities, NaN where unknown; row 0 has the lowest y. Occupied and free cells are what
        the file's thresholds say.
    origin : list of two float
        Lower left corner, x, y in m.
    resolution : float
        Side of a cell in m.

    Raises
    ------
    FormatError
        If the YAML or its picture is not in order.
    """
    keys = USUAL | _read_keys(path)
    written = keys.get("origin")
    origin = [_number(path, "origin", v) for v in written] if isinstance(written, list) else []
    if len(origin) != 3 or not abs(origin[2]) <= RIGHT_ANGLED:
        raise FormatError(f"origin must be [x, y, 0] (a turned map is not supported), got {written!r}", path)
    resolution = _number(path, "resolution", keys.get("resolution"))
    grey = _read_grey(path, str(keys.get("image", "")))[::-1]
    return _probabilities(path, keys, grey), origin[:2], resolution


def _read_keys(path):
    """What the YAML holds, a dict."""
    try:
        keys = yaml.safe_load(read_bytes(path))
    except (yaml.YAMLError, ValueError, RecursionError) as error:  # ValueError: a date that is none
        raise FormatError(f"not YAML: {' '.join(str(error).split())}", path) from None
    if not isinstance(keys, dict):
        raise FormatError(f"expected 'key: value' in each line, got {str(keys)[:40]!r}", path)
    return keys


def _number(path, key, value):
    """The value as a float: to YAML 1e-9, without a point, is text, and yes is no number."""
    try:
        return float(str(value))
    except ValueError:
        raise FormatError(f"{key} must be a number, got {value!r}", path) from None


def _read_grey(path, name):
    """Grey values (H, W) from 0 to 255 of the picture beside a map, of a coloured one the mean as
    in map_server.
    """
    # os.path and not pathlib, for which a name too long or with a zero byte is another error.
    place = os.path.join(os.path.dirname(path), name)
    if not os.path.isfile(place):
        raise FormatError(f"its picture {name!r} is missing", path)
    try:
        with Image.open(place) as picture:
            if picture.mode.startswith("I"):  # sixteen bits
                return np.asarray(picture) / 257
            colours = np.asarray(picture.convert("RGBA"), float)
    except Exception as error:  # whatever Pillow's parsers happen to raise
        raise FormatError(f"not a readable picture ({error})", place) from None
    if (colours[..., 3] < 255).any():
        raise FormatError("a map must have no transparent pixels", place)
    return colours[..., :3].mean(axis=2)


def _probabilities(path, keys, grey):
    """Probabilities by the map's `mode`, set so that occupied and free cells are what the file's
    thresholds say.
    """
    mode = keys["mode"]
    from_file(path, check_choice, "mode", mode, ("trinary", "scale", "raw"))
    from_file(path, check_choice, "negate", keys["negate"], (0, 1))  # or false and true
    below, above = (_number(path, key, keys[key]) for key in ("free_thresh", "occupied_thresh"))
    if not 0 <= below <= above <= 1:
        rule = "thresholds must be 0 <= free_thresh <= occupied_thresh <= 1"
        raise FormatError(f"{rule}, got free_thresh {below:g} and occupied_thresh {above:g}", path)
    if mode == "raw":
        return np.where(grey <= 100, grey / 100, np.nan)
    probability = (grey if keys["negate"] else 255 - grey) / 255
    occupied, free = probability > above, probability < below
    just_free = np.nextafter(OCCUPIED_FROM, 0)
    sides = np.maximum(probability, OCCUPIED_FROM), np.minimum(probability, just_free)
    return np.select([occupied, free], sides, np.nan if mode == "trinary" else probability)
