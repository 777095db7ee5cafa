"""dollop observe: the user's trajectory in a laser log."""

import sys
from pathlib import Path

import numpy as np

import dollop
from dollop.formats.kinds import EVERYBODY, PNG, TRAJECTORY
from dollop.formats.writing import Output, check_outputs, together, whole_file
from dollop.gridmap import map_inputs
from dollop.people import moving_speed
from dollop.trajectory import arc_length

__all__ = ["IN_DOUBT", "run"]

IN_DOUBT = 3
"""Exit status of a command that is done, with notes that put its result in doubt."""


def run(options):
    """Observe, dollop observe LOG MAP.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.
    """
    out, picture = _outputs(options)
    log = dollop.read_log(options.log, options.topic, options.fov)
    background = dollop.OccupancyGrid.load(options.map)
    found = dollop.observe(log, background, options.user, min_area=options.min_area)
    if found.user is None:
        for note in found.notes:
            print(note, file=sys.stderr)
        raise ValueError(f"nobody walks in {options.log}; tracks of something else: {len(found.tracks)}")
    with together():
        if options.tracks:
            _write_people(found.people, options.tracks)
        _draw_observation(found, background, picture)
        _write_track(found.user, out)
    walked, seconds = arc_length(found.user.positions)[-1], np.ptp(found.user.t)
    hidden = f"out of sight for {found.user.occluded.mean():.0%}"
    print(f"the user walked {walked:.1f} m in {seconds:.1f} s, {hidden}; {len(found.environment)} static objects")
    _tell(found, log.t[0])
    print(f"wrote {', '.join(map(str, filter(None, (out, picture, options.tracks))))}")
    if not found.trusted:
        sys.exit(IN_DOUBT)


def _outputs(options):
    """Paths of the trajectory and its picture, if both can be written and are no input."""
    out = Path(options.out)
    tracks = [Path(options.tracks)] if options.tracks else []
    if any(path.suffix != ".csv" or path == out for path in tracks):
        raise ValueError(f"--tracks must be named .csv, and not as --out, got {options.tracks}")
    if out.suffix != ".csv":
        raise ValueError(f"--out must be named .csv (its picture, .png, lands beside it), got {out}")
    picture = out.with_suffix(".png")
    outputs = [Output(out, TRAJECTORY), Output(picture, PNG)]
    outputs += [Output(path, EVERYBODY) for path in tracks]
    check_outputs(outputs, [options.log, *map_inputs(options.map)])
    return out, picture


def _tell(found, begin):
    """Notes, and who walked where if there is a choice, on the error stream."""
    for note in found.notes:
        print(f"{'doubt' if note.doubt else 'note'}: {note}", file=sys.stderr)
    if len(found.people) > 1 and any(note.kind == "people" for note in found.notes):
        print("say who the user is with --user X,Y or --user NUMBER:", file=sys.stderr)
        for k, who in enumerate(found.people):
            x, y = who.positions[0]
            way = f"{arc_length(who.positions)[-1]:.1f} m at {moving_speed(who):.2f} m/s"
            when = f"{who.t[0] - begin:.1f} to {who.t[-1] - begin:.1f} s"
            print(f"  {k}: from ({x:.2f}, {y:.2f}), {when}, {way}", file=sys.stderr)


def _write_track(user, path):
    """The user's trajectory as a table."""
    with whole_file(path, "w", TRAJECTORY) as stream:
        _table(user).to_csv(stream, index=False, float_format="%.4f")


def _write_people(people, path):
    """Everybody's trajectories as a table, by the number of each."""
    import pandas as pd

    tables = [_table(who).assign(person=k) for k, who in enumerate(people)]
    with whole_file(path, "w", EVERYBODY) as stream:
        pd.concat(tables).to_csv(stream, index=False, float_format="%.4f")


def _table(track):
    """A track's times in s, positions in m, and whether it was out of sight."""
    import pandas as pd

    table = pd.DataFrame(track.positions, columns=["x", "y"])
    table.insert(0, "t", track.t)
    return table.assign(occluded=track.occluded)


def _draw_observation(found, background, path):
    """The user's way and the static objects on the map, as a picture."""
    import matplotlib.pyplot as plt

    from dollop import plot

    with plot.style():
        figure, ax = plt.subplots()
        plot.grid_map(ax, background)
        plot.boxes(ax, found.environment.boxes, "static objects")
        plot.path(ax, found.user.positions, "user")
        plot.plane(ax).legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        try:
            with whole_file(path, kind=PNG) as stream:
                figure.savefig(stream, format="png")
        finally:
            plt.close(figure)
