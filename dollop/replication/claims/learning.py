"""Claims on learning from several demonstrations (Sec. V).

All that is judged was walked, seen by the laser and segmented. Beside it stand subgoals that were
drawn of a known task by the model that the learner assumes, which flatters it: they are only told.
The paper's claims are judged by method="paper"; what Dollop learns by default is told beside it, in
numbers that end in "ours".
"""

from dataclasses import replace
from functools import lru_cache, partial
from itertools import combinations
from math import nan
from operator import attrgetter
from types import SimpleNamespace

import numpy as np

from dollop.cdhmm import SubgoalHMM
from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.lds import LDS
from dollop.learning.paper import members_along
from dollop.replication import recordings
from dollop.replication.baseline import merged
from dollop.replication.choosing import adapted, learned, model_of, response_of, task_of
from dollop.replication.claims.claim import MOSTLY, Criterion, claim, unknown
from dollop.replication.claims.measures import error_of, plain_run
from dollop.replication.claims.walked import (
    LEARNED,
    NEARER,
    WALKS,
    exponent,
    intended_places,
    intended_way,
    laws_of,
    walks_again,
)
from dollop.replication.reconstruction import TOLD
from dollop.robot.performing import Unicycle, perform
from dollop.sequenced_lds import SequencedLDS
from dollop.trajectory import distance_to_polyline

__all__ = []

SPREAD = TOLD.spread
"""Standard deviation in m of a drawn subgoal along each axis."""

# ---- subgoals of one task in one layout


@claim(
    "V",
    "If the algorithm finds statistical similarities between the subgoals of different "
    "demonstrations, then the CDHMM is simplified by combining the similarities.",
    Criterion("path_right", "share of paths as long as a usual walk", MOSTLY, 0.05, trials=1),
    Criterion("states_right", "share of CDHMMs with the states needed", MOSTLY, 0.05, trials=1),
    Criterion("states_more", "number of states beyond those needed"),
    Criterion("share_left", "states, share of the subgoals merged"),
    Criterion("pairs_right", "pairs of walks: share of CDHMMs of no more states than needed"),
    Criterion("pairs_more", "pairs of walks: number of states beyond those needed"),
    Criterion("path_right_ours", "paths right, the spread being estimated", trials=1),
    Criterion("states_right_ours", "states right, the spread being estimated", trials=1),
    Criterion("drawn_path_right", "drawn: share of paths with the task's six states", trials=1),
    Criterion("drawn_states_right", "drawn: share with the right number of states", trials=1),
    Criterion("drawn_path_right_ours", "drawn: paths right, the spread being estimated", trials=1),
    Criterion("drawn_states_right_ours", "drawn: states right, so estimated", trials=1),
    choices=(*WALKS, "merging", "spread"),
)
def combined(seed, how=TOLD):
    """Whether five walks of one person in one layout merge into one task.

    Slaloms, each segmented alone. The path is right if it has as many subgoals as the walk in the
    middle, by their number (the median). States needed: as many as the walk of the most subgoals
    has, for no walk comes to a state twice, and all mean the same. One in twenty matters. Drawn:
    five demonstrations of six subgoals that scatter by 0.15 m along each axis, one more that is no
    part of the task in 30 % of them, with a state of its own. The spread is named; ours is told
    without.
    """
    shown = subgoals_again(seed, how)[:5]
    if not shown:
        return unknown("combined") | combined_drawn(seed)
    model, ours = model_of(shown, how), SubgoalHMM.fit(shown)
    pairs = [states_more(model_of(pair, how)) for pair in combinations(shown, 2)]
    numbers = {
        "path_right": path_right(model),
        "states_right": float(states_more(model) == 0),
        "states_more": states_more(model),
        "share_left": len(model.means) / sum(map(len, shown)),
        "pairs_right": np.mean(np.equal(pairs, 0)),
        "pairs_more": np.mean(pairs),
        "path_right_ours": path_right(ours),
        "states_right_ours": float(states_more(ours) == 0),
    }
    return numbers | combined_drawn(seed)


def subgoals_again(seed, how):
    """Subgoals (K, 2) in m of each walk of one person in one layout; none if one cannot be cut."""
    walks = [each.demonstration for each in walks_again(seed, how.only(WALKS))]
    return [law.subgoals for law in laws_of(walks, attrgetter("law"))]


def path_right(model):
    """Whether the most-likely path is as long as the demonstration in the middle, by number."""
    return float(len(model.most_likely_path()) == np.median(list(map(len, model.sequences))))


def states_more(model):
    """By how many states a model has more than its longest demonstration has subgoals."""
    return float(len(model.means) - max(map(len, model.sequences)))


def combined_drawn(seed, n=5):
    """Whether drawn subgoals merge into the task's states and one for each that is none of it."""
    truth = np.array(TASKS["slalom"])
    shown = draw_demonstrations(truth, n, SPREAD, seed=[seed, 19])
    right, numbers = len(truth) + sum(len(each) > len(truth) for each in shown), {}
    for ours, model in (("", SubgoalHMM.fit(shown, SPREAD)), ("_ours", SubgoalHMM.fit(shown))):
        numbers[f"drawn_path_right{ours}"] = float(len(model.most_likely_path()) == len(truth))
        numbers[f"drawn_states_right{ours}"] = float(len(model.means) == right)
    return numbers


@claim(
    "V",
    "This merging process gives an increasingly accurate estimate about where the user intended "
    "the subgoals to be located.",
    Criterion("one_more_than_five_m", "off the intended way: one minus five [m]", NEARER, 0.01),
    Criterion("passing_alone_more_m", "two layouts: one slalom minus two [m]", NEARER, 0.01),
    Criterion("off_1_m", "subgoals of one walk, off the intended way [m]"),
    Criterion("off_2_m", "subgoals merged from two [m]"),
    Criterion("off_5_m", "subgoals merged from five [m]"),
    Criterion("sixth_off_1_m", "a sixth walk, off the law of one [m]"),
    Criterion("sixth_off_5_m", "a sixth walk, off the law of five [m]"),
    Criterion("passing_alone_more_ours_m", "two layouts, ours: one slalom minus two [m]"),
    Criterion("drawn_two_more_than_ten_m", "drawn: error from two minus from ten [m]"),
    Criterion("drawn_exponent", "drawn: exponent in their number (ideal: -0.5)"),
    Criterion("drawn_error_2_m", "drawn: mean error of the subgoals from two [m]"),
    Criterion("drawn_error_10_m", "drawn: mean error from ten [m]"),
    Criterion("half_two_more_than_ten_m", "drawn, half as wide: two minus ten [m]"),
    Criterion("half_right", "drawn, half as wide: share of right number from ten", trials=1),
    Criterion("twice_two_more_than_ten_m", "drawn, twice as wide: two minus ten [m]"),
    Criterion("twice_right", "drawn, twice as wide: share of right number from ten", trials=1),
    Criterion("tails_two_more_than_ten_m", "drawn, heavy tails: two minus ten [m]"),
    Criterion("tails_right", "drawn, heavy tails: share of right number from ten", trials=1),
    choices=LEARNED,
)
def subgoals(seed, how=TOLD):
    """How far subgoals of one walk, and merged from two and five, are from where they were meant.

    The walks of `combined`. The walker means to pass each cone 0.75 m from its centre, left and
    right in turn: the mean distance of the subgoals to the smooth way through these places, without
    his errors; where along it they are meant to be nobody knows. Two layouts: the mean distance of
    the passing places in a third to the law adapted to it, of one slalom minus of two. A centimetre
    matters, half of the tolerance. A sixth walk: its mean distance to the law. Drawn: error of six
    subgoals that scatter by 0.15 m along each axis, half or twice as wide, or by Student's t of
    three degrees of freedom, one more in 30 %; where their number is right.
    """
    if not subgoals_again(seed, how):
        return unknown("subgoals") | subgoals_drawn(seed)
    numbers = off_the_intended_way(seed, how) | sixth_off(seed, how) | subgoals_drawn(seed)
    numbers["one_more_than_five_m"] = numbers["off_1_m"] - numbers["off_5_m"]
    for ours, found in by_paper_and_ours(seed, how):
        numbers[f"passing_alone_more{ours}_m"] = passing_alone_more(found)
    return numbers


def off_the_intended_way(seed, how):
    """Mean distance in m from the intended way of subgoals of one walk, and merged from several."""
    shown, (first, *_) = subgoals_again(seed, how)[:5], walks_again(seed, how.only(WALKS))
    way = intended_way(first.scene)
    sets = {1: [[each] for each in shown], 2: [shown[:2], shown[2:4]], 5: [shown]}
    off = {}
    for n, each in sets.items():
        places = [path_of(together, how) for together in each]
        off[f"off_{n}_m"] = np.mean([distance_to_polyline(found, way).mean() for found in places])
    return off


def sixth_off(seed, how):
    """How far in m the sixth walk is from the law of one other (the mean of five), and of five."""
    *shown, kept = [each.demonstration for each in walks_again(seed, how.only(WALKS))]
    laws, method = [task_of(each, how).law for each in shown], response_of(how)
    try:
        together = learned(shown, how).law
    except ValueError:  # an ambiguous matching: it asks instead of guessing
        return {"sixth_off_1_m": nan, "sixth_off_5_m": nan}
    return {
        "sixth_off_1_m": np.mean([error_of(law, kept.walks, method) for law in laws]),
        "sixth_off_5_m": error_of(together, kept.walks, method),
    }


def path_of(sequences, how):
    """Subgoals (L, 2) in m along the most-likely path of a model of several sequences of them."""
    model = model_of(sequences, how)
    return model.means[model.most_likely_path()]


def subgoals_drawn(seed, numbers=(1, 2, 5, 10)):
    """Error of merged subgoals that were drawn, from one demonstration to ten, and its fall."""
    truth = np.array(TASKS["slalom"])

    def drawn(n, spread=SPREAD):
        return draw_demonstrations(truth, n, spread, seed=[seed, n])

    errors = errors_by_number(truth, numbers, drawn)
    told = {f"drawn_error_{n}_m": error for n, error in errors.items()}
    told |= {
        "drawn_two_more_than_ten_m": errors[2] - errors[10],
        "drawn_exponent": exponent(errors),
    }
    for name, draw in (
        ("half", partial(drawn, spread=SPREAD / 2)),
        ("twice", partial(drawn, spread=2 * SPREAD)),
        ("tails", lambda n: drawn_with_tails(truth, n, [seed, 18, n])),
    ):
        wrong = errors_by_number(truth, (2, 10), draw)
        told[f"{name}_two_more_than_ten_m"] = wrong[2] - wrong[10]
        told[f"{name}_right"] = float(np.isfinite(wrong[10]))
    return told


def errors_by_number(truth, numbers, draw):
    """Error of the merged subgoals in m for each number n of demonstrations draw(n)."""
    return {n: subgoal_error(merged(draw(n)), truth) for n in numbers}


def drawn_with_tails(truth, n, seed):
    """Demonstrations that scatter by Student's t of three degrees of freedom."""
    rng = np.random.default_rng(seed)
    exact = draw_demonstrations(truth, n, 0.0, seed=rng)
    return [subgoals + SPREAD * rng.standard_t(3, subgoals.shape) for subgoals in exact]


def subgoal_error(found, truth):
    """Mean distance in m of the found subgoals from the true ones, nan if not as many."""
    return np.linalg.norm(found - truth, axis=1).mean() if len(found) == len(truth) else nan


# ---- slaloms in several layouts


@lru_cache(maxsize=2)
def slaloms(seed, how=TOLD):
    """Two slaloms in different layouts, learned, and a third in whose layout they are tried.

    Parameters
    ----------
    seed : int
    how : Reconstruction, optional

    Returns
    -------
    SimpleNamespace or None
        `shown` and `kept` (Demonstration), `both` and `alone` (Task, adapted to the third layout),
        `scene` of the third, `response` by which their laws are judged; None where the layouts
        cannot be matched with confidence.
    """
    *walked, third = (recordings.slalom(k, seed, how.only(WALKS)) for k in range(3))
    shown, kept = [each.demonstration for each in walked], third.demonstration
    try:
        both = adapted(learned(shown, how), kept.environment, how)
        alone = [adapted(task_of(each, how), kept.environment, how) for each in shown]
    except ValueError:  # ambiguous, or a walk that cannot be cut: it asks instead of guessing
        return None
    if any(note.kind == "set aside" for note in both.notes):
        return None
    found = {"shown": shown, "kept": kept, "both": both, "alone": alone}
    return SimpleNamespace(**found, scene=third.scene, response=response_of(how))


def by_paper_and_ours(seed, how):
    """Slaloms as chosen to be learned, and by Dollop's way: (end of the names, slaloms)."""
    ours = replace(how, learning="anchored")
    return [("", slaloms(seed, how.only(LEARNED))), ("_ours", slaloms(seed, ours.only(LEARNED)))]


@claim(
    "V",
    "when segments of the task are merged together, Dollop estimates a single LDS that describes "
    "both segments, which improves the generalization ability of the estimated trajectory",
    Criterion("own_lds_more_m", "error with own LDS minus with shared ones [m]", NEARER, 0.01),
    Criterion("alone_more_m", "error of a task of one slalom minus of two [m]", NEARER, 0.01),
    Criterion("both_m", "error of the task of two demonstrations [m]"),
    Criterion("alone_more_ours_m", "ours: error of one demonstration minus that of two [m]"),
    Criterion("both_ours_m", "ours: error of the task of two demonstrations [m]"),
    choices=LEARNED,
)
def shared(seed, how=TOLD):
    """Error of a task of two slaloms, of its LDS if not shared, and of a task of one slalom.

    Two slaloms in different layouts, a third kept back: mean distance of what was walked there to
    the law adapted to its layout. First with the same subgoals, only the LDS being shared or not,
    as the paper learns; then as a whole. A centimetre matters, half of the tolerance. Ours shares
    no LDS: its law is fitted anew where the objects stand.
    """
    numbers = unknown("shared")
    if slaloms(seed, how.only(LEARNED)) is None:
        return numbers
    for ours, found in by_paper_and_ours(seed, how):
        if found is not None:
            both, *alone = walked_errors(found)
            numbers |= {f"both{ours}_m": both, f"alone_more{ours}_m": np.mean(alone) - both}
    found = slaloms(seed, replace(how, learning="paper").only(LEARNED))
    if found is None:
        return numbers
    laws = [with_own_lds(found.both, found.shown, d) for d in range(len(found.shown))]
    own = [error_of(law, found.kept.walks) for law in laws]
    return numbers | {"own_lds_more_m": np.mean(own) - walked_errors(found)[0]}


@claim(
    "V",
    "Dollop is able to reproduce and generalize user actions if it has access to multiple "
    "demonstrations performed under different environment configurations",
    Criterion(
        "sides_right",
        "share of laws that pass every cone on the user's side",
        MOSTLY,
        0.05,
        trials=1,
    ),
    Criterion(
        "plain_clear",
        "share of runs under the plain law that touch nothing",
        MOSTLY,
        0.05,
        trials=1,
    ),
    Criterion("refused", "share refused: ambiguous, or a walk that cannot be cut", trials=1),
    Criterion("sides_right_ours", "share of our laws that pass every cone rightly", trials=1),
    Criterion("plain_clear_ours", "share of plain runs under our law that touch nothing", trials=1),
    Criterion("clear_ours", "share of our runs, going round obstacles", trials=1),
    choices=(*LEARNED, "reach", "gain"),
)
def generalize(seed, how=TOLD):
    """Whether law and robot pass every cone of another layout, on the user's side and untouched.

    The slaloms of `shared`: the law in the layout of the third, beside what the user walked there;
    and one run of a unicycle under each law, which is to finish and touch nothing. One in twenty
    matters. How many layouts are drawn for one that has room is told with `kept`.
    """
    if slaloms(seed, how.only(LEARNED)) is None:
        return unknown("generalize") | {"refused": 1.0}
    numbers, grid = unknown("generalize") | {"refused": 0.0}, recordings.background_map()
    for ours, found in by_paper_and_ours(seed, how):
        if found is None:
            return numbers
        rng = np.random.default_rng([seed, 20])
        (start,) = recordings.starts_near_the_beginning(found.both, 1, rng)
        numbers[f"sides_right{ours}"] = sides_right(found)
        numbers[f"plain_clear{ours}"] = clear(plain_run, found.both, start, how)
    return numbers | {"clear_ours": clear(perform, found.both, Unicycle(start), background=grid)}


def clear(run, *inputs, **choices):
    """Whether a run finishes and touches nothing; one that is refused does not."""
    try:
        driven = run(*inputs, **choices)
    except ValueError:
        return 0.0
    return float(driven.finished and not driven.collisions)


def walked_errors(found):
    """Mean distances in m of the third slalom to the law of both others, and of each alone."""
    tasks = (found.both, *found.alone)
    return [error_of(task.law, found.kept.walks, found.response) for task in tasks]


def with_own_lds(task, shown, d):
    """The task's law with the LDS of demonstration d alone wherever it has part in a shared one."""
    own = []
    for segment, members in zip(task.law.segments, members_along(task.model), strict=True):
        mine = [shown[each].law.segments[i].statistics for each, i in members if each == d]
        own.append(LDS(mine[0], segment.goal) if mine else segment)
    return SequencedLDS(tuple(own), task.law.start, task.law.speeds)


def sides_right(found):
    """Whether the law of both slaloms passes every cone on the side on which the user passed it."""
    (walk,) = found.kept.walks
    cones, planned = found.kept.environment.centres, found.both.law.response(method=found.response)
    law, user = (recordings.passing_sides(path, cones) for path in (planned, walk))
    return float(np.array_equal(law, user))


def passing_alone_more(found):
    """How much nearer in m to the intended places a law of two slaloms is than laws of one."""
    if found is None:
        return nan
    places = intended_places(found.scene.positions)
    ways = [task.law.response(method=found.response) for task in (found.both, *found.alone)]
    both, *alone = (distance_to_polyline(places, way).mean() for way in ways)
    return np.mean(alone) - both
