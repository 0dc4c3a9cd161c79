"""Viscous damping in the joints A and B: a torque against each joint's speed."""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.errors import ParameterError
from twolink.loads import Loads, motor_loads


@dataclass(frozen=True)
class JointDamping:
    """Damping of the joints A and B (N m s/rad), zero or positive."""

    coefficient: tuple[float, float]

    def __post_init__(self) -> None:
        """Refuse damping that drives."""
        for joint, value in zip("AB", self.coefficient, strict=True):
            if isinstance(value, (int, float)) and not 0 <= value < float("inf"):
                raise ParameterError(
                    f"joint damping at {joint} is {value!r}; allowed is zero or a positive number "
                    "of N m s/rad"
                )

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques against u1, and against u2 − u1."""
        c1, c2 = self.coefficient
        u1, u2 = u
        return motor_loads(-c1 * u1, -c2 * (u2 - u1))
