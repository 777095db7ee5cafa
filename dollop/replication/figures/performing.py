"""Figures 6b and 7: the control law, and the robot that performs it (Sec. III)."""

import joblib
import matplotlib.pyplot as plt
import numpy as np

from dollop import plot
from dollop.replication import recordings
from dollop.replication.figures.panel import panel
from dollop.robot.performing import distances_to_law, return_times
from dollop.trajectory import distance_to_polyline, mean_trajectory

SIZE = (6, 5.2)
PAIR = (10, 4.7)
CONTROLS = {  # suffix in the metrics: what it is, and how the robot is asked for it
    "_plain": ("the paper's kind of control: plain, obstacles ignored", ("plain", False)),
    "": ("Dollop's own: pursuit, going round obstacles", ("pursuit", True)),
}


@panel("6b")
def figure_6b():
    """The subgoals and control law extracted from the demonstrations.

    Crosses are subgoals, where one LDS hands over to the next; the green line is the response of
    the sequenced LDS started where the laps start, the arrowheads say which way it is walked. At
    some subgoals it has a corner: each segment is fitted without regard to the next, and its
    response arrives along the direction in which it is slowest. The paper: 6 LDS, 20 mm on average.
    """
    recording, observation = recordings.figure_eights(), recordings.figure_eights_observed()
    law, laps = recordings.figure_eight_task().law, recordings.figure_eight_laps()
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(recordings.background_map(), recording.log.poses[0], observation.environment.boxes, ax)
    for k, lap in enumerate(laps):
        plot.path(ax, lap, "laps" if k == 0 else None, linewidth=0.4, alpha=0.6)
    plot.law(ax, law.response())
    plot.subgoals(ax, law.subgoals)
    plot.legend_below(figure, ax)
    return figure, {
        "n_segments": len(law.segments),
        "mean_error_m": distance_to_polyline(mean_trajectory(laps), law.response()).mean(),
        "mean_error_laps_m": np.mean([law.error(lap) for lap in laps]),
        "tolerance_m": 0.02,
    }


@panel("7a", own="plain law", pursuit="pursuit")
def figure_7a():
    """Ten runs of Agent Orange performing the estimated trajectory of Figure 6b.

    Left the paper's kind of law, which points along the response and knows nothing of wheels, so
    that the robot swings wide in the curves; right the one that respects the robot's dynamics. The
    fan is the starts, each a little off. Distances are from the robot to the response from where
    that run started, not to the green line, which starts where the laps do.
    """
    task = recordings.figure_eight_task()
    figure, axes = plt.subplots(1, 2, figsize=PAIR, sharey=True)
    metrics = {}
    titles = {"plain": "plain: points along the response", "pursuit": "pursuit: respects the robot's dynamics"}
    runs_of = at_once(recordings.eight_runs, [(control,) for control in titles])
    for ax, (control, title), runs in zip(axes, titles.items(), runs_of, strict=True):
        draw_runs(ax, task, runs, title)
        distances = np.concatenate([distances_to_law(run, task.law) for run in runs])
        errors = [pose_errors(run) for run in runs]
        metrics[control] = {
            **recordings.counts(runs),
            "mean_distance_m": distances.mean(),
            "max_distance_m": distances.max(),
            "min_clearance_m": least_clearance(runs),
            "localisation_error_m": np.mean([place for place, _ in errors]),
            "localisation_error_deg": np.degrees(np.mean([turn for _, turn in errors])),
        }
    plot.legend_below(figure, axes[0])
    return figure, metrics["plain"] | {f"{key}_pursuit": value for key, value in metrics["pursuit"].items()}


@panel("7b", own="plain law", aware="plain law, going round obstacles")
def figure_7b():
    """The response of Agent Orange after being kidnapped.

    Five runs, a shade and dashes each. A dotted line leads to where the robot was carried, and the
    number there is the run's, the same left and right. The plain law heads for the active subgoal
    through whatever is in the way, and the circle is the robot where that first ends in a contact;
    that the paper's robot hit nothing was, as it says, a coincidence. Right the same law, which now
    goes round obstacles: nothing else differs. One run may touch an obstacle several times, so
    contacts and runs with a contact are counted apart. Time to return: until the robot is within
    ten centimetres of the response from its start and stays there for a second.
    """
    task = recordings.figure_eight_task()
    figure, axes = plt.subplots(1, 2, figsize=PAIR, sharey=True)
    metrics = {}
    titles = {"plain": "plain, obstacles ignored", "aware": "plain, going round obstacles"}
    runs_of = at_once(recordings.kidnapped_runs, [("plain", False), ("plain", True)])
    for ax, (name, title), runs in zip(axes, titles.items(), runs_of, strict=True):
        draw_runs(ax, task, runs, title)
        times = np.concatenate([return_times(run, task.law) for run in runs])
        back = times[np.isfinite(times)]
        metrics[name] = recordings.counts(runs) | {
            "return_time_s": back.mean() if len(back) else None,
            "min_clearance_m": least_clearance(runs),
        }
    plot.legend_below(figure, *axes)
    return figure, metrics["plain"] | {f"{key}_aware": value for key, value in metrics["aware"].items()}


def at_once(work, arguments):
    """What `work` returns for each of some arguments, two at a time: the numbers are the same,
    seeds being fixed.
    """
    return joblib.Parallel(n_jobs=2)(joblib.delayed(work)(*each) for each in arguments)


def draw_runs(ax, task, runs, title):
    """The law, and the runs of the robot over it."""
    plot.workspace(recordings.background_map(), None, task.environment.boxes, ax, title)
    plot.law(ax, task.law.response())
    plot.runs(ax, runs)


def least_clearance(runs):
    """The least distance in m that any of the runs left between the robot's rim and an obstacle."""
    return min(run.clearance.min() for run in runs)


def pose_errors(run):
    """Mean errors of the estimated pose while the robot trusts it: m and rad."""
    off = (run.poses - run.true_poses)[run.localised]
    return np.hypot(off[:, 0], off[:, 1]).mean(), np.abs(np.angle(np.exp(1j * off[:, 2]))).mean()
