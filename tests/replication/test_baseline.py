"""Merging beside hidden Markov models and the plain mean.

The demonstrations drawn, the judge, the outcome.
"""

import numpy as np
import pytest

from dollop.lab.drawn import TASKS, draw_demonstrations
from dollop.replication.baseline import (
    METHODS,
    gaussian_hmm,
    judge,
    merged,
    plain_mean,
    study,
    summary,
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


@pytest.mark.parametrize("left_to_right", [False, True])
def test_hidden_markov_model_finds_what_is_plain(left_to_right):
    """From six narrow demonstrations of four subgoals, both forms find the number and the order."""
    drawn = draw_demonstrations(SLALOM[:4], 6, 0.05, extra=0)
    verdict = judge(gaussian_hmm(drawn, left_to_right, n_states=range(3, 6)), SLALOM[:4])
    assert verdict["right_order"]
    assert verdict["error"] < 0.05


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
