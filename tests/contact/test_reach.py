"""Reach of points, against the places of points in many poses and exact tangents."""

import math

import mpmath
import numpy as np
import pytest
import sympy

from tests.verification.chains import GENERAL
from twolink.chain import Chain
from twolink.contact.reach import is_reachable
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.surface import Surface
from twolink.kinematics import position
from twolink.scene import Scene
from twolink.simulation import simulate

# C1 is 5/16 from A; C2 is 5/8 from B, which is 1/2 from A.
EXACT = Chain((1.0, 1.0), (0.5, 0.75), ((0.25, 0.1875), (0.375, -0.5)), (0.1, 0.1))
REACH = {"B": 0.5, "C1": 0.3125, "C2": 1.125, "D": 1.25}


@pytest.mark.parametrize("point", REACH)
@pytest.mark.parametrize(("part", "expected"), [(1.0, False), (1.5, False), (0.75, True)])
def test_a_tangent_is_not_crossed(point, part, expected):
    """On a floor, and along (3, 4), which is 5 long: all numbers are exact."""
    distance = part * REACH[point]
    assert is_reachable(EXACT, point, (0.0, -1.0), (2.0, distance)) is expected
    assert is_reachable(EXACT, point, (3.0, 4.0), (0.0, -1.25 * distance)) is expected


@pytest.mark.parametrize("point", REACH)
def test_a_floor_of_one_rounding_above_a_tangent_is_crossed(point):
    lower, higher = np.nextafter(REACH[point], 2), np.nextafter(REACH[point], 0)
    assert not is_reachable(EXACT, point, (0.0, -1.0), (7.0, float(lower)))
    assert is_reachable(EXACT, point, (0.0, -1.0), (7.0, float(higher)))


def test_reach_is_that_of_poses(random):
    """The lowest n · P of a point over many poses is below the surface or above it."""
    q = random.uniform(-math.pi, math.pi, (2, 40_000))
    for _ in range(40):
        normal, place = random.normal(size=2), random.normal(size=2)
        for point in REACH:
            where = position(GENERAL, tuple(q), getattr(GENERAL, point))
            lowest = (normal @ np.array(where) - normal @ place).min() / np.linalg.norm(normal)
            found = is_reachable(GENERAL, point, tuple(normal.tolist()), tuple(place.tolist()))
            if abs(lowest) > 1e-2:
                assert found == (lowest < 0)


def test_a_surface_beyond_the_chain_and_one_around_its_pivot():
    assert not is_reachable(EXACT, "D", (0.0, -1.0), (0.0, 10.0))
    assert is_reachable(EXACT, "D", (0.0, -1.0), (0.0, -10.0))


def test_the_decision_does_not_depend_on_the_numbers_of_the_chain():
    for chain in (EXACT.convert(np.longdouble), EXACT.convert(mpmath.mpf)):
        assert not is_reachable(chain, "D", (0.0, -1.0), (0.0, 1.25))
        assert is_reachable(chain, "D", (0.0, -1.0), (0.0, 1.2499999999999998))
    symbolic = EXACT.convert(lambda value: sympy.Symbol("x") * value)
    assert is_reachable(symbolic, "D", (0.0, -1.0), (0.0, 10.0))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("length", [0.3, 0.7, 1.0])
def test_a_floor_at_the_lowest_place_of_the_elbow_changes_nothing(length, friction):
    """B touches it without speed. Round-off made impacts, which turned link 1 around."""
    chain = Chain.uniform_bars(length=(length, length))
    floor = Surface((0.0, length), (0.0, -1.0), on=("B",), restitution=0.5, friction=friction)
    scene = Scene(chain, (0.3, -0.2), (0.0, 0.0), 2.0, (Gravity(), floor))
    found = simulate(scene)
    free = simulate(Scene(chain, (0.3, -0.2), (0.0, 0.0), 2.0, (Gravity(),)))
    assert found.met
    assert not found.impacts
    assert np.abs(found.u - free.u).max() <= found.error + free.error


def test_elements_know_whether_they_can_be_struck():
    floor = Surface((0.0, 0.6), (0.0, -1.0), on=("B", "D"))
    cushion = CompliantSurface((0.0, 0.6), (0.0, -1.0), "hertz", 1e3, on=("B", "D"))
    for kind in (floor, cushion):
        first, second = kind.contact_elements(EXACT)
        assert (first.reachable, second.reachable) == (False, True)
