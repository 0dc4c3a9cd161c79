"""The end of an arc: its last step up to an event, and the state there."""

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from tests.simulation.hybrid.test_course import STOP, course_of
from twolink.contact.states import ContactState as S
from twolink.contact.states import EventKind as E
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.certificate import Finding
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.course import set_up
from twolink.simulation.hybrid.end_of_arc import cut, end_state
from twolink.simulation.hybrid.flow import flow
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.steps_of_arc import take_steps


def test_the_steps_after_an_event_are_cut_off():
    block = Block(np.array([0.0, 1.0, 2.0]), np.ones(3), np.zeros((3, 5, 4)))
    found = cut(block, Finding(1, 0.25, Trigger(E.HITS, 0)))
    assert found.starts.tolist() == [0.0, 1.0]
    assert found.lengths.tolist() == [1.0, 0.25]
    assert len(found.coefficients) == 2
    assert block.lengths.tolist() == [1.0] * 3


@pytest.mark.parametrize("until", [None, 0.5])
def test_the_state_is_that_of_the_last_step(until):
    """1 − t², at the end of the step or at a given time, which it has to the last bit."""
    system = system_of(*STOP, chain=BALANCED)
    course = course_of(system, state_of(system, (1.0, 0.5), (0.0, 2.0)), S.OPEN)
    set_up(course)
    block, _, _ = take_steps(course, 1, 0.5)
    end = end_state(course, block, until)
    assert end.t == 0.5
    assert end.q == pytest.approx((0.75, 1.5), rel=1e-15)
    assert end.u == pytest.approx((-1.0, 2.0), rel=1e-15)
    assert end.gaps[0] == pytest.approx(0.5, rel=1e-15)


def test_a_joint_that_sticks_does_not_creep():
    system = system_of(Gravity(), JointFriction((50.0, 0.0)))
    state, mode = state_of(system, (0.3, 0.2), (0.0, 0.5)), mode_of(system, S.STICKS)
    arc = flow(system, state, mode, 2.0, Compiler("lagrange"), lambda t, size: None)
    assert arc.end.u[0] == 0
    assert arc.end.q[0] == 0.3
