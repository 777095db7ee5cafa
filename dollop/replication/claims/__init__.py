"""The paper's testable claims, and the experiment behind each: a pure function of a seed that
returns numbers.

A claim has one criterion or more: the mean of a number over the seeds, and the range in which the
claim wants it; some numbers have none and are only told. A criterion is met when the whole 95 %
interval lies within its range, and clearly not met when it lies wholly beside it. A claim holds if
all its criteria are met; it does not hold if none is and one clearly is not; otherwise it holds in
part.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from dollop.replication.claims.environment import (
    consistent,
    counted,
    counterintuitive,
    matching_time,
    moved,
    optimal,
    single,
)
from dollop.replication.claims.learning import combined, generalize, several, shared
from dollop.replication.claims.observing import (
    ACCELERATION,
    PREDICTORS,
    VELOCITY,
    centroid,
    fastest,
    filtering,
    greedy,
    interpolation,
    prediction,
    straight,
    velocity,
)
from dollop.replication.claims.performing import (
    KIDNAPPINGS,
    figure,
    follow,
    generalise,
    kidnap,
    luck,
    parameters,
    salient,
    scaled,
    segments,
    stable,
    state,
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
        The claim wants the mean over the seeds in here, the upper end included; None if the number
        is only told.
    trials : int
        The number of a seed is the share of so many trials, 0 if it is no share. The interval of a
        share of one trial is Wilson's.
    timed : bool
        Whether it is a time that something took, which no two runs have in common.
    """

    number: str
    meaning: str
    wanted: tuple
    trials: int = 0
    timed: bool = False


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
    constructed : bool
        Whether the method as reconstructed makes it true or false whatever the data: then the
        experiment checks the program, and says nothing of the world.
    """

    id: str
    section: str
    quote: str
    experiment: Callable
    criteria: tuple
    setup: str
    constructed: bool = False


MORE, NONE = (0.0, inf), (-inf, 1e-6)

CLAIMS = {
    claim.id: claim
    for claim in (
        Claim(
            "single",
            "I",
            "only allows a single scaling or shifting parameter applied to the entire trajectory so that if only some "
            "objects in the environment move, then complete retraining would be required",
            single,
            (
                Criterion("scaled_more_m", "error of the law scaled and shifted as a whole minus adapted [m]", MORE),
                Criterion("turned_more_m", "scaled, turned and shifted minus adapted [m]", None),
                Criterion("left_more_m", "not adapted at all minus adapted [m]", None),
                Criterion("adapted_m", "error of the law adapted by its objects [m]", None),
            ),
            "One of the two cans moved at random (0.4 m standard deviation along each axis): mean distance of what a "
            "user walks there to the law, its subgoals moved with the objects or all by one transformation.",
        ),
        Claim(
            "filter",
            "II",
            "We use a Kalman filter [8] to estimate the velocity of a foreground object and to filter out sensor noise",
            filtering,
            (
                Criterion("raw_more_m", "error of the centroids minus that of the filter [m]", MORE),
                Criterion("raw_velocity_more_m_s", "the same of velocity, centroids by differences [m/s]", MORE),
                Criterion("filtered_m", "error of the filter [m]", None),
                Criterion("filtered_velocity_m_s", "error of its velocity [m/s]", None),
                Criterion("smoothed_m", "error of the smoothed track [m]", None),
            ),
            "Five figure-eights while the walker is in sight: estimates from the scans so far, the bias taken out.",
        ),
        Claim(
            "centroid",
            "II",
            "filter out sensor noise, which seems primarily due to the inconsistent nature of computing the centroid "
            "of a blob",
            centroid,
            (
                Criterion("laser_sds", "centroid noise per axis, in standard deviations of a reading (5 mm)", (1, inf)),
                Criterion("share_without_laser_noise", "share of its variance left with an ideal laser", (0.5, inf)),
                Criterion("noise_mm", "centroid noise per axis [mm]", None),
            ),
            "Centroids of a walker of known path over five figure-eights, the bias taken out; then the same walk seen "
            "by a laser without noise and mixed pixels.",
        ),
        Claim(
            "prediction",
            "II",
            "In our experiments, Kalman predictions were more reliable in modeling occluded foreground-object motion.",
            prediction,
            (
                Criterion("particles_more_m", "error of particles minus error of Kalman predictions [m]", MORE),
                Criterion(
                    "particles_missed_more", "share of reappearances missed by 0.5 m, particles minus Kalman", MORE
                ),
                Criterion("blind_more_m", "error of blind particles minus Kalman [m]", None),
                Criterion("blind_missed_more", "missed by 0.5 m, blind particles minus Kalman", None),
                Criterion("kalman_m", "error of the Kalman predictions [m]", None),
                Criterion("kalman_missed", "share of reappearances that they miss by 0.5 m", None),
            ),
            "Predictions of a walker behind the cans from the scans before, the bias taken out: by the Kalman filter, "
            "by 200 particles that die where the laser would have seen them, and by blind ones that do not. Position "
            "and velocity, each with the noise that suits it best behind the cans, chosen on ten other seeds: "
            + ", ".join(f"{motion.noise:g}" for motion, _ in PREDICTORS.values())
            + " m^2/s^3.",
        ),
        Claim(
            "velocity",
            "II",
            "We found that incorporating an estimate of velocity (but not acceleration) generally produced the best "
            "performance in tracking occluded objects.",
            velocity,
            (
                Criterion(
                    "cans_acceleration_more_m", "behind the cans: error with acceleration minus with velocity [m]", MORE
                ),
                Criterion("anywhere_acceleration_more_m", "hidden anywhere: the same [m]", MORE),
                Criterion("cans_standing_more_m", "behind the cans: error without velocity minus with it [m]", MORE),
                Criterion("anywhere_standing_more_m", "hidden anywhere: the same [m]", MORE),
                Criterion("cans_velocity_m", "behind the cans: error with velocity [m]", None),
                Criterion("anywhere_velocity_m", "hidden anywhere: error with velocity [m]", None),
            ),
            "Predictions of a walker behind the cans, and of one whose centroids are taken away for one second in "
            "four, from the scans before, the bias taken out. Each motion model with the noise that suits it best, "
            f"chosen on ten other seeds: {VELOCITY.noise:g} m^2/s^3 with velocity, {ACCELERATION.noise:g} m^2/s^5 with "
            "acceleration.",
        ),
        Claim(
            "straight",
            "II",
            "our Kalman predictions of occluded objects will proceed in straight lines",
            straight,
            (
                Criterion("bend_mm", "largest distance of a prediction from a straight line [mm]", NONE),
                Criterion("walked_bend_mm", "the same of the way walked meanwhile, mean [mm]", None),
            ),
            "The walker behind the cans, position and velocity.",
            constructed=True,
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
                    "sparse_greedy_per_min", "two walkers: identity switches per walker and minute, greedy", (-inf, 1)
                ),
                Criterion("dense_greedy_more_per_min", "twelve walkers: the same, greedy minus joint", MORE),
                Criterion("sparse_greedy_more_per_min", "two walkers: greedy minus joint", None),
                Criterion("dense_greedy_per_min", "twelve walkers: greedy", None),
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
                    "error while the user is out of sight, after the near-side bias is taken out [m]",
                    (0, 0.1),
                ),
                Criterion("visible_error_m", "the same while in sight [m]", None),
                Criterion("occluded_raw_m", "out of sight, the bias left in [m]", None),
                Criterion("bias_m", "near-side bias: the walker is farther than the centroids by [m]", None),
                Criterion("occluded_s", "time out of sight in five figure-eights [s]", None),
            ),
            "The smoothed track of the user over five figure-eights. Accurate: within 0.1 m of where the walker's "
            "centroid is expected, the true path moved towards the laser by the bias of that recording.",
        ),
        Claim(
            "fastest",
            "II",
            "We consider the foreground object with the highest estimated velocity to be the user.",
            fastest,
            (
                Criterion("alone", "one walker: share of the time in which it is the user", (0.95, 1)),
                Criterion("both", "and while a slower one strolls in front of the robot", (0.95, 1)),
                Criterion("alone_ours", "one walker, with our additions", None),
                Criterion("both_ours", "two walkers, with our additions", None),
                Criterion("changes", "how often the user then changes, two walkers", None),
            ),
            "Five figure-eights as they are, and with a second person at half the speed who passes between the robot "
            "and the user; while the user walks. The fastest track in each scan, as the paper says. Our additions: "
            "only visible objects can become the user, and another one takes over only after having been faster by "
            "0.3 m/s for 0.5 s.",
        ),
        Claim(
            "loss",
            "II",
            "During one demonstration the Kalman filter temporarily lost track of the user.",
            interpolation,
            (Criterion("lost_per_lap", "share of the laps in which the user was lost", (0.036, 0.624), 5),),
            "The same tracks. Lost: found again as another track. Wanted: the 95 % interval (Wilson) of the paper's "
            "one in five demonstrations.",
        ),
        Claim(
            "parameters",
            "III",
            "To reduce the number of parameters used to describe a demonstration, Dollop represents trajectories by a "
            "sequence of linear dynamical systems [9].",
            parameters,
            (
                Criterion("share_of_lap", "numbers in the law, share of those in one lap", (-inf, 1)),
                Criterion("share_of_polyline", "share of those in a polyline as near to the laps", None),
                Criterion("numbers", "numbers in the law", None),
            ),
            "Matrix, subgoal and speed of each LDS, and the start, beside the coordinates of one lap, ten a second; "
            "and beside those of the coarsest polyline with equal steps along the laps' mean that is as near to it.",
        ),
        Claim(
            "salient",
            "III",
            "captures the salient features of the trajectory such as direction, curvature, and speed",
            salient,
            (
                Criterion("direction_deg", "mean difference of direction [degrees]", (0, 10)),
                Criterion("curvature_correlation", "correlation of the curvatures", (0.8, 1)),
                Criterion("speed_off_share", "mean difference of speed, share of the mean speed", (0, 0.1)),
                Criterion("own_speed_off_share", "the same of the LDS's own steps", None),
            ),
            "The law beside the laps at 200 equal shares of the way. Its speed is the mean speed that is kept for each "
            "segment: re-timed LDS have none of their own. An LDS fitted to the samples as they are has one.",
        ),
        Claim(
            "stable",
            "III",
            "encoding the trajectory with a stable control law induced by the LDS",
            stable,
            (
                Criterion("margin", "one minus the largest spectral radius of forty LDS", MORE),
                Criterion(
                    "end_off_m",
                    "distance from the last subgoal at the end, from twenty starts anywhere [m]",
                    (0, 0.0101),
                ),
            ),
            "LDS of random walks of 3 to 59 steps, re-timed and not; responses of the figure-eight's law, which end "
            "within their reach of 0.01 m or not at all.",
            constructed=True,
        ),
        Claim(
            "laps",
            "III",
            "multiple demonstrations of a trajectory can be incorporated to compute a more accurate generalization of "
            "the intended user trajectory",
            generalise,
            (
                Criterion("alone_more_m", "error of a law of one lap minus that of a law of several [m]", MORE),
                Criterion("several_m", "error of a law of all laps but the last [m]", None),
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
                    "off_percent", "largest deviation from the scaled and shifted response, in % of its size", (0, 1)
                ),
            ),
            "Subgoals and start of the figure-eight's law scaled by 0.5 to 2 and shifted by up to 3 m.",
            constructed=True,
        ),
        Claim(
            "figure",
            "III",
            "this estimated trajectory appears to capture the intentions of the original trajectory: a “figure-eight” "
            "trajectory that avoids the obstacles",
            figure,
            (
                Criterion("eight", "share of laws that go round the cans in opposite directions", (0.9, 1), 1),
                Criterion("clearance_m", "least distance from law to can [m]", MORE),
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
                Criterion("n_segments", "number of LDS at a tolerance of 20 mm", (5.5, 6.5)),
                Criterion("n_at_10_mm", "at 10 mm", None),
                Criterion("n_at_40_mm", "at 40 mm", None),
                Criterion("error_m", "at 20 mm: mean distance from the laps' mean to the law [m]", None),
                Criterion("error_laps_m", "at 20 mm: mean distance from the single laps to the law [m]", None),
            ),
            "Five figure-eights. The tolerance bounds the mean error of each segment, and the number of LDS follows "
            "from it; so the error cannot exceed 20 mm and is no criterion.",
        ),
        Claim(
            "follow",
            "III",
            "While it does not exactly follow the idealized trajectory in Figure 6(b), the robot does come fairly "
            "close to the predicted path.",
            follow,
            (
                Criterion("mean_m", "mean distance of the robot from the response [m]", (0.01, 0.1)),
                Criterion("max_m", "largest distance [m]", (0, 0.25)),
                Criterion("finished", "share of runs that finished", (0.9, 1), 1),
            ),
            "One run under the plain law by a unicycle with the Pioneer's limits, from a start 0.15 m and 20 degrees "
            "(standard deviations) off. Fairly close: 0.1 m on average, the robot's radius of 0.25 m at most.",
        ),
        Claim(
            "luck",
            "III",
            "It is coincidental that none of the responses to the kidnapping resulting in Agent Orange hitting the "
            "obstacles, or laboratory walls",
            luck,
            (
                Criterion("hit", "share of kidnapped runs that hit something", (0.05, 1), KIDNAPPINGS),
                Criterion("five_missed", "share of five runs in which none does", (-inf, 0.5), 1),
                Criterion("hit_before_back", "share that hit something before they are back", None, KIDNAPPINGS),
            ),
            "Five runs under the plain law, each kidnapped once to anywhere in the laboratory: obstacles, furniture "
            "and walls. Back: within 0.1 m of the response for a second.",
        ),
        Claim(
            "state",
            "III",
            "the response of the control laws only depends on the current state of the robot and is independent of "
            "objects in the environment",
            state,
            (
                Criterion("objects_m", "change of a run when all objects are taken away [m]", NONE),
                Criterion(
                    "segments_deg",
                    "difference of direction between two segments in force at one place [degrees]",
                    (-inf, 1),
                ),
            ),
            "A run under the plain law with and without the cans, its subgoals being where they were; directions of "
            "all pairs of segments at fifty places.",
            constructed=True,
        ),
        Claim(
            "kidnap",
            "III",
            "the response of Agent Orange to being kidnapped seems to be a reasonable estimate of user intent",
            kidnap,
            (
                Criterion(
                    "returned", "share that come back to the response, touching nothing before", (0.9, 1), KIDNAPPINGS
                ),
                Criterion("finished", "share that finish, touching nothing", (0.9, 1), KIDNAPPINGS),
                Criterion("goes_on", "share of these that go on as the user did", (0.9, 1)),
                Criterion("heading_deg", "angle to the user's direction until it is back [degrees]", (-inf, 45)),
                Criterion("return_s", "time until it is back [s]", None),
            ),
            "The runs of `luck`; a collision ends a run. Going on as the user did: from the next subgoal to the end "
            "round the cans as the law of the demonstrations. The user's direction: at the nearest place of the laps "
            "that belongs to the segment in force.",
        ),
        Claim(
            "time",
            "IV-A",
            "in practice, a large number of environment objects can be matched in well under a second",
            matching_time,
            (Criterion("seconds", "time for fifty objects, two hundred corners [s]", (0, 0.5), timed=True),),
            "The paper's cost and the Hungarian method, with the margin to the second best; best of three.",
        ),
        Claim(
            "optimal",
            "IV-A",
            "This formulation can be solved optimally by linear programming",
            optimal,
            (
                Criterion("program_off", "cost of the linear program minus ours, absolute", NONE),
                Criterion("fractional", "largest distance of its solution from whole numbers", NONE),
                Criterion("brute_force_off", "least cost of all bijections minus ours, absolute", NONE),
            ),
            "Ten objects: the Hungarian method beside a linear program. Two objects: beside all bijections of eight "
            "corners.",
            constructed=True,
        ),
        Claim(
            "number",
            "IV-A",
            "This means that the number of environment objects must be the same in all demonstrations of a task. In "
            "our experiments this has not shown itself as a problem",
            counted,
            (Criterion("other_number", "share of demonstrations with another number of objects", (-inf, 0.05), 4),),
            "A figure-eight round two cans and three slaloms among four cones, as the robot sees them. No problem: in "
            "fewer than one of twenty.",
        ),
        Claim(
            "moved",
            "IV-B",
            "each LDS in the estimated trajectory adapts its response to these novel conditions, succeeding in "
            "determining what the user would have done: a “figure-eight” trajectory that avoids the obstacles",
            moved,
            (
                Criterion("eight", "share of adapted laws that are still a figure-eight", (0.9, 1), 1),
                Criterion("law_clear", "share of adapted laws that touch no can", (0.9, 1), 1),
                Criterion("robot_clear", "share of runs that finish and touch nothing", (0.9, 1), 1),
                Criterion("refused", "share of layouts refused as ambiguous", None, 1),
                Criterion("subgoals_moved_m", "how far the subgoals moved [m]", None),
            ),
            "Both cans moved at random (0.4 m standard deviation along each axis), seen by the laser and matched; one "
            "run under the plain law.",
        ),
        Claim(
            "combined",
            "V",
            "If the algorithm finds statistical similarities between the subgoals of different demonstrations, then "
            "the CDHMM is simplified by combining the similarities.",
            combined,
            (
                Criterion("path_right", "share of most-likely paths with the task's six states", (0.9, 1), 1),
                Criterion("states_right", "share of CDHMMs with the right number of states", (0.9, 1), 1),
                Criterion("states_more", "number of states minus the right one", None),
                Criterion("share_left", "states, share of the subgoals merged", None),
            ),
            "Five demonstrations of six subgoals that scatter by 0.15 m along each axis, one more that is no part of "
            "the task in 30 % of them. Right: the task's six and one for each that is no part of it.",
        ),
        Claim(
            "subgoals",
            "V",
            "This merging process gives an increasingly accurate estimate about where the user intended the subgoals "
            "to be located.",
            several,
            (
                Criterion("two_more_than_ten_m", "error from two demonstrations minus that from ten [m]", MORE),
                Criterion(
                    "exponent", "exponent of the error in the number of demonstrations (ideal: -0.5)", (-0.7, -0.3)
                ),
                Criterion(
                    "passing_alone_more_m",
                    "walked slaloms: distance from the intended passing places, one demonstration minus two [m]",
                    MORE,
                ),
                Criterion("error_2_m", "mean error of the subgoals from two demonstrations [m]", None),
                Criterion("error_10_m", "from ten [m]", None),
                Criterion("half_two_more_than_ten_m", "scatter half as wide: two minus ten [m]", None),
                Criterion("half_right", "and share with the right number from ten", None, 1),
                Criterion("twice_two_more_than_ten_m", "scatter twice as wide: two minus ten [m]", None),
                Criterion("twice_right", "and share with the right number from ten", None, 1),
                Criterion("tails_two_more_than_ten_m", "heavy tails: two minus ten [m]", None),
                Criterion("tails_right", "and share with the right number from ten", None, 1),
            ),
            "Demonstrations of six subgoals that scatter by 0.15 m along each axis as merging expects, half or twice "
            "as wide, or by Student's t of three degrees of freedom of that scale; one more that is no part of the "
            "task in 30 % of them. The error where the number of subgoals is right. Walked slaloms: those of `shared`; "
            "a walker intends to pass a cone 0.75 m from its centre.",
        ),
        Claim(
            "shared",
            "V",
            "when segments of the task are merged together, Dollop estimates a single LDS that describes both "
            "segments, which improves the generalization ability of the estimated trajectory",
            shared,
            (
                Criterion("own_lds_more_m", "error with LDS of one demonstration minus with shared ones [m]", MORE),
                Criterion("alone_more_m", "error of a task of one demonstration minus that of two [m]", MORE),
                Criterion("both_m", "error of the task of two demonstrations [m]", None),
            ),
            "Two slaloms in different layouts, a third kept back: mean distance of what was walked there to the law "
            "adapted to its layout. First with the same subgoals, only the LDS being shared or not; then as a whole.",
        ),
        Claim(
            "generalize",
            "V",
            "Dollop is able to reproduce and generalize user actions if it has access to multiple demonstrations "
            "performed under different environment configurations",
            generalize,
            (
                Criterion("sides_right", "share of laws that pass every cone on the user's side", (0.9, 1), 1),
                Criterion("plain_clear", "share of runs under the plain law that touch nothing", (0.9, 1), 1),
                Criterion("aware_clear", "the same going round obstacles, beyond the paper", None, 1),
                Criterion("refused", "share of layouts refused as ambiguous", None, 1),
            ),
            "The same slaloms: the law in the layout of the third, beside what the user walked there; and one run of a "
            "unicycle under each law, which is to finish and touch nothing.",
        ),
        Claim(
            "consistent",
            "VI",
            "we can compute environment matchings quickly and consistently",
            consistent,
            (
                Criterion("seconds", "time for two objects, the paper's cost [s]", (0, 0.5), timed=True),
                Criterion("literal", "share of layouts matched alike twice, the paper's cost", (0.9, 1), 1),
                Criterion("robust", "the same, robust matching", None, 1),
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
                    "literal_exact_once",
                    "share of seeds with a corner matched wrong in one of ten exact layouts, the paper's cost",
                    (0.5, 1),
                    1,
                ),
                Criterion("literal_exact", "share of exact layouts with a corner matched wrong", None, 10),
                Criterion("literal_seen", "the same, boxes seen inexactly", None, 10),
                Criterion("robust_seen", "the same, robust matching", None, 10),
            ),
            "Three boxes of equal size in a room of 6 m, each moved by 0.4 m (standard deviation along each axis); "
            "seen inexactly: their sides off by up to 50 mm. Not difficult: one in ten random layouts will do.",
        ),
    )
}
"""Every claim by its id."""
