"""Checks of numbers and arrays: what is right passes as it is, and errors name value and rule."""

import re
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from dollop.checks import (
    FARTHEST,
    check_choice,
    check_positive,
    checked_array,
    checked_number,
    checked_positions,
    put_in,
)

NUMBERS = st.floats(-1e9, 1e9)


@given(st.floats())
def test_positive_is_what_is_greater_than_nothing_and_less_than_infinity(value):
    """Whatever the number, NaN and zeros of either sign included."""
    if 0 < value < float("inf"):
        assert check_positive("side", value) is None
    else:
        with pytest.raises(ValueError, match="^side must be positive and finite, got "):
            check_positive("side", value)


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, -np.inf])
def test_numbers_out_of_range_are_named(value):
    """The error names the value and the rule; zero passes where it may."""
    with pytest.raises(ValueError, match=f"side must be positive and finite, got {value}"):
        check_positive("side", value)
    with pytest.raises(ValueError, match=f"side must be finite and not negative, got {value}"):
        check_positive("side", value, or_zero=True)
    with pytest.raises(ValueError, match="side must be positive and finite, got 0"):
        check_positive("side", 0)
    check_positive("side", 0, or_zero=True)


def test_a_choice_is_one_of_the_known():
    """Any container of them will do; a list as a value is refused and not hashed."""
    check_choice("control", "plain", {"plain": 1})
    for value in ("plan", None, ["plain"]):
        with pytest.raises(ValueError, match="control must be one of 'plain', 'pursuit', got "):
            check_choice("control", value, ("plain", "pursuit"))


@given(hnp.arrays(float, hnp.array_shapes(max_dims=3, max_side=4), elements=NUMBERS))
def test_an_array_of_the_shape_passes_as_a_copy(values):
    """The same numbers, not the same memory; numbers and letters describe the shape alike."""
    for shape in (values.shape, "NMK"[: values.ndim]):
        array = checked_array("boxes", values, *shape)
        np.testing.assert_array_equal(array, values)
        assert not np.shares_memory(array, values)


@given(hnp.arrays(float, hnp.array_shapes(max_dims=3, max_side=4), elements=NUMBERS))
def test_an_array_of_another_shape_is_refused(values):
    """One row more, one axis more: both shapes are told."""
    for shape in ((len(values) + 1, *values.shape[1:]), (*values.shape, "N")):
        with pytest.raises(ValueError, match=r"^boxes must have shape \(.*\), got \(.*\)$"):
            checked_array("boxes", values, *shape)


def test_what_is_not_finite_is_named_with_its_row():
    """Unless the caller has a use for it."""
    values = [[0.0, 1.0], [np.nan, 2.0]]
    with pytest.raises(ValueError, match=r"^poses must be finite, got \[nan, 2.0\] in row 1$"):
        checked_array("poses", values, "N", 2)
    assert np.isnan(checked_array("poses", values, "N", 2, finite=False)[1, 0])


@pytest.mark.parametrize("values", [[["far", 1.0]], [[10**400, 1.0]], [[1.0], [1.0, 2.0]], {"a": 1}])
def test_an_array_is_of_numbers_in_rows_of_one_length(values):
    """Text, what no float holds, rows of several lengths and a dictionary raise ValueError that names them."""
    with pytest.raises(ValueError, match=r"^boxes must be numbers in rows of one length, got [\[{]"):
        checked_array("boxes", values, "N", 2)


@given(st.one_of(st.floats(), st.integers()), st.floats(-1e9, 1e9), st.floats(-1e9, 1e9))
def test_a_number_is_finite_and_in_its_bounds(value, one, other):
    """It comes back as a float if it is, bounds included; if not, the error names name, rule and value."""
    least, most = sorted((one, other))
    if least <= value <= most:
        number = checked_number("turn", value, least, most)
        assert number == value and isinstance(number, float)
        return
    rule = "in .* to .*" if abs(value) <= FARTHEST else r"a finite number within 1e\+09"
    with pytest.raises(ValueError, match=f"^turn must be {rule}, got {re.escape(str(value)[:60])}"):
        checked_number("turn", value, least, most)


@pytest.mark.parametrize("value", [np.float32(0.5), np.int64(3), np.float64(0.5), 7, -0.0])
def test_numbers_of_numpy_are_numbers(value):
    """They come back as floats of Python."""
    assert type(checked_number("turn", value)) is float and checked_number("turn", value, value, value) == value


@pytest.mark.parametrize("value", ["0.4", b"1", True, np.False_, None, [1.0], np.array([1.0]), {}, 1j])
def test_what_is_no_number_is_named(value):
    """Text, a bool, nothing and what holds numbers are none."""
    with pytest.raises(ValueError, match=f"^turn must be a finite number, got {re.escape(repr(value))}$"):
        checked_number("turn", value)


def test_what_no_float_holds_is_cut_short():
    """A whole number of 401 digits is refused, and 60 of them are told."""
    with pytest.raises(ValueError, match=r"^turn must be a finite number within 1e\+09, got 10{59}$"):
        checked_number("turn", 10**400)


def test_positions_lie_in_the_plane_and_on_this_planet():
    """None at all is a trajectory too; a distance of which the square overflows is none."""
    assert checked_positions("walk", np.empty((0, 2))).shape == (0, 2)
    with pytest.raises(ValueError, match=r"^walk must have shape \(N, 2\), got \(1, 3\)$"):
        checked_positions("walk", [[0, 1, 2]])
    with pytest.raises(ValueError, match="^walk must lie within 1e.09 m of .*, got 1e.10 m$"):
        checked_positions("walk", [[0.0, -1e10]])


def test_what_is_put_into_a_record_stays():
    """A frozen record gets its values in its making, and arrays cannot be changed afterwards."""

    @dataclass(frozen=True)
    class Record:
        points: np.ndarray
        side: float

        def __post_init__(self):
            put_in(self, points=np.array(self.points), side=float(self.side))

    record = Record([1.0, 2.0], 3)
    assert record.points.tolist() == [1.0, 2.0] and isinstance(record.side, float)
    with pytest.raises(ValueError, match="read-only"):
        record.points[0] = 7.0
