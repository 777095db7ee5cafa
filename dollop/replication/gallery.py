"""The gallery: every panel with its caption, what to look at, and its numbers, as one page.

Captions and looks stand with the drawings (`dollop.replication.figures`); here are the words and
units of the numbers, and what a figure comes to in one line. Neither has measured numbers in it:
those come from metrics.json, so that they cannot drift apart.
"""

import re

__all__ = ["IN_ONE_LINE", "NAMES", "page"]

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
Names of panels are the paper's; those that begin with x are not in the paper. Below each picture is the
same for print, in the width of a column.
"""

OF_THE_PAPER = {
    "1": ("Agent Orange, a Pioneer 2 DX with a SICK LMS 200", "photograph", "rendered model"),
    "2": ("the stages of Dollop", "flow diagram", "with the functions and records behind them"),
    "3": ("one laser scan", "a scan", "{beams} beams"),
    "4": ("how the user is observed, stage by stage", "flow diagram", "the stages' own pictures"),
    "5": ("the laboratory with two trash cans", "photograph", "rendered model"),
    "6a": (
        "the user's track over five figure-eights",
        "one loss",
        "{track_error_mean_m} from the truth on average; near-side bias {bias_m}, of the paper's centroid"
        " {paper_bias_m}; {losses} losses",
    ),
    "6b": (
        "subgoals and control law",
        "6 LDS, 20 mm",
        "{n_segments} LDS, {mean_error_m} to the laps' mean, {mean_error_laps_m} to the single laps;"
        " {paper_mean_error_m} and {paper_mean_error_laps_m} with every LDS alone, as in the paper",
    ),
    "7a": (
        "ten runs of the robot",
        '"fairly close"',
        "of {runs} runs {plain_finished} finish with the paper's kind of control, {plain_mean_distance_m} from the law,"
        " and {plain_runs_with_collision} touch anything; with Dollop's own {own_finished}, {own_mean_distance_m},"
        " and {own_runs_with_collision}",
    ),
    "7b": (
        "five runs, each kidnapped",
        "none hit anything, by coincidence",
        "of {runs} runs {plain_finished} finish with the paper's kind of control, and {plain_runs_with_collision} with"
        " a contact; with Dollop's own, which goes round obstacles, {own_finished} and {own_runs_with_collision}",
    ),
    "8": (
        "matching eight corners",
        "drawing of the idea",
        "both costs match rightly, the literal one by a hair ({literal_margin} of {literal_cost})",
    ),
    "9": ("the springs behind it", "drawing of the idea", "the springs and forces of that matching"),
    "10a": ("moved obstacles: the subgoals", "one layout", "{layouts} layouts, {matching_right} matched rightly"),
    "10b": (
        "moved obstacles: the runs",
        "one layout",
        "of {runs} runs {plain_finished} finish with the paper's kind of control and {plain_runs_with_collision} touch"
        " an obstacle, with Dollop's own {own_finished} and {own_runs_with_collision}",
    ),
    "11a": ("a task shown once", "a demonstration", "a slalom of {n_segments} segments"),
    "11b": ("and again, in a different environment", "a demonstration", "a slalom of {n_segments} segments"),
    "12a": (
        "the merged CDHMM",
        "the most-likely path",
        "{states_before} subgoals merge into {states_after} states",
    ),
    "12b": (
        "performed in a new environment",
        "one environment",
        "of {runs} runs {plain_finished} finish with the paper's kind of control and {plain_runs_with_collision} touch"
        " a cone, with Dollop's own {own_finished} and {own_runs_with_collision}",
    ),
}
BEYOND_IT = {
    "x1": (
        "right matchings against box noise",
        "",
        "two random boxes, sides off by 5 cm: literal {literal_2_objects%}, robust {robust_2_objects%}; two cans as the"
        " laser sees them: {literal_cans_seen%}, {robust_cans_seen%}",
    ),
    "x2": (
        "merging beside hidden Markov models",
        "",
        "right from two demonstrations: merging {merging_right_2%}, a left-to-right hidden Markov model"
        " {left_to_right_right_2%}; of tasks of 8 to 15 subgoals an ergodic one {hmm_longer_right_2%}",
    ),
    "x3": (
        "learning among objects that stand elsewhere each time, beside TP-GMM, ProMP and DMP",
        "",
        "after two demonstrations {anchored_error_percent_2} of the way's size off what the person would do, TP-GMM"
        " {tp_gmm_error_percent_2}, ProMP {promp_error_percent_2}, DMP {dmp_error_percent_2}",
    ),
    "x4": (
        "three demonstrations, one with a detour",
        "",
        "{states_before} subgoals merge into {states_after} states; {states_aside} of them are the detour's, which the"
        " most-likely path leaves aside",
    ),
}
IN_ONE_LINE = OF_THE_PAPER | BEYOND_IT
"""What each panel shows, what the paper has there, and what is here; numbers in braces, % for a share."""

NUMBER = re.compile(r"\{(\w+)(%?)\}")


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
    sections = [section(panel, metrics[panel.id]) for panel in shown]
    return "\n".join([HEAD, overview(shown, metrics), *sections])


def overview(panels, metrics):
    """All of them as one table: what each shows, what the paper has, and what came of it here."""
    head = ["| figure | shows | the paper | here |", "|---|---|---|---|"]
    return "\n".join([*head, *(row(panel, metrics[panel.id]) for panel in panels)]) + "\n"


def row(panel, numbers):
    """One panel in one line, led by a link to its section.

    One that nobody has put into a line has its caption there, and one that was made without the
    line's numbers ends without them.
    """
    shows, paper, here = IN_ONE_LINE.get(panel.id, (panel.caption.rstrip("."), "", ""))
    if all(name in numbers for name, _ in NUMBER.findall(here)):
        here = NUMBER.sub(lambda found: amount(found, numbers, panel.columns), here)
    else:
        here = ""
    return f"| [{panel.id}](#figure-{panel.id}) | {shows} | {paper or '–'} | {here or '–'} |"


def amount(found, numbers, columns):
    """The number that braces stand for."""
    key, percent = found.groups()
    if percent:
        return f"{100 * numbers[key]:.0f} %"
    return quantity(numbers[key], NAMES[name_of(key, columns)][1])


def section(panel, numbers):
    """One panel: heading, picture, its PDF if it has one, what to look at, numbers."""
    parts = [
        f"## Figure {panel.id}",
        f"*{panel.caption}*",
        f"![Figure {panel.id}: {panel.caption}]({panel.picture})",
        *([f"[For print (PDF)]({panel.printed})"] if panel.printed else []),
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
