"""Claims on observing (Sec. II) with real people, beside the same numbers of simulated ones.

The recordings are other people's and stay where they are: in the folder that the environment
variable DOLLOP_EXTERNAL_DATA names. They are

- walks/: 110 people who cross a yard, seen by a drone (Yang et al., arXiv 1902.00487), already
  filtered there with constant velocity, so that accelerations are smaller than they were;
- people/: three recordings of lasers at the height of legs (Leigh et al., ICRA 2015), in one of
  which somebody has marked where the person is.

What is measured of real people is measured of simulated ones by the same lines of code, and the two
are never put into one number. No verdict hangs on either.
"""

import os
import zipfile
from dataclasses import asdict, dataclass
from itertools import chain
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy import stats

from dollop.checks import need
from dollop.formats.files import FormatError
from dollop.formats.kinds import Kind
from dollop.formats.logs import read_log
from dollop.formats.writing import together, whole_file
from dollop.gridmap import OccupancyGrid
from dollop.lab.people import read_walks
from dollop.lab.person import figure_eight
from dollop.observation import observe
from dollop.replication.running import REPORT, as_json, put_between_marks, report_beside
from dollop.tracking import (
    Motion,
    draw_particles,
    move_particles,
    particle_moments,
    predict,
    smooth,
    update,
)

__all__ = [
    "DATA", "HIDDEN", "NOISE", "NOISES", "Number", "PERIOD", "Seen", "annotated", "best_motion",
    "command", "errors_when_hidden", "even_walk", "folder_of_recordings", "gap_errors",
    "hidden_people", "local_noise", "numbers", "people_table", "predictions", "publish", "seen_of",
    "simulated_walks", "states_of", "stretches",
]  # fmt: skip

DATA = "DOLLOP_EXTERNAL_DATA"
"""Environment variable that names the folder of recordings."""

HIDDEN = (0.4, 1.0, 2.0, 3.5, 5.0)
"""For so long people are hidden, in s."""

PERIOD, FIRST, EVERY = 0.1, 2.0, 1.0
"""s: between positions; what is seen of a walker before it is hidden; and between two hidings."""

NOISES = tuple(np.geomspace(1e-5, 1e3, 25))
"""Noises of the motion models that are tried, in m^2/s^(2 order - 1): more than the claims try, for
people who cross a yard walk more evenly than those can say."""

NOISE = 0.028
"""m per axis: that of the centroids in the simulation (`centroid`)."""

MISSED = 0.5
"""m from a prediction at which who reappears is taken for somebody new, as in `prediction`."""

ROUND = 0.5
"""m round a person within which a reading is one of them."""

NEARER = 0.2
"""m: what is so much nearer than a beam's usual reading does not stand there."""

FEWEST, HALF_SECOND, STRETCH = 2, 0.5, 10.0
"""Readings that make a centroid; s on either side of a smooth piece of way; s of a stretch."""

LONG = 30.0
"""s for which somebody is followed before a standing laser who counts."""

WALKERS = 40
"""Simulated figure-eights beside the 110 walks; the first five are seen by the laser as well."""

WALKS = "Yang et al., arXiv 1902.00487 (walks/); no licence stated, to be cited"
BAGS = {
    "demo_stationary_simple_environment.bag": (
        "Leigh et al., ICRA 2015 (leg_tracker), BSD-3: three people before a standing laser"
    ),
    "walker_1.bag": "Leigh et al., ICRA 2015 (leg_tracker), BSD-3: one person before a standing laser",
    "person_following_outdoor_1.bag.zip": (
        "Leigh et al., ICRA 2015 (leg_tracker_benchmarks), no licence stated: a robot follows one person outdoors"
    ),
}

SUMMARY = Kind("numbers of real people", rb'\A\[\s*(\]|\{\s*"claim":)')


@dataclass(frozen=True)
class Number:
    """A number of real or of simulated people.

    Parameters
    ----------
    claim : str
        Whose experiment it belongs to.
    number, meaning : str
        Its name, and what it is with its unit.
    people : str
        "real" or "simulated".
    source : str
        Which people, and the licence of a recording.
    hidden_s : float or None
        For how long they were hidden, in s.
    noise_mm : float
        Standard deviation of the noise that was added per axis, in mm.
    mean, low, high : float or None
        With its 95 % interval (Student's), which takes people who walked together for strangers.
    n : int
        Of how many.
    unit : str
        What is counted.
    """

    claim: str
    number: str
    meaning: str
    people: str
    source: str
    hidden_s: float | None
    noise_mm: float
    mean: float | None
    low: float | None
    high: float | None
    n: int
    unit: str


def measured(values, **what):
    """A `Number` from values (N,), one for each unit; nan are none."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values)]
    n = len(values)
    mean = values.mean() if n else nan
    reach = stats.t.ppf(0.975, n - 1) * stats.sem(values) if n > 1 else nan
    mean, low, high = (short(end) for end in (mean, mean - reach, mean + reach))
    return Number(**what, mean=mean, low=low, high=high, n=n)


def short(value):
    """A number to four significant digits, None for what is no number."""
    return float(f"{value:.4g}") if np.isfinite(value) else None


def folder_of_recordings():
    """The folder with other people's recordings.

    Returns
    -------
    Path

    Raises
    ------
    ValueError
        If the environment variable names none that is there.
    """
    named = os.environ.get(DATA)
    if not named or not Path(named).is_dir():
        raise ValueError(f"real people need {DATA} to name a folder with walks/ and people/, got {named!r}")
    return Path(named)


# ---- predictions of people who are hidden


def even_walk(walk):
    """Positions (M, 2) in m of a walk (N, 3) of t in s, x and y, every tenth of a second."""
    t = np.arange(walk[0, 0], walk[-1, 0] + 1e-9, PERIOD)
    return np.column_stack([np.interp(t, walk[:, 0], column) for column in walk.T[1:]])


def simulated_walks(count=WALKERS):
    """Simulated people who walk one figure-eight each, seen from above.

    Parameters
    ----------
    count : int

    Returns
    -------
    list of (N, 3) float arrays
        t in s, x and y in m.
    """
    from dollop.lab import figure_eight_scene

    walks = [figure_eight(figure_eight_scene(), seed, laps=1) for seed in range(count)]
    return [np.column_stack([walk.t, walk.positions]) for walk in walks]


def states_of(walks, motion):
    """Where the Kalman filter has several people, each from what was seen of them so far.

    Parameters
    ----------
    walks : sequence of K (N_k, 2) float arrays
        Positions in m, every tenth of a second.
    motion : Motion

    Returns
    -------
    means : (T, K, n, 2) float array
        In m, m/s, and m/s^2 for an order n of 3; of no meaning after the end of a walk.
    covariances : (T, K, n, n) float array
    """
    longest = max(map(len, walks))
    shown = np.stack([walk[np.minimum(np.arange(longest), len(walk) - 1)] for walk in walks], axis=1)
    state, transition = motion.birth(shown[0]), motion.transition(PERIOD)
    states = [state]
    for places in shown[1:]:
        state = update(*predict(*state, *transition), places, motion.measurement_sd)
        states.append(state)
    means, covariances = zip(*states, strict=True)
    return np.array(means), np.array(covariances)


def predictions(mean, steps, motion):
    """Where somebody will be, by the motion model.

    Parameters
    ----------
    mean : (..., n, 2) float array
        When last seen, in m, m/s, m/s^2.
    steps : int
        Tenths of a second.
    motion : Motion

    Returns
    -------
    (..., steps, 2) float array
        In m.
    """
    F = motion.transitions(PERIOD * np.arange(1, steps + 1))[0]
    return F[:, 0] @ mean[..., :, :]


def standing(mean, steps, motion):
    """As `predictions`, of somebody who stays where they were last seen."""
    return np.broadcast_to(mean[..., :1, :], (*mean.shape[:-2], steps, 2))


def hidings(walk, steps):
    """The last scans before somebody is hidden for so many, once a second."""
    return np.arange(round(FIRST / PERIOD), len(walk) - steps, round(EVERY / PERIOD))


def errors_when_hidden(walks, shown, motion, steps, predicted=predictions):
    """Errors of predicting people who are hidden, for each of them.

    Parameters
    ----------
    walks, shown : sequences of K (N_k, 2) float arrays
        Where people are, and where they are seen, in m, every tenth of a second.
    motion : Motion
    steps : int
        Tenths of a second for which they are hidden.
    predicted : callable, optional
        As `predictions`.

    Returns
    -------
    errors : (K,) float array
        Mean distance in m while hidden, nan of who walks for too short a time.
    missed : (K,) float array
        Share of the hidings after which the prediction is off by half a metre or more.
    """
    means, _ = states_of(shown, motion)
    errors, missed = np.full((2, len(walks)), nan)
    for k, walk in enumerate(walks):
        last = hidings(walk, steps)
        if len(last):
            hidden = walk[last[:, None] + np.arange(1, steps + 1)]
            off = np.linalg.norm(predicted(means[last, k], steps, motion) - hidden, axis=2)
            errors[k], missed[k] = off.mean(), (off[:, -1] >= MISSED).mean()
    return errors, missed


def particle_errors(walks, shown, motion, steps):
    """As `errors_when_hidden`, by 200 particles that know nothing of free space."""
    means, covariances = states_of(shown, motion)
    transition = motion.transition(PERIOD)
    errors, missed = np.full((2, len(walks)), nan)
    for k, walk in enumerate(walks):
        off, rng = [], np.random.default_rng([k, steps])
        for last in hidings(walk, steps):
            cloud, guesses = draw_particles(means[last, k], covariances[last, k], rng), []
            for _ in range(steps):
                cloud = move_particles(cloud, *transition, rng)
                guesses.append(particle_moments(cloud)[0][0])
            off.append(np.linalg.norm(guesses - walk[last + 1 : last + steps + 1], axis=1))
        if off:
            errors[k], missed[k] = np.mean(off), (np.array(off)[:, -1] >= MISSED).mean()
    return errors, missed


def best_motion(walks, shown, order):
    """The motion model whose noise predicts these people best, all times hidden together."""
    models = [Motion(order, noise) for noise in NOISES]
    totals = np.zeros(len(models))
    for k, model in enumerate(models):
        for n in _steps():
            errors, _ = errors_when_hidden(walks, shown, model, n)
            totals[k] += errors[np.isfinite(errors)].sum()
    return models[totals.argmin()]


def _steps():
    """The times of being hidden in tenths of a second."""
    return [round(each / PERIOD) for each in HIDDEN]


def hidden_people(walks, noise=0.0):
    """Errors of every predictor for people, each half of them with noises chosen on the other.

    Every other person is of one half. What is predicted with is chosen for all times of being
    hidden together.

    Parameters
    ----------
    walks : list of (N_k, 2) float arrays
    noise : float
        Added to what is seen, in m per axis.

    Returns
    -------
    dict
        By predictor and tenths of a second hidden: (errors, missed), as `errors_when_hidden`.
    """
    rng = np.random.default_rng(0)
    shown = [walk + rng.normal(0.0, noise, walk.shape) if noise else walk for walk in walks]
    first, second = (_half_hidden(walks, shown, half) for half in (0, 1))
    return {key: np.hstack([first[key], second[key]]) for key in first}


def _half_hidden(walks, shown, half):
    """As `hidden_people`, of one half."""
    mine, other = ((walks[k::2], shown[k::2]) for k in (half, 1 - half))
    straight, curved = (best_motion(*other, order) for order in (2, 3))
    found = {}
    for n in _steps():
        found["velocity", n] = errors_when_hidden(*mine, straight, n)
        found["acceleration", n] = errors_when_hidden(*mine, curved, n)
        found["standing", n] = errors_when_hidden(*mine, straight, n, standing)
        found["particles", n] = particle_errors(*mine, straight, n)
    return found


COMPARED = (
    ("velocity", "velocity_m", "error with velocity [m]", ("velocity", 0), None),
    (
        "velocity",
        "acceleration_more_m",
        "acceleration minus velocity [m]",
        ("acceleration", 0),
        ("velocity", 0),
    ),
    ("velocity", "standing_more_m", "neither minus velocity [m]", ("standing", 0), ("velocity", 0)),
    (
        "prediction",
        "blind_more_m",
        "blind particles minus Kalman [m]",
        ("particles", 0),
        ("velocity", 0),
    ),
    ("prediction", "kalman_missed", "share that Kalman misses by 0.5 m", ("velocity", 1), None),
    (
        "prediction",
        "blind_missed_more",
        "the same, particles minus Kalman",
        ("particles", 1),
        ("velocity", 1),
    ),
)
"""Claim, number, meaning, whose errors (0) or misses (1) it is of, and minus whose."""


def numbers_hidden(walks, noise, **what):
    """Numbers of `velocity` and `prediction` of some people, by how long they are hidden."""
    found, numbers = hidden_people(walks, noise), []
    for claim, number, meaning, (one, row), other in COMPARED:
        for seconds, n in zip(HIDDEN, _steps(), strict=True):
            values = found[one, n][row] - (found[other[0], n][other[1]] if other else 0.0)
            told = {"claim": claim, "number": number, "meaning": meaning, "hidden_s": seconds}
            numbers.append(measured(values, **told, noise_mm=1e3 * noise, unit="person", **what))
    return numbers


# ---- people before a laser


@dataclass(frozen=True, eq=False)
class Seen:
    """One person before a laser.

    Parameters
    ----------
    t : (N,) float array
        s.
    centroids : (N, 2) float array
        Mean of the readings of that person in m, nan where there are too few.
    """

    t: np.ndarray
    centroids: np.ndarray


def seen_of(log, t, places, rows=None):
    """Centroids of a person whose whereabouts are known.

    Parameters
    ----------
    log : LaserLog
        A laser that stands still, or one in whose own frame everything is (`rows` given).
    t : (N,) float array
        s.
    places : (N, 2) float array
        Where the person is about, in m.
    rows : (N,) int array, optional
        Scans of the log; those at the times `t` otherwise. Without it readings of what stands, not
        nearer than the median of their beam, are left out.

    Returns
    -------
    Seen
    """
    standing = rows is None
    rows = np.searchsorted(log.t, t) if standing else rows
    ranges, bearings = log.ranges[rows], log.angles + log.poses[rows, 2:]
    with np.errstate(invalid="ignore"):
        x = log.poses[rows, :1] + ranges * np.cos(bearings)
        y = log.poses[rows, 1:2] + ranges * np.sin(bearings)
        near = np.hypot(x - places[:, :1], y - places[:, 1:]) < ROUND
        if standing:
            near &= ranges < np.median(log.ranges, axis=0) - NEARER
    count = near.sum(axis=1)
    sums = np.column_stack([np.where(near, each, 0.0).sum(axis=1) for each in (x, y)])
    few = (count < FEWEST)[:, None]
    return Seen(np.asarray(t, float), np.where(few, nan, sums / np.maximum(count, 1)[:, None]))


def stretches(seen):
    """Walks of 10 s, one after the other, seen in nine of ten scans and moving by a metre."""
    found = []
    for begin in np.arange(seen.t[0], seen.t[-1] - STRETCH, STRETCH):
        rows = (seen.t >= begin) & (seen.t < begin + STRETCH)
        part = Seen(seen.t[rows], seen.centroids[rows])
        shown = np.isfinite(part.centroids[:, 0])
        if len(shown) < 20 or shown.mean() < 0.9 or np.diff(part.t).max() > 0.5 or not shown[0]:
            continue
        if np.hypot(*np.ptp(part.centroids[shown], axis=0)) >= 1.0:
            found.append(part)
    return found


def local_noise(seen):
    """Noise of centroids about a smooth way, where the truth is not known.

    A parabola is laid through the half second before and after each centroid, that one included;
    what it leaves, made up for what it takes along, is noise. What sways for longer is not seen
    in it.

    Parameters
    ----------
    seen : Seen

    Returns
    -------
    float
        Standard deviation per axis in m.
    """
    shown = np.isfinite(seen.centroids[:, 0])
    t, places = seen.t[shown], seen.centroids[shown]
    squares = []
    for i in range(len(t)):
        near = np.abs(t - t[i]) <= HALF_SECOND + 1e-3
        if near.sum() >= 6 and np.abs(t[near][[0, -1]] - t[i]).min() > 0.6 * HALF_SECOND:
            powers = np.vander(t[near] - t[i], 3, increasing=True)
            weights = np.linalg.pinv(powers)[0]  # the parabola's value at t[i], from the places
            own = 1 - weights[np.flatnonzero(near) == i][0]
            squares.append(np.square(places[i] - weights @ places[near]).mean() / own)
    return np.sqrt(np.mean(squares)) if squares else nan


def gap_errors(seen, seconds):
    """How far the smoothed track through a gap is from what was seen there.

    Parameters
    ----------
    seen : Seen
        A stretch of 10 s.
    seconds : float
        The gap, in its middle.

    Returns
    -------
    float
        Mean distance in m of the track from the centroids that it was not shown.
    """
    off = np.abs(seen.t - seen.t.mean()) <= seconds / 2
    if not np.isfinite(seen.centroids[off, 0]).any():
        return nan
    track, _ = smooth(seen.t, np.where(off[:, None], nan, seen.centroids), Motion())
    return np.nanmean(np.linalg.norm(track - seen.centroids, axis=1)[off])


def followed(path):
    """People before a laser that stands still, followed from scan to scan: list of Seen."""
    log = read_log(path)
    people = observe(log, OccupancyGrid.from_log(log)).people
    long = [person for person in people if person.t[-1] - person.t[0] > LONG]
    return [seen_of(log, person.t, person.positions) for person in long]


def annotated(path, scans="/scan_base2", places="/ground_truth_people_tracks"):
    """The person whom somebody has marked in the scans of a zipped bag: list of one Seen.

    Everything is in the frame of the laser, which moves.
    """
    with TemporaryDirectory() as folder:
        with zipfile.ZipFile(path) as packed:
            bag = packed.extract(path.name.removesuffix(".zip"), folder)
        log = read_log(bag, topic=scans)
        times, marked = _marked(bag, scans, places)
    if len(times) != len(log):
        problem = f"of {len(times)} scans all must be readable, got {len(log)}"
        raise FormatError(problem, path)
    rows = np.searchsorted(times, marked[:, 0]) - 1
    kept = np.flatnonzero((rows >= 0) & (np.diff(rows, append=len(times)) > 0))
    return [seen_of(log, log.t[rows[kept]], marked[kept, 1:], rows[kept])]


def _marked(bag, scans, places):
    """When the scans of a bag came, (T,) in s, and what is marked, (N, 3) of time, x and y."""
    need("ros")
    from rosbags.highlevel import AnyReader

    with AnyReader([Path(bag)]) as reader:
        chosen = [each for each in reader.connections if each.topic in (scans, places)]
        times, marked = [], []
        for connection, stamp, raw in reader.messages(chosen):
            if connection.topic == scans:
                times.append(1e-9 * stamp)
            else:
                place = reader.deserialize(raw, connection.msgtype).pose.position
                marked.append((1e-9 * stamp, place.x, place.y))
    return np.array(times), np.array(marked)


def simulated_before_the_laser(body, count=5):
    """Simulated people who walk five figure-eights each in the paper's laboratory: list of Seen."""
    from dollop.lab import record_figure_eights
    from dollop.replication import recordings

    found = []
    for seed in range(count):
        recording = record_figure_eights(seed, **recordings.KEPT, body=body)
        log, truth = recording.log, recording.truth
        places = np.column_stack([np.interp(log.t, truth.t, column) for column in (truth.x, truth.y)])
        found.append(seen_of(log, log.t, places))
    return found


def numbers_seen(walkers, **what):
    """Numbers of `centroid` and `interpolation` of people before a laser."""
    parts = list(chain.from_iterable(map(stretches, walkers)))
    noise = [1e3 * local_noise(part) for part in parts]
    what |= {"noise_mm": 0.0, "unit": "stretch of 10 s"}
    meaning = "noise per axis about a smooth way [mm]"
    told = {"claim": "centroid", "number": "local_noise_mm", "meaning": meaning, "hidden_s": None}
    numbers = [measured(noise, **told, **what)]
    meaning = "smoothed track in a gap, from what was seen there [m]"
    told = {"claim": "interpolation", "number": "gap_m", "meaning": meaning}
    for seconds in HIDDEN:
        errors = [gap_errors(part, seconds) for part in parts]
        numbers.append(measured(errors, **told, hidden_s=seconds, **what))
    return numbers


# ---- all of it, and telling


def numbers(folder):
    """Every number of real people, and of simulated ones beside them.

    Parameters
    ----------
    folder : str or Path
        With walks/ and people/.

    Returns
    -------
    list of Number

    Raises
    ------
    FormatError
        If a recording is missing or something else.
    ImportError
        If rosbags or PyBullet is not installed.
    """
    need("ros")
    need("lab")
    folder, found = Path(folder), []
    crowds = {"real": (read_walks(folder / "walks"), WALKS)}
    crowds["simulated"] = simulated_walks(), "one figure-eight each, seen from above"
    for people, (walks, source) in crowds.items():
        even = [even_walk(walk) for walk in walks]
        for noise in (0.0, NOISE):
            found += numbers_hidden(even, noise, people=people, source=source)
    for name, source in BAGS.items():
        read = annotated if name.endswith(".zip") else followed
        found += numbers_seen(read(folder / "people" / name), people="real", source=source)
    for body, told in (("torso", "a torso"), ("legs", "two legs")):
        source = f"five figure-eights each, {told} before the laser"
        found += numbers_seen(simulated_before_the_laser(body), people="simulated", source=source)
    return found


def people_table(found):
    """Numbers as a Markdown table, those of simulated and of real people beside each other.

    What was seen from above is told with the noise of centroids; without it, it is in people.json.

    Parameters
    ----------
    found : list of Number

    Returns
    -------
    str
    """
    head = "| claim | number | hidden for | simulated | real people |"
    noisy = [each for each in found if each.noise_mm or each.claim in ("centroid", "interpolation")]
    keys = dict.fromkeys((each.claim, each.meaning, each.hidden_s) for each in noisy)
    return "\n".join([head, "|" + "---|" * 5, *(_row(key, noisy) for key in keys)])


def _row(key, found):
    """A row of the table."""
    claim, meaning, hidden = key
    mine = [each for each in found if (each.claim, each.meaning, each.hidden_s) == key]
    cells = []
    for side in ("simulated", "real"):
        cells.append("<br>".join(_told(each) for each in mine if each.people == side))
    time = "" if hidden is None else f"{hidden:g} s"
    return f"| `{claim}` | {meaning} | {time} | {' | '.join(cells)} |"


WHOSE = {
    "a torso": "torso",
    "two legs": "legs",
    "three people": "three people",
    "one person before": "one person",
    "follows one": "outdoors",
}


def _told(number):
    """A number with its interval, and whose it is where there are several."""
    whose = next((f"{name}: " for words, name in WHOSE.items() if words in number.source), "")
    if number.low is None:
        return f"{whose}no interval"
    return f"{whose}{number.mean:.3g} [{number.low:.3g}, {number.high:.3g}]"


def command(options):
    """Measure real people and simulated ones, write people.json, and the table in REPLICATION.md.

    Parameters
    ----------
    options : argparse.Namespace
        folder (None for the usual one).

    Raises
    ------
    ValueError
        If the environment variable names no folder of recordings, or the report has no such table.
    FormatError
        If a recording is missing or something else.
    ImportError
        If an extra is missing.
    OSError
        If the folder cannot be written to.
    """
    recorded, folder = folder_of_recordings(), options.folder or Path("study")
    folder.mkdir(parents=True, exist_ok=True)
    publish(numbers(recorded), folder)


def publish(found, folder):
    """Write the numbers into a folder, and the table into REPLICATION.md if it stands beside it."""
    report = report_beside(folder)
    with together():
        with whole_file(folder / "people.json", "w", SUMMARY) as stream:
            stream.write(as_json([asdict(each) for each in found]))
        if report:
            text = put_between_marks(report.read_text(), "people", people_table(found))
            with whole_file(report, "w", REPORT) as stream:
                stream.write(text)
    print(f"wrote {folder / 'people.json'}")
