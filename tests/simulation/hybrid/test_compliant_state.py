"""States of compliant surfaces through press, turn and release, by hand and by closed forms."""

import math

import mpmath
import pytest

from twolink.contact.coordinates import PointCoordinate
from twolink.contact.elastoplastic import ElastoPlastic, Material
from twolink.contact.elements import CompliantContact, RigidContact
from twolink.contact.force_laws import Hertz, KelvinVoigt, Phase, PlasticState
from twolink.simulation.hybrid import compliant_state
from twolink.simulation.hybrid.compliant_state import CompliantState

EPSILON = 2.0**-52
# The depth (m) that is the rounding of a place.
SMALL = 1e-13
UP = PointCoordinate("D", (0.0, -1.0))
DAMPED = CompliantContact("D on cushion", UP, 0.5, KelvinVoigt(100.0, 4.0))
SPRING = CompliantContact("D on cushion", UP, 0.5, KelvinVoigt(100.0))
BALL = CompliantContact("D on ball", UP, 0.5, Hertz(100.0))
STEEL = Material(modulus=1e11, radius=0.01, strength=3e8, poisson=0.3)
YIELDING = CompliantContact(
    "D on steel", UP, 0.5, Hertz(STEEL.stiffness), memory=ElastoPlastic(STEEL)
)
DEPTH = 5 * STEEL.yield_depth
FLOWING = CompliantState(math.sqrt(DEPTH), 0, PlasticState(Phase.FLOWS))


def test_an_undisturbed_surface_has_no_offset():
    assert compliant_state.undisturbed(RigidContact("D", UP, 0.5, 0.0)) is None
    assert compliant_state.undisturbed(BALL) == CompliantState()
    assert compliant_state.undisturbed(BALL).offset == 0
    assert compliant_state.undisturbed(YIELDING).plastic == PlasticState(Phase.WHOLE)


def test_a_state_of_a_surface_cannot_be_changed():
    with pytest.raises(AttributeError):
        FLOWING.residual_depth = 1.0


@pytest.mark.parametrize(("element", "root"), [(DAMPED, None), (BALL, 0.1)])
def test_only_laws_of_the_root_have_a_root_when_pressed(element, root):
    start = compliant_state.undisturbed(element)
    assert compliant_state.pressed(element, start, 0.1).sqrt_depth == root
    pressed_at = compliant_state.pressed_at(element, start, 0.01)
    assert pressed_at.sqrt_depth == (None if root is None else pytest.approx(0.1, rel=1e-15))


@pytest.mark.parametrize(
    ("share", "phase"), [(0.5, Phase.WHOLE), (1.5, Phase.YIELDS), (5.0, Phase.FLOWS)]
)
def test_a_start_deep_in_a_yielding_surface_is_on_its_branch_of_compression(share, phase):
    """Hertz's up to δ_y, elasto-plastic but still Hertz's up to 1.9 δ_y, and then the flow."""
    start = compliant_state.undisturbed(YIELDING)
    pressed = compliant_state.pressed_at(YIELDING, start, share * STEEL.yield_depth)
    assert pressed.plastic.phase is phase


def test_a_released_damper_is_where_it_gives_no_force_at_that_speed():
    """k δ = c v: 100 δ = 4 · 0.5."""
    state = compliant_state.released(DAMPED, CompliantState(), 0.5, 0.02, SMALL)
    assert state.residual_depth == pytest.approx(0.02)
    assert DAMPED.law.force(state.residual_depth, 0, -0.5) == pytest.approx(0, abs=1e-15)
    for element, root in [(SPRING, None), (BALL, 0.1)]:
        released = compliant_state.released(element, CompliantState(root), 0.5, 0.0, SMALL)
        assert released == CompliantState(None, 0)


@pytest.mark.parametrize(("off", "kept"), [(3e-14, False), (3e-13, True)])
def test_the_depth_of_a_released_damper_is_known_within_the_rounding_of_a_place(off, kept):
    """A fast damper is left at 1e-12 m, of which its place shows few digits.

    At a depth that is larger by a tenth the surface would spring back faster than the point.
    """
    depth = 1e-12 + off
    fast = CompliantContact("D on fast", UP, 0.5, KelvinVoigt(1e8, 1e-4))
    state = compliant_state.released(fast, CompliantState(), 1.0, depth, SMALL)
    assert state.residual_depth == pytest.approx(depth if kept else 1e-12, rel=1e-12)


def test_a_point_that_is_struck_out_of_a_damper_leaves_it_where_it_was():
    """Faster than the surface springs back: at 9 m/s it would have to be 0.36 m deep."""
    state = compliant_state.released(DAMPED, CompliantState(), 9.0, 0.02, SMALL)
    assert state.residual_depth == 0.02


def test_a_damped_surface_comes_back_in_the_time_of_its_decay():
    """2 · depth · exp(−k t/c) is the round-off at the returned time."""
    state, rounding = CompliantState(residual_depth=0.02), 2.0**-52
    time = compliant_state.relaxation_time(DAMPED, state, rounding)
    left = 0.02 * mpmath.exp(-25 * time)
    assert float(left) == pytest.approx(rounding / 2, rel=1e-12)
    after = CompliantState(residual_depth=float(left))
    assert compliant_state.relaxation_time(DAMPED, after, rounding) == 0
    assert compliant_state.relaxed(after).residual_depth == 0


def test_a_relaxed_surface_has_an_infinite_relaxation_time():
    assert compliant_state.relaxation_time(DAMPED, CompliantState(), 1e-16) == math.inf


def test_an_overtaken_surface_keeps_its_depth_without_a_press():
    state = compliant_state.overtaken(DAMPED, CompliantState(0.3), 0.02)
    assert (state.sqrt_depth, state.residual_depth) == (None, 0.02)


def test_a_turn_leaves_the_point_and_its_force_where_they_were():
    """The root is that of the depth below the dent, and the curve of restitution starts there."""
    turned = compliant_state.turned(YIELDING, FLOWING)
    dent = turned.plastic
    assert dent.phase is Phase.DENTED
    assert dent.deepest == pytest.approx(DEPTH)
    assert turned.sqrt_depth**2 + dent.residual == pytest.approx(DEPTH, rel=1e-14)
    assert turned.offset == dent.residual > 0
    law = YIELDING.branch(dent).law
    force = law.force(turned.sqrt_depth**2, turned.sqrt_depth, 0)
    assert force == pytest.approx(STEEL.flow_force(DEPTH), rel=1e-12)


def test_the_dent_of_a_turn_is_the_published_one():
    """δ_r/δ_m = 1.02 (1 − ((y + 5.9)/6.9)^−0.54), here in mpmath for y = 5."""
    dent = compliant_state.turned(YIELDING, FLOWING).plastic
    expected = 1.02 * (1 - (mpmath.mpf(10.9) / 6.9) ** mpmath.mpf(-0.54))
    assert dent.residual / DEPTH == pytest.approx(float(expected), rel=1e-12)


def test_pressing_beyond_the_deepest_place_continues_the_plastic_flow():
    """On to the whole surface's curve, at the same depth below the build-up."""
    turned = compliant_state.turned(YIELDING, FLOWING)
    on = compliant_state.reached(YIELDING, turned)
    assert on.plastic == PlasticState(Phase.FLOWS)
    assert on.sqrt_depth**2 == pytest.approx(DEPTH, rel=1e-14)


def test_a_release_from_a_dent_keeps_the_dent_until_it_is_cleared():
    turned = compliant_state.turned(YIELDING, FLOWING)
    free = compliant_state.released(YIELDING, turned, 0.5, 0.0, SMALL)
    assert free.sqrt_depth is None
    assert free.offset == turned.plastic.residual
    pressed = compliant_state.pressed(YIELDING, free, 0.0)
    assert pressed.plastic == turned.plastic
    assert pressed.offset == free.offset
    assert compliant_state.cleared(free).plastic == PlasticState(Phase.WHOLE)
    assert compliant_state.cleared(free).offset == 0


def test_a_light_press_on_a_dent_springs_back_to_the_same_dent():
    turned = compliant_state.turned(YIELDING, FLOWING)
    again = compliant_state.turned(YIELDING, turned)
    free = compliant_state.released(YIELDING, again, 0.5, 0.0, SMALL)
    assert free.plastic == turned.plastic
