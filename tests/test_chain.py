import copy
import dataclasses
import math
import pickle
from fractions import Fraction

import flint
import mpmath
import numpy as np
import pytest
import sympy

from twolink.chain import Chain, Point, Rotor


def test_uniform_bars_are_the_sources():
    chain = Chain.uniform_bars((3.0, 1.0), (2.0, 0.5))
    assert chain.inertia == (3.0 * 4.0 / 12, 0.25 / 12)
    assert (Point(1, 1.0, 0.0), Point(2, 0.25, 0.0)) == (chain.C1, chain.C2)
    assert (Point(1, 2.0, 0.0), Point(2, 0.5, 0.0)) == (chain.B, chain.D)
    assert (chain.m1, chain.m2, chain.L1, chain.L2) == (3.0, 1.0, 2.0, 0.5)


def test_point_masses_sit_at_the_ends():
    chain = Chain.point_masses((3.0, 1.0), (2.0, 0.5))
    assert chain.inertia == (0.0, 0.0)
    assert chain.C1 == chain.B
    assert chain.C2 == chain.D


def test_a_chain_is_frozen():
    chain = Chain.uniform_bars()
    with pytest.raises(dataclasses.FrozenInstanceError):
        chain.mass = (2.0, 2.0)  # type: ignore[misc]


def test_a_chain_of_floats_is_its_own_conversion_to_float():
    bars = Chain.uniform_bars((1.0, 2.0), (0.5, 0.7))
    assert bars.convert(float) is bars
    whole = Chain(mass=(1, 2.0), length=(1.0, 1.0), centre=((0.5, 0.0),) * 2, inertia=(0.1, 0.1))
    assert [type(m) for m in whole.convert(float).mass] == [float, float]


def test_conversion_keeps_floats_exactly_and_bars_as_rationals():
    bars = Chain.uniform_bars((0.1, 1.0), (0.3, 1.0))
    exact = bars.convert(Fraction)
    assert exact.mass == (Fraction(0.1), Fraction(1))
    assert exact.inertia == (Fraction(0.1) * Fraction(0.3) ** 2 / 12, Fraction(1, 12))
    with mpmath.workdps(50):
        assert mpmath.mpf(1) / 12 == bars.convert(mpmath.mpf).I_C2
        # A given inertia is the float that it is, not the rational it may stand for.
        given = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.5, 0.0)), (1 / 12, 1 / 12))
        assert mpmath.mpf(1) / 12 != given.convert(mpmath.mpf).I_C2


@pytest.mark.parametrize(
    "change",
    [
        {"inertia": (0.5, 0.7)},
        {"inertia": (1 / 12, math.nextafter(1 / 12, 1.0))},
        {"mass": (1.0, 2.0)},
        {"length": (1.0, 2.0)},
    ],
)
def test_a_changed_bar_has_the_inertia_that_it_states(change):
    changed = dataclasses.replace(Chain.uniform_bars(), **change)
    assert changed.convert(Fraction).inertia == tuple(map(Fraction, changed.inertia))


@pytest.mark.parametrize(
    "copied",
    [
        copy.copy,
        copy.deepcopy,
        lambda chain: pickle.loads(pickle.dumps(chain)),
        lambda chain: dataclasses.replace(chain, centre=((0.4, 0.0), (0.5, 0.1))),
        lambda chain: dataclasses.replace(chain, rotors=(Rotor(0.1, (1.0, 0.0)),)),
        lambda chain: dataclasses.replace(chain, inertia=chain.inertia),
    ],
)
def test_a_copied_bar_keeps_its_exact_inertia(copied):
    bars = Chain.uniform_bars((0.1, 1.0), (0.3, 1.0))
    assert copied(bars).convert(Fraction).inertia == bars.convert(Fraction).inertia
    assert Fraction(1, 12) == bars.convert(Fraction).I_C2


@pytest.mark.parametrize("scale", [1e-300, 0.1, 1.0, 1e200])
def test_a_unit_vector_has_the_digits_of_the_chain(scale):
    """(3, 4) and its multiples by powers of two are exactly (3/5, 4/5)."""
    factor = math.ldexp(1.0, math.frexp(scale)[1])
    with mpmath.workdps(60):
        chain = Chain.uniform_bars().convert(mpmath.mpf)
        for found, exact in zip(chain.unit((3 * factor, -4 * factor)), (3, -4), strict=True):
            assert abs(found - mpmath.mpf(exact) / 5) < mpmath.mpf(10) ** -59
    x, y = Chain.uniform_bars().unit((3 * factor, -4 * factor))
    assert (x, y) == (0.6, -0.8)
    assert isinstance(x, float)


def test_a_unit_vector_of_fractions_has_the_digits_of_the_chain():
    with mpmath.workdps(60):
        chain = Chain.uniform_bars().convert(mpmath.mpf)
        x, y = chain.unit((Fraction(3, 7), Fraction(-4, 7)))
        assert abs(x - mpmath.mpf(3) / 5) + abs(y + mpmath.mpf(4) / 5) < mpmath.mpf(10) ** -58
    assert Chain.uniform_bars().unit((Fraction(3, 7), Fraction(-4, 7))) == pytest.approx(
        (0.6, -0.8)
    )


def test_real_numbers_get_the_type_of_the_chain_and_others_are_unchanged():
    bars, symbol = Chain.uniform_bars(), sympy.Symbol("k")
    assert bars.scalars((Fraction(1, 3), 2)) == (1 / 3, 2.0)
    assert bars.scalar(symbol) is symbol
    found = bars.convert(np.longdouble).scalars((Fraction(1, 3), 0.1))
    assert found == (np.longdouble(1) / 3, np.longdouble(0.1))
    assert [type(number) for number in found] == [np.longdouble] * 2


def test_conversion_keeps_long_doubles_exactly_in_numbers_that_take_none():
    mass = np.longdouble(1) / 3
    chain = Chain((mass, 1.0), (1.0, 1.0), ((0.5, 0.0),) * 2, (0.1, 0.1))
    with flint.ctx.workprec(128):
        numerator, denominator = mass.as_integer_ratio()
        assert chain.convert(flint.arb).m1 == flint.arb(numerator) / denominator


@pytest.mark.parametrize("vector", [(0.0, -2.5), (-1e-200, 0.0)])
def test_a_unit_vector_along_an_axis_is_exact(vector):
    expected = tuple(math.copysign(1.0, c) if c else 0.0 for c in vector)
    assert Chain.uniform_bars().unit(vector) == expected
