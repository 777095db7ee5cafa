"""The command line: dollop map, observe, data, study; each command loads only what it needs."""

import argparse
import os
import sys
from importlib import import_module
from pathlib import Path

import numpy as np

import dollop
from dollop.formats.kinds import EVERYBODY, PNG, TRAJECTORY
from dollop.formats.writing import Output, check_outputs, together, whole_file
from dollop.gridmap import map_inputs, map_outputs
from dollop.people import moving_speed
from dollop.trajectory import arc_length

__all__ = ["in_one_line", "main", "replication"]

STOPPED = 130
"""Exit status of a command that was interrupted: 128 and the number of the signal."""
IN_DOUBT = 3
"""Exit status of a command that is done, with notes that put its result in doubt."""


def main(arguments=None):
    """Run one command; what is refused, or interrupted, ends with one line.

    A bad file or value, and Ctrl-C, are told without a traceback.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the shell by default.

    Raises
    ------
    SystemExit
        With 1 and the message for what is refused, 2 for a usage that is none, 130 when
        interrupted.
    """
    root, commands = _parser()
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and not arguments[0].startswith("-") and arguments[0] not in commands:
        print(f"dollop: no command {arguments[0]!r}; known: {', '.join(commands)}", file=sys.stderr)
        sys.exit(2)
    options = root.parse_args(arguments)
    in_one_line("dollop", options.run, options)


def in_one_line(program, work, *arguments):
    """Do the work of a command; what is refused, or interrupted, ends it with one line.

    Parameters
    ----------
    program : str
        Who says it.
    work : callable
    *arguments : object
        What the work takes.

    Raises
    ------
    SystemExit
        With 1 and the message for what is refused, 130 when interrupted. If nobody reads what it
        says (a pipe that is closed) the work is done all the same, and the status 1.
    """
    try:
        work(*arguments)
        sys.stdout.flush()
    except BrokenPipeError:
        # Or Python would say so once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (ValueError, OSError, ImportError, OverflowError) as error:
        sys.exit(f"{program}: {error}")
    except KeyboardInterrupt as stop:
        print(f"\n{program}: stopped{f'; {stop}' if stop.args else ''}", file=sys.stderr)
        sys.exit(STOPPED)


def _parser():
    """The parser of all commands, and their names."""
    about = "Learning by observation with a mobile robot."
    root = argparse.ArgumentParser(prog="dollop", description=about)
    root.add_argument("--version", action="version", version=f"dollop {dollop.__version__}")
    commands = root.add_subparsers(required=True, metavar="command")
    log = argparse.ArgumentParser(add_help=False)
    log.add_argument("log", help="CARMEN log (.log, .log.gz, .clf) or ROS bag")
    log.add_argument("--topic", help="LaserScan topic of a bag, if there are several")
    log.add_argument(
        "--fov",
        type=degrees,
        metavar="DEGREES",
        help="field of view, if the log does not state it",
    )

    def command(run, name, help, *parents):
        parser = commands.add_parser(name, parents=parents, help=help)
        parser.set_defaults(run=run)
        return parser.add_argument

    add = command(_map, "map", "build a background map from a log with known poses", log)
    add("map", help="what to write: .yaml (ROS map_server) or .map (CARMEN)")
    add("--resolution", type=number, default=0.05, help="m per cell (default: 0.05)")
    add = command(_observe, "observe", "track the user in a laser log", log)
    add("map", help="background map: .yaml (ROS map_server) or .map (CARMEN)")
    add(
        "--user",
        type=_user,
        default="fastest",
        metavar="WHO",
        help="fastest (default), a place X,Y or a number",
    )
    add("--tracks", metavar="FILE", help="everybody's trajectories, a .csv")
    add(
        "--min-area",
        type=number,
        default=0.01,
        help="smallest foreground object in m^2 (default: 0.01)",
    )
    add(
        "--out",
        default="user.csv",
        help="the trajectory (default: user.csv); a .png lands beside it",
    )
    add = command(_data, "data", "remake the recordings that the notebooks read")
    add("--folder", type=Path, default=Path("data"), help="where to write (default: data)")
    add = command(
        _study,
        "study",
        "test the paper's claims over many seeds, or the whole chain in random worlds",
    )
    add(
        "ids",
        nargs="*",
        metavar="claim",
        help="which (default: all); an unknown one lists them; worlds: random worlds",
    )
    add("--seeds", type=whole, help="how many (default: 100; 300 worlds)")
    add("--first-seed", type=whole, default=0, metavar="N", help="of the worlds (default: 0)")
    add("--quick", action="store_true", help="3 seeds, or 11 worlds, for a look")
    add("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://host:8786")
    add("--folder", type=Path, help="for the table (default: study; study-quick with --quick)")
    return root, tuple(commands.choices)


def number(text):
    """A number as people write it: to Python 1_0 is ten."""
    return float(text if text.isascii() and "_" not in text else "no number")


def whole(text):
    """A whole number, likewise."""
    return int(text if text.isascii() and "_" not in text else "no number")


def degrees(text):
    """The angle in rad that so many degrees are."""
    return float(np.radians(number(text)))


def replication(module):
    """A module of the replication, which a library that was installed without it does not have.

    Parameters
    ----------
    module : str
        Its name in `dollop.replication`.

    Returns
    -------
    module

    Raises
    ------
    ImportError
        If the replication is not part of this installation.
    """
    try:
        return import_module(f"dollop.replication.{module}")
    except ModuleNotFoundError as error:
        if not error.name.startswith("dollop.replication"):
            raise
        raise ImportError("the replication is not part of this installation") from None


def _map(options):
    """dollop map LOG MAP"""
    check_outputs(map_outputs(options.map), [options.log])
    log = dollop.read_log(options.log, options.topic, options.fov)
    dollop.OccupancyGrid.from_log(log, options.resolution).save(options.map)
    print(f"wrote {options.map}")


def _user(text):
    """Who the user is, as `dollop.observe` takes it: fastest, a place X,Y, or a number."""
    if text == "fastest":
        return text
    try:
        return tuple(map(number, text.split(","))) if text.count(",") == 1 else whole(text)
    except ValueError:
        rule = "fastest, a place X,Y in m, or a number"
        raise argparse.ArgumentTypeError(f"WHO must be {rule}, got {text!r:.60}") from None


def _observe(options):
    """dollop observe LOG MAP"""
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


def _data(options):
    """dollop data"""
    written = replication("recordings").save_all(options.folder)
    print(f"wrote {', '.join(written)} into {options.folder}/")


def _study(options):
    """dollop study [CLAIM ...], or dollop study worlds"""
    replication("study").command(options)


if __name__ == "__main__":
    main()
