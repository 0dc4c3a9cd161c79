"""The sizes of places, speeds and forces of a system."""

import math

import pytest

from tests.simulation.hybrid import BARS, system_of
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.integration.precisions import PRECISIONS

FLOOR = Surface((0.0, 1.0), (0.0, -1.0), on=("B", "D"), name="floor")


def test_a_gap_is_closed_within_the_rounding_of_its_bound():
    """Of the length of the chain for points, and of 1 rad for joints.

    Friction without a contact has no gap, and short links do not get beyond the surfaces.
    """
    far, stop = Surface((0.0, 8.0), (0.0, -1.0), on=("D",)), JointStop("A", lower=-20.0, upper=0.5)
    effects, unit = (JointFriction((1.0, 0.0)), FLOOR, far, stop), 64 * 2.0**-52
    system = system_of(*effects, chain=Chain.uniform_bars((1.0, 1.0), (5.0, 5.0)))
    sizes = {1: 10, 2: 10, 3: 10, 4: 20, 5: 1}
    assert system.scales.near == tuple((i, size * unit) for i, size in sizes.items())
    assert system_of(*effects).scales.near == ((2, 2 * unit), (4, 20 * unit), (5, unit))
    small = system_of(*effects, chain=Chain.uniform_bars((1.0, 1.0), (0.5, 0.7)))
    assert small.scales.near[0] == (2, 1.2 * unit)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_places_are_known_within_round_off_of_their_size(precision):
    """A press begins half a last digit deep: a place is rounded to nearest."""
    stop = JointStop("A", lower=-4.0)
    scales = system_of(FLOOR, stop, precision=precision).scales
    assert scales.sizes == (2.0, 2.0, 4.0)
    assert float(scales.least_root(0)) ** 2 == pytest.approx(scales.rounding, rel=1e-15)
    assert scales.rounding < scales.places_of_rounding[0] < scales.grazing(0) < 1e-9
    assert scales.places_of_rounding[2] == 2 * scales.places_of_rounding[0]
    assert scales.resolution >= scales.rounding


@pytest.mark.parametrize("unit", [2.0**-10, 2.0**10])
def test_scaled_forces_do_not_depend_on_the_unit_of_length(unit):
    """Masses are the same, and so are times: forces have the unit of the length."""
    cushion = CompliantSurface((0.0, 1.0), (0.0, -1.0), "kelvin-voigt", 1e6)
    far = CompliantSurface((0.0, unit), (0.0, -1.0), "kelvin-voigt", 1e6)
    one = system_of(cushion, JointStop("A", lower=-1.0), chain=BARS).scales
    bars = Chain.uniform_bars((1.0, 1.0), (unit, unit))
    other = system_of(far, JointStop("A", lower=-1.0), chain=bars).scales
    assert other.force(0) * unit == one.force(0)
    assert other.force(1) * unit**2 == one.force(1) == one.moment
    assert other.forces_of_rounding == one.forces_of_rounding
    assert one.forces_of_rounding[1] == 0.0
    assert math.isfinite(one.slowest)


@pytest.mark.parametrize("unit", [2.0**-10, 2.0**20])
def test_stabilisation_is_a_rate_in_the_unit_of_time(unit):
    """Each step of the longest length reduces errors by the same part."""
    one, other = (system_of(FLOOR, longest_step=step).scales for step in (1.0, unit))
    assert other.stabilisation * unit == one.stabilisation
    assert other.of_rounded_start * unit == one.of_rounded_start
    assert 1e-14 < one.of_rounded_start < 1e-12


def test_a_hertzian_surface_has_no_force_of_rounding():
    """Its force is of the root of the depth, a variable of its own."""
    cushion = CompliantSurface((0.0, 1.0), (0.0, -1.0), "hertz", 1e6)
    assert system_of(cushion).scales.forces_of_rounding == (0.0,)
