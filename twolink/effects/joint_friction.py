"""Coulomb friction in the joints A and B, with true sticking.

A joint that turns is resisted by the kinetic torque; one at rest is held by whatever torque up to
the static one it takes. Which of them holds is a mode (`twolink.simulation.modes`), not a steep
curve through zero speed.
"""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar, sign
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import DryFriction
from twolink.errors import ParameterError
from twolink.loads import Loads, motor_loads


@dataclass(frozen=True)
class JointFriction:
    """Friction torques of the joints A and B (N m): kinetic, and static (kinetic unless given)."""

    kinetic: tuple[float, float]
    static: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse friction that drives, and static friction below the kinetic."""
        for joint, kinetic, static in zip("AB", self.kinetic, self.holding, strict=True):
            if not 0 <= kinetic < float("inf"):
                raise ParameterError(
                    f"joint friction at {joint} is {kinetic!r}; allowed is zero or a positive "
                    "number of N m"
                )
            if not kinetic <= static < float("inf"):
                raise ParameterError(
                    f"static joint friction at {joint} is {static!r}; allowed is the kinetic "
                    f"{kinetic!r} N m or more"
                )

    @property
    def holding(self) -> tuple[float, float]:
        """The largest torques that hold the joints at rest (N m)."""
        return self.kinetic if self.static is None else self.static

    def nonsmooth(self, chain: Chain) -> tuple[DryFriction, ...]:
        """Return the friction of each joint that has any."""
        limits = zip(self.kinetic, self.holding, strict=True)
        joints = (JointCoordinate("A"), JointCoordinate("B"))
        return tuple(
            DryFriction(joint.joint, joint, kinetic, static)
            for joint, (kinetic, static) in zip(joints, limits, strict=True)
            if static != 0
        )

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the kinetic torques by the joints' speeds; none where a joint is at rest.

        At rest friction does no work, and its torque is what the rest of the chain demands.
        """
        (k1, k2), (u1, u2) = self.kinetic, u
        return motor_loads(-k1 * sign(u1), -k2 * sign(u2 - u1))
