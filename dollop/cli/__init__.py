"""The command line, from a log to a robot: each command loads only what it needs."""

import argparse
import os
import sys
import warnings
from importlib import import_module
from pathlib import Path

import dollop
from dollop.cli.options import PERFORMED, degrees, number, numbers, user, whole, wholes

__all__ = ["in_one_line", "main", "replication"]

LOG = "CARMEN log (.log, .log.gz, .clf) or ROS bag"
MAP = "map: .yaml (ROS map_server) or .map (CARMEN)"
STOPPED = 130
"""Exit status of a command that was interrupted: 128 and the number of the signal."""


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
    in_one_line("dollop", _run, options)


def _run(options):
    """Load the command, unless it is here, and run it."""
    work = options.run if callable(options.run) else import_module(f"dollop.cli.{options.run}").run
    work(options)


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
        says (a pipe or stream that is closed) the work is done all the same, and the status 1.
    """
    heard = sys.stdout is not None
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed from the beginning, as by >&-
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _once()
            work(*arguments)
        sys.stdout.flush()
        if not heard:
            sys.exit(f"{program}: standard output is closed: what was to be said could not be written")
    except BrokenPipeError:
        # Or Python would say so once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except (ValueError, OSError, ImportError, OverflowError) as error:
        sys.exit(f"{program}: {error}")
    except KeyboardInterrupt as stop:
        print(f"\n{program}: stopped{f'; {stop}' if stop.args else ''}", file=sys.stderr)
        sys.exit(STOPPED)


def _once():
    """What tells each warning as one line, once; a stand-in for `warnings.showwarning`."""
    told = set()

    def tell(message, *_, **__):
        text = " ".join(str(message).split())
        if text not in told:
            told.add(text)
            print(f"note: {text}", file=sys.stderr)

    return tell


def _parser():
    """The parser of all commands, and their names."""
    about = "Learning by observation with a mobile robot."
    root = argparse.ArgumentParser(prog="dollop", description=about)
    root.add_argument("--version", action="version", version=f"dollop {dollop.__version__}")
    commands = root.add_subparsers(required=True, metavar="command")
    log, json, watched = (argparse.ArgumentParser(add_help=False) for _ in range(3))
    add = log.add_argument
    add("--topic", help="LaserScan topic of a bag, if there are several")
    fov = "field of view, if the log does not state it"
    add("--fov", type=degrees, metavar="DEGREES", help=fov)
    json.add_argument("--json", action="store_true", help="say it as one JSON object, for programs")
    add = watched.add_argument
    area = "smallest foreground object in m^2 (default: 0.01)"
    add("--min-area", type=number, default=0.01, help=area)

    def command(run, name, help, *parents):
        parser = commands.add_parser(name, parents=parents, help=help)
        parser.set_defaults(run=run)
        return parser.add_argument

    add = command("mapping", "map", "build a background map from a log with known poses", log, json)
    add("log", help=LOG)
    add("map", help="what to write: .yaml (ROS) or .map (CARMEN); a .png lands beside it")
    add("--resolution", type=number, default=0.05, help="m per cell (default: 0.05)")
    add = command("observing", "observe", "track the user in a laser log", log, watched, json)
    add("log", help=LOG)
    add("map", help=f"background {MAP}")
    who = "fastest (default), a place X,Y or a number"
    add("--user", type=user, default="fastest", metavar="WHO", help=who)
    add("--tracks", metavar="FILE", help="everybody's trajectories, a .csv")
    out = "the trajectory (default: user.csv); a .png lands beside it"
    add("--out", default="user.csv", help=out)
    _add_learn(command("learning", "learn", "learn a task from demonstrations", log, watched, json))
    add = command("adapting", "adapt", "a task where objects stand now", log, watched, json)
    add("task", help="a task, .json")
    add("log", help=f"a look at the objects: {LOG}")
    add("--map", required=True, help=f"background {MAP}")
    which = "where each of the task's objects is now, by number, such as --matching=1,0,-1 (-1: gone)"
    add("--matching", type=wholes, metavar="N,...", help=which)
    add("--turned", action="store_true", help="turn what is shown with the layout")
    add("--out", required=True, metavar="TASK.json", help="the adapted task; may be the same file")
    _add_perform(command("performing", "perform", "let a simulated robot perform a task", json))
    add = command("showing", "show", "a picture and five lines of any file", log, json)
    add("file", help="a log, map, task, run, scene, trajectory or route")
    add("--map", help=f"draw it on this {MAP}")
    add("--out", required=True, metavar="PICTURE.png", help="the picture")
    add = command("exporting", "export", "a task as what other robots' software drives", json)
    add("task", help="a task, .json")
    add("--to", required=True, metavar="TARGET", help="nav2, waypoints or csv")
    add("--out", required=True, metavar="FILE", help=".geojson, .yaml or .csv")
    add = command(_data, "data", "remake the recordings that the notebooks read")
    add("--folder", type=Path, default=Path("data"), help="where to write (default: data)")
    add = command(
        _study,
        "study",
        "test the paper's claims over many seeds and choices, or the whole chain in random worlds",
    )
    add(
        "ids",
        nargs="*",
        metavar="claim",
        help="which (default: all), an unknown one lists them; or criteria, universes, people or worlds",
    )
    add("--seeds", type=whole, help="how many (default: 200; 300 worlds)")
    add("--first-seed", type=whole, metavar="N", help="default: 1000; 0 for worlds")
    add("--quick", action="store_true", help="3 seeds, or 11 worlds, for a look")
    add("--scheduler", metavar="ADDRESS", help="of a Dask cluster, such as tcp://host:8786")
    add("--folder", type=Path, help="for the table (default: study; study-quick with --quick)")
    return root, tuple(commands.choices)


def _add_learn(add):
    """The arguments of dollop learn."""
    add("logs", nargs="+", metavar="log", help=f"a demonstration each: {LOG}")
    add("--map", required=True, help=f"background {MAP}")
    add("--out", required=True, metavar="TASK.json", help="the task; a .png lands beside it")
    who = "fastest (default), a place X,Y or a number; once, or once for each log"
    add("--user", type=user, action="append", metavar="WHO", help=who)
    how = "anchored (default): in the frames of the objects; paper: as the paper does"
    add("--method", choices=("anchored", "paper"), default="anchored", help=how)
    exact = "mean error in m that each segment of the law keeps (default: 0.02)"
    add("--tolerance", type=number, default=0.02, metavar="M", help=exact)


def _add_perform(add):
    """The arguments of dollop perform; what is not said is as in `PERFORMED`."""
    add("task", help="a task, .json")
    add("--map", required=True, help=f"walls and furniture: {MAP}")
    add("--out", required=True, metavar="RUN.csv", help="the run; a .png lands beside it")
    add("--radius", type=number, metavar="M", help="of the robot (default: 0.25 m)")
    limits = "speed in m/s, turn in rad/s, their accelerations (default: 0.5,0.8,0.5,1.57, a Pioneer's)"
    add("--limits", type=numbers, metavar="V,W,A,B", help=limits)
    add("--period", type=number, metavar="S", help="of the control loop in s (default: 0.1)")
    how = "pursuit (default), or plain, the paper's kind"
    add("--control", choices=("pursuit", "plain"), help=how)
    add("--kidnap", type=whole, metavar="N", help="put the robot N times somewhere else")
    add("--seed", type=whole, help="of when and where to (default: 0)")
    add("--timeout", type=number, metavar="S", help="give up after (default: 600 s)")
    add("--film", metavar="FILE.gif", help="a film of it, too")
    add.__self__.set_defaults(**PERFORMED)


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


def _data(options):
    """dollop data"""
    written = replication("recordings").save_all(options.folder)
    print(f"wrote {', '.join(written)} into {options.folder}/")


def _study(options):
    """dollop study [CLAIM ...], or dollop study worlds"""
    replication("study").command(options)
