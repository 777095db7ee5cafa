"""dollop observe: the user's trajectory in a laser log."""

import csv
from pathlib import Path

import numpy as np

from dollop.cli.naming import check_written, outputs_of, unused
from dollop.cli.telling import Result, command, tell, tell_notes
from dollop.cli.watching import load_map, map_files, read_log, tell_people, watched
from dollop.formats.kinds import EVERYBODY, PNG, TRAJECTORY
from dollop.formats.writing import Output, together, whole_file
from dollop.trajectory import arc_length

__all__ = ["run", "said"]


def run(options):
    """Observe, dollop observe LOG MAP.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        If nobody walks.
    """
    out, picture = _outputs(options)
    log = read_log(options.log, options, options.map)
    background = load_map(options.map, options.log)
    found = watched(log, background, options.user, options.min_area)
    if found.user is None:
        tell_notes(found.notes)
        others = f"tracks of something else: {len(found.tracks)}"
        raise ValueError(f"nobody walks in {options.log}; {others}")
    with together():
        if options.tracks:
            _write_people(found.people, options.tracks)
        _draw_observation(found, background, picture)
        _write_track(found.user, out)
    tell_people(found, log.t[0])
    written = [path for path in (out, picture, options.tracks) if path]
    tell(Result(_lines(found), written, _next(options), found.notes, _data(found)), options.json)


def _outputs(options):
    """Paths of the trajectory and its picture, if both can be written and are no input."""
    out, picture = outputs_of(options, ".csv", "the trajectory")
    tracks = [Path(options.tracks)] if options.tracks else []
    if any(path.suffix != ".csv" or path == out for path in tracks):
        raise ValueError(f"--tracks must be named .csv, and not as --out, got {options.tracks}")
    outputs = [Output(out, TRAJECTORY), *(Output(path, EVERYBODY) for path in tracks)]
    read = [options.log, *map_files(options.map, "LOG", options.log)]
    check_written(outputs, read, picture, out)
    return out, picture


def _lines(found):
    """What was observed, for people."""
    walked, seconds = arc_length(found.user.positions)[-1], np.ptp(found.user.t)
    hidden = f"out of sight for {found.user.occluded.mean():.0%}"
    objects = f"{len(found.environment)} static objects"
    return (f"the user walked {walked:.1f} m in {seconds:.1f} s, {hidden}; {objects}",)


def _data(found):
    """What was observed, for programs."""
    user = found.user
    walked = {
        "from": user.positions[0],
        "to": user.positions[-1],
        "walked": arc_length(user.positions)[-1],
    }
    return {
        "user": {**walked, "seconds": np.ptp(user.t), "occluded": user.occluded.mean()},
        "people": len(found.people),
        "objects": found.environment.boxes,
    }


def _next(options):
    """The command that learns from what was observed."""
    words = ["learn", options.log, "--map", options.map, *said(options)]
    return command(*words, "--out", unused(Path(options.out).with_name("task.json"), ".png"))


def said(options):
    """The options by which a log is read and observed, where they are not the usual ones.

    Parameters
    ----------
    options : argparse.Namespace

    Returns
    -------
    list of str
    """
    words = [] if options.topic is None else ["--topic", options.topic]
    words += [] if options.fov is None else ["--fov", f"{np.degrees(options.fov):.12g}"]
    words += [f"--user={_who(options.user)}"] if options.user != "fastest" else []
    return words + (["--min-area", options.min_area] if options.min_area != 0.01 else [])


def _who(user):
    """Who the user is, as the command line has it."""
    return ",".join(f"{each:.12g}" for each in user) if isinstance(user, tuple) else user


def _write_track(user, path):
    """The user's trajectory as a table."""
    with whole_file(path, "w", TRAJECTORY) as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerows([("t", "x", "y", "occluded"), *_rows(user)])


def _write_people(people, path):
    """Everybody's trajectories as a table, by the number of each."""
    with whole_file(path, "w", EVERYBODY) as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(("t", "x", "y", "occluded", "person"))
        for k, who in enumerate(people):
            table.writerows((*row, k) for row in _rows(who))


def _rows(track):
    """A track's times as the log has them, positions in m, and whether it was out of sight."""
    columns = track.t.tolist(), *track.positions.T.tolist(), track.occluded.tolist()
    for t, x, y, occluded in zip(*columns, strict=True):
        yield repr(t), f"{x:.4f}", f"{y:.4f}", occluded


def _draw_observation(found, background, path):
    """The user's way and the static objects on the map, as a picture."""
    from dollop import plot

    def draw(ax):
        plot.grid_map(ax, background)
        plot.boxes(ax, found.environment.boxes, "static objects")
        plot.path(ax, found.user.positions, "user")
        ax.plot(*found.user.positions[0], "o", color=plot.USER, markersize=6, label="begin")

    with whole_file(path, kind=PNG) as stream:
        stream.write(plot.png(draw))
