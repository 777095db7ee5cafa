"""Command line: dollop map, dollop observe, dollop data."""

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dollop import plot, study
from dollop.files import whole_file
from dollop.gridmap import OccupancyGrid
from dollop.logs import read_log, write_log
from dollop.observation import observe


def main(arguments=None):
    """Run one command; a bad file or value ends with its message instead of a traceback."""
    options = parser().parse_args(arguments)
    try:
        options.run(options)
    except (ValueError, OSError, ImportError) as error:
        sys.exit(f"dollop: {error}")


def parser():
    """The commands and their arguments."""
    root = argparse.ArgumentParser(prog="dollop", description="Learning by observation with a mobile robot.")
    commands = root.add_subparsers(required=True, metavar="command")
    build = commands.add_parser("map", help="build a background map from a laser log with known poses")
    build.add_argument("log", help="CARMEN log (.log, .log.gz, .clf) or ROS bag")
    build.add_argument("map", help="what to write: .yaml (ROS map_server) or .map (CARMEN)")
    build.add_argument("--resolution", type=float, default=0.05, help="m per cell (default: 0.05)")
    build.set_defaults(run=build_map)
    watch = commands.add_parser("observe", help="track the user in a laser log")
    watch.add_argument("log", help="CARMEN log (.log, .log.gz, .clf) or ROS bag")
    watch.add_argument("map", help="background map: .yaml (ROS map_server) or .map (CARMEN)")
    watch.add_argument("--out", default="user.csv", help="where the trajectory goes; a .png lands beside it")
    watch.set_defaults(run=observe_log)
    data = commands.add_parser("data", help="remake the recordings that the notebooks read")
    data.add_argument("--folder", type=Path, default=Path("data"), help="where to write (default: data)")
    data.set_defaults(run=record_data)
    study.add_arguments(commands.add_parser("study", help="test the paper's claims over many seeds"))
    return root


def build_map(options):
    """dollop map LOG MAP"""
    OccupancyGrid.from_log(read_log(options.log), options.resolution).save(options.map)
    print(f"wrote {options.map}")


def observe_log(options):
    """dollop observe LOG MAP"""
    log, background = read_log(options.log), OccupancyGrid.load(options.map)
    observation = observe(log, background)
    if observation.user is None:
        raise ValueError(f"nobody moves in {options.log}: there are {len(observation.tracks)} tracks, none is fast")
    user, out = observation.user, Path(options.out)
    columns = {"t": user.t, "x": user.positions[:, 0], "y": user.positions[:, 1], "occluded": user.occluded}
    with whole_file(out, "w") as stream:
        pd.DataFrame(columns).to_csv(stream, index=False, float_format="%.4f")
    with plot.style():
        figure, ax = plt.subplots()
        plot.grid_map(ax, background)
        plot.boxes(ax, observation.environment.boxes, "static objects")
        plot.path(ax, user.positions, "user")
        plot.plane(ax).legend()
        with whole_file(out.with_suffix(".png")) as stream:
            figure.savefig(stream)
        plt.close(figure)
    walked = np.linalg.norm(np.diff(user.positions, axis=0), axis=1).sum()
    print(f"the user walked {walked:.1f} m in {user.t[-1] - user.t[0]:.1f} s, lost {observation.losses} times;")
    print(f"{len(observation.environment.boxes)} static objects; wrote {out} and {out.with_suffix('.png')}")


def record_data(options):
    """dollop data"""
    from dollop import experiments

    options.folder.mkdir(parents=True, exist_ok=True)
    write_log(options.folder / "empty_lab.log.gz", experiments.empty_lab())
    experiments.background_map().save(options.folder / "lab.yaml")
    recordings = {"figure_eights": experiments.figure_eights()}
    recordings |= {f"slalom_{k}": experiments.slalom_recording(k) for k in (0, 1)}
    recordings |= {f"moved_cans_{k}": experiments.moved_cans(k) for k in range(len(experiments.LAYOUTS))}
    recordings["moved_cones"] = experiments.moved_cones()
    for name, recording in recordings.items():
        recording.save(options.folder / f"{name}.log.gz")
    print(f"wrote empty_lab, lab, {', '.join(recordings)} into {options.folder}/")


if __name__ == "__main__":
    main()
