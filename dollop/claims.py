"""The paper's testable claims, and the experiment behind each: a pure function of a seed that returns numbers.

A claim has one criterion or more: the mean of a number over the seeds, and the range in which the claim wants it; some
numbers have none and are only told. A criterion is met when the whole 95 % interval lies within its range, and clearly
not met when it lies wholly beside it. A claim holds if all its criteria are met; it does not hold if none is and one
clearly is not; otherwise it holds in part.

Seeds are shared: what the laser saw of one seed's walk is recorded once and serves all experiments of that seed.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from dollop.trials import (
    ACCELERATION,
    VELOCITY,
    centroid,
    consistent,
    counterintuitive,
    figure,
    follow,
    generalise,
    greedy,
    interpolation,
    kidnap,
    luck,
    matching_time,
    moved,
    prediction,
    scaled,
    segments,
    several,
    shared,
    stable,
    velocity,
)


@dataclass(frozen=True)
class Criterion:
    """What a claim says of one number.

    Attributes
    ----------
    number : str
        Key of the experiment's result.
    meaning : str
        What it is, with its unit.
    wanted : (float, float) or None
        The claim wants the mean over the seeds in here, the upper end included; None if the number is only told.
    band : (float, float)
        The mean over a hundred seeds lies in here, or something has changed since the study was made. For n seeds it
        is wider by the square root of 100 / n.
    share : bool
        Whether the number is 0 or 1, so that its interval is that of a share (Wilson).
    """

    number: str
    meaning: str
    wanted: tuple
    band: tuple
    share: bool = False


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper that an experiment can test.

    Attributes
    ----------
    id : str
    section : str
        Of the paper.
    quote : str
        Its words.
    experiment : callable
        seed -> dict of numbers; nan where the seed gives none.
    criteria : tuple of Criterion
    setup : str
        What is measured, on what, in a sentence or two.
    timed : bool
        Whether the numbers are times, which no two runs have in common.
    """

    id: str
    section: str
    quote: str
    experiment: Callable
    criteria: tuple
    setup: str
    timed: bool = False


MORE = (0.0, inf)

CLAIMS = {
    claim.id: claim
    for claim in (
        Claim(
            "centroid",
            "II",
            "filter out sensor noise, which seems primarily due to the inconsistent nature of computing the centroid "
            "of a blob",
            centroid,
            (
                Criterion(
                    "laser_sds",
                    "centroid noise per axis, in standard deviations of a reading (5 mm)",
                    (1, inf),
                    (5.45, 5.7),
                ),
                Criterion(
                    "share_without_laser_noise",
                    "share of its variance left with an ideal laser",
                    (0.5, inf),
                    (0.79, 0.83),
                ),
                Criterion("noise_mm", "centroid noise per axis [mm]", None, (27.25, 28.4)),
            ),
            "Centroids of a walker of known path over five figure-eights, the mean distance to the near side taken "
            "out; then the same walk seen by a laser without noise and mixed pixels.",
        ),
        Claim(
            "prediction",
            "II",
            "In our experiments, Kalman predictions were more reliable in modeling occluded foreground-object motion.",
            prediction,
            (
                Criterion(
                    "particles_more_m",
                    "error of particles minus error of Kalman predictions [m]",
                    MORE,
                    (-0.0125, -0.0015),
                ),
                Criterion(
                    "particles_missed_more",
                    "share of reappearances missed by 0.5 m, particles minus Kalman",
                    MORE,
                    (-0.015, 0.02),
                ),
                Criterion("kalman_m", "error of the Kalman predictions [m]", None, (0.1135, 0.1315)),
                Criterion(
                    "kalman_missed",
                    "share of reappearances that Kalman predictions miss by 0.5 m",
                    None,
                    (0, 0.015),
                ),
            ),
            "Predictions of a walker behind the cans from the scans before, by the Kalman filter and by 200 particles "
            "that die where the laser would have seen them; the same motion model.",
        ),
        Claim(
            "velocity",
            "II",
            "We found that incorporating an estimate of velocity (but not acceleration) generally produced the best "
            "performance in tracking occluded objects.",
            velocity,
            (
                Criterion(
                    "cans_acceleration_more_m",
                    "behind the cans: error with acceleration minus with velocity [m]",
                    MORE,
                    (-0.05, -0.025),
                ),
                Criterion("anywhere_acceleration_more_m", "hidden anywhere: the same [m]", MORE, (-0.014, 0.0005)),
                Criterion(
                    "cans_standing_more_m",
                    "behind the cans: error without velocity minus with it [m]",
                    MORE,
                    (0.2035, 0.2215),
                ),
                Criterion("anywhere_standing_more_m", "hidden anywhere: the same [m]", MORE, (0.3345, 0.3495)),
                Criterion("cans_velocity_m", "behind the cans: error with velocity [m]", None, (0.114, 0.1325)),
                Criterion("anywhere_velocity_m", "hidden anywhere: error with velocity [m]", None, (0.169, 0.1815)),
            ),
            "Predictions of a walker behind the cans, and of one whose centroids are taken away for one second in "
            "four, from the scans before. Each motion model with the noise that suits it best, chosen on ten "
            f"other seeds: {VELOCITY.noise:g} m^2/s^3 with velocity, {ACCELERATION.noise:g} m^2/s^5 with acceleration.",
        ),
        Claim(
            "greedy",
            "II",
            "This greedy search for foreground-object tracking works well in environments that are relatively sparse. "
            "However, a joint optimization procedure may be more appropriate in workspaces with a large number of "
            "coinciding dynamic foreground objects.",
            greedy,
            (
                Criterion(
                    "sparse_greedy_per_min",
                    "two walkers: identity switches per walker and minute, greedy",
                    (-inf, 1),
                    (0, 0.4),
                ),
                Criterion(
                    "dense_greedy_more_per_min", "twelve walkers: the same, greedy minus joint", MORE, (0.05, 0.75)
                ),
                Criterion("sparse_greedy_more_per_min", "two walkers: greedy minus joint", None, (-0.2, 0.2)),
                Criterion("dense_greedy_per_min", "twelve walkers: greedy", None, (2.95, 4.1)),
            ),
            "Walkers at 1 m/s on smooth random ways through a square of 6 m, without the laser: centroids with 30 mm "
            "noise, one for those nearer to each other than 0.4 m. A switch: a walker goes on under another track.",
        ),
        Claim(
            "interpolation",
            "II",
            "Though the user is temporarily occluded while demonstrating the trajectory, the filters are able to "
            "interpolate the trajectory accurately.",
            interpolation,
            (
                Criterion(
                    "occluded_error_m",
                    "error of the track while the user is out of sight [m]",
                    (0, 0.1),
                    (0.0475, 0.053),
                ),
                Criterion("visible_error_m", "error while in sight [m]", None, (0.021, 0.0255)),
                Criterion("occluded_s", "time out of sight in five figure-eights [s]", None, (5.4, 5.7)),
            ),
            "The smoothed track of the user over five figure-eights against the true path. Accurate: within 0.1 m.",
        ),
        Claim(
            "fastest",
            "II",
            "We consider the foreground object with the highest estimated velocity to be the user.",
            interpolation,
            (
                Criterion(
                    "followed", "share of the time in which the user's track is the walker's", (0.95, 1), (0.98, 1)
                ),
            ),
            "The same tracks. The walker's: within 0.5 m of where its centroid is expected.",
        ),
        Claim(
            "loss",
            "II",
            "During one demonstration the Kalman filter temporarily lost track of the user.",
            interpolation,
            (Criterion("lost", "share of recordings in which the user was lost", (0.01, 0.99), (0, 0.06), share=True),),
            "The same tracks. Lost: found again as another track.",
        ),
        Claim(
            "stable",
            "III",
            "encoding the trajectory with a stable control law induced by the LDS",
            stable,
            (
                Criterion(
                    "largest_radius",
                    "largest spectral radius of forty LDS fitted to random walks",
                    (0, 1),
                    (0.96, 1),
                ),
                Criterion(
                    "end_off_m",
                    "distance from the last subgoal at the end, from twenty starts anywhere [m]",
                    (0, 0.0101),
                    (0.0075, 0.012),
                ),
            ),
            "LDS of random walks of 3 to 59 steps, re-timed and not; responses of the figure-eight's law.",
        ),
        Claim(
            "laps",
            "III",
            "multiple demonstrations of a trajectory can be incorporated to compute a more accurate generalization of "
            "the intended user trajectory",
            generalise,
            (
                Criterion(
                    "alone_more_m",
                    "error of a law of one lap minus that of a law of several [m]",
                    MORE,
                    (0.004, 0.0185),
                ),
                Criterion("several_m", "error of a law of all laps but the last [m]", None, (0.0565, 0.072)),
            ),
            "Mean distance from a lap that was kept back, the last, to laws fitted to the first and to all others.",
        ),
        Claim(
            "scaled",
            "III",
            "a trajectory can be scaled or shifted by simply moving the subgoals and allowing the LDS to interpolate "
            "its response",
            scaled,
            (
                Criterion(
                    "off_percent",
                    "largest deviation from the scaled and shifted response, in % of its size",
                    (0, 1),
                    (0.03, 0.07),
                ),
            ),
            "Subgoals and start of the figure-eight's law scaled by 0.5 to 2 and shifted by up to 3 m.",
        ),
        Claim(
            "figure",
            "III",
            "this estimated trajectory appears to capture the intentions of the original trajectory: a “figure-eight” "
            "trajectory that avoids the obstacles",
            figure,
            (
                Criterion(
                    "eight",
                    "share of laws that go round the cans in opposite directions",
                    (0.9, 1),
                    (0.95, 1),
                    share=True,
                ),
                Criterion("clearance_m", "least distance from law to can [m]", MORE, (0.82, 0.855)),
            ),
            "Winding numbers of the law's response round both cans.",
        ),
        Claim(
            "segments",
            "III",
            "the estimated trajectory is represented by 6 LDS estimates and has an average error of 20 millimeters "
            "compared to the original trajectory",
            segments,
            (
                Criterion("n_segments", "number of LDS", (5.5, 6.5), (5.85, 6.15)),
                Criterion("error_m", "mean distance from the laps' mean to the law [m]", (0, 0.020), (0.011, 0.0155)),
                Criterion("error_laps_m", "mean distance from the single laps to the law [m]", None, (0.0485, 0.0555)),
            ),
            "Five figure-eights, tolerance 20 mm for the mean error of each segment, from which their number follows.",
        ),
        Claim(
            "follow",
            "III",
            "While it does not exactly follow the idealized trajectory in Figure 6(b), the robot does come fairly "
            "close to the predicted path.",
            follow,
            (
                Criterion("mean_m", "mean distance of the robot from the response [m]", (0.01, 0.1), (0.042, 0.047)),
                Criterion("max_m", "largest distance [m]", (0, 0.25), (0.0875, 0.102)),
                Criterion("finished", "share of runs that finished", (0.9, 1), (0.95, 1), share=True),
            ),
            "One run under the plain law by a unicycle with the Pioneer's limits, from a start 0.15 m and 20 degrees "
            "(standard deviations) off. Fairly close: 0.1 m on average, the robot's radius of 0.25 m at most.",
        ),
        Claim(
            "kidnap",
            "III",
            "the response of Agent Orange to being kidnapped seems to be a reasonable estimate of user intent",
            kidnap,
            (
                Criterion(
                    "returned",
                    "share of kidnappings after which the robot comes back to the response",
                    (0.9, 1),
                    (0.98, 1),
                ),
                Criterion("finished", "share of kidnapped runs that finish", (0.9, 1), (0.98, 1)),
                Criterion("return_s", "time until it is back [s]", None, (4.4, 5.85)),
            ),
            "Five runs, each kidnapped once to anywhere in the laboratory. Reasonable: it comes back to within 0.1 m "
            "of the response and finishes. The robot passes through what it hits.",
        ),
        Claim(
            "luck",
            "III",
            "It is coincidental that none of the responses to the kidnapping resulting in Agent Orange hitting the "
            "obstacles, or laboratory walls",
            luck,
            (
                Criterion("hit", "share of kidnapped runs that hit something", (0.05, 1), (0.145, 0.31)),
                Criterion("five_missed", "share of five runs in which none does", (-inf, 0.5), (0.1, 0.5), share=True),
            ),
            "The same runs: obstacles, furniture and walls.",
        ),
        Claim(
            "time",
            "IV-A",
            "in practice, a large number of environment objects can be matched in well under a second",
            matching_time,
            (Criterion("seconds", "time for fifty objects, two hundred corners [s]", (0, 0.5), (0, 1.0)),),
            "The paper's cost and the Hungarian method, with the margin to the second best; best of three.",
            timed=True,
        ),
        Claim(
            "moved",
            "IV-B",
            "each LDS in the estimated trajectory adapts its response to these novel conditions, succeeding in "
            "determining what the user would have done: a “figure-eight” trajectory that avoids the obstacles",
            moved,
            (
                Criterion(
                    "eight", "share of adapted laws that are still a figure-eight", (0.9, 1), (0.95, 1), share=True
                ),
                Criterion("law_clear", "share of adapted laws that touch no can", (0.9, 1), (0.95, 1), share=True),
                Criterion(
                    "robot_clear", "share of runs that finish and touch nothing", (0.9, 1), (0.92, 1), share=True
                ),
                Criterion("refused", "share of layouts refused as ambiguous", None, (0, 0.05), share=True),
                Criterion("subgoals_moved_m", "how far the subgoals moved [m]", None, (0.38, 0.51)),
            ),
            "Both cans moved at random (0.4 m standard deviation along each axis), seen by the laser and matched; one "
            "run under the plain law.",
        ),
        Claim(
            "subgoals",
            "V",
            "This merging process gives an increasingly accurate estimate about where the user intended the subgoals "
            "to be located.",
            several,
            (
                Criterion(
                    "two_more_than_ten_m", "error from two demonstrations minus that from ten [m]", MORE, (0.06, 0.09)
                ),
                Criterion(
                    "exponent",
                    "exponent of the error in the number of demonstrations (ideal: -0.5)",
                    (-0.7, -0.3),
                    (-0.555, -0.445),
                ),
                Criterion("error_2_m", "mean error of the subgoals from two demonstrations [m]", None, (0.12, 0.15)),
                Criterion("error_10_m", "from ten [m]", None, (0.0535, 0.064)),
            ),
            "Demonstrations of six subgoals that scatter by 0.15 m along each axis, one more that is no part of the "
            "task in 30 % of them. The error where the number of subgoals is right.",
        ),
        Claim(
            "shared",
            "V",
            "when segments of the task are merged together, Dollop estimates a single LDS that describes both "
            "segments, which improves the generalization ability of the estimated trajectory",
            shared,
            (
                Criterion(
                    "own_lds_more_m",
                    "error with LDS of one demonstration minus with shared ones [m]",
                    MORE,
                    (0.0015, 0.0085),
                ),
                Criterion(
                    "alone_more_m", "error of a task of one demonstration minus that of two [m]", MORE, (0, 0.025)
                ),
                Criterion("both_m", "error of the task of two demonstrations [m]", None, (0.135, 0.18)),
            ),
            "Two slaloms in different layouts, a third kept back: mean distance of what was walked there to the law "
            "adapted to its layout. First with the same subgoals, only the LDS being shared or not; then as a whole.",
        ),
        Claim(
            "generalize",
            "V",
            "Dollop is able to reproduce and generalize user actions if it has access to multiple demonstrations "
            "performed under different environment configurations",
            shared,
            (
                Criterion(
                    "sides_right",
                    "share of laws that pass every cone on the user's side",
                    (0.9, 1),
                    (0.8, 1),
                    share=True,
                ),
                Criterion("refused", "share of layouts refused as ambiguous", None, (0, 0.16), share=True),
            ),
            "The same slaloms: the law in the layout of the third, beside what the user walked there.",
        ),
        Claim(
            "consistent",
            "VI",
            "we can compute environment matchings quickly and consistently",
            consistent,
            (
                Criterion(
                    "literal",
                    "share of layouts matched alike twice, the paper's cost",
                    (0.9, 1),
                    (0.55, 0.95),
                    share=True,
                ),
                Criterion("robust", "the same, robust matching", None, (0.95, 1), share=True),
            ),
            "The laser looks twice at the same moved cans; the figure-eight's environment is matched to both.",
        ),
        Claim(
            "counterintuitive",
            "VI",
            "it is not difficult to contrive environments that result in counter-intuitive matchings",
            counterintuitive,
            (
                Criterion(
                    "literal_seen",
                    "share of layouts with a corner matched wrong, the paper's cost",
                    (0.1, 1),
                    (0.775, 0.875),
                ),
                Criterion("literal_exact", "the same, boxes of exactly equal size", (0.1, 1), (0.055, 0.15)),
                Criterion("robust_seen", "the same as the first, robust matching", None, (0, 0.005)),
            ),
            "Three boxes in a room of 6 m, each moved by 0.4 m (standard deviation along each axis), their sides seen "
            "off by up to 50 mm.",
        ),
    )
}
"""Every claim by its id."""
