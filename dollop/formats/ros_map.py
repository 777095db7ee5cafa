"""Maps of ROS map_server: a YAML of flat keys that names a picture.

Grey v of the picture, whose first row is the highest y, means the probability (255 - v) / 255,
unless `negate`; see http://wiki.ros.org/map_server.
"""

import hashlib
import io
import os
import re
import struct
import warnings
from contextlib import suppress

import numpy as np
import yaml
from PIL import PngImagePlugin, PpmImagePlugin

from dollop.checks import check_choice, told
from dollop.formats.carmen_map import OCCUPIED_FROM
from dollop.formats.files import FormatError, check_cells, from_file, read_bytes, written_number
from dollop.formats.kinds import PGM, ROS_MAP
from dollop.formats.plain_yaml import plain_nodes
from dollop.formats.writing import Output, together, whole_file

__all__ = ["outputs", "picture_of", "read_map", "write_map"]

UNKNOWN_GREY = (127, 128)
"""Written maps have thresholds that make these two greys, and no other, the unknown."""

RIGHT_ANGLED = 1e-6
"""A turn in rad that counts as none: it moves what is a hundred metres away by a tenth of a
millimetre.
"""

USUAL = {"mode": "trinary", "negate": "0", "occupied_thresh": "0.65", "free_thresh": "0.196"}
"""What those keys are that a map need not have."""

NEGATE = {
    "0": False,
    "false": False,
    "no": False,
    "off": False,
    "1": True,
    "true": True,
    "yes": True,
    "on": True,
}
"""What `negate` can be, in small letters, in capitals or with one."""

MAX_YAML, MAX_NODES = 1 << 16, 1000
"""Bytes and nodes of the YAML, which holds seven keys, and perhaps others that are passed over."""

MAX_PICTURE, MAX_HEAD = 1 << 27, 1 << 12
"""Bytes of the picture, the most cells in text, and of a PGM's head up to its size."""

PNG = b"\x89PNG\r\n\x1a\n"
"""How a PNG begins."""
_GAP = rb"(?:\s|#[^\n\r]*[\n\r])+"
PNM_SIZE = re.compile(rb"P[1-6]" + _GAP + rb"(\d+)" + _GAP + rb"(\d+)\s")
"""How a PGM begins, or another of its family, with its size."""

PAIR = re.compile(rb"^# dollop pair ([0-9a-f]{16})$", re.MULTILINE)
"""The comment by which the two files of a map know each other, in both of them."""


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
        The YAML, of at most 64 KiB and 1000 nodes, without anchors, aliases and tags; its picture
        is a PGM or a PNG of at most 128 MiB and 20 million pixels.

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
        If the YAML or its picture is not in order, or each carries the mark of another pair.
    """
    content = read_bytes(path, MAX_YAML)
    keys = USUAL | from_file(path, _keys_of, content)
    written = keys.get("origin")
    numbers = written if isinstance(written, list) else []
    origin = [_number(path, "origin", each) for each in numbers]
    if len(origin) != 3 or not abs(origin[2]) <= RIGHT_ANGLED:
        rule = "origin must be [x, y, 0] (a turned map is not supported)"
        raise FormatError(f"{rule}, got {told(written)}", path)
    resolution = _number(path, "resolution", keys.get("resolution"))
    grey = _read_grey(path, keys.get("image"), PAIR.search(content))[::-1]
    return _probabilities(path, keys, grey), origin[:2], resolution


def _read_keys(path):
    """The keys of a YAML: each a text as it stands there, a list of such, or None for what else it is.

    No object is made of it but these.
    """
    return from_file(path, _keys_of, read_bytes(path, MAX_YAML))


def _keys_of(content):
    found, nodes = {}, plain_nodes(content, MAX_NODES)
    if not isinstance(next(nodes, None), yaml.MappingStartEvent):
        raise ValueError(f"expected 'key: value' in each line, got {told(content[:60])}")
    for key in nodes:
        if isinstance(key, yaml.MappingEndEvent):
            break
        name, value = _value(key, nodes), _value(next(nodes), nodes)
        if not isinstance(name, str) or name in found or name == "<<":
            place = f"{told(name)} on line {key.start_mark.line + 1}"
            raise ValueError(f"a key must be a text, given once, got {place}")
        found[name] = value
    if any(isinstance(event, yaml.NodeEvent) for event in nodes):
        raise ValueError("expected one document, got another after it")
    return found


def _value(event, nodes):
    """The node that begins with an event, gone through to its end: a text, a list of texts, or None."""
    if isinstance(event, yaml.ScalarEvent):
        return event.value
    parts, depth = [], 1
    while depth:
        inner = next(nodes)
        depth += isinstance(inner, yaml.CollectionStartEvent)
        depth -= isinstance(inner, yaml.CollectionEndEvent)
        parts.append(getattr(inner, "value", None))
    return parts[:-1] if isinstance(event, yaml.SequenceStartEvent) else None


def _number(path, key, value):
    """The value of a key as a float."""
    if not isinstance(value, str):
        raise FormatError(f"{key} must be a number, got {told(value)}", path)
    return from_file(path, written_number, key, value)


def _read_grey(path, name, mark):
    """Grey values (H, W) from 0 to 255 of the picture beside a map, of a coloured one the mean as
    in map_server; `mark` is the match of `PAIR` in the YAML.
    """
    if not isinstance(name, str):
        raise FormatError(f"image must be the name of its picture, got {told(name)}", path)
    # os.path and not pathlib, for which a name too long or with a zero byte is another error.
    folders = map(os.path.dirname, (path, os.path.realpath(path)))  # of a link beside either
    place = next(filter(os.path.exists, (os.path.join(folder, name) for folder in folders)), None)
    if place is None:
        raise FormatError(f"its picture {told(name, 150)} is missing", path)
    content = read_bytes(place, MAX_PICTURE)
    kind, size = _kind_and_size(place, content)
    from_file(place, check_cells, *size)
    other = PAIR.search(content[:MAX_HEAD]) if kind is PpmImagePlugin.PpmImageFile else None
    if mark and other and mark[1] != other[1]:
        own = f"{os.path.basename(path)} of pair {mark[1].decode()}"
        found = f"it is of pair {other[1].decode()}, and {own}"
        raise FormatError(f"is one half of another run: {found}", place)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what Pillow would warn of is no map
            return _grey_of(kind, content, size)
    except Exception as error:  # whatever Pillow's parsers happen to raise
        raise FormatError(f"not a readable picture ({error})", place) from None


def _kind_and_size(place, content):
    """The reader of a PGM or PNG, and its columns and rows, by its first bytes."""
    if content.startswith(PNG) and len(content) >= 24:
        return PngImagePlugin.PngImageFile, struct.unpack(">II", content[16:24])
    head = PNM_SIZE.match(content[:MAX_HEAD])
    if head is None:
        rule = f"neither PNG nor PGM with its size in {MAX_HEAD} bytes"
        raise FormatError(f"not a readable picture ({rule})", place)
    return PpmImagePlugin.PpmImageFile, (float(head[1]), float(head[2]))


def _grey_of(kind, content, size):
    """Grey values (H, W) of a picture."""
    with kind(io.BytesIO(content)) as picture:
        if picture.size != size:
            raise ValueError(f"two sizes, {size} and {picture.size}")
        if picture.mode == "F":
            raise ValueError("a map has whole numbers, this one has none")
        if picture.mode.startswith("I"):  # sixteen bits
            return np.asarray(picture) / 257
        if picture.mode in ("1", "L") and "transparency" not in picture.info:
            return np.asarray(picture.convert("L"), float)
        colours = np.asarray(picture.convert("RGBA"))
    if (colours[..., 3] < 255).any():
        raise ValueError("a map must have no transparent pixels")
    return colours[..., :3].mean(axis=2)


def _probabilities(path, keys, grey):
    """Probabilities by the map's `mode`, set so that occupied and free cells are what the file's
    thresholds say.
    """
    mode = keys["mode"]
    from_file(path, check_choice, "mode", mode, ("trinary", "scale", "raw"))
    below, above = (_number(path, key, keys[key]) for key in ("free_thresh", "occupied_thresh"))
    if not 0 <= below <= above <= 1:
        rule = "thresholds must be 0 <= free_thresh <= occupied_thresh <= 1"
        raise FormatError(f"{rule}, got free_thresh {below:g} and occupied_thresh {above:g}", path)
    negate = _negate(path, keys["negate"])
    if mode == "raw":
        return np.where(grey <= 100, grey / 100, np.nan)
    probability = (grey if negate else 255 - grey) / 255
    occupied, free = probability > above, probability < below
    np.maximum(probability, OCCUPIED_FROM, out=probability, where=occupied)
    np.minimum(probability, np.nextafter(OCCUPIED_FROM, 0), out=probability, where=free)
    if mode == "trinary":
        probability[~(occupied | free)] = np.nan
    return probability


def _negate(path, value):
    """Whether dark is free: what `negate` says."""
    for letters in (str.lower, str.upper, str.capitalize):
        words = {letters(word): meaning for word, meaning in NEGATE.items()}
        if isinstance(value, str) and value in words:
            return words[value]
    raise FormatError(f"negate must be one of {', '.join(NEGATE)}, got {told(value)}", path)
