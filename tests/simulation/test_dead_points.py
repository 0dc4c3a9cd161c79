"""A point at rest for an instant, near a singular pose, while the links turn on."""

import pytest

from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.scene import Scene
from twolink.simulation import simulate


@pytest.mark.slow_but_first
@pytest.mark.parametrize("lower", [-3e-14, -1e-12, -1e-10, -1e-6])
def test_a_dead_point_of_a_nearly_stretched_chain_turns_the_slide_of_its_end(lower):
    """B rests on a stop, so that D stops along x where the chain is straight up to the stop."""
    effects = (
        JointTorque((0.0, -5.0)),
        JointStop("B", lower=lower),
        EndForce(normal=-3.0, friction=0.3),
    )
    trajectory = simulate(Scene(Chain.uniform_bars(), (-0.5, -0.5), (2.0, 2.0), 0.5, effects))
    (turned,) = [event for event in trajectory.events if "D slips backward" in str(event.mode)]
    _, before = trajectory.at([turned.entered], side="left")
    _, after = trajectory.at([turned.entered], side="right")
    assert before == pytest.approx(after, rel=1e-9)
    assert after[0, 0] == pytest.approx(after[1, 0])
    assert after[0, 0] > 1.0
    T = trajectory.kinetic_energy
    works = sum(trajectory.work().values())
    assert works == pytest.approx(T - T[0], abs=1e-9)
