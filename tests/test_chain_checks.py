"""Parameters that a chain refuses, each in one sentence."""

import math
from fractions import Fraction

import numpy as np
import pytest

from twolink.chain import Chain, Point, Rotor
from twolink.errors import ParameterError

GOOD = {
    "mass": (1.0, 2.0),
    "length": (1.0, 0.5),
    "centre": ((0.5, 0.0), (0.25, 0.1)),
    "inertia": (0.1, 0.05),
}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mass": (0.0, 2.0)}, r"link 1: mass must be a positive.*; got 0.0"),
        ({"mass": (1.0, -2.0)}, r"link 2: mass must be a positive.*; got -2.0"),
        ({"mass": (math.nan, 2.0)}, r"link 1: mass must be .*; got nan"),
        ({"mass": (1.0, math.inf)}, r"link 2: mass must be .*; got inf"),
        ({"mass": (1.0,)}, "mass must be a pair"),
        ({"mass": 1.0}, r"mass must be a pair.*; got 1.0"),
        ({"mass": ("1", 1.0)}, r"link 1: mass must be a number.*; got '1'"),
        ({"mass": (True, 1.0)}, r"link 1: mass must be a number.*; got True"),
        ({"length": (0.0, 1.0)}, r"link 1: length must be a positive.*; got 0.0"),
        ({"length": (1.0, -1.0)}, r"link 2: length must be zero or a positive.*; got -1.0"),
        ({"length": (1.0, math.nan)}, r"link 2: length must be .*; got nan"),
        ({"inertia": (-0.1, 1.0)}, r"link 1: inertia must be zero or a positive.*; got -0.1"),
        ({"inertia": (0.1, math.inf)}, r"link 2: inertia must be .*; got inf"),
        ({"centre": ((0.5, math.nan), (0.5, 0.0))}, r"link 1: centre must be .*; got nan"),
        ({"centre": (0.5, 0.5)}, r"link 1: centre must be a pair.*; got 0.5"),
        ({"centre": ((0.5, 0.0), (0.5,))}, "link 2: centre must be a pair"),
        (
            {"centre": ((0.5, 0.0), (0.0, 0.0)), "inertia": (0.1, 0.0)},
            r"link 2: inertia about B must be a positive.*; got 0.0",
        ),
        (
            {"centre": ((0.0, 0.0), (0.5, 0.0)), "inertia": (0.0, 0.0)},
            r"link 1: inertia about A must be a positive.*; got 0.0",
        ),
    ],
)
def test_bad_parameters_are_refused_in_one_sentence(change, words):
    with pytest.raises(ParameterError, match=words) as caught:
        Chain(**{**GOOD, **change})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("make", [Chain.uniform_bars, Chain.point_masses])
@pytest.mark.parametrize(
    ("mass", "length", "words"),
    [
        ((1.0, 1.0), (1.0, 0.0), "link 2: length must be a positive"),
        ((1.0, 1.0), (0.0, 1.0), "link 1: length must be a positive"),
        ((1.0, 0.0), (1.0, 1.0), "link 2: mass must be a positive"),
        ((1.0, 1.0), (math.inf, 1.0), r"link 1: length must be .*; got inf"),
    ],
)
def test_bars_and_point_masses_need_lengths(make, mass, length, words):
    with pytest.raises(ParameterError, match=words):
        make(mass, length)


def test_zero_length_is_allowed_where_it_does_not_matter():
    """L2 only places D; with its own inertia the chain moves all the same."""
    chain = Chain(**{**GOOD, "length": (1.0, 0.0)})
    assert Point(2, 0.0, 0.0) == chain.D


def test_a_circulating_set_with_a_negative_inertia_is_refused():
    with pytest.raises(ParameterError, match=r"link 2: inertia must be zero or.*; got -0\.00013"):
        Chain(
            (0.10548177618443695, 0.07619744360415454),
            (0.05, 0.05),
            ((0.05, 0.0), (0.0366, 0.0)),
            (0.00046, -0.00013),
        )


@pytest.mark.parametrize("size", [1e-310, 1e-160, 1e155, 1e300])
def test_a_chain_that_float64_cannot_hold_is_refused(size):
    """Else det M would be 0 or infinite, and every acceleration a NaN."""
    with pytest.raises(ParameterError, match=r"determinant must be 1e-290 to .*; got"):
        Chain.uniform_bars((size, size))
    assert Chain.uniform_bars((1e140, 1e140)).m1 == 1e140


@pytest.mark.parametrize("make", [Chain.uniform_bars, Chain.point_masses])
@pytest.mark.parametrize("size", [10**155, 10**300, Fraction(10) ** 300, Fraction(1, 10**160)])
def test_exact_numbers_have_the_range_of_float64(make, size):
    """Products of exact numbers and floats do not overflow to infinity: they raise an error."""
    for mass, length in (((size, size), (size, size)), ((0.5, 1), (0.5, size))):
        with pytest.raises(ParameterError, match=r"determinant must be 1e-290 to |got (inf|0\.0)"):
            make(mass, length)


def test_an_entry_of_an_array_that_is_no_number_is_refused():
    with pytest.raises(ParameterError, match="link 2: mass must be a number; got None"):
        Chain.uniform_bars((1.0, np.array([None, 1])), (1.0, 1.0))


def test_a_determinant_that_hardly_varies_is_held_by_float64_all_the_same():
    """Found by fuzzing: rounding put the least of all poses an ulp above the most."""
    chain = Chain(
        (1.0, 1.333521432163324e-06),
        (1.0, 10.0),
        ((1.0, 0.75), (2.5, 5.0)),
        (1000000.0, 1.333521432163324),
    )
    assert chain.m2 == 1.333521432163324e-06


@pytest.mark.parametrize(
    ("rotor", "sentence"),
    [
        (Rotor(-5.0, (1.0, 0.0)), r"rotor 1: inertia must be zero or a positive .*; got -5\.0"),
        (Rotor(math.nan, (1.0, 0.0)), "rotor 1: inertia must be zero or a positive"),
        (Rotor("a", (1.0, 0.0)), "rotor 1: inertia must be a number; got 'a'"),
        (Rotor(0.1, (1.0, 0.0, 2.0)), "rotor 1: turning must be a pair of finite numbers; got"),
        (Rotor(0.1, (math.inf, 0.0)), "rotor 1: turning must be a pair of finite numbers; got"),
        (Rotor(0.1, 3.0), r"rotor 1: turning must be a pair of finite numbers; got 3\.0"),
        (5, "rotors must be a sequence of rotors; got 5"),
    ],
)
def test_rotors_that_add_no_inertia_are_refused(rotor, sentence):
    with pytest.raises(ParameterError, match=sentence):
        Chain(**GOOD, rotors=(rotor,))
    with pytest.raises(ParameterError, match=sentence):
        Chain(**GOOD).with_rotors((rotor,))


def test_rotors_are_a_sequence():
    with pytest.raises(ParameterError, match="rotors must be a sequence of rotors; got 5"):
        Chain(**GOOD).with_rotors(5)
