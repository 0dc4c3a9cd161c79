"""Viscous damping in the joints A and B: a torque against each joint's speed."""

from dataclasses import dataclass
from numbers import Real

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects.effect import Effect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads


@dataclass(frozen=True)
class JointDamping(Effect):
    """Damping of the joints A and B (N m s/rad), zero or positive."""

    coefficient: tuple[float, float]

    def __post_init__(self) -> None:
        """Require non-negative coefficients."""
        take_fields(self, "joint damping")
        for joint, value in zip("AB", self.coefficient, strict=True):
            if isinstance(value, Real) and not 0 <= value < float("inf"):
                raise ParameterError(
                    f"joint damping at {joint} must be zero or positive and finite; got {value!r}"
                    " N m s/rad"
                )

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the torques against u1, and against u2 − u1."""
        c1, c2 = chain.scalars(self.coefficient)
        u1, u2 = u
        return motor_loads(-c1 * u1, -c2 * (u2 - u1))
