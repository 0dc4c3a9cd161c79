"""Coulomb friction in the joints A and B, with exact sticking.

The kinetic torque resists a turning joint; a constraint torque, up to the static limit, holds a
joint at rest. The two are modes of the hybrid simulator, not a steep curve through zero speed.
"""

from dataclasses import dataclass

from twolink.arithmetic import Pair, Scalar, sign
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import DryFriction
from twolink.effects.effect import ContactEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads, motor_loads


@dataclass(frozen=True)
class JointFriction(ContactEffect):
    """Friction torques of the joints A and B (N m): kinetic, and static (kinetic unless given)."""

    kinetic: tuple[float, float]
    static: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Require 0 ≤ kinetic ≤ static torques."""
        take_fields(self, "joint friction")
        for joint, kinetic, static in zip("AB", self.kinetic, self.holding, strict=True):
            if not 0 <= kinetic < float("inf"):
                raise ParameterError(
                    f"joint friction at {joint} must be zero or positive and finite; got"
                    f" {kinetic!r} N m"
                )
            if not kinetic <= static < float("inf"):
                raise ParameterError(
                    f"static joint friction at {joint} must be finite and not below the kinetic"
                    f" {kinetic!r} N m; got {static!r} N m"
                )

    @property
    def holding(self) -> tuple[float, float]:
        """The largest static friction torques of the joints (N m)."""
        return self.kinetic if self.static is None else self.static

    def contact_elements(self, chain: Chain) -> tuple[DryFriction, ...]:
        """Return the dry friction of each joint with a non-zero torque."""
        limits = zip(self.kinetic, self.holding, strict=True)
        joints = (JointCoordinate("A"), JointCoordinate("B"))
        return tuple(
            DryFriction(joint.joint, joint, chain.scalar(kinetic), chain.scalar(static))
            for joint, (kinetic, static) in zip(joints, limits, strict=True)
            if static != 0
        )

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: all forces depend on the mode."""
        return ()

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return the kinetic torques by the speeds of the joints; zero for a joint at rest.

        At rest friction does no work, and the equations of motion determine its torque.
        """
        (k1, k2), (u1, u2) = chain.scalars(self.kinetic), u
        return motor_loads(-k1 * sign(u1), -k2 * sign(u2 - u1))
