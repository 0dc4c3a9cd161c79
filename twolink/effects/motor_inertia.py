"""Inertia of the motors' rotors, which turn faster than the joints they drive."""

from dataclasses import dataclass
from fractions import Fraction

from twolink.chain import Chain, Rotor
from twolink.effects.effect import RotorEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields


@dataclass(frozen=True)
class MotorInertia(RotorEffect):
    """Rotors of the motors at A and B: inertia J about their axes (kg m²), and gear ratio n.

    A rotor turns n times as fast as its joint, against it if n < 0. The motor at A stands on the
    ground and the one at B on link 1, which carries its rotor along: ω = u1 + n (u2 − u1). Engines
    with the `armature` J n² of a joint neglect this; so does `carried` = false. The
    links' masses include those of the rotors, and their inertias do not include J.
    """

    inertia: tuple[float, float]
    ratio: tuple[float, float] = (1.0, 1.0)
    carried: bool = True

    def __post_init__(self) -> None:
        """Require non-negative inertias and finite ratios."""
        take_fields(self, "motor inertia")
        for joint, inertia, ratio in zip("AB", self.inertia, self.ratio, strict=True):
            if not 0 <= inertia < float("inf"):
                raise ParameterError(
                    f"motor inertia at {joint} must be zero or positive and finite; got"
                    f" {inertia!r} kg m²"
                )
            if not abs(ratio) < float("inf"):
                raise ParameterError(f"gear ratio at {joint} must be finite; got {ratio!r}")

    def with_rotors(self, chain: Chain) -> Chain:
        """Return the chain with the rotors of non-zero inertia."""
        n1, n2 = self.ratio
        # A fraction, as 1 − n is rounded in float64.
        own = 1 - (Fraction(n2) if isinstance(n2, (int, float)) else n2)
        turning = (n1, 0.0), (own if self.carried else -n2, n2)
        rotors = tuple(Rotor(J, w) for J, w in zip(self.inertia, turning, strict=True) if J)
        return chain.with_rotors(rotors)
