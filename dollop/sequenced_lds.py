"""The user's trajectory as a sequence of linear dynamical systems, the control law (Sec. III)."""

from dataclasses import dataclass, replace

import numpy as np

from dollop.checks import check_positive, checked_array
from dollop.lds import LDS
from dollop.segmentation import best_segments, fewest_cuts, raw_statistics, retimed_statistics, segment_errors
from dollop.trajectory import (
    align,
    arc_length,
    check_one_way,
    check_trajectories,
    check_trajectory,
    distance_to_polyline,
    resample,
)

__all__ = ["SequencedLDS"]

LEAST_REACH = 1e-6  # m: nearer to a subgoal than coordinates can tell, none would ever arrive
MOST_CANDIDATES = 1000  # errors of all pairs of cuts are held at once


@dataclass(frozen=True, eq=False)
class SequencedLDS:
    """A trajectory as a sequence of LDS, each handing over to the next at its subgoal (Sec. III).

    Attributes
    ----------
    segments : tuple of K LDS
        In order.
    start : (2,) float array
        Where the demonstrations start on average, m.
    speeds : (K,) float array
        Mean demonstrated speed along each segment, m/s.
    """

    segments: tuple
    start: np.ndarray
    speeds: np.ndarray

    def __repr__(self):
        ends = self.start, self.subgoals[-1]
        way = " to ".join(f"({x:.2f}, {y:.2f})" for x, y in ends)
        return f"SequencedLDS of {len(self.segments)} segments from {way}"

    @property
    def subgoals(self):
        """(K, 2) float array: where the segments end, m."""
        return np.array([segment.goal for segment in self.segments])

    @classmethod
    def fit(cls, trajectories, tolerance=0.02, n_segments=None, retimed=True, sample_period=0.1, candidates=100):
        """Divide a trajectory, or several walks of it, into segments of one LDS each (Sec. III).

        Several walks are aligned (`dollop.trajectory.align`); a subgoal is the mean of the places
        where they are cut, and an LDS is fitted to the statistics of all. The error of a segment is
        the mean distance from the walks' mean to the response of its LDS, started at the subgoal
        before. Dynamic programming finds, among all divisions at the candidate cuts, those with the
        fewest segments of which none has an error above the tolerance, and of these the one with
        the least total error.

        Parameters
        ----------
        trajectories : (N, 2) array_like or sequence of (N_k, 2) array_like
            Positions in m; several must be walks of one way (`dollop.trajectory.ways_apart`).
        tolerance : float
            Largest mean error of a segment in m.
        n_segments : int, optional
            Exactly so many segments with the least total error instead; the tolerance then plays no
            part.
        retimed : bool
            Whether to fit the re-timed curves or the samples as they are (see `LDS.fit`).
        sample_period : float
            Time between samples in s; only `speeds` depends on it.
        candidates : int
            Number of places, at equal distances, where the trajectory may be cut, both its ends
            included. The time taken grows with the cube.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            Trajectories as in `LDS.fit`, walks that are not of one way, a parameter out of its
            range, or a tolerance that no division keeps.

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> len(law.segments), law.subgoals.round(6) + 0.0
        (1, array([[0., 1.]]))
        """
        check_search(tolerance, n_segments, sample_period, candidates)
        walks = check_trajectories(trajectories)
        aligned, shares = align(walks, 2 * candidates - 1)
        check_one_way(walks, aligned)
        path, moments = aligned.mean(axis=0)[::2], cut_moments(walks, shares[:, ::2])
        statistics = retimed_statistics(aligned) if retimed else raw_statistics(walks, moments)
        if n_segments is None:
            cuts = fewest_cuts(path, statistics, tolerance)
        else:
            cuts = best_segments(segment_errors(path, statistics), n_segments)
        spans = zip(cuts[:-1], np.diff(cuts), path[cuts[1:]], strict=True)
        segments = tuple(LDS(statistics(start, length), goal) for start, length, goal in spans)
        return cls(segments, path[0], demonstrated_speeds(walks, moments[:, cuts], sample_period))

    def response(self, start=None, reach=0.01):
        """Follow the segments, handing over to the next within reach of each subgoal (Sec. III).

        Since every LDS is stable, this happens after finitely many steps from any start. The next
        segment sets out from the place of the handing over.

        Parameters
        ----------
        start : (2,) array_like, optional
            m; by default the demonstrations' start.
        reach : float
            m, at least a micrometre.

        Returns
        -------
        (M, 2) float array
            From start to within reach of the last subgoal, m.

        Raises
        ------
        ValueError
            A start that is no position, or too small a reach.

        Examples
        --------
        Kidnapped, it still ends at the last subgoal:

        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> bool(np.linalg.norm(law.response([-30.0, 20.0])[-1] - law.subgoals[-1]) <= 0.01)
        True
        """
        if not reach >= LEAST_REACH:
            raise ValueError(f"reach must be at least {LEAST_REACH:g} m, got {reach}")
        states = [checked_array("start", self.start if start is None else start, 2)]
        for segment in self.segments:
            while np.linalg.norm(states[-1] - segment.goal) > reach:
                states.append(segment.step(states[-1]))
        return np.array(states)

    def error(self, trajectory):
        """Mean distance of a trajectory's samples to the response.

        Parameters
        ----------
        trajectory : (N, 2) array_like
            m.

        Returns
        -------
        float
            m.

        Raises
        ------
        ValueError
            No trajectory (see `check_trajectory`).

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> law.error(law.response())
        0.0
        """
        return self.errors(trajectory)["mean"]

    def errors(self, trajectory):
        """Distances between the samples of a trajectory and the response.

        Parameters
        ----------
        trajectory : (N, 2) array_like
            m.

        Returns
        -------
        dict of float
            In m: "mean" and "max" from the samples to the nearest places on the response; "reverse"
            the mean from the response, sampled at equal distances, to the nearest places on the
            trajectory.

        Raises
        ------
        ValueError
            No trajectory (see `check_trajectory`).
        """
        samples, response = check_trajectory(trajectory), self.response()
        there = distance_to_polyline(samples, response)
        back = distance_to_polyline(resample(response, len(samples)), samples)
        return {"mean": float(there.mean()), "max": float(there.max()), "reverse": float(back.mean())}

    def with_subgoals(self, subgoals, start=None, turned=False):
        """The same task with its subgoals moved (Sec. IV).

        Every LDS keeps its A, so the response adapts by itself.

        Parameters
        ----------
        subgoals : (K, 2) array_like
            m.
        start : (2,) array_like, optional
            Moved as well, m; by default the demonstrations' start stays.
        turned : bool
            Beyond the paper: turn every LDS as the line from the subgoal before to its own has
            turned.

        Returns
        -------
        SequencedLDS

        Raises
        ------
        ValueError
            Another number of subgoals, or a position that is not finite.

        Examples
        --------
        >>> turn = np.linspace(0, np.pi / 2, 50)[:, None]
        >>> law = SequencedLDS.fit(np.hstack([np.cos(turn), np.sin(turn)]))
        >>> moved = law.with_subgoals(law.subgoals + [3.0, 0.0], law.start + [3.0, 0.0])
        >>> np.allclose(moved.response(), law.response() + [3.0, 0.0])
        True
        """
        goals = checked_array("subgoals", subgoals, len(self.segments), 2)
        start = checked_array("start", self.start if start is None else start, 2)
        segments = self.segments
        if turned:
            turns = chord_angles(start, goals) - chord_angles(self.start, self.subgoals)
            segments = map(LDS.turned, segments, turns)
        moved = [replace(segment, goal=goal) for segment, goal in zip(segments, goals, strict=True)]
        return replace(self, segments=tuple(moved), start=start)


def chord_angles(start, subgoals):
    """Directions (K,) in rad of the lines from each subgoal to the next, from the start on."""
    chords = np.diff(np.vstack([start, subgoals]), axis=0)
    return np.arctan2(chords[:, 1], chords[:, 0])


def check_search(tolerance, n_segments, sample_period, candidates):
    """Raise ValueError for a parameter of `SequencedLDS.fit` that is out of its range."""
    if not tolerance > 0:
        raise ValueError(f"tolerance must be positive, got {tolerance}")
    check_positive("sample_period", sample_period)
    if not 3 <= candidates <= MOST_CANDIDATES:
        raise ValueError(f"candidates must be 3 to {MOST_CANDIDATES}, got {candidates}")
    most = (candidates - 1) // 2
    if n_segments is not None and n_segments not in range(1, most + 1):
        rule = f"n_segments must be a whole number from 1 to {most} (half the candidates)"
        raise ValueError(f"{rule}, got {n_segments}")


def cut_moments(walks, shares):
    """When each walk is at given shares (K, C) of its way: (K, C) fractional sample numbers."""
    pairs = zip(shares, map(arc_length, walks), strict=True)
    return np.array([np.interp(share * w[-1], w, np.arange(len(w))) for share, w in pairs])


def demonstrated_speeds(walks, moments, sample_period):
    """Mean speed (S,) in m/s between fractional sample numbers (K, S + 1), over all walks."""
    pairs = zip(moments, map(arc_length, walks), strict=True)
    walked = [np.interp(moment, np.arange(len(w)), w) for moment, w in pairs]
    taken = np.maximum(np.diff(moments, axis=1).sum(axis=0), np.finfo(float).tiny)
    return np.diff(walked, axis=1).sum(axis=0) / (taken * sample_period)
