"""The gallery: every panel with its caption, what to look at, and its numbers, as one page of Markdown.

Captions carry no numbers: those come from metrics.json, so that they cannot drift apart.
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
    """

    caption: str
    look: str


PANELS = {
    "1": Panel(
        "The mobile robot used in these experiments, Agent Orange.",
        "A Pioneer 2 DX with its real dimensions: two driven wheels, a castor, and the SICK on top. The paper has "
        "a photograph; this is the model that the simulation drives.",
    ),
    "2": Panel(
        "Conceptual flow diagram of Dollop.",
        "Bold is the paper's word for a stage, under it the function that does it and the record that it returns. "
        "What stands in the left frame happens once per demonstration; the right one brings all demonstrations "
        "together. No arrow points back.",
    ),
    "3": Panel(
        "Sample laser scan.",
        "The robot sits at the bottom. Every dot is where a beam ended; behind each can and behind the user lies "
        "a shadow. Nothing in the scan says which dots are a person.",
    ),
    "4": Panel(
        "Flow diagram for observing the user.",
        "Every stage with its own intermediate picture, all of the same moment. In the third the background map "
        "has explained walls and desks (grey dots); what is left is foreground (blue).",
    ),
    "5": Panel(
        "Example setup of the laboratory with two obstacles in the workspace.",
        "Two trash cans about four metres apart among desks and stools; the robot watches from the wall.",
    ),
    "6a": Panel(
        "The track of the user during five demonstrations of a figure-eight.",
        "Orange dots are Kalman predictions, made while the user was out of sight behind a can. The bias is no "
        "error of tracking: a laser sees only the near side of a body. The track error is what remains without "
        "it.",
    ),
    "6b": Panel(
        "The subgoals and control law extracted from the demonstrations.",
        "Crosses are subgoals, where one LDS hands over to the next; the green line is the response of the "
        "sequenced LDS started where the laps start. The paper: 6 LDS, 20 mm on average.",
    ),
    "7a": Panel(
        "Ten runs of Agent Orange performing the estimated trajectory of Figure 6b.",
        "Left the paper's law, which points along the response and knows nothing of wheels, so that the robot "
        "swings wide in the curves; right the law that respects the robot's dynamics (the numbers that end in "
        "pursuit). The fans are the starts, each a little off. Distances are between robot and response.",
    ),
    "7b": Panel(
        "The response of Agent Orange after being kidnapped.",
        "Dotted lines are where it was carried. The plain law heads for the active subgoal through whatever is in "
        "the way; that the paper's robot hit nothing was, as it says, a coincidence. Right, the law that goes "
        "round obstacles (the numbers that end in aware).",
    ),
    "8": Panel(
        "The eight objects on the left must be matched to those on the right.",
        "Solid lines keep each box together. The dashed ones, the literal cost's, cross between boxes: forces "
        "within one box outweigh those between boxes, so errors of a few centimetres in a box decide. The two "
        "costs have different units; the margin says how far behind the second-best matching is.",
    ),
    "9": Panel(
        "Intuitive representation of the spring optimisation.",
        "Line width is the spring constant, arrows are forces. Enlarged, the short springs of a box's own edges "
        "dwarf all others, which is why the literal matching hangs on the box's size.",
    ),
    "10a": Panel(
        "Performing the task of Figure 6b in modified environments: the subgoals.",
        "Dotted boxes and pale crosses: before; solid boxes and black crosses: now. The robot found the moved "
        "cans with its own laser. The figure-eight still goes round both.",
    ),
    "10b": Panel(
        "Performing the task of Figure 6b in modified environments: the robot's runs.",
        "Purple lines are runs of the simulated robot from slightly different starts; clearance is from its rim "
        "to the nearest obstacle.",
    ),
    "11a": Panel(
        "The first demonstration of a task, its subgoals and control law.",
        "A slalom past four cones, as tracked by the laser. The law hides the track where the two agree.",
    ),
    "11b": Panel(
        "The second demonstration, in a different environment.",
        "The same cones, elsewhere: the walk passes each on the same side as before.",
    ),
    "12a": Panel(
        "The CDHMM estimated from the demonstrations of Figure 11, with the most-likely path.",
        "Both demonstrations were mapped to the first one's environment; then states that the evidence cannot "
        "tell apart were merged. An ellipse is what the demonstrations leave open about a subgoal: two standard "
        "deviations.",
    ),
    "12b": Panel(
        "The result after mapping the subgoals to a new environment.",
        "Nobody ever walked among these cones. The purple runs pass each on the side that was demonstrated.",
    ),
    "x1": Panel(
        "Beyond the paper: how matching fares when box sizes are uncertain.",
        "The literal cost loses its way as soon as boxes are not exact, and a laser that sees one side of a can "
        "is off by some centimetres. Numbers: the share of layouts with every corner right, by method and number "
        "of objects, at 5 cm.",
    ),
    "x2": Panel(
        "Beyond the paper: learning a task from more and more demonstrations.",
        "Left, how often a method finds the right subgoals in the right order; right, how far off they are when "
        "it does. Merging should fall along the dotted line: the best that averaging can do. In the names of the "
        "numbers the last figure counts demonstrations.",
    ),
}

HEAD = """\
# The figures

Every panel, drawn by `make figures` from nothing but seeds, with its caption, what to look at, and the numbers behind
it. This page is written by the same command, from [metrics.json](metrics.json). Names of panels are the paper's; those
that begin with x are not in the paper.
"""

UNITS = {"m": "m", "s": "s", "deg": "°"}


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
    shown = [panel for panel in PANELS if panel in metrics]
    return "\n".join([HEAD, *(section(panel, metrics[panel], picture_of(panel)) for panel in shown)])


def section(panel, numbers, picture):
    """One panel: heading, picture, what to look at, numbers."""
    words = PANELS[panel]
    parts = [
        f"## Figure {panel}",
        f"*{words.caption}*",
        f"![Figure {panel}: {words.caption}]({picture})",
        f"**What to look at.** {words.look}",
    ]
    return "\n\n".join(parts + ([table(numbers)] if numbers else [])) + "\n"


def table(numbers):
    """Numbers as a Markdown table.

    >>> print(table({"mean_error_m": 0.013071, "n_segments": 6}))
    | number | |
    |---|---|
    | mean error | 13 mm |
    | n segments | 6 |
    """
    rows = (f"| {name(key)} | {quantity(key, value)} |" for key, value in numbers.items())
    return "\n".join(["| number | |", "|---|---|", *rows])


def name(key):
    """A key of metrics.json as words, without its unit."""
    return " ".join(word for word in key.split("_") if word not in UNITS)


def quantity(key, value):
    """A number with the unit that its key names, to the digits worth reading.

    >>> quantity("return_time_s_aware", 8.421228), quantity("bias_m", 1.2), quantity("right_merging_2", 0.98)
    ('8.4 s', '1.20 m', '0.98')
    """
    unit = next((UNITS[word] for word in key.split("_") if word in UNITS), "")
    if value is None:
        return "none"
    if isinstance(value, list):
        return " ".join(map(str, value))
    if unit == "m":
        return f"{1000 * value:.0f} mm" if abs(value) < 1 else f"{value:.2f} m"
    if unit:
        return f"{value:.1f} {unit}"
    return f"{value:.3g}" if isinstance(value, float) and abs(value) < 100 else f"{value:.0f}"
