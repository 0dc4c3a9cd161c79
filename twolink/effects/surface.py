"""A rigid surface: a half-plane that points of the chain cannot enter."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate, PointName
from twolink.contact.elements import RigidContact
from twolink.contact.impact_laws import LAWS
from twolink.contact.reach import is_reachable
from twolink.effects.effect import ContactEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads


@dataclass(frozen=True)
class Surface(ContactEffect):
    """A half-plane through `point` (m), on whose side of the outward `normal` the chain may be.

    It limits the points `on` (of B, C1, C2 and D). `restitution` is e of the law of restitution
    `law`; `friction` is Coulomb's μ while a point slides and `static` the one while it sticks (the
    same unless given). In an impact friction is that of sliding. `name` is for the log.

    Rigid contact admits no motion if the chain is stretched or folded towards a point that the
    surface or its friction holds while the links turn: no finite impulse stops them. A simulation
    ends there with this reason.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    on: tuple[PointName, ...] = ("D",)
    restitution: float = 0.0
    law: Literal["newton", "newton-routh", "poisson", "stronge"] = "stronge"
    friction: float = 0.0
    static: float | None = None
    name: str = "surface"

    def __post_init__(self) -> None:
        """Require a non-zero normal, 0 ≤ e ≤ 1 and 0 ≤ μ ≤ static μ."""
        take_fields(self, self.name if isinstance(self.name, str) else "surface", real=True)
        if not all(math.isfinite(x) for x in (*self.point, *self.normal)):
            raise ParameterError(
                f"{self.name}: point and normal must be finite numbers; got point {self.point!r}"
                f" and normal {self.normal!r}"
            )
        if math.hypot(*self.normal) == 0:
            raise ParameterError(
                f"{self.name}: normal must be two numbers, not both zero; got {self.normal!r}"
            )
        if not self.on or len(set(self.on)) < len(self.on) or not set(self.on) <= set(_POINTS):
            raise ParameterError(
                f"{self.name}: on must be one or more of {', '.join(_POINTS)}, each once; got"
                f" {self.on!r}"
            )
        if not 0 <= self.restitution <= 1:
            raise ParameterError(
                f"{self.name}: restitution must be 0 to 1; got {self.restitution!r}"
            )
        if self.law not in LAWS:
            raise ParameterError(
                f"{self.name}: law must be one of {', '.join(LAWS)}; got {self.law!r}"
            )
        if not 0 <= self.friction < math.inf:
            raise ParameterError(
                f"{self.name}: friction must be zero or positive and finite; got {self.friction!r}"
            )
        if self.static is not None and not self.friction <= self.static < math.inf:
            raise ParameterError(
                f"{self.name}: static must be finite and not below the friction {self.friction!r};"
                f" got {self.static!r}"
            )

    @property
    def label(self) -> str:
        """The name of the surface."""
        return self.name

    def contact_elements(self, chain: Chain) -> tuple[RigidContact, ...]:
        """Return a rigid contact for each point, rough if there is friction.

        The tangent is a quarter turn from the normal: along x on a floor, whose normal is −y.
        """
        (x, y), (X, Y) = chain.unit(self.normal), chain.scalars(self.point)
        static = self.friction if self.static is None else self.static
        return tuple(
            RigidContact(
                name=f"{point} on {self.name}",
                normal=PointCoordinate(point, (x, y)),
                bound=x * X + y * Y,
                restitution=chain.scalar(self.restitution),
                tangent=PointCoordinate(point, (-y, x)) if static else None,
                kinetic=chain.scalar(self.friction),
                static=chain.scalar(static),
                law=self.law,
                reachable=is_reachable(chain, point, self.normal, self.point),
            )
            for point in self.on
        )

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: all forces depend on the mode."""
        return ()

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: the constraint force of a surface is not a function of the state."""
        return ()


_POINTS = ("B", "C1", "C2", "D")
