"""The gallery: every panel with its caption, what to look at, and its numbers, as one page of
Markdown.

Captions carry no measured numbers: those come from metrics.json, so that they cannot drift apart.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Panel:
    """What is written beside a panel.

    Attributes
    ----------
    caption : str
        What it shows, after the paper's caption.
    look : str
        What to look at, and what to make of it.
    columns : dict
        Where the numbers are of several things: how their names end in metrics.json, and what each
        thing is.
    """

    caption: str
    look: str
    columns: dict


def panel(caption, look, **columns):
    """A Panel; `plain="..."` is a column of numbers whose names end in _plain, `own="..."` of those
    that do not.
    """
    return Panel(caption, look, {"" if end == "own" else f"_{end}": words for end, words in columns.items()})


PANELS = {
    "1": panel(
        "The mobile robot used in these experiments, Agent Orange.",
        "A Pioneer 2 DX with its real dimensions: two driven wheels, a castor, and the SICK on top. The paper has "
        "a photograph; this is the model that the simulation drives.",
    ),
    "2": panel(
        "Conceptual flow diagram of Dollop.",
        "Bold is the paper's word for a stage, under it the function that does it and the record that it returns. "
        "What stands in the left frame happens once per demonstration; the right one brings all demonstrations "
        "together. No arrow points back.",
    ),
    "3": panel(
        "Sample laser scan.",
        "The robot sits at the bottom. Every dot is where a beam ended; behind each can and behind the user lies "
        "a shadow. Nothing in the scan says which dots are a person.",
    ),
    "4": panel(
        "Flow diagram for observing the user.",
        "Every stage with its own intermediate picture. The background map explains walls and desks (grey dots); "
        "what is left are foreground cells (blue). They go two ways. A quick foreground grid follows the user: the "
        "darker a cell, the more often it was hit of late; its blobs are the foreground objects, each with its "
        "centroid (plus), and tracking these tells the user (blue) from what stands still. A second, slower grid "
        "forgets the user and keeps the static objects. The two stages of the slower grid are drawn after the whole "
        "recording, all others at one moment of it.",
    ),
    "5": panel(
        "Example setup of the laboratory with two obstacles in the workspace.",
        "Two trash cans about four metres apart among desks and stools; the robot watches from the wall.",
    ),
    "6a": panel(
        "The track of the user during five demonstrations of a figure-eight.",
        "Orange dots are Kalman predictions, made while the user was out of sight behind a can. The bias is no "
        "error of tracking: a laser sees only the near side of a body. The track error is what remains without "
        "it.",
    ),
    "6b": panel(
        "The subgoals and control law extracted from the demonstrations.",
        "Crosses are subgoals, where one LDS hands over to the next; the green line is the response of the "
        "sequenced LDS started where the laps start, the arrowheads say which way it is walked. At some subgoals it "
        "has a corner: each segment is fitted without regard to the next, and its response arrives along the "
        "direction in which it is slowest. The paper: 6 LDS, 20 mm on average.",
    ),
    "7a": panel(
        "Ten runs of Agent Orange performing the estimated trajectory of Figure 6b.",
        "Left the paper's kind of law, which points along the response and knows nothing of wheels, so that the "
        "robot swings wide in the curves; right the one that respects the robot's dynamics. The fan is the starts, "
        "each a little off. Distances are from the robot to the response from where that run started, not to the "
        "green line, which starts where the laps do.",
        own="plain law",
        pursuit="pursuit",
    ),
    "7b": panel(
        "The response of Agent Orange after being kidnapped.",
        "Five runs, a shade and dashes each. A dotted line leads to where the robot was carried, and the number "
        "there is the run's, the same left and right. The plain law heads for the active subgoal through whatever "
        "is in the way, and the circle is the robot where that first ends in a contact; that the paper's robot hit "
        "nothing was, as it says, a coincidence. Right the same law, which now goes round obstacles: nothing else "
        "differs. One run may touch an obstacle several times, so contacts and runs with a contact are counted "
        "apart. Time to return: until the robot is within ten centimetres of the response from its start and stays "
        "there for a second.",
        own="plain law",
        aware="plain law, going round obstacles",
    ),
    "8": panel(
        "The eight objects on the left must be matched to those on the right.",
        "Here the left ones are above and the right ones below, drawn aside so that every line can be told apart. "
        "The robust matching keeps each box together. The literal cost's lines cross between boxes: forces within "
        "one box outweigh those between boxes, so errors of a few centimetres in a box decide. Corners count from "
        "zero in the numbers: for 1 to 8, in this order, which of a (0) to h (7) it goes to. The two costs have "
        "different units; the margin says how far behind the second-best matching is.",
        own="robust",
        literal="literal",
    ),
    "9": panel(
        "Intuitive representation of the spring optimisation.",
        "Line width grows with the logarithm of the spring constant; arrows are forces. The short springs within a "
        "box dwarf all others, and each force points into its own box as if there were no second one: this is why "
        "the literal matching hangs on the boxes' sizes. The numbers are what these springs lead to: the literal "
        "matching of Figure 8.",
    ),
    "10a": panel(
        "Performing the task of Figure 6b in modified environments: the subgoals.",
        "Grey dotted boxes and grey crosses: before; solid boxes and black crosses: now. The robot found the moved "
        "cans with its own laser. The figure-eight still goes round both.",
    ),
    "10b": panel(
        "Performing the task of Figure 6b in modified environments: the robot's runs.",
        "Purple lines are runs of the simulated robot; the fan is their starts, each a little off. Above the paper's "
        "kind of control, below Dollop's own, from the same starts: it follows the law more closely, and leaves it "
        "only where it is near a can. Clearance is from the robot's rim to the nearest obstacle.",
        plain="plain, obstacles ignored",
        own="pursuit, going round obstacles",
    ),
    "11a": panel(
        "The first demonstration of a task, its subgoals and control law.",
        "A slalom past four cones, as tracked by the laser (thin line), and the law that was made of it (wide line).",
    ),
    "11b": panel(
        "The second demonstration, in a different environment.",
        "The same cones, elsewhere: the walk passes each on the same side as before.",
    ),
    "12a": panel(
        "The CDHMM estimated from the demonstrations of Figure 11, with the most-likely path.",
        "Both demonstrations were mapped to the first one's environment (dots and triangles); then states that the "
        "evidence cannot tell apart were merged. An ellipse is two standard deviations of where a state's subgoal "
        "is expected. With two demonstrations that is nearly all prior: the model starts from the spread below, and "
        "the two subgoals of a state change it little.",
    ),
    "12b": panel(
        "The result after mapping the subgoals to a new environment.",
        "Nobody ever walked among these cones; the fan is the starts of ten runs, the same above and below. Above "
        "the paper's kind of control: the plain law, which knows of no obstacle. It touches a cone, backs off and "
        "gets round it: past the third cone the law leaves less room than the robot needs, for a law is a line, and "
        "moved subgoals do not keep every distance. Below Dollop's own: it goes round what is in the "
        "way, and that alone is why nothing is touched. The circles are the robot where it first touches something.",
        plain="plain, obstacles ignored",
        own="pursuit, going round obstacles",
    ),
    "x1": panel(
        "Beyond the paper: how matching fares when box sizes are uncertain.",
        "Left, objects drawn at random, each moved, and seen with box sizes off by up to so much; the numbers are "
        "at 5 cm. The literal cost loses its way as soon as boxes are not exact. Right, cans and cones that the "
        "simulated laser sees, each layout matched to the first: a laser sees one side of a can and is off by "
        "some centimetres.",
        literal="literal",
        robust="robust",
    ),
    "x2": panel(
        "Beyond the paper: learning a task from more and more demonstrations.",
        "Left, how often a method finds the right subgoals in the right order, bars being 95 % intervals; right, "
        "how far off they are where their number is right. Dotted is the error to be expected of the mean of so "
        "many subgoals, which falls as one over the root of their number; merging, which has no more to go by, "
        "should lie on it, and lies a little to one side by chance, as these seeds drew. The two hidden Markov "
        "models take far longer and get fewer seeds.",
        merging="merging",
        mean="plain mean",
        hmm="HMM, BIC",
        left_to_right="left-to-right HMM, BIC",
    ),
}

NAMES = {  # name in metrics.json, without the end that says of what: words, and the unit
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
    "matching_right": ("layouts matched right", ""),
    "layouts": ("layouts", ""),
    "states_before": ("states before merging", ""),
    "states_after": ("states after", ""),
    "path_length": ("states on the most-likely path", ""),
    "spread_m": ("prior spread, one standard deviation", "m"),
    "mean_sd_m": ("standard deviation of a state, mean", "m"),
    "passed_on_the_demonstrated_side": ("runs that pass every cone on the demonstrated side", ""),
    **{f"{n}_objects": (f"{n} objects, sizes off by 5 cm: share right", "") for n in (2, 3, 4)},
    "cans_seen": ("2 cans seen by the laser: share right", ""),
    "cones_seen": ("4 cones seen by the laser: share right", ""),
    "seeds": ("seeds", ""),
    **{f"right_{n}": (f"{n} demonstrations: share right", "") for n in (2, 5, 10)},
    **{f"error_m_{n}": (f"{n} demonstrations: mean error", "m") for n in (2, 5, 10)},
    "exponent": ("error falls with the number to the power of", ""),
    "error_by_expected": ("error, as a share of the expected one", ""),
}

HEAD = """\
# The figures

Every panel, drawn by `make figures` from nothing but seeds, with its caption, what to look at, and the numbers behind
it. This page is written by the same command, from [metrics.json](metrics.json). Names of panels are the paper's; those
that begin with x are not in the paper.
"""


def page(metrics, picture_of):
    """The gallery as Markdown.

    Parameters
    ----------
    metrics : dict
        Numbers by panel id, as in metrics.json; panels without an entry are left out.
    picture_of : callable
        From a panel id to the name of its picture.

    Returns
    -------
    str
    """
    shown = [name for name in PANELS if name in metrics]
    return "\n".join([HEAD, *(section(name, metrics[name], picture_of(name)) for name in shown)])


def section(name, numbers, picture):
    """One panel: heading, picture, what to look at, numbers."""
    words = PANELS[name]
    parts = [
        f"## Figure {name}",
        f"*{words.caption}*",
        f"![Figure {name}: {words.caption}]({picture})",
        f"**What to look at.** {words.look}",
    ]
    return "\n\n".join(parts + ([table(numbers, words.columns)] if numbers else [])) + "\n"


def table(numbers, columns):
    """Numbers as a Markdown table, a column for each thing that they are of.

    >>> print(table({"mean_error_m": 0.013071, "n_segments": 6}, {}))
    | | |
    |---|---|
    | mean error of the law | 13 mm |
    | segments, an LDS each | 6 |
    >>> print(table({"runs": 5, "finished": 4, "finished_aware": 5}, {"": "plain law", "_aware": "going round"}))
    | | plain law | going round |
    |---|---|---|
    | runs | 5 | |
    | runs that finished | 4 | 5 |
    """
    rows = {}
    for key, value in numbers.items():
        name, end = parted(key, columns)
        rows.setdefault(name, {})[end] = quantity(value, NAMES[name][1])
    ends = columns or {"": ""}
    lines = [["", *ends.values()], ["---"] * (len(ends) + 1)]
    lines += [[NAMES[name][0], *(cells.get(end, "") for end in ends)] for name, cells in rows.items()]
    return "\n".join(line(cells) for cells in lines)


def line(cells):
    """One line of a Markdown table."""
    if set(cells) == {"---"}:
        return "|" + "|".join(cells) + "|"
    return "|" + "|".join(f" {cell} " if cell else " " for cell in cells) + "|"


def parted(key, ends):
    """A key of metrics.json as its name in NAMES and which of `ends` it ends in.

    >>> parted("finished_aware", {"": "plain law", "_aware": "going round"})
    ('finished', '_aware')

    Raises
    ------
    KeyError
        A number that nobody has named in words.
    """
    for end in sorted(ends or {""}, key=len, reverse=True):
        name = key.removesuffix(end)
        if key.endswith(end) and name in NAMES:
            return name, end
    raise KeyError(f"no words for the number {key!r}: add them to NAMES")


def quantity(value, unit=""):
    """A number with its unit, to the digits worth reading.

    >>> quantity(8.421228, "s"), quantity(1.2, "m"), quantity(0.98)
    ('8.4 s', '1.20 m', '0.98')
    """
    if value is None:
        return "none"
    if isinstance(value, list):
        return " ".join(map(str, value))
    if unit == "m":
        return f"{1000 * value:.0f} mm" if abs(value) < 1 else f"{value:.2f} m"
    if unit:
        return f"{value:.1f} {unit}"
    return f"{value:.3g}" if isinstance(value, float) and abs(value) < 100 else f"{value:.0f}"
