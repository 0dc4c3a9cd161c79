"""The steps of an arc: as many as asked for, no longer than allowed, and up to an event."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.campaign.draw_coincidences import draw_coincidence
from tests.campaign.units import Units, in_units
from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from tests.simulation.hybrid.test_course import BALL, STOP, course_of
from twolink.chain import Chain
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.course import set_up
from twolink.simulation.hybrid.flow import flow
from twolink.simulation.hybrid.steps_of_arc import _longest_press, take_steps

POINTS = ("B", "C1", "C2", "D")


def begun(system, q, u=(0.0, 0.0), state=S.OPEN, until=10.0):
    course = course_of(system, state_of(system, q, u), state, until=until)
    set_up(course)
    return course


def test_as_many_steps_are_taken_as_asked_for_and_none_is_longer():
    system = system_of(*STOP, chain=BALANCED)
    block, over, failure = take_steps(begun(system, (1.0, 0.2)), 3, 0.125)
    assert block.lengths.tolist() == [0.125] * 3
    assert block.starts.tolist() == [0.0, 0.125, 0.25]
    assert (over, failure) == (False, "")


def test_further_steps_leave_the_steps_before_as_they_are():
    system = system_of(*STOP, chain=BALANCED)
    course = begun(system, (1.0, 0.2), until=1e3)
    first, _, _ = take_steps(course, 3, 0.125)
    kept = [each.copy() for each in first]
    take_steps(course, 3, 0.25)
    for own, before in zip(first, kept, strict=True):
        np.testing.assert_array_equal(own, before)


def test_steps_end_with_the_arc():
    system = system_of(*STOP, chain=BALANCED)
    block, over, _ = take_steps(begun(system, (1.0, 0.0), until=0.3), 8, 0.125)
    assert over
    assert block.lengths.sum() == pytest.approx(0.3, rel=1e-15)


def test_steps_end_where_a_gap_is_negative():
    """1 − t² is 0.25 at 0.87 s."""
    system = system_of(*STOP, chain=BALANCED)
    block, over, _ = take_steps(begun(system, (1.0, 0.0)), 100, 0.125)
    assert not over
    assert block.starts[-1] < math.sqrt(0.75) < block.starts[-1] + block.lengths[-1]


def test_a_step_whose_coefficients_are_not_finite_is_a_failure():
    system = system_of(Gravity(), JointStop("A", lower=-9.0))
    course = begun(system, (0.3, 0.2))
    course.stepper.state[0] = math.nan
    block, over, failure = take_steps(course, 3, 0.125)
    assert (len(block.lengths), over) == (0, False)
    assert "not finite" in failure


def test_no_step_of_a_press_follows_one_whose_clock_is_beyond_the_end():
    """The certificate finds the end on it."""
    system = system_of(BALL)
    course = begun(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED, until=1e-4)
    block, over, _ = take_steps(course, 100, 1e-6)
    clock = block.coefficients[:, course.compiled.clock, 0]
    assert not over
    assert clock.max() < 1e-4 <= course.stepper.state[course.compiled.clock]


def test_no_step_of_a_press_follows_one_on_which_the_point_leaves():
    """Its √depth is below zero at the end of that step."""
    system = system_of(BALL)
    course = begun(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED)
    block, over, failure = take_steps(course, 100, 1e-6)
    (root,) = course.compiled.falling
    assert (over, failure) == (False, "")
    assert len(block.lengths) < 100
    assert (block.coefficients[:, root, 0] >= 0).all()
    assert course.stepper.state[root] < 0


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_a_press_that_round_off_has_ended_as_it_begins_takes_steps_forward(precision):
    """Another event is at the instant at which the point leaves: its √depth is below zero."""
    system = system_of(BALL, precision=precision)
    state = state_of(system, (0.0, 0.0), (0.01, 0.01))
    (own,) = state.compliant
    state = state._replace(compliant=(own._replace(sqrt_depth=system.number(-1e-24)),))
    course = course_of(system, state, S.CLOSED, until=1e-4)
    set_up(course)
    block, _, failure = take_steps(course, 2, 1e-6)
    assert failure == ""
    assert (block.lengths > 0).all()


def test_points_in_pairs_leave_a_surface_at_one_instant():
    """Their roots fall to zero together, and more slowly the smaller they are: steps grow with it.

    Five contacts of two points press on two surfaces in one place.
    """
    scene = replace(draw_coincidence(1, 662), duration=0.01)
    found = simulate(scene)
    assert not found.failure
    assert found.met
    pressed = [sum(state is not S.OPEN for state in event.mode.states) for event in found.events]
    # Two joints slide as well. B and C1, a contact each, and C1 on the other surface leave.
    assert max(pressed) == 2 + 5
    assert pressed[-1] == 2 + 2


@pytest.mark.slow
@pytest.mark.parametrize("units", [Units(), Units(length=-10, mass=-10)], ids=["1 m", "1 mm"])
@pytest.mark.parametrize("u", [(-0.5, 0.2), (0.0, 0.0)])
def test_eight_contacts_press_from_their_first_instant(units, u):
    """A chain lies on two surfaces in one place. Powers of s would leave the range of float64."""
    floors = (
        CompliantSurface((0.0, 0.0), (0.0, 1.0), "hertz", 1e5, on=POINTS, name="smooth"),
        CompliantSurface(
            (0.0, 0.0), (0.0, 1.0), "hertz", 1e5, on=POINTS, friction=0.3, name="rough"
        ),
    )
    down = Gravity(9.81, (0.0, -1.0))
    scene = Scene(Chain.uniform_bars(), (0.0, 0.0), u, 0.2, (down, *floors))
    found = simulate(in_units(scene, units))
    assert found.met
    assert np.isfinite(found.q).all()


def test_the_longest_step_of_a_press_has_the_pace_of_its_roots():
    """At the least root of six points, a step of the product of all would overflow."""
    system = system_of(BALL)
    course = begun(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED, until=1e-4)
    (index,) = course.compiled.moving
    least = float(system.scales.least_root(index))
    assert _longest_press(course, 1e-4) == pytest.approx(2e-4 / least, rel=1e-12)
    take_steps(course, 3, 1e-6)
    root = float(course.stepper.values[4 + len(course.compiled.gaps)])
    assert root > 10 * least
    assert _longest_press(course, 1e-4) == pytest.approx(2e-4 / root, rel=1e-12)


def test_a_step_of_a_press_takes_no_more_than_the_longest_step():
    system = system_of(BALL, longest_step=1e-5)
    course = begun(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED, until=1e-4)
    take_steps(course, 3, 1e-6)
    root = float(course.stepper.values[4 + len(course.compiled.gaps)])
    assert _longest_press(course, 1e-4) == pytest.approx(1e-5 / root, rel=1e-12)


def test_an_arc_keeps_only_the_memory_of_its_steps():
    system = system_of(Gravity(), JointStop("A", lower=-1.0))
    (block,) = flow(
        system,
        state_of(system, (-0.99, 0.0), (-5.0, 0.0)),
        mode_of(system, S.OPEN),
        10.0,
        Compiler("lagrange"),
        lambda t, size: None,
    ).blocks
    rows = block.coefficients
    kept = rows.nbytes if rows.base is None else memoryview(rows.base).nbytes
    # The step in which the event was seen may follow those that the arc has.
    assert kept <= (len(block.lengths) + 1) * rows[0].nbytes


@pytest.mark.parametrize(("precision", "digits"), [("double", 300), ("long double", 4900)])
def test_the_powers_of_the_longest_step_stay_in_the_range_of_the_numbers(precision, digits):
    """A press of the least root would let a step of a long arc take any length."""
    system = system_of(BALL, precision=precision)
    course = begun(system, (0.0, 0.0), (0.01, 0.01), S.CLOSED, until=1e-4)
    far = replace(system, longest_step=1e290)
    longest = _longest_press(course._replace(system=far), system.number(1e290))
    assert longest > 1
    order = course.stepper.integrator.order
    assert math.log10(float(longest)) * order < digits
