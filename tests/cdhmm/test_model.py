"""Sec. V: known tasks recovered, and what must hold for any demonstrations."""

from itertools import pairwise, permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.stats import multivariate_normal

from dollop.cdhmm import SubgoalHMM
from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.lds import LDS, Statistics

SLALOM = np.array(TASKS["slalom"])


def found_by(model):
    return model.means[model.most_likely_path()]


def partition(model):
    """Which subgoals share a state, whatever the states are called."""
    return {frozenset(members) for members in members_of(model).values()}


def members_of(model):
    members = {}
    for demonstration, states in enumerate(model.states):
        for place, state in enumerate(states.tolist()):
            members.setdefault(state, []).append((demonstration, place))
    return members


# ---- known tasks


def test_ties_go_to_the_path_of_fewer_states():
    """Of two demonstrations, one of which has a subgoal more, the shorter one is the task."""
    longer = np.insert(SLALOM, 3, (2.0, 2.5), axis=0)
    assert len(SubgoalHMM.fit([longer, SLALOM]).most_likely_path()) == 6


@pytest.mark.parametrize("spread", [0.05, 0.15])
@pytest.mark.parametrize(("n", "share"), [(2, 0.95), (5, 0.99)])
@pytest.mark.parametrize("task", TASKS)
def test_right_number_of_subgoals(task, n, share, spread):
    """Two demonstrations give the true number of subgoals in 95 % of seeds, five in 99 %, odd subgoals or not."""
    seeds = range(100) if task == "slalom" else range(100, 130)
    lengths = [
        len(SubgoalHMM.fit(draw_demonstrations(TASKS[task], n, spread, seed=seed)).most_likely_path()) for seed in seeds
    ]
    assert np.mean(np.equal(lengths, 6)) >= share


@pytest.mark.parametrize("n", [2, 5, 12])
def test_error_falls_with_the_root_of_the_number_of_demonstrations(n):
    """Subgoals are as near the truth as the mean of n scattered points: spread sqrt(pi / 2) / sqrt(n), within 10 %."""
    errors = []
    for seed in range(20):
        found = found_by(SubgoalHMM.fit(draw_demonstrations(SLALOM, n, 0.15, seed=seed)))
        errors.append(np.linalg.norm(found - SLALOM, axis=1).mean())
    assert np.mean(errors) == pytest.approx(0.15 * np.sqrt(np.pi / 2 / n), rel=0.1)


def test_a_place_visited_twice_stays_two_states():
    """The crossing of the figure-eight is two states, as it comes twice in every demonstration."""
    model = SubgoalHMM.fit(draw_demonstrations(TASKS["figure-eight"], 4, 0.1, extra=0, seed=3))
    path = model.most_likely_path()
    assert len(path) == len(model.means) == 6
    assert np.linalg.norm(model.means[path[1]] - model.means[path[4]]) < 0.2


def test_covariances_approach_the_true_ones():
    """Forty demonstrations tell a narrow and a wide direction, though the prior expects neither."""
    random = np.random.default_rng(0)
    sequences = [SLALOM + random.normal(0, (0.05, 0.25), SLALOM.shape) for _ in range(40)]
    deviations = np.sqrt(np.diagonal(SubgoalHMM.fit(sequences, 0.15).covariances, axis1=1, axis2=2))
    assert np.allclose(deviations.mean(0), (0.05, 0.25), atol=0.03)


# ---- a demonstration that does something else


@pytest.mark.parametrize("seed", range(5))
def test_another_task_is_reported_and_moves_no_subgoal(seed):
    """A demonstration of another task, near some subgoals by chance, is an outlier: the task stays as without it."""
    demonstrations = draw_demonstrations(SLALOM, 4, 0.05, extra=0, seed=seed)
    other = np.array([(0.2, 1.8), (1.4, 1.1), (3.1, 2.0), (4.4, 0.8), (6.0, 2.2)])
    model = SubgoalHMM.fit([*demonstrations[:2], other, *demonstrations[2:]])
    assert model.outliers() == (2,)
    assert np.allclose(found_by(model), np.mean(demonstrations, axis=0))
    kept = np.concatenate([states for k, states in enumerate(model.states) if k != 2])
    assert not np.isin(model.states[2], kept).any()


def test_the_task_backwards_is_another_task():
    """The same subgoals in the opposite order are no demonstration of the task, and change nothing in it."""
    demonstrations = draw_demonstrations(SLALOM, 3, 0.05, extra=0, seed=0)
    model = SubgoalHMM.fit([*demonstrations, SLALOM[::-1]])
    assert model.outliers() == (3,)
    assert np.allclose(found_by(model), np.mean(demonstrations, axis=0))


def test_two_outliers_alike_share_states_with_each_other():
    """Two demonstrations of another task are one branch of their own."""
    other = SLALOM + (0, 4)
    model = SubgoalHMM.fit([*draw_demonstrations(SLALOM, 4, 0.05, extra=0, seed=1), other, other + 0.02])
    assert model.outliers() == (4, 5)
    assert np.array_equal(model.states[4], model.states[5])


def test_like_demonstrations_have_no_outlier():
    """Demonstrations of one task are no outliers, whatever odd subgoal they have."""
    assert all(SubgoalHMM.fit(draw_demonstrations(SLALOM, 5, 0.1, seed=seed)).outliers() == () for seed in range(20))


# ---- what holds for any demonstrations

coordinates = st.floats(-5, 5, allow_subnormal=False) | st.sampled_from([0.0, 0.1, 1.0])
any_demonstrations = st.lists(
    st.integers(1, 5).flatmap(lambda length: arrays(float, (length, 2), elements=coordinates)), min_size=1, max_size=5
)


@settings(max_examples=150)
@given(any_demonstrations, st.sampled_from([0.01, 0.15, 2.0]))
def test_any_demonstrations_give_a_proper_acyclic_model(sequences, spread):
    """Rows and their ends sum to one, edges lead upwards, covariances are positive, the path leads through."""
    model = SubgoalHMM.fit(sequences, spread)
    assert np.allclose(model.transitions.sum(1) + model.end, 1)
    assert model.start.sum() == pytest.approx(1)
    assert not np.tril(model.transitions).any()
    assert (np.linalg.eigvalsh(model.covariances) > 0).all()
    path = model.most_likely_path()
    assert model.start[path[0]] > 0
    assert model.end[path[-1]] > 0
    assert all(model.transitions[u, v] > 0 for u, v in pairwise(path))


@settings(max_examples=60)
@given(any_demonstrations)
def test_any_demonstration_passes_its_states_in_order(sequences):
    """A demonstration visits no state twice, and means are the means of what was merged into them."""
    model = SubgoalHMM.fit(sequences)
    assert all((np.diff(states) > 0).all() for states in model.states)
    for state, members in members_of(model).items():
        assert np.allclose(model.means[state], np.mean([sequences[k][i] for k, i in members], axis=0))


@pytest.mark.parametrize("task", TASKS)
def test_order_of_demonstrations_does_not_matter(task):
    """Every order of four demonstrations leads to the same states."""
    sequences = draw_demonstrations(TASKS[task], 4, 0.15, seed=7)
    expected = partition(SubgoalHMM.fit(sequences))
    for order in permutations(range(4)):
        found = partition(SubgoalHMM.fit([sequences[k] for k in order]))
        assert {frozenset((order[k], i) for k, i in members) for members in found} == expected


def test_frame_and_unit_do_not_matter():
    """Turned, moved and scaled demonstrations give the same states, turned, moved and scaled (the spread too)."""
    sequences = draw_demonstrations(TASKS["ring"], 5, 0.15, seed=2)
    c, s = np.cos(0.7), np.sin(0.7)
    turned = [100 * sequence @ [[c, s], [-s, c]] + (4e3, -7e3) for sequence in sequences]
    plain, moved = SubgoalHMM.fit(sequences), SubgoalHMM.fit(turned, spread=15.0)
    assert partition(plain) == partition(moved)
    assert np.allclose(found_by(moved), 100 * found_by(plain) @ [[c, s], [-s, c]] + (4e3, -7e3))


def test_identical_demonstrations_become_one_chain():
    """Where every choice is a tie, the structure is still the right one."""
    model = SubgoalHMM.fit([SLALOM] * 4)
    assert np.allclose(model.means, SLALOM)
    assert np.array_equal(model.transitions, np.eye(6, k=1))


def test_one_demonstration_is_the_task():
    """A single demonstration is its own chain."""
    model = SubgoalHMM.fit([SLALOM])
    assert np.allclose(found_by(model), SLALOM)
    assert model.outliers() == ()


def test_adding_equals_fitting_all_at_once():
    """One more demonstration leads where fitting all of them leads."""
    sequences = draw_demonstrations(SLALOM, 4, 0.1, seed=5)
    added, fitted = SubgoalHMM.fit(sequences[:3]).add(sequences[3]), SubgoalHMM.fit(sequences)
    assert partition(added) == partition(fitted)
    assert np.array_equal(added.means, fitted.means)


def test_demonstrations_are_not_changed():
    """Neither fitting nor the record kept of them touches the arrays given."""
    sequences = draw_demonstrations(SLALOM, 2, 0.1, seed=5)
    copies = [sequence.copy() for sequence in sequences]
    model = SubgoalHMM.fit(sequences)
    sequences[0][0] = 99
    assert np.array_equal(model.sequences[0], copies[0])
    assert np.array_equal(sequences[1], copies[1])


# ---- segments along edges


def segments_of(demonstrations, random):
    """A bent trajectory to each subgoal, from the one before or from the origin."""
    ends = [np.concatenate([[(-1.0, 0.0)], demonstration]) for demonstration in demonstrations]
    bend = np.sin(np.linspace(0, np.pi, 20))[:, None] * (0.0, 0.3)
    return [
        [np.linspace(a, b, 20) + bend + random.normal(0, 0.02, (20, 2)) for a, b in pairwise(each)] for each in ends
    ]


def test_merged_segments_share_the_law_of_the_pooled_data():
    """Statistics added along an edge give the LDS that least squares fits to all segments of that edge together."""
    demonstrations = draw_demonstrations(SLALOM, 4, 0.05, seed=1)
    segments = segments_of(demonstrations, np.random.default_rng(1))
    model = SubgoalHMM.fit(demonstrations)
    for members in model.segments().values():
        along = [segments[k][i] for k, i in members]
        first, *others = map(Statistics.of, along)
        assert np.allclose(sum(others, first).matrix, LDS.fit(along, retimed=False).A)


def test_every_segment_runs_along_one_edge():
    """The map from edges to segments holds each segment once, and only edges that the model has."""
    model = SubgoalHMM.fit(draw_demonstrations(SLALOM, 5, 0.1, seed=9))
    edges = model.segments()
    every = {(k, i) for k, sequence in enumerate(model.sequences) for i in range(len(sequence))}
    assert sorted(member for members in edges.values() for member in members) == sorted(every)
    assert all((model.start[v] if u == -1 else model.transitions[u, v]) > 0 for u, v in edges)


# ---- another demonstration


def test_likelihood_is_the_sum_over_all_paths():
    """The forward recursion equals the sum over every sequence of states."""
    model = SubgoalHMM.fit(draw_demonstrations(SLALOM[:3], 3, 0.2, seed=4))
    sequence, total = SLALOM[:3] + 0.1, 0.0
    for states in product(range(len(model.means)), repeat=3):
        steps = [model.transitions[u, v] for u, v in pairwise(states)]
        density = [
            multivariate_normal(model.means[state], model.covariances[state]).pdf(point)
            for state, point in zip(states, sequence, strict=True)
        ]
        total += model.start[states[0]] * np.prod(steps) * model.end[states[-1]] * np.prod(density)
    assert model.log_likelihood(sequence) == pytest.approx(np.log(total))


def test_likelihood_prefers_the_task():
    """The task is more likely than the task moved aside, and what no path can emit is impossible."""
    model = SubgoalHMM.fit(draw_demonstrations(SLALOM, 3, 0.05, extra=0, seed=4))
    assert model.log_likelihood(SLALOM) > model.log_likelihood(SLALOM + 0.5)
    assert model.log_likelihood(SLALOM[:3]) == -np.inf


def test_states_of_another_demonstration():
    """The task passes all states in order; an odd subgoal belongs to none; a part of the task to its states."""
    model = SubgoalHMM.fit(draw_demonstrations(SLALOM, 3, 0.05, extra=0, seed=4))
    assert model.states_of(SLALOM).tolist() == [0, 1, 2, 3, 4, 5]
    assert model.states_of(np.insert(SLALOM, 2, (3, 3), axis=0)).tolist() == [0, 1, -1, 2, 3, 4, 5]
    assert model.states_of(SLALOM[1:4]).tolist() == [1, 2, 3]


# ---- bad input


@pytest.mark.parametrize(
    ("sequences", "message"),
    [
        ([], "at least one demonstration, got none"),
        ([SLALOM, np.empty((0, 2))], r"demonstration 1 must hold at least one subgoal"),
        ([SLALOM[0]], r"demonstration 0 must have shape \(N, 2\), got \(2,\)"),
        ([np.zeros((4, 3))], r"demonstration 0 must have shape \(N, 2\), got \(4, 3\)"),
        ([SLALOM, [(0, 0), (np.nan, 1)]], "demonstration 1 must be finite, got .*nan"),
        ([[(np.inf, 1)]], "demonstration 0 must be finite"),
    ],
)
def test_bad_demonstrations_are_named(sequences, message):
    """No, empty, misshapen or not finite demonstrations are refused, with their number."""
    with pytest.raises(ValueError, match=message):
        SubgoalHMM.fit(sequences)


@pytest.mark.parametrize("spread", [0, -0.1, np.nan, np.inf])
def test_a_spread_must_be_positive(spread):
    """A spread of zero or less, or none at all, is refused."""
    with pytest.raises(ValueError, match=f"spread must be .*, got {spread}"):
        SubgoalHMM.fit([SLALOM], spread)


def test_bad_input_to_a_model_is_named():
    """A misshapen sequence, or one that is not finite, is refused."""
    model = SubgoalHMM.fit([SLALOM])
    with pytest.raises(ValueError, match="sequence must be finite"):
        model.states_of([(0, np.nan)])
    with pytest.raises(ValueError, match=r"sequence must have shape \(N, 2\), got \(0,\)"):
        model.log_likelihood([])


def test_of_equally_probable_ways_the_one_shown_first_is_taken():
    """Two demonstrations that part and meet again: neither is better, so the first one's way is the task."""
    first, second = [(0, 0), (2, 0), (4, 1.5), (6, 0), (8, 0)], [(0, 0), (2, 0), (4, -1.5), (6, 0), (8, 0)]
    for shown in ([first, second], [second, first]):
        model = SubgoalHMM.fit(shown)
        np.testing.assert_allclose(model.means[model.most_likely_path()], shown[0], atol=1e-9)


@pytest.mark.parametrize(
    ("sequence", "spread", "says"),
    [
        ([(0, 0), (1, 0)], 1e-100, "spread must be in 1e-06 to 1e.06, got 1e-100"),
        ([(0, 0), (1, 0)], 1e300, "spread must be "),
        ([(0, 0), (1e154, 0)], 0.15, "must lie within 1e.09 m of the origin, got 1e.154 m"),
    ],
)
def test_numbers_beyond_all_measure_are_refused(sequence, spread, says):
    """What would drown the evidence in rounding is an error, not an endless search."""
    with pytest.raises(ValueError, match=says):
        SubgoalHMM.fit([sequence, sequence], spread)
