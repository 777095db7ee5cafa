"""Figures 6b and 7: the control law, and the robot that performs it (Sec. III)."""

import matplotlib.pyplot as plt
import numpy as np

from dollop import experiments, plot
from dollop.execution import distances_to_law, return_times
from dollop.trajectory import distance_to_polyline, mean_trajectory

SIZE = (6, 5.2)


def figure_6b():
    """Subgoals and control law extracted from the demonstrations of Fig. 6a."""
    recording, observation = experiments.figure_eights(), experiments.figure_eights_observed()
    law, laps = experiments.figure_eight_task().law, experiments.figure_eight_laps()
    figure, ax = plt.subplots(figsize=SIZE)
    plot.workspace(experiments.background_map(), recording.log.poses[0], observation.environment.boxes, ax)
    for k, lap in enumerate(laps):
        plot.path(ax, lap, "laps" if k == 0 else None, linewidth=0.4, alpha=0.6)
    plot.path(ax, law.response(), "control law", plot.LAW, linewidth=2)
    plot.subgoals(ax, law.subgoals)
    plot.legend_below(figure, ax)
    return figure, {
        "n_segments": len(law.segments),
        "mean_error_m": distance_to_polyline(mean_trajectory(laps), law.response()).mean(),
        "mean_error_laps_m": np.mean([law.error(lap) for lap in laps]),
        "tolerance_m": 0.02,
    }


def figure_7a():
    """Ten runs of the robot: the paper's law, and beside it the one that respects the robot's dynamics."""
    task = experiments.figure_eight_task()
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.9), sharey=True)
    metrics = {}
    for ax, control in zip(axes, ("plain", "pursuit"), strict=True):
        runs = experiments.eight_runs(control)
        draw_runs(ax, task, runs, f"{control} law")
        distances = np.concatenate([distances_to_law(run, task.law) for run in runs])
        errors = [pose_errors(run) for run in runs]
        metrics[control] = {
            **experiments.counts(runs),
            "mean_distance_m": distances.mean(),
            "max_distance_m": distances.max(),
            "min_clearance_m": min(run.clearance.min() for run in runs),
            "localisation_error_m": np.mean([place for place, _ in errors]),
            "localisation_error_deg": np.degrees(np.mean([turn for _, turn in errors])),
        }
    plot.legend_below(figure, axes[0])
    return figure, metrics["plain"] | {f"{key}_pursuit": value for key, value in metrics["pursuit"].items()}


def figure_7b():
    """Five runs, each kidnapped once: the paper's law, and beside it the one that goes round obstacles."""
    task = experiments.figure_eight_task()
    figure, axes = plt.subplots(1, 2, figsize=(10, 4.9), sharey=True)
    metrics = {}
    for ax, name, choices in zip(axes, ("plain", "aware"), (("plain", False), ("pursuit", True)), strict=True):
        runs = experiments.kidnapped_runs(*choices)
        draw_runs(ax, task, runs, {"plain": "plain law", "aware": "pursuit, going round obstacles"}[name])
        times = np.concatenate([return_times(run, task.law) for run in runs])
        back = times[np.isfinite(times)]
        metrics[name] = experiments.counts(runs) | {"return_time_s": back.mean() if len(back) else None}
    plot.legend_below(figure, axes[0])
    return figure, metrics["plain"] | {f"{key}_aware": value for key, value in metrics["aware"].items()}


def draw_runs(ax, task, runs, title):
    """The law, and the runs of the robot over it."""
    plot.workspace(experiments.background_map(), None, task.environment.boxes, ax, title)
    plot.path(ax, task.law.response(), "control law", plot.LAW, linewidth=2)
    plot.runs(ax, runs)


def pose_errors(run):
    """Mean errors of the estimated pose while the robot trusts it: m and rad."""
    off = (run.poses - run.true_poses)[run.localised]
    return np.hypot(off[:, 0], off[:, 1]).mean(), np.abs(np.angle(np.exp(1j * off[:, 2]))).mean()
