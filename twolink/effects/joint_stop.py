"""Stops of a joint: unilateral limits of its angle, with restitution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import RigidContact
from twolink.effects.effect import ContactEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads


@dataclass(frozen=True)
class JointStop(ContactEffect):
    """Stops of the joint A or B, at its angles `lower` and `upper` (rad); either may be absent.

    The angles are q1 for A and q2 − q1 for B, and count turns. `restitution` e is the ratio of
    the joint's speeds after and before.
    """

    joint: Literal["A", "B"]
    lower: float | None = None
    upper: float | None = None
    restitution: float = 0.0

    def __post_init__(self) -> None:
        """Require at least one angle, lower < upper, and 0 ≤ e ≤ 1."""
        take_fields(self, "joint stop", real=True)
        if self.joint not in ("A", "B"):
            raise ParameterError(f"joint stop: joint must be 'A' or 'B'; got {self.joint!r}")
        where = f"joint stop at {self.joint}"
        for name, angle in (("lower", self.lower), ("upper", self.upper)):
            if angle is not None and not abs(angle) < float("inf"):
                raise ParameterError(f"{where}: {name} must be a finite angle; got {angle!r} rad")
        if self.lower is None and self.upper is None:
            raise ParameterError(f"{where} must have lower, upper, or both; got no angle")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise ParameterError(
                f"{where}: lower must be below upper; got lower {self.lower!r} and upper"
                f" {self.upper!r} rad"
            )
        if not 0 <= self.restitution <= 1:
            raise ParameterError(f"{where}: restitution must be 0 to 1; got {self.restitution!r}")

    @property
    def label(self) -> str:
        """The joint."""
        return self.joint

    def contact_elements(self, chain: Chain) -> tuple[RigidContact, ...]:
        """Return the given stops, as bounds of the angle of the joint."""
        found, restitution = [], chain.scalar(self.restitution)
        for name, angle, sense in (("lower", self.lower, 1), ("upper", self.upper, -1)):
            if angle is not None:
                direction = JointCoordinate(self.joint, sense)
                words = f"{self.joint} on its {name} stop"
                bound = chain.scalar(sense * angle)
                found.append(RigidContact(words, direction, bound, restitution))
        return tuple(found)

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: all forces depend on the mode."""
        return ()

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: the constraint force of a stop is not a function of the state."""
        return ()
