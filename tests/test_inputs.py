"""Arguments as values: tuples and Python's numbers, or one sentence that names the argument."""

import itertools
import math
from dataclasses import dataclass
from datetime import timedelta
from decimal import Decimal
from fractions import Fraction
from typing import Literal

import mpmath
import numpy as np
import pytest
import sympy

from twolink import inputs
from twolink.errors import ParameterError
from twolink.text import quoted


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (1, 1),
        (0.5, 0.5),
        (np.float64(0.5), 0.5),
        (np.float32(0.5), 0.5),
        (np.int8(3), 3),
        (np.array(2.0), 2.0),
        (Fraction(1, 3), Fraction(1, 3)),
        (Decimal("0.1"), Fraction(1, 10)),
        (Decimal("0e-999999"), Fraction(0)),
        (Decimal("-Infinity"), -math.inf),
        (np.longdouble(2), np.longdouble(2)),
        (sympy.Symbol("x"), sympy.Symbol("x")),
    ],
)
def test_numbers_of_any_kind(given, kept):
    found = inputs.as_number("x", given)
    assert found == kept
    assert type(found) is type(kept)


@pytest.mark.parametrize(
    "given", ["1", b"1", None, True, np.True_, [1.0], (1.0,), {}, np.zeros(2), object(), float, 1j]
)
def test_non_numbers_are_refused(given):
    with pytest.raises(ParameterError, match="x must be a number; got ") as caught:
        inputs.as_number("x", given)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("given", ["NaN", "sNaN", "-NaN123"])
def test_decimals_that_are_no_number_are_nan(given):
    assert math.isnan(inputs.as_number("x", Decimal(given)))


@pytest.mark.parametrize(
    "given",
    [
        10**400,
        -(10**400),
        Decimal("1e400"),
        Decimal("-1e-999999"),
        Decimal("1e999999"),
        Fraction(10**400),
    ],
)
def test_a_number_beyond_float64_is_refused(given):
    with pytest.raises(ParameterError, match="x must be a number that float64 can hold; got"):
        inputs.as_number("x", given)


@pytest.mark.parametrize("kind", [Fraction, Decimal, np.float32, sympy.Rational, int])
def test_real_numbers_are_float64(kind):
    for found in (inputs.as_real("x", kind("3")), inputs.as_positive("x", kind("3"))):
        assert (type(found), found) == (float, 3.0)


@pytest.mark.parametrize("given", [0.0, -1.0, math.nan, math.inf])
def test_numbers_that_are_not_positive_are_refused(given):
    with pytest.raises(ParameterError, match="x must be a positive number; got"):
        inputs.as_positive("x", given)


@pytest.mark.parametrize("given", [math.nan, math.inf])
def test_non_finite_numbers_are_refused(given):
    with pytest.raises(ParameterError, match="x must be a finite real number; got"):
        inputs.as_real("x", given)


@pytest.mark.parametrize("given", [1, np.int64(1)])
def test_counts(given):
    assert inputs.as_count("n", given, 1) == 1


@pytest.mark.parametrize("given", [True, np.bool_(False)])
def test_flags(given):
    assert inputs.as_flag("n", given) is bool(given)


@pytest.mark.parametrize("given", [1, "yes", None, np.array([True, False])])
def test_other_values_for_a_flag_are_refused(given):
    with pytest.raises(ParameterError, match="n must be True or False; got"):
        inputs.as_flag("n", given)


@pytest.mark.parametrize("given", [0, -1, 1.0, "1", None, True])
def test_values_that_are_no_counts_are_refused(given):
    with pytest.raises(ParameterError, match="n must be a whole number of 1 or more; got"):
        inputs.as_count("n", given, 1)


@pytest.mark.parametrize(
    "given", [(1.0, 2.0), [1.0, 2.0], np.array([1.0, 2.0]), (x for x in (1.0, 2.0)), range(1, 3)]
)
def test_sequences_become_tuples(given):
    found = inputs.as_pair("q", given)
    assert found == (1.0, 2.0)
    assert type(found) is tuple
    assert all(type(x) in (int, float) for x in found)


@pytest.mark.parametrize(
    "given", [1.0, "ab", (1.0,), (1.0, 2.0, 3.0), {1.0, 2.0}, {1: 2, 3: 4}, None, np.array(1.0)]
)
def test_values_that_are_no_pairs_are_refused(given):
    with pytest.raises(ParameterError, match="q must be a pair of numbers; got"):
        inputs.as_pair("q", given)


def test_a_wrong_entry_is_named_by_its_index():
    with pytest.raises(ParameterError, match=r"q\[1\] must be a number; got 'b'"):
        inputs.as_pair("q", (1.0, "b"))
    with pytest.raises(ParameterError, match=r"q\[0\] must be a number; got array"):
        inputs.as_pair("q", np.eye(2))


def test_a_generator_without_an_end_is_refused(monkeypatch):
    monkeypatch.setattr(inputs, "MOST_ENTRIES", 100)
    with pytest.raises(ParameterError, match="effects must have 100 entries or fewer"):
        inputs.as_tuple("effects", itertools.count(), "a sequence")


@pytest.mark.parametrize(
    "given",
    [
        *("abc", "1", [[1.0]], None, {}, ["a"], [1.0, [2.0]], ["2"], [b"2"], [True, False], True),
        *(2 + 3j, np.array([2 + 3j]), np.timedelta64(2, "ms"), timedelta(seconds=1), [None]),
        *(np.array([2], "timedelta64[ms]"), np.array([1.0, "2"], object), [sympy.Symbol("t")]),
    ],
)
def test_values_that_are_no_row_of_times_are_refused(given):
    with pytest.raises(ParameterError, match="times must be a number of seconds, or a row of"):
        inputs.as_times(given)


def test_times():
    assert inputs.as_times(1).tolist() == [1.0]
    mixed = np.array([Fraction(1, 4), Decimal("0.5"), mpmath.mpf(1)], object)
    assert inputs.as_times(mixed).tolist() == [0.25, 0.5, 1.0]
    assert inputs.as_times(np.array([1, 2], np.longdouble)).tolist() == [1.0, 2.0]
    assert inputs.as_times(x / 2 for x in range(3)).tolist() == [0.0, 0.5, 1.0]


def test_a_quoted_value_is_one_short_line():
    class Rude:
        def __repr__(self):
            raise RuntimeError

    assert quoted(float) == "the class float"
    assert quoted(Rude()) != ""
    assert len(quoted("x" * 9999)) < 150
    assert "\n" not in quoted(np.eye(3))


@dataclass(frozen=True)
class Drawn:
    size: float
    pair: tuple[float, float] | None = None
    rows: tuple[float, ...] = ()
    kind: Literal["a", "b"] = "a"
    on: tuple[Literal["B", "D"], ...] = ("D",)
    whole: bool = False

    def __post_init__(self):
        inputs.take_fields(self, "drawn")


def test_fields_are_taken_by_their_annotations():
    drawn = Drawn(np.float32(1), [1, 2], iter([3.0]), "b", ["B"], np.True_)
    assert drawn == Drawn(1.0, (1, 2), (3.0,), "b", ("B",), True)
    assert hash(drawn)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"size": None}, "drawn: size must be a number; got None"),
        ({"pair": "ab"}, "drawn: pair must be a pair of numbers; got 'ab'"),
        ({"pair": (1, "b")}, r"drawn: pair\[1\] must be a number; got 'b'"),
        ({"rows": 3}, "drawn: rows must be a sequence of numbers; got 3"),
        ({"kind": ["a"]}, r"drawn: kind must be a string; got \['a'\]"),
        ({"on": "D"}, "drawn: on must be a sequence of strings; got 'D'"),
        ({"on": [1]}, r"drawn: on\[0\] must be a string; got 1"),
        ({"whole": 1}, "drawn: whole must be True or False; got 1"),
    ],
)
def test_a_field_that_is_something_else_is_refused(change, words):
    with pytest.raises(ParameterError, match=words):
        Drawn(**{"size": 1.0, **change})


@pytest.mark.parametrize("given", [10**308, 2**63, 10**400])
def test_a_count_beyond_those_of_python_s_sequences_is_refused(given):
    """Products of counts are estimates of memory and time, which float64 has to hold."""
    with pytest.raises(
        ParameterError, match=r"n must be a whole number of \d+ or less; got 1|9223"
    ):
        inputs.as_count("n", given)
    assert inputs.as_count("n", 2**63 - 1) == 2**63 - 1


@pytest.mark.parametrize("given", [5e-324, Fraction(1, 10**291), np.float32(0.0), -1.0])
def test_durations_too_short_for_steps_are_refused(given):
    assert inputs.as_duration("seconds", inputs.LEAST_DURATION) == 1e-290
    with pytest.raises(ParameterError, match=r"seconds must be (1e-290 s or more|a positive num)"):
        inputs.as_duration("seconds", given)
