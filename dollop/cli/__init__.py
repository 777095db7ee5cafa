"""The command line: dollop map, observe, data, study; each command loads only what it needs."""

import argparse
import os
import sys
from importlib import import_module
from pathlib import Path

import dollop
from dollop.cli.options import degrees, number, user, whole

__all__ = ["in_one_line", "main", "replication"]

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

    add = command("mapping", "map", "build a background map from a log with known poses", log)
    add("map", help="what to write: .yaml (ROS map_server) or .map (CARMEN)")
    add("--resolution", type=number, default=0.05, help="m per cell (default: 0.05)")
    add = command("observing", "observe", "track the user in a laser log", log)
    add("map", help="background map: .yaml (ROS map_server) or .map (CARMEN)")
    add(
        "--user",
        type=user,
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
