"""Logs and maps as a command line names them, and what is observed in them."""

import os
import sys
from functools import partial
from pathlib import Path

import dollop
from dollop.cli.telling import busy
from dollop.formats.kinds import BAG, CARMEN_LOG, CARMEN_MAP, ROS_MAP, kind_of
from dollop.gridmap import map_inputs
from dollop.people import moving_speed
from dollop.trajectory import arc_length

__all__ = ["check_kind", "load_map", "map_files", "read_log", "tell_people", "watched"]

LOGS, MAPS = (CARMEN_LOG, BAG), (CARMEN_MAP, ROS_MAP, BAG)
"""Kinds of files that hold laser scans, and maps; a bag can hold both."""


def check_kind(word, path, kinds, other=None):
    """Refuse a file that is known to hold something else.

    Parameters
    ----------
    word : str
        What the command line calls it.
    path : str or Path
    kinds : sequence of Kind
        What it may hold.
    other : (str, str or Path), optional
        Word and path of the file that it may have been mistaken for.

    Raises
    ------
    FileNotFoundError
        If there is none.
    ValueError
        With what it holds.
    """
    if not os.path.exists(path):
        raise FileNotFoundError(f"{word} must be a file that is there, got {path}")
    found = kind_of(path)
    if found is None or found in kinds:
        return
    swapped = other is not None and os.path.exists(other[1]) and kind_of(other[1]) in kinds
    advice = f": are {word} and {other[0]} swapped?" if swapped else ""
    wanted = " or ".join(kind.name for kind in kinds)
    raise ValueError(f"{word} must be {wanted}, got {path}, which is {found.name}{advice}")


def read_log(path, options, map=None):
    """The log of a path, with the options of the command line.

    Parameters
    ----------
    path : str
    options : argparse.Namespace
        Its `topic` and `fov`.
    map : str, optional
        The map that is named beside it.

    Returns
    -------
    LaserLog

    Raises
    ------
    ValueError, OSError
        For what is no log.
    """
    check_kind("LOG", path, LOGS, None if map is None else ("MAP", map))
    with busy(f"reading {path}"):
        return dollop.read_log(path, options.topic, options.fov)


def load_map(path, log=None):
    """The map of a path.

    Parameters
    ----------
    path : str
    log : str, optional
        The log that is named beside it.

    Returns
    -------
    OccupancyGrid

    Raises
    ------
    ValueError, OSError
        For what is no map.
    """
    check_kind("MAP", path, MAPS, None if log is None else ("LOG", log))
    return dollop.OccupancyGrid.load(path)


def map_files(path, word, other):
    """Files that `load_map` reads of a map, if it is none of another kind.

    Parameters
    ----------
    path : str
    word, other : str
        What the file is called, and which it is, that it may have been mistaken for.

    Returns
    -------
    list of str or Path

    Raises
    ------
    ValueError
        If it is no map, as far as that can be told before it is read.
    """
    if os.path.exists(path):
        check_kind("MAP", path, MAPS, (word, other))
    return map_inputs(path)


def watched(log, background, user="fastest", min_area=0.01, what="observing"):
    """What `dollop.observe` finds in a log, with a bar for a terminal where that takes longer.

    Parameters
    ----------
    log : LaserLog
    background : OccupancyGrid
    user : str, (x, y) or int
    min_area : float
        In m^2.
    what : str
        What the bar says.

    Returns
    -------
    Observation

    Raises
    ------
    ValueError
        As `dollop.observe`.
    """
    if not sys.stderr.isatty():
        return dollop.observe(log, background, user, min_area=min_area)
    from tqdm import tqdm

    observer = dollop.Observer(background, log.angles, user, min_area=min_area)
    for i in tqdm(range(len(log)), desc=what, unit=" scans", leave=False, delay=1.0):
        observer.step(log.t[i], log.ranges[i], log.poses[i])
    return observer.observation(log.notes)


def tell_people(found, begin, log=None):
    """Who walked where, on the error stream, if there is a choice.

    Parameters
    ----------
    found : Observation
    begin : float
        Time of the log's first scan in s.
    log : str, optional
        Whose people these are, where there are several logs.
    """
    if len(found.people) < 2 or not any(note.kind == "people" for note in found.notes):
        return
    say = partial(print, file=sys.stderr)
    say(f"say who the user{f' of {Path(log)}' if log else ''} is with --user X,Y or --user NUMBER:")
    for k, who in enumerate(found.people):
        x, y = who.positions[0]
        way = f"{arc_length(who.positions)[-1]:.1f} m at {moving_speed(who):.2f} m/s"
        when = f"{who.t[0] - begin:.1f} to {who.t[-1] - begin:.1f} s"
        say(f"  {k}: from ({x:.2f}, {y:.2f}), {when}, {way}")
