"""Checks of numbers and arrays: what is right passes as it is, and errors name value and rule."""

import re
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from dollop.checks import (
    FARTHEST,
    Note,
    check_choice,
    check_positive,
    checked_array,
    checked_flag,
    checked_flags,
    checked_generator,
    checked_number,
    checked_positions,
    checked_record,
    checked_records,
    checked_whole,
    checked_wholes,
    put_in,
    told,
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
    with pytest.raises(ValueError, match=f"^turn must be {rule}, got {re.escape(told(value))}$"):
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
    """A whole number of 401 digits is refused, and told by how many it has."""
    with pytest.raises(ValueError, match=r"^turn must be a finite number within 1e\+09, got .* some 401 digits$"):
        checked_number("turn", 10**400)
    for check in (check_positive, checked_whole, checked_flag, checked_array):
        with pytest.raises(ValueError, match="got .* some 401 digits"):
            check("turn", 10**400)


NO_NUMBERS = {
    "text": ["far", 1.0], "one truth value": [0.5, True], "one truth value of numpy": [[1.0], [np.True_]],
    "nothing": [None, 1.0], "complex": [1.0, 2j], "digits": ["1.0", "2.0"], "bytes": b"12", "a string": "12",
    "truth values": np.array([True, False]), "objects": np.array([1.0, 2.0], dtype=object),
    "masked": np.ma.masked_array([1.0, 2.0], [True, False]), "dates": np.array(["2004-04-26"], "datetime64[D]"),
    "spans": [np.timedelta64(1, "s")], "complex array": np.array([1j]), "ragged": [[1.0], [1.0, 2.0]],
    "a huge number": [10**400], "a set": {1.0}, "a dictionary": {"a": 1}, "a generator": (x for x in (1.0, 2.0)),
    "sparse": scipy.sparse.eye(2), "None": None, "a table with text": pd.DataFrame({"x": ["a"]}),
    "a list of a masked array": [np.ma.masked_array([1.0], [True])], "records": np.zeros(2, "f8,f8"),
}  # fmt: skip


@pytest.mark.parametrize("values", NO_NUMBERS.values(), ids=NO_NUMBERS)
def test_numbers_only(values):
    """What numpy would make numbers of, or would lose in doing so, is refused, and told in a line."""
    with pytest.raises(ValueError, match="^boxes must be numbers in rows of one length, got ") as refused:
        checked_array("boxes", values, "N", 2)
    assert len(str(refused.value)) < 300


def test_a_list_that_holds_itself_is_no_array():
    """However deep one looks."""
    endless = [1.0]
    endless.append(endless)
    with pytest.raises(ValueError, match="^boxes must be numbers in rows of one length, got "):
        checked_array("boxes", endless, "N")


ROWS = [[1.0, 2.0], [3.0, 4.0]]
NUMBERS_ALL = {
    "lists": ROWS, "tuples": tuple(map(tuple, ROWS)), "arrays in a list": list(map(np.array, ROWS)),
    "whole numbers": [[1, 2], [3, 4]], "mixed": [[np.float32(1), 2], (3, np.uint8(4))],
    "range": [range(1, 3), range(3, 5)],
    "single": np.array(ROWS, np.float32), "half": np.array(ROWS, np.float16), "bytes": np.array(ROWS, np.uint8),
    "long": np.array(ROWS, np.longdouble), "a table": pd.DataFrame(ROWS), "columns": [pd.Series(row) for row in ROWS],
}  # fmt: skip


@pytest.mark.parametrize("values", NUMBERS_ALL.values(), ids=NUMBERS_ALL)
def test_numbers_of_every_kind_are_welcome(values):
    """Of Python, numpy and pandas; what comes back is a plain float array of its own."""
    array = checked_array("boxes", values, "N", 2)
    assert type(array) is np.ndarray and array.dtype == float and array.tolist() == ROWS
    assert not (isinstance(values, np.ndarray) and np.shares_memory(array, values))


def test_dots_stand_for_any_axes():
    """A state, many states, and a grid of them."""
    for shape in ((2,), (7, 2), (3, 4, 2)):
        assert checked_array("states", np.zeros(shape), "...", 2).shape == shape
    with pytest.raises(ValueError, match=r"^states must have shape \(..., 2\), got \(\)$"):
        checked_array("states", 1.0, "...", 2)


@given(st.one_of(st.integers(-5, 15), st.floats(-5, 15), st.booleans(), st.just("3"), st.just(np.int8(3))))
def test_what_is_whole_comes_back_as_an_int(value):
    """1.0 is whole, 1.9 and True are not; the bounds count."""
    whole = not isinstance(value, bool | str) and value == int(value)
    if whole and 1 <= value <= 8:
        assert checked_whole("m", value, 1, 8) == value and type(checked_whole("m", value, 1, 8)) is int
        assert checked_wholes("m", [value], "K", least=1, most=8).tolist() == [value]
        return
    with pytest.raises(ValueError, match=f"^m must be a whole number, 1 to 8, got {re.escape(told(value))}$"):
        checked_whole("m", value, 1, 8)
    with pytest.raises(ValueError, match="^m must be "):
        checked_wholes("m", [value], "K", least=1, most=8)


def test_a_flag_is_true_or_false():
    """Numpy's too; 1, "no" and None are none. In arrays 0 and 1 do."""
    assert checked_flag("avoid", np.True_) is True and checked_flag("avoid", False) is False
    for value in (1, "abc", None, [True], np.array([True])):
        with pytest.raises(ValueError, match="^avoid must be True or False, got "):
            checked_flag("avoid", value)
    for values in ([True, False], np.array([1, 0]), (1.0, 0.0), pd.Series([True, False])):
        assert checked_flags("seen", values, "N").tolist() == [True, False]
    for values in ([True, 0], ["a"], [2, 0], None, [[True], [True, False]], np.ma.masked_array([True], [True])):
        with pytest.raises(ValueError, match="^seen must "):
            checked_flags("seen", values, "N")


def test_a_record_is_of_its_kind():
    """One, or several; the first that is none is named."""
    note = Note("pause", "no scan for 3 s")
    assert checked_record("note", note, Note) is note and checked_records("notes", [note], Note) == (note,)
    with pytest.raises(ValueError, match=r"^notes\[1\] must be a Note, got None$"):
        checked_records("notes", [note, None], Note)
    with pytest.raises(ValueError, match="^notes must be several of Note, got 5$"):
        checked_records("notes", 5, Note)


@pytest.mark.parametrize("fields", [(5, "text"), ("kind", None), ("kind", "text", "no")])
def test_a_note_is_two_texts_and_a_flag(fields):
    """A note that is asked whether it is in doubt must be able to tell."""
    with pytest.raises(ValueError, match="must be a str|must be True or False"):
        Note(*fields)


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


def test_tables_of_pandas_are_numbers():
    """Also of the types that know what is missing, and without rows; with something missing, or text, they are none."""
    table = pd.DataFrame({"x": [1, 2], "y": [0.5, 1.5]})
    for each in (table, table.convert_dtypes()):
        np.testing.assert_array_equal(checked_array("x", each, "N", 2), table)
    assert checked_array("x", pd.DataFrame(columns=["x", "y"]), "N", 2).shape == (0, 2)
    for wrong in (table.assign(x="a"), pd.DataFrame({"x": [1, None]}, dtype="Int64").assign(y=1.0)):
        with pytest.raises(ValueError, match="must be"):
            checked_array("x", wrong, "N", 2)


def test_seeds_are_those_of_numpy_but_none():
    """Several numbers, a sequence of seeds and a generator are; numbers that come out otherwise each time are not."""
    for seed in (3, [3, 5], np.random.SeedSequence(3)):
        one, other = checked_generator("seed", seed), np.random.default_rng(seed)
        assert one.random() == other.random()
    with pytest.raises(ValueError, match="seed, if no Generator, must be a whole number"):
        checked_generator("seed", None)
