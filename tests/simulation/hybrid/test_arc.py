"""An arc: the number of its steps."""

import pytest

from tests.simulation.hybrid import BALANCED, mode_of, state_of, system_of
from twolink.contact.states import ContactState as S
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.simulation.hybrid.arc import NO_ARCS
from twolink.simulation.hybrid.compile import Compiler
from twolink.simulation.hybrid.flow import flow

TURNING = JointTorque((-6.0, 0.0)), JointStop("A", lower=-9.0)
"""The angle is a polynomial of time, so that only the longest step ends a step."""


def arc_of(longest_step, until):
    system = system_of(*TURNING, chain=BALANCED, longest_step=longest_step)
    state = state_of(system, (0.3, 0.2))
    return flow(
        system, state, mode_of(system, S.OPEN), until, Compiler("lagrange"), lambda t, size: None
    )


def test_the_steps_of_an_arc_are_those_of_all_its_blocks():
    """2 s in steps of 1/64 s."""
    arc = arc_of(1 / 64, 2.0)
    assert len(arc.blocks) > 1
    assert arc.step_count == 128
    assert arc._replace(blocks=arc.blocks[:1]).step_count == len(arc.blocks[0].lengths)
    assert arc._replace(blocks=()).step_count == 0


def test_there_are_no_arcs_to_add_to():
    with pytest.raises(TypeError):
        NO_ARCS[0] = None
