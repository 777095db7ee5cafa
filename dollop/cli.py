"""Command line: dollop map, dollop observe, dollop data, dollop study."""

import argparse
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

from dollop import plot
from dollop.formats.files import check_writable, whole_file
from dollop.formats.logs import read_log, write_log
from dollop.gridmap import OccupancyGrid, check_is_map
from dollop.observation import observe
from dollop.replication import study

LEG_HEIGHT = "at leg height a walker is two small blobs: try --min-area 0.0025 --stride 0.6"


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
    log = argparse.ArgumentParser(add_help=False)
    log.add_argument("log", help="CARMEN log (.log, .log.gz, .clf) or ROS bag")
    log.add_argument("--topic", help="which LaserScan topic of a bag; needed only if there are several")
    build = commands.add_parser("map", parents=[log], help="build a background map from a laser log with known poses")
    build.add_argument("map", help="what to write: .yaml (ROS map_server) or .map (CARMEN)")
    build.add_argument("--resolution", type=float, default=0.05, help="m per cell (default: 0.05)")
    build.set_defaults(run=build_map)
    watch = commands.add_parser("observe", parents=[log], help="track the user in a laser log")
    watch.add_argument("map", help="background map: .yaml (ROS map_server) or .map (CARMEN)")
    watch.add_argument("--min-area", type=float, default=0.01, help="smallest foreground object in m^2 (default: 0.01)")
    watch.add_argument("--stride", type=float, default=0.0, help="blobs nearer than this in m are one (default: 0)")
    watch.add_argument(
        "--out", default="user.csv", help="the trajectory, a .csv; a .png of the same name lands beside it"
    )
    watch.set_defaults(run=observe_log)
    data = commands.add_parser("data", help="remake the recordings that the notebooks read")
    data.add_argument("--folder", type=Path, default=Path("data"), help="where to write (default: data)")
    data.set_defaults(run=record_data)
    study.add_arguments(commands.add_parser("study", help="test the paper's claims over many seeds"))
    return root


def build_map(options):
    """dollop map LOG MAP"""
    check_is_map(options.map)
    check_writable(options.map)
    OccupancyGrid.from_log(read_log(options.log, options.topic), options.resolution).save(options.map)
    print(f"wrote {options.map}")


def observe_log(options):
    """dollop observe LOG MAP"""
    out, picture = outputs(options)
    log, background = read_log(options.log, options.topic), OccupancyGrid.load(options.map)
    observation = observe(log, background, min_area=options.min_area, stride=options.stride)
    user = observation.user
    if user is None:
        text = f"nobody moves in {options.log}: there are {len(observation.tracks)} tracks, none is fast"
        raise ValueError(f"{text}; {LEG_HEIGHT}")
    columns = {"t": user.t, "x": user.positions[:, 0], "y": user.positions[:, 1], "occluded": user.occluded}
    with whole_file(out, "w") as stream:
        pd.DataFrame(columns).to_csv(stream, index=False, float_format="%.4f")
    with plot.style():
        figure, ax = plt.subplots()
        plot.grid_map(ax, background)
        plot.boxes(ax, observation.environment.boxes, "static objects")
        plot.path(ax, user.positions, "user")
        plot.plane(ax).legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        with whole_file(picture) as stream:
            figure.savefig(stream)
        plt.close(figure)
    walked = np.linalg.norm(np.diff(user.positions, axis=0), axis=1).sum()
    print(f"the user walked {walked:.1f} m in {user.t[-1] - user.t[0]:.1f} s, lost {observation.losses} times;")
    print(f"{len(observation.environment.boxes)} static objects; wrote {out} and {picture}")


def outputs(options):
    """Paths of the trajectory and of its picture, once it is clear that both can be written and cover no input."""
    out = Path(options.out)
    if out.suffix != ".csv":
        raise ValueError(f"--out must be named .csv (its picture, .png, lands beside it), got {out}")
    if out.with_suffix("").resolve() == Path(options.map).with_suffix("").resolve():
        raise ValueError(f"--out must have another name than the map, whose picture it may replace, got {out}")
    for path in (out, out.with_suffix(".png")):
        check_writable(path)
    return out, out.with_suffix(".png")


def record_data(options):
    """dollop data"""
    from dollop.replication import recordings

    options.folder.mkdir(parents=True, exist_ok=True)
    check_writable(options.folder / "lab.yaml")
    write_log(options.folder / "empty_lab.log.gz", recordings.empty_lab())
    recordings.background_map().save(options.folder / "lab.yaml")
    scenes = {"figure_eights": recordings.figure_eights()}
    scenes |= {f"slalom_{k}": recordings.slalom_recording(k) for k in (0, 1)}
    scenes |= {f"moved_cans_{k}": recordings.moved_cans(k) for k in range(len(recordings.LAYOUTS))}
    scenes["moved_cones"] = recordings.moved_cones()
    for name, recording in scenes.items():
        recording.save(options.folder / f"{name}.log.gz")
    print(f"wrote empty_lab, lab, {', '.join(scenes)} into {options.folder}/")


if __name__ == "__main__":
    main()
