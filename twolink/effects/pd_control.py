"""Proportional and derivative control of the joint angles."""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import Effect
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads
from twolink.validation import check_finite


@dataclass(frozen=True)
class PdControl(Effect):
    """Motors at A and B that drive the joint angles q1 and q2 − q1 to a target (rad).

    `proportional` in N m/rad, `derivative` in N m s/rad.
    """

    target: tuple[float, float]
    proportional: tuple[float, float]
    derivative: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        """Require finite numbers."""
        take_fields(self, "PD control")
        check_finite("PD control", **vars(self))

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques kp (target − θ) − kd dθ/dt of both motors."""
        (q1, q2), (u1, u2) = q, u
        (p1, p2), (d1, d2) = chain.scalars(self.proportional), chain.scalars(self.derivative)
        target1, target2 = chain.scalars(self.target)
        return motor_loads(
            p1 * (target1 - q1) - d1 * u1,
            p2 * (target2 - (q2 - q1)) - d2 * (u2 - u1),
        )
