"""Stops of a joint: angles that it cannot pass, and from which it rebounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import RigidContact
from twolink.errors import ParameterError
from twolink.loads import Loads


@dataclass(frozen=True)
class JointStop:
    """Stops of the joint A or B, at its angles `lower` and `upper` (rad); either may be absent.

    The angles are q1 for A and q2 − q1 for B, and count turns. `restitution` e is the ratio of
    the joint's speeds after and before.
    """

    joint: Literal["A", "B"]
    lower: float | None = None
    upper: float | None = None
    restitution: float = 0.0

    def __post_init__(self) -> None:
        """Refuse stops that are none, that leave no room, or that give energy."""
        if self.joint not in ("A", "B"):
            raise ParameterError(f"joint stop: joint is {self.joint!r}; allowed are 'A' and 'B'")
        where = f"joint stop at {self.joint}"
        for name, angle in (("lower", self.lower), ("upper", self.upper)):
            if angle is not None and not abs(angle) < float("inf"):
                raise ParameterError(f"{where}: {name} is {angle!r}; allowed is a number of rad")
        if self.lower is None and self.upper is None:
            raise ParameterError(f"{where} has no angle; allowed are lower, upper, or both")
        if self.lower is not None and self.upper is not None and not self.lower < self.upper:
            raise ParameterError(
                f"{where}: lower is {self.lower!r} and upper {self.upper!r} rad; allowed is lower "
                "below upper"
            )
        if not 0 <= self.restitution <= 1:
            raise ParameterError(f"{where}: restitution is {self.restitution!r}; allowed is 0 to 1")

    def nonsmooth(self, chain: Chain) -> tuple[RigidContact, ...]:
        """Return the stops that there are, as bounds of the joint's angle."""
        found = []
        for name, angle, sense in (("lower", self.lower, 1), ("upper", self.upper, -1)):
            if angle is not None:
                direction = JointCoordinate(self.joint, sense)
                words = f"{self.joint} on its {name} stop"
                found.append(RigidContact(words, direction, sense * angle, self.restitution))
        return tuple(found)

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return nothing: what a stop gives is whatever bars the way, and no function of state."""
        return ()
