"""Merging beside hidden Markov models and the plain mean: the forms, the judge, the outcome."""

import numpy as np
import pytest

from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.replication.baseline import (
    ERGODIC,
    LEFT_TO_RIGHT,
    METHODS,
    STARTS,
    Form,
    _least,
    gaussian_hmm,
    judge,
    merged,
    plain_mean,
    study,
    summary,
    task_of,
)

SLALOM = np.array(TASKS["slalom"])
QUICK = {"merging": merged, "plain mean": plain_mean}


def test_judge_knows_number_order_and_error():
    """A wrong number has no error; two subgoals exchanged are out of order.

    A crossing met twice is no exchange.
    """
    assert judge(SLALOM[:5], SLALOM)["right_number"] is False
    assert np.isnan(judge(SLALOM[:5], SLALOM)["error"])
    assert judge(SLALOM[[0, 2, 1, 3, 4, 5]], SLALOM)["right_order"] is False
    assert judge(TASKS["figure-eight"], TASKS["figure-eight"])["right_order"] is True
    assert judge(SLALOM + (0.03, 0.04), SLALOM)["error"] == pytest.approx(0.05)


def test_plain_mean_of_equal_lengths_is_the_mean():
    """Where all demonstrations are equally long, nothing is stretched."""
    drawn = draw_demonstrations(SLALOM, 4, 0.1, extra=0)
    assert np.allclose(plain_mean(drawn), np.mean(drawn, axis=0))


@pytest.mark.parametrize("form", [ERGODIC, LEFT_TO_RIGHT, Form(1, "diag", criterion="ICL"), Form(0, "tied")])
def test_hidden_markov_model_finds_what_is_plain(form):
    """From six narrow demonstrations of four subgoals, every form finds the number and the order."""
    drawn = draw_demonstrations(SLALOM[:4], 6, 0.05, extra=0)
    verdict = judge(gaussian_hmm(drawn, form), SLALOM[:4])
    assert verdict["right_order"]
    assert verdict["error"] < 0.05


@pytest.mark.parametrize("form", [ERGODIC, LEFT_TO_RIGHT])
def test_hidden_markov_model_at_its_best_needs_two_demonstrations(form):
    """One of two has a subgoal that is no part of the task: it is left out."""
    drawn = draw_demonstrations(SLALOM, 2, 0.1, extra=0, seed=1)
    drawn[1] = np.insert(drawn[1], 3, (3.0, 3.0), axis=0)
    assert judge(gaussian_hmm(drawn, form), SLALOM)["right_order"]


def test_steps_left_to_right_pass_over_as_many_states_as_they_may():
    """A band above the diagonal: counted by hand for four states."""
    assert Form(0).steps(4).sum() == 4 + 3
    assert Form(1).steps(4).sum() == 4 + 3 + 2
    assert np.array_equal(Form(9).steps(4), np.triu(np.ones((4, 4), bool)))
    assert Form().steps(4).all()
    assert not np.tril(Form(1).steps(6), -1).any()


@pytest.mark.parametrize("covariance", ["told", "diag", "spherical", "tied"])
@pytest.mark.parametrize("passed", [None, 0, 1, 9])
@pytest.mark.parametrize("size", [1, 2, 5])
def test_free_parameters_are_those_that_can_be_changed(passed, covariance, size):
    """Entry by entry: of each row of probabilities all that may not be zero, less one."""
    form, free = Form(passed, covariance), 0
    for row in (form.steps(size)[0], *form.steps(size)):
        free += sum(1 for may in row if may) - 1
    covariances = {"told": 0, "diag": 2 * size, "spherical": size, "tied": 3}[covariance]
    assert form.free_parameters(size) == free + 2 * size + covariances


def test_free_parameters_where_hmmlearn_counts_right():
    """Ergodic, nothing is fixed: hmmlearn's own count. Of an upper triangle k (k + 1) / 2 - k steps are free."""
    model = pytest.importorskip("hmmlearn.hmm").GaussianHMM(5, "diag")
    model.n_features = 2
    assert Form(covariance="diag").free_parameters(5) == sum(model._get_n_fit_scalars_per_param().values())
    begins, steps = 5 - 1, 5 * 6 // 2 - 5
    assert Form(9, "diag").free_parameters(5) == begins + steps + 4 * 5


@pytest.mark.parametrize("start", ["mean", "k-means in order"])
def test_starts_are_in_the_order_of_the_task(start):
    """Twice through the same place: each mean is near its own subgoal."""
    eight = np.array(TASKS["figure-eight"])
    drawn = draw_demonstrations(eight, 4, 0.03, extra=0)
    means = STARTS[start](drawn, 6, np.random.RandomState(0))
    assert judge(means, eight)["right_order"]
    assert judge(means, eight)["error"] < 0.05


def test_search_for_the_number_of_states_finds_the_least_it_passes():
    """From the middle both ways, over one size that is no better, to the ends at most."""
    scores, asked = {3: 5.0, 4: 7.0, 5: 6.0, 6: 6.5, 7: 4.0, 8: 4.5, 9: 4.6, 10: 0.0}, []

    def found(size):
        asked.append(size)
        return scores.get(size, 9.0), size

    assert _least(found, 5, 20) == (4.0, 7)
    assert max(asked) == 9 and len(set(asked)) == len(asked)
    assert _least(lambda size: (-float(size), size), 5, 6) == (-6.0, 6)
    assert _least(lambda size: (float(size), size), 2, 6) == (1.0, 1)


@pytest.mark.parametrize(
    "wrong", [{"passed": -1}, {"passed": 1.5}, {"covariance": "full"}, {"criterion": "bic"}, {"starts": ("middle",)}]
)
def test_a_form_that_there_is_not_is_refused(wrong):
    """It names what is wrong."""
    with pytest.raises(ValueError, match=next(iter(wrong)).removesuffix("s")):
        Form(**wrong)


@pytest.mark.parametrize("sequences", [[], [[]], [[[np.nan, 0]]], [[1, 2, 3]]])
def test_hidden_markov_models_of_no_subgoals_are_refused(sequences):
    """No demonstrations, none in one, no numbers, no positions."""
    with pytest.raises(ValueError, match="demonstration"):
        gaussian_hmm(sequences)
    with pytest.raises(ValueError, match="spread"):
        gaussian_hmm([SLALOM], spread=0)


def test_one_subgoal_is_a_task():
    """The least there can be."""
    for form in (ERGODIC, LEFT_TO_RIGHT):
        assert gaussian_hmm([[[1.0, 2.0]]], form) == pytest.approx(np.array([[1.0, 2.0]]))


def test_a_drawn_task_goes_on_by_one_to_two_metres_and_never_comes_near_itself():
    """As many subgoals as asked for, another task for another seed."""
    for seed in range(20):
        task = task_of(12, seed)
        gaps = np.linalg.norm(task[:, None] - task, axis=-1) + 9 * np.eye(12)
        steps = np.linalg.norm(np.diff(task, axis=0), axis=1)
        assert gaps.min() >= 0.75 and steps.min() >= 1 and steps.max() <= 2
    assert not np.allclose(task_of(12, 0), task_of(12, 1))
    assert np.array_equal(task_of("slalom", 3), SLALOM)


def test_study_compares_all_methods_on_the_same_demonstrations():
    """Every method judges every case once.

    On two demonstrations merging is right more often than the plain mean.
    """
    table = study(tasks=("slalom",), numbers=(2,), spreads=(0.15,), seeds=range(25), methods=QUICK)
    shares = summary(table).loc[("slalom", 0.15, 2)]
    assert len(table) == 50
    assert shares.loc["merging", "right_order"] >= 0.95
    assert shares.loc["merging", "right_order"] > shares.loc["plain mean", "right_order"]
    assert shares.loc["merging", "error"] < shares.loc["plain mean", "error"]


def test_study_knows_every_method():
    """One case runs through all methods, and names task, number, spread and seed."""
    table = study(tasks=("ring",), numbers=(2,), spreads=(0.05,), seeds=(3,))
    assert table["method"].tolist() == list(METHODS)
    assert table[["task", "n", "spread", "seed"]].drop_duplicates().to_numpy().tolist() == [["ring", 2, 0.05, 3]]


def test_two_at_once_find_the_same():
    """Jobs share the cases out and change no number but the times; rows keep their order."""
    asked = (("slalom", "ring"), (2, 3), (0.15,), range(3), QUICK)
    one, two = (study(*asked, jobs=jobs).drop(columns="seconds") for jobs in (1, 2))
    assert one.equals(two) and len(one) == 24
