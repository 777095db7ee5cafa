"""The replication's experiments, from seeds: each is simulated once and shared by the figures that show it."""

from functools import cache

from dollop.gridmap import OccupancyGrid
from dollop.lds import SequencedLDS
from dollop.observation import observe
from dollop.trajectory import laps

SEED = 2004
"""Every experiment draws from this seed, the year of the paper."""


@cache
def empty_lab():
    """Laser log of a drive through the laboratory while it is empty."""
    from dollop.lab import record_background

    return record_background(SEED)


@cache
def background_map():
    """Background map of the laboratory, built from the drive through it."""
    return OccupancyGrid.from_log(empty_lab())


@cache
def figure_eights():
    """Recording of five figure-eights round two trash cans (Sec. II)."""
    from dollop.lab import record_figure_eights

    return record_figure_eights(SEED)


@cache
def figure_eights_observed():
    """Observation of the five figure-eights."""
    return observe(figure_eights().log, background_map())


@cache
def figure_eight_laps():
    """The five laps, cut out of the user's trajectory."""
    user = figure_eights_observed().user
    return laps(user.t, user.positions)


@cache
def figure_eight_law():
    """Sequenced LDS of the five laps (Sec. III)."""
    return SequencedLDS.fit(figure_eight_laps())
