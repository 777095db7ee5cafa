"""What the paper leaves open, and how it is filled in: one record of choices, the same all the way.

Every experiment takes one, so that it can be asked what its number would be had something else been
chosen (`dollop.replication.universes`).
"""

from dataclasses import dataclass, fields, replace

__all__ = ["LEVELS", "TOLD", "Reconstruction"]


@dataclass(frozen=True)
class Reconstruction:
    """How the paper is read where it leaves something open; the defaults are what is told everywhere.

    Parameters
    ----------
    lds : {"re-timed", "raw"}
        What each LDS is fitted to: samples re-timed so that the way that remains decays
        geometrically, or as they are.
    tolerance : float
        Error in m that a segment may have.
    cuts : {"mean", "largest", "six"}
        What the tolerance bounds, the mean error of a segment or its largest; or no tolerance, but
        the division into six of least error.
    laid : {"warped", "even"}
        How laps are laid together: by a monotone warp, or share of the way by share of the way.
    weights : float
        Power of the inverse distance that weighs a corner.
    corners : int
        m, the number of nearest corners that a subgoal is tied to; all where there are no more.
    matching : {"robust", "literal"}
        How moved objects are matched: by Dollop's cost, what is not sure being left out; or by the
        paper's, corner by corner.
    merging : {"evidence", "spread"}
        By what subgoals are merged: Bayesian evidence, or nearness as the spread has it.
    spread : float
        Standard deviation in m of a subgoal along each axis, which merging expects.
    learning : {"paper", "anchored"}
        The paper's order, map first and merge then, or Dollop's.
    reach : float
        Within so many m of its subgoal an LDS hands over to the next (plain law).
    gain : float
        How eagerly the robot turns, as a multiple of the usual.
    laser_noise : float
        Standard deviation of a reading in m; pixels mix as much more or less often.
    motion_noise : float
        Spectral density in m²/s³ that the Kalman filter expects.
    walker : {"torso", "swaying", "legs"}
        What the laser meets: a torso, one that sways and drifts twice as far, or two legs.
    """

    lds: str = "re-timed"
    tolerance: float = 0.020
    cuts: str = "mean"
    laid: str = "warped"
    weights: float = 2.0
    corners: int = 16
    matching: str = "robust"
    merging: str = "evidence"
    spread: float = 0.15
    learning: str = "paper"
    reach: float = 0.25
    gain: float = 1.0
    laser_noise: float = 0.005
    motion_noise: float = 0.5
    walker: str = "torso"

    def only(self, names):
        """The same with all other fields as they are told.

        Parameters
        ----------
        names : sequence of str
            Fields.

        Returns
        -------
        Reconstruction

        Examples
        --------
        >>> how = Reconstruction(tolerance=0.04, walker="legs")
        >>> how.only(["walker", "gain"]) == Reconstruction(walker="legs")
        True
        """
        return replace(TOLD, **{name: getattr(self, name) for name in names})

    def changed(self):
        """What is other than told.

        Returns
        -------
        dict
            Value by field.
        """
        pairs = ((each.name, getattr(self, each.name)) for each in fields(self))
        return {name: value for name, value in pairs if value != getattr(TOLD, name)}


TOLD = Reconstruction()
"""What REPLICATION.md tells, and the claims are judged by."""

LEVELS = {
    "lds": ("re-timed", "raw"),
    "tolerance": (0.020, 0.010, 0.040),
    "cuts": ("mean", "largest", "six"),
    "laid": ("warped", "even"),
    "weights": (2.0, 1.0, 4.0),
    "corners": (16, 4),
    "matching": ("robust", "literal"),
    "merging": ("evidence", "spread"),
    "spread": (0.15, 0.10, 0.25),
    "learning": ("paper", "anchored"),
    "reach": (0.25, 0.15, 0.40),
    "gain": (1.0, 0.5, 2.0),
    "laser_noise": (0.005, 0.0, 0.015),
    "motion_noise": (0.5, 0.1, 2.0),
    "walker": ("torso", "swaying", "legs"),
}
"""What else a field could reasonably be, that which is told first; nobody who reads the paper can say
which. Noise of a reading: none, the data sheet's, three times as much."""
