"""dollop export: a task as what other robots' software drives."""

import dollop
from dollop.cli.naming import unused
from dollop.cli.telling import Result, command, tell
from dollop.cli.watching import check_kind
from dollop.formats.kinds import TASK
from dollop.formats.writing import check_outputs

__all__ = ["run"]


def run(options):
    """Export, dollop export TASK.json --to nav2|waypoints|csv --out FILE.

    Parameters
    ----------
    options : argparse.Namespace
        Of the command line.

    Raises
    ------
    ValueError
        For a target that is not known, or a file that is not named as it should be.
    """
    from dollop.route import export, export_outputs

    check_outputs(export_outputs(options.out, options.to), [options.task])
    check_kind("TASK", options.task, [TASK])
    route = export(dollop.Task.load(options.task), options.out, options.to)
    nodes, length = len(route.places), route.lengths.sum()
    near = f"at most {1000 * route.deviation:.1f} mm from the way of the law"
    line = f"{nodes} places over {length:.1f} m, {near}"
    look = command("show", options.out, "--out", unused(f"{options.out}.png"))
    data = {
        "places": nodes,
        "length": length,
        "deviation": route.deviation,
        "clearance": route.clearance,
    }
    tell(Result((line,), (options.out,), look, route.notes, data), options.json)
