"""The gallery: every panel with its caption, what to look at, and its numbers, as one page.

Captions and looks stand with the drawings (`dollop.replication.figures`); here are the words and
units of the numbers. Captions carry no measured numbers: those come from metrics.json, so that they
cannot drift apart.
"""

__all__ = ["NAMES", "page"]

NAMES = {
    "beams": ("beams", ""),
    "returns": ("beams that came back", ""),
    "track_error_mean_m": ("track error, mean", "m"),
    "track_error_p95_m": ("track error, 95 % are below", "m"),
    "track_error_max_m": ("track error, largest", "m"),
    "bias_m": ("near-side bias", "m"),
    "occluded_s": ("time that the user was occluded", "s"),
    "losses": ("times that the user was lost", ""),
    "n_segments": ("segments, an LDS each", ""),
    "mean_error_m": ("mean error of the law", "m"),
    "mean_error_laps_m": ("mean error to the single laps", "m"),
    "tolerance_m": ("tolerance asked for", "m"),
    "largest_corner_deg": ("largest corner of the law, at a subgoal", "°"),
    "runs": ("runs", ""),
    "finished": ("runs that finished", ""),
    "collisions": ("contacts with an obstacle, in all runs", ""),
    "runs_with_collision": ("runs with a contact", ""),
    "mean_distance_m": ("distance to the response, mean", "m"),
    "max_distance_m": ("distance to the response, largest", "m"),
    "min_clearance_m": ("least clearance of the rim, as a circle", "m"),
    "localisation_error_m": ("error of the estimated position, mean", "m"),
    "localisation_error_deg": ("error of the estimated heading, mean", "°"),
    "return_time_s": ("time to return, mean", "s"),
    "indices": ("goes to corner", ""),
    "cost": ("cost", ""),
    "margin": ("margin to the second best", ""),
    "probability": ("probability of the matching", ""),
    "matching_right": ("layouts matched right", ""),
    "layouts": ("layouts", ""),
    "states_before": ("states before merging", ""),
    "states_after": ("states after", ""),
    "path_length": ("states on the most-likely path", ""),
    "demonstrations": ("demonstrations", ""),
    "states_aside": ("states beside the most-likely path", ""),
    "spread_m": ("prior spread, one standard deviation", "m"),
    "mean_sd_m": ("standard deviation of a state, mean", "m"),
    "passed_on_the_demonstrated_side": ("runs that pass every cone on the demonstrated side", ""),
    **{f"{n}_objects": (f"{n} objects, sizes off by 5 cm: share right", "") for n in (2, 3, 4)},
    **{f"{n}_objects_told": (f"{n} objects: mean probability told", "") for n in (2, 3, 4)},
    "cans_seen": ("2 cans seen by the laser: share right", ""),
    "cones_seen": ("4 cones seen by the laser: share right", ""),
    "seeds": ("seeds", ""),
    **{f"right_{n}": (f"{n} demonstrations: share right", "") for n in (2, 5, 10)},
    **{f"error_m_{n}": (f"{n} demonstrations: mean error", "m") for n in (2, 5, 10)},
    **{f"longer_right_{n}": (f"tasks of 8 to 15 subgoals, {n} demonstrations: share right", "") for n in (2, 5)},
    "tasks": ("tasks", ""),
    **{
        f"error_percent_{n}": (
            f"{n} demonstration{'s' * (n > 1)}: median error, of the task's size",
            "%",
        )
        for n in (1, 2, 3, 5, 10)
    },
    "error_percent": ("median error, of the task's size", "%"),
    "exponent": ("error falls with the number to the power of", ""),
    "error_by_expected": ("error, as a share of the expected one", ""),
}
"""Words and unit of each name in metrics.json, without the beginning that says of what."""

HEAD = """\
# The figures

Every panel, drawn by `make figures` from nothing but seeds, with its caption, what to look at, and
the numbers behind it. This page is written by the same command, from [metrics.json](metrics.json).
Names of panels are the paper's; those that begin with x are not in the paper.
"""


def page(panels, metrics):
    """The gallery as Markdown.

    Parameters
    ----------
    panels : iterable of Panel
        In the order of the page.
    metrics : dict
        Numbers by panel id, as in metrics.json; panels without an entry are left out.

    Returns
    -------
    str

    Raises
    ------
    KeyError
        A number that nobody has named in words.
    """
    shown = [panel for panel in panels if panel.id in metrics]
    return "\n".join([HEAD, *(section(panel, metrics[panel.id]) for panel in shown)])


def section(panel, numbers):
    """One panel: heading, picture, what to look at, numbers."""
    parts = [
        f"## Figure {panel.id}",
        f"*{panel.caption}*",
        f"![Figure {panel.id}: {panel.caption}]({panel.picture})",
        f"**What to look at.** {panel.look}",
    ]
    return "\n\n".join(parts + ([table(numbers, panel.columns)] if numbers else [])) + "\n"


def table(numbers, columns):
    """Numbers as a Markdown table, a column for each thing that they are of.

    >>> print(table({"mean_error_m": 0.013071, "n_segments": 6}, {}))
    |  |  |
    | --- | --- |
    | mean error of the law | 13 mm |
    | segments, an LDS each | 6 |
    >>> numbers = {"runs": 5, "plain_finished": 4, "own_finished": 5}
    >>> print(table(numbers, {"plain": "plain law", "own": "going round"}))
    |  | plain law | going round |
    | --- | --- | --- |
    | runs | 5 | 5 |
    | runs that finished | 4 | 5 |
    """
    names = dict.fromkeys(name_of(key, columns) for key in numbers)
    columns = columns or {"": ""}
    lines = [["", *columns.values()], ["---"] * (len(columns) + 1)]
    for name in names:
        words, unit = NAMES[name]
        lines.append([words, *(quantity(of_what(numbers, end, name), unit) for end in columns)])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def of_what(numbers, column, name):
    """The number of this name that is the column's own, else what is told of all, else no number.

    >>> numbers = {"cost": 1.8, "literal_cost": 28268, "own_finished": 10}
    >>> of_what(numbers, "literal", "cost"), of_what(numbers, "robust", "cost")
    (28268, 1.8)
    >>> of_what(numbers, "plain", "finished")
    ''
    """
    return numbers.get(f"{column}_{name}", numbers.get(name, ""))


def name_of(key, columns):
    """The name in NAMES of a key of metrics.json, whichever of the columns it begins with.

    >>> name_of("plain_finished", {"plain": "plain law"}), name_of("runs", {"plain": "plain law"})
    ('finished', 'runs')

    Raises
    ------
    KeyError
        A number that nobody has named in words.
    """
    begun = [key.removeprefix(f"{column}_") for column in columns if key.startswith(f"{column}_")]
    name = begun[0] if begun else key
    if name not in NAMES:
        raise KeyError(f"no words for the number {key!r}: add them to NAMES")
    return name


def quantity(value, unit=""):
    """A number with its unit, to the digits worth reading.

    >>> quantity(8.421228, "s"), quantity(1.2, "m"), quantity(0.98)
    ('8.4 s', '1.20 m', '0.98')
    """
    if value is None or value == "":
        return "none" if value is None else ""
    if isinstance(value, list):
        return " ".join(map(str, value))
    if unit == "m":
        return f"{1000 * value:.0f} mm" if abs(value) < 1 else f"{value:.2f} m"
    if unit:
        return f"{value:.1f} {unit}"
    return f"{value:.3g}" if isinstance(value, float) and abs(value) < 100 else f"{value:.0f}"
