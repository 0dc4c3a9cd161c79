"""Inertia of the motors' rotors, which turn faster than the joints they drive."""

from dataclasses import dataclass, replace

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain, Rotor
from twolink.errors import ParameterError
from twolink.loads import Loads


@dataclass(frozen=True)
class MotorInertia:
    """Rotors of the motors at A and B: inertia J about their axes (kg m²), and gear ratio n.

    A rotor turns n times as fast as its joint, against it if n < 0. The motor at A stands on the
    ground and the one at B on link 1, which carries its rotor along: ω = u1 + n (u2 − u1). Engines
    that know a joint's `armature` J n² leave the carrying out; so does `carried` = false. The
    links' masses include those of the rotors, and their inertias do not include J.
    """

    inertia: tuple[float, float]
    ratio: tuple[float, float] = (1.0, 1.0)
    carried: bool = True

    def __post_init__(self) -> None:
        """Refuse negative inertia."""
        for joint, inertia, ratio in zip("AB", self.inertia, self.ratio, strict=True):
            if not 0 <= inertia < float("inf"):
                raise ParameterError(
                    f"motor inertia at {joint} is {inertia!r}; allowed is zero or a positive "
                    "number of kg m²"
                )
            if not abs(ratio) < float("inf"):
                raise ParameterError(f"gear ratio at {joint} is {ratio!r}; allowed is a number")

    def equipped(self, chain: Chain) -> Chain:
        """Return the chain with these rotors; one without inertia is none."""
        n1, n2 = self.ratio
        turning = (n1, 0.0), ((1.0 - n2) if self.carried else -n2, n2)
        rotors = tuple(Rotor(J, w) for J, w in zip(self.inertia, turning, strict=True) if J)
        return replace(chain, rotors=chain.rotors + rotors)

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return nothing: what a rotor resists with is in the mass matrix."""
        return ()
