"""A point at rest for an instant, near a singular pose, while the links turn on."""

import pytest

from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
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


def test_a_dead_point_where_friction_nearly_cancels_the_push_does_not_stop_the_links():
    """Where the chain is straight the surface is inclined by arctan 1/2.1019, and μ is 2.1.

    The slide was taken for one that friction locks, and u was set to zero without an impulse.
    """
    chain = Chain(
        (2.4, 4.1), (1.9, 0.26), ((0.703, -0.152), (0.234, -0.0247)), (0.199272, 0.027716)
    )
    slope = (-0.7940924129144878, -0.6077970382879853)
    surface = Surface(
        (1.9041481551019224, -0.9610227196735492), slope, restitution=0.79, law="newton-routh",
        friction=2.1, name="s",
    )  # fmt: skip
    torque = JointTorque((-16.0, 0.0), (78.0, -2.0), (0.62, 2.9), (-2.2, 0.68))
    scene = Scene(
        chain, (-0.41, -0.9), (-0.13635976011201212, 0.8710089829965392), 1.7,
        (Gravity(), torque, surface),
    )  # fmt: skip
    trajectory = simulate(scene)
    assert trajectory.met
    assert trajectory.impacts == ()
    (turned,) = [event for event in trajectory.events if "slips backward" in str(event.mode)]
    q, before = trajectory.at([turned.entered], side="left")
    _, after = trajectory.at([turned.entered], side="right")
    assert q[0, 0] == pytest.approx(q[1, 0], abs=1e-9)
    assert before == pytest.approx(after, rel=1e-9)
    assert after[1, 0] > 3.0
