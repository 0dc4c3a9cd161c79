"""Constant torques of motors at the joints A and B."""

from dataclasses import dataclass

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.loads import Loads, Torque


@dataclass(frozen=True)
class JointTorque:
    """Torques of the motors at A and B (N m), in the positive sense of the angles.

    The motor at A stands on the ground and turns link 1; the motor at B stands on link 1 and
    turns link 2, so its reaction acts on link 1.
    """

    torque: Pair

    def loads(self, chain: Chain, q: Pair, u: Pair) -> Loads:
        """Return the torques on link 1 and on link 2."""
        tau1, tau2 = self.torque
        return Torque(1, tau1), Torque(1, -tau2), Torque(2, tau2)
