from fractions import Fraction

import mpmath
import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import kane, lagrange
from twolink.effects.gravity import Gravity

HANGING = (np.pi / 2, np.pi / 2)


def test_weights_act_at_the_mass_centres_along_y():
    first, second = Gravity(9.80665).loads(GENERAL, (0.3, -0.4), (0.0, 0.0))
    assert (first.point, second.point) == (GENERAL.C1, GENERAL.C2)
    assert first.components == (0, GENERAL.m1 * 9.80665)
    assert second.components == (0, GENERAL.m2 * 9.80665)


@pytest.mark.parametrize("formulation", [kane, lagrange])
def test_a_horizontal_link_falls(formulation):
    """Gravity turns a link that lies along x towards y, in the positive sense."""
    Q1, Q2 = formulation.generalized_active_force(
        GENERAL, (0.0, 0.0), Gravity().loads(GENERAL, (0.0, 0.0), (0.0, 0.0))
    )
    assert pytest.approx(9.81 * (GENERAL.m1 * 0.35 + GENERAL.m2 * 0.9)) == Q1
    assert pytest.approx(9.81 * GENERAL.m2 * 0.55) == Q2


def test_the_potential_is_lowest_where_the_centres_are():
    bars = type(GENERAL).uniform_bars()
    V = Gravity().potential_energy(bars, HANGING)
    assert pytest.approx(-9.81 * (0.5 + 1.5)) == V
    for q in ((1.5, 1.6), (1.6, 1.5), (1.6, 1.6)):
        assert Gravity().potential_energy(bars, q) > V


@pytest.mark.parametrize("direction", [(3.0, 4.0), (0.3, -0.4)])
def test_the_components_of_gravity_have_the_digits_of_the_chain(direction):
    """Those of float64 would be wrong after the 16th digit, in any reference."""
    with mpmath.workdps(60):
        chain = GENERAL.convert(mpmath.mpf)
        x, y = map(mpmath.mpf, direction)
        weight = chain.m1 * mpmath.mpf(9.81) / mpmath.sqrt(x * x + y * y)
        first, _ = Gravity(9.81, direction).loads(chain, (0, 0), (0, 0))
        for found, share in zip(first.components, (x, y), strict=True):
            assert abs(found - weight * share) < mpmath.mpf(10) ** -57


def test_gravity_along_an_axis_is_its_size():
    first, second = Gravity(9.81, (0.0, -3.0)).loads(GENERAL, (0, 0), (0, 0))
    assert first.components == (0, -9.81 * GENERAL.m1)
    assert second.components == (0, -9.81 * GENERAL.m2)


@pytest.mark.parametrize("direction", [(0.0, 0.3), (-0.7, 0.0)])
def test_gravity_along_an_axis_is_exact_as_a_fraction(direction):
    exact = Gravity(Fraction(981, 100), direction)
    first, _ = exact.loads(GENERAL.convert(Fraction), (0, 0), (0, 0))
    weight = Fraction(GENERAL.m1) * Fraction(981, 100)
    assert first.components == ((0, weight) if direction[1] else (-weight, 0))
