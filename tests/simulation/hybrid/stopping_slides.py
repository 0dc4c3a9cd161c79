"""Two slides of a chain with M = diag(1, 1) that come to rest at 1 s, or almost then.

A decelerates by 4 rad/s², and the elbow by 5.5 rad/s². At rest the torques are 1.5 N m in A, below
its static limit of 3.5 N m, and −1 N m in B, below 1.5 N m but above its kinetic friction.
"""

from tests.simulation.hybrid import system_of
from twolink.chain import Chain
from twolink.effects.joint_friction import JointFriction
from twolink.effects.sampled_torque import SampledTorque
from twolink.scene import Scene
from twolink.simulation.hybrid.run import hybrid_run


def first_arc(later=0.0):
    """Return the system and the arc until A is at rest, `later` (rad/s) before the elbow is."""
    chain = Chain((0.25, 0.25), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.6875, 1.0))
    effects = (
        JointFriction((2.0, 0.5), (3.5, 1.5)),
        SampledTorque((0.0,), (0.5,), (-1.0,), "hold"),
    )
    run = hybrid_run(Scene(chain, (0.0, 0.0), (-4.0, 1.5 + later), 2.0, effects), [0.0, 2.0])
    return system_of(*effects, chain=chain), run.arcs[0]
