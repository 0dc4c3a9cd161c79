"""A compliant surface: a half-plane that pushes back the points that press into it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.compliance import ContactLaw, Hertz, HuntCrossley, KelvinVoigt
from twolink.directions import PointDirection, PointName
from twolink.errors import ParameterError
from twolink.loads import Loads
from twolink.nonsmooth import Cushion

_LAWS = ("kelvin-voigt", "hertz", "hunt-crossley")
_POINTS = ("B", "C1", "C2", "D")


@dataclass(frozen=True)
class CompliantSurface:
    """A half-plane through `point` (m) with an outward `normal`, pressed by the points `on`.

    `law` is `kelvin-voigt`, with `stiffness` in N/m and `loss` in N s/m (a damper); `hertz`, with
    `stiffness` in N/m^{3/2}; or `hunt-crossley`, with the same and `loss` in s/m. `friction` is
    Coulomb's μ while a point slides and `static` the one while it sticks.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    law: Literal["kelvin-voigt", "hertz", "hunt-crossley"]
    stiffness: float
    loss: float = 0.0
    on: tuple[PointName, ...] = ("D",)
    friction: float = 0.0
    static: float | None = None
    name: str = "cushion"

    def __post_init__(self) -> None:
        """Refuse what has no side, pulls, or drives."""
        if not all(math.isfinite(x) for x in (*self.point, *self.normal)):
            self._refuse("point and normal", (self.point, self.normal), "numbers")
        if math.hypot(*self.normal) == 0:
            self._refuse("normal", self.normal, "two numbers, not both zero")
        if self.law not in _LAWS:
            self._refuse("law", self.law, ", ".join(_LAWS))
        if not 0 < self.stiffness < math.inf:
            self._refuse("stiffness", self.stiffness, "a positive number")
        if not 0 <= self.loss < math.inf or (self.law == "hertz" and self.loss != 0):
            allowed = "zero" if self.law == "hertz" else "zero or a positive number"
            self._refuse("loss", self.loss, allowed)
        if not self.on or len(set(self.on)) < len(self.on) or not set(self.on) <= set(_POINTS):
            self._refuse("on", self.on, f"one or more of {', '.join(_POINTS)}")
        if not 0 <= self.friction < math.inf:
            self._refuse("friction", self.friction, "zero or a positive number")
        if self.static is not None and not self.friction <= self.static < math.inf:
            self._refuse("static", self.static, f"the friction {self.friction!r} or more")

    def _refuse(self, what: str, value: object, allowed: str) -> None:
        raise ParameterError(f"{self.name}: {what} is {value!r}; allowed is {allowed}")

    @classmethod
    def of_a_ball(
        cls,
        point: tuple[float, float],
        normal: tuple[float, float],
        *,
        radius: float,
        modulus: tuple[float, float],
        poisson: tuple[float, float],
        **others: object,
    ) -> CompliantSurface:
        """Return the Hertz contact of a ball of a radius (m) at the point that presses.

        `modulus` E (Pa) and `poisson` ν are those of the ball and of the surface:
        K = 4/3 E* √R, with 1/E* = Σ (1 − ν²)/E.
        """
        inverse = sum((1 - nu * nu) / E for E, nu in zip(modulus, poisson, strict=True))
        stiffness = 4 / 3 * math.sqrt(radius) / inverse
        return cls(point, normal, "hertz", stiffness, **others)  # type: ignore[arg-type]

    def nonsmooth(self, chain: Chain) -> tuple[Cushion, ...]:
        """Return a cushion for each point, rough if there is friction."""
        size = math.hypot(*self.normal)
        x, y = self.normal[0] / size, self.normal[1] / size
        static = self.friction if self.static is None else self.static
        laws: dict[str, ContactLaw] = {
            "kelvin-voigt": KelvinVoigt(self.stiffness, self.loss),
            "hertz": Hertz(self.stiffness),
            "hunt-crossley": HuntCrossley(self.stiffness, self.loss),
        }
        return tuple(
            Cushion(
                name=f"{point} on {self.name}",
                direction=PointDirection(point, (x, y)),
                bound=x * self.point[0] + y * self.point[1],
                law=laws[self.law],
                tangent=PointDirection(point, (-y, x)) if static else None,
                kinetic=self.friction,
                static=static,
            )
            for point in self.on
        )

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return nothing: what a cushion gives depends on its mode, touched or free."""
        return ()
