"""The course of an arc: the integrator at its start, and the surfaces that spring back."""

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.course import Course, now, set_up, springing_back

STOP = JointTorque((-6.0, 0.0)), JointStop("A", lower=0.25)
BALL = CompliantSurface((0.0, 0.0), (0.0, -1.0), "hertz", 1e6)


def course_of(system, state, *states, until=10.0):
    mode = mode_of(system, *states)
    compiled = Compiler("lagrange").mode(system, mode, springing_back(state))
    with compiled.pool.lend() as stepper:
        return Course(system, compiled, stepper, mode, state, until, 0.0)


@pytest.mark.parametrize("precision", ["double", "long double", "quadruple"])
def test_an_integrator_begins_with_the_state_and_the_gaps_at_the_time_of_the_start(precision):
    system = system_of(*STOP, chain=BALANCED, precision=precision)
    state = state_of(system, (1.0, 0.5), (-2.0, 0.125))._replace(t=system.number(3))
    course = course_of(system, state, S.OPEN)
    set_up(course)
    assert [float(x) for x in course.stepper.state] == [1.0, 0.5, -2.0, 0.125, 0.75]
    assert now(course) == 3


def test_a_course_with_a_clock_begins_at_zero_beside_the_time():
    """The independent variable is not time, which is that of the start and the clock."""
    system = system_of(BALL)
    state = state_of(system, (0.0, 0.0), (0.01, 0.01))._replace(t=3.0)
    course = course_of(system, state, S.CLOSED)
    set_up(course)
    assert course.compiled.clock is not None
    assert course.stepper.integrator.time == 0
    assert now(course) == 3.0
    course.stepper.state[course.compiled.clock] = 0.5
    assert now(course) == 3.5


def test_the_parameters_are_those_of_the_mode():
    """With a torque that differs from piece to piece the code is shared, and its number set."""
    for torque in (-6.0, -3.0):
        system = system_of(JointTorque((torque, 0.0)), STOP[1], chain=BALANCED)
        course = course_of(system, state_of(system, (1.0, 0.0)), S.OPEN)
        set_up(course)
        course.stepper.step(0.5, True)
        # 1 + t²/2 · torque/3 after half a second.
        assert course.stepper.state[0] == pytest.approx(1 + torque / 3 / 8, rel=1e-14)


def test_surfaces_that_have_not_recovered_spring_back():
    cushion = CompliantSurface((0.0, 0.0), (0.0, -1.0), "kelvin-voigt", 100.0, loss=1.0)
    state = state_of(system_of(cushion), (0.3, 0.2))
    assert springing_back(state) == ()
    (own,) = state.compliant
    pressed = state._replace(compliant=(own._replace(residual_depth=np.float64(1e-3)),))
    assert springing_back(pressed) == (0,)
    assert springing_back(state_of(system_of(*STOP, chain=BALANCED), (1.0, 0.0))) == ()
