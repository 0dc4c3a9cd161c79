"""A compliant surface: a half-plane with a normal force law for points that penetrate it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.contact.coordinates import PointCoordinate, PointName
from twolink.contact.elastoplastic import ElastoPlastic, Material, hertzian
from twolink.contact.elements import CompliantContact
from twolink.contact.force_laws import (
    ContactLaw,
    Hertz,
    HuntCrossley,
    Hysteresis,
    KelvinVoigt,
    NoPull,
)
from twolink.contact.reach import is_reachable
from twolink.effects.effect import ContactEffect
from twolink.errors import ParameterError
from twolink.inputs import take_fields
from twolink.loads import Loads

_LAWS = ("kelvin-voigt", "hertz", "hunt-crossley", "elasto-plastic")
_OF_BALLS = _LAWS[1:]
_WITH_LOSS = ("kelvin-voigt", "hunt-crossley")
_POINTS = ("B", "C1", "C2", "D")
_MATERIAL = ("radius", "modulus", "poisson")

# The largest ratio of strength and modulus. The fits grow as exp(23 S_y/E*), and no solid exceeds
# a ratio of one by much.
_STRONGEST = 10.0


@dataclass(frozen=True)
class CompliantSurface(ContactEffect):
    """A half-plane through `point` (m) with an outward `normal`, pressed by the points `on`.

    `law` is `kelvin-voigt`, with `stiffness` in N/m and `loss` in N s/m (a damper); `hertz`, with
    `stiffness` in N/m^{3/2}; `hunt-crossley`, with the same and `loss` in s/m; or `elasto-plastic`.
    The indenter is a ball: its `radius` (m), and `modulus` E (Pa) and `poisson` ν of the ball and
    of the surface may replace the stiffness of all laws but the first, K = 4/3 E* √R with
    1/E* = Σ (1 − ν²)/E. The last needs them, and the yield `strength` (Pa) of both. `friction` is
    Coulomb's μ while a point slides and `static` the one while it sticks. No law pulls: with `loss`
    a negative force is replaced by zero.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    law: Literal["kelvin-voigt", "hertz", "hunt-crossley", "elasto-plastic"]
    stiffness: float | None = None
    loss: float = 0.0
    on: tuple[PointName, ...] = ("D",)
    friction: float = 0.0
    static: float | None = None
    name: str = "cushion"
    radius: float | None = None
    modulus: tuple[float, float] | None = None
    poisson: tuple[float, float] | None = None
    strength: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Require a non-zero normal, points, valid coefficients and a complete material."""
        take_fields(
            self, self.name if isinstance(self.name, str) else "compliant surface", real=True
        )
        if not all(math.isfinite(x) for x in (*self.point, *self.normal)):
            self._refuse("point and normal", (self.point, self.normal), "finite numbers")
        if math.hypot(*self.normal) == 0:
            self._refuse("normal", self.normal, "two numbers, not both zero")
        if self.law not in _LAWS:
            self._refuse("law", self.law, f"one of {', '.join(_LAWS)}")
        self._check_material()
        lossy = self.law in _WITH_LOSS
        if not 0 <= self.loss < math.inf or (not lossy and self.loss != 0):
            self._refuse("loss", self.loss, "zero or positive and finite" if lossy else "zero")
        if not self.on or len(set(self.on)) < len(self.on) or not set(self.on) <= set(_POINTS):
            self._refuse("on", self.on, f"one or more of {', '.join(_POINTS)}, each once")
        if not 0 <= self.friction < math.inf:
            self._refuse("friction", self.friction, "zero or positive and finite")
        if self.static is not None and not self.friction <= self.static < math.inf:
            required = f"finite and not below the friction {self.friction!r}"
            self._refuse("static", self.static, required)

    def _check_material(self) -> None:
        """Require a positive stiffness, or the complete material of a ball."""
        yields = self.law == "elasto-plastic"
        wanted = (*_MATERIAL, "strength") if yields else _MATERIAL
        given = [name for name in (*_MATERIAL, "strength") if getattr(self, name) is not None]
        if not given and not yields:
            if self.stiffness is None or not 0 < self.stiffness < math.inf:
                self._refuse("stiffness", self.stiffness, "a positive finite number")
            return
        if self.stiffness is not None or self.law not in _OF_BALLS or set(given) != set(wanted):
            both = ["stiffness"] if self.stiffness is not None else []
            required = f"{', '.join(wanted)} of a ball"
            if not yields:
                required = "stiffness" + (f", or {required}" if self.law in _OF_BALLS else "")
            received = " and ".join([*both, *given]) or "none"
            self._refuse(f"the parameters of {self.law}", received, required)
        if not 0 < self._radius < math.inf:
            self._refuse("radius", self.radius, "a positive finite number")
        for name in ("modulus", "strength")[: 1 + yields]:
            if not all(0 < x < math.inf for x in getattr(self, name)):
                self._refuse(name, getattr(self, name), "two positive finite numbers")
        assert self.poisson is not None
        if not all(-1 < nu <= 0.5 for nu in self.poisson):
            self._refuse("poisson", self.poisson, "two numbers above -1 and up to 0.5")
        if yields:
            self._check_yielding()

    def _check_yielding(self) -> None:
        """Require a material within the range of Jackson and Green's fits, and of float64."""
        material = self._material_in(float)
        if material.poisson < 0:
            self._refuse("poisson", self.poisson, "zero or positive for the body that yields")
        if not material.strength <= _STRONGEST * material.modulus:
            required = (
                f"at most {_STRONGEST:g} times the common modulus E*, {material.modulus:.3g} Pa, "
                "for the body that yields"
            )
            self._refuse("strength", self.strength, required)
        if not 0 < material.yield_force < math.inf:
            required = "those of a surface that yields at a positive finite force"
            given = self.radius, self.modulus, self.strength
            self._refuse("radius, modulus and strength", given, required)

    def _refuse(self, parameter: str, value: object, required: str) -> None:
        raise ParameterError(f"{self.name}: {parameter} must be {required}; got {value!r}")

    @property
    def _radius(self) -> float:
        assert self.radius is not None
        return self.radius

    def _modulus_in(self, number: Callable[[Any], Scalar]) -> Scalar:
        """Return E* (Pa) in a type of numbers."""
        assert self.modulus is not None
        assert self.poisson is not None
        (E1, E2), (nu1, nu2) = map(number, self.modulus), map(number, self.poisson)
        return 1 / ((1 - nu1 * nu1) / E1 + (1 - nu2 * nu2) / E2)

    def _stiffness_in(self, number: Callable[[Any], Scalar]) -> Scalar:
        """Return the given stiffness, or the Hertzian one of the ball, in a type of numbers."""
        if self.stiffness is not None:
            return number(self.stiffness)
        return hertzian(self._modulus_in(number), number(self._radius))

    def _material_in(self, number: Callable[[Any], Scalar]) -> Material:
        """Return the yielding body, the one of lesser C S_y (Jackson and Green)."""
        assert self.poisson is not None
        assert self.strength is not None
        modulus, radius = self._modulus_in(number), number(self._radius)
        bodies = [
            Material(modulus, radius, number(strength), number(nu))
            for strength, nu in zip(self.strength, self.poisson, strict=True)
        ]
        return min(bodies, key=lambda body: float(body.slope))

    @property
    def label(self) -> str:
        """The name of the surface."""
        return self.name

    def contact_elements(self, chain: Chain) -> tuple[CompliantContact, ...]:
        """Return a compliant contact for each point, rough if there is friction."""
        (x, y), (X, Y) = chain.unit(self.normal), chain.scalars(self.point)
        static = self.friction if self.static is None else self.static
        law, memory = self._law(chain)
        return tuple(
            CompliantContact(
                name=f"{point} on {self.name}",
                normal=PointCoordinate(point, (x, y)),
                bound=x * X + y * Y,
                law=law,
                tangent=PointCoordinate(point, (-y, x)) if static else None,
                kinetic=chain.scalar(self.friction),
                static=chain.scalar(static),
                memory=memory,
                reachable=is_reachable(chain, point, self.normal, self.point),
            )
            for point in self.on
        )

    def _law(self, chain: Chain) -> tuple[ContactLaw, Hysteresis | None]:
        """Return the law of the undamaged surface, and its history dependence."""
        if self.law == "elasto-plastic":
            material = self._material_in(chain.scalar)
            return Hertz(material.stiffness), ElastoPlastic(material)
        stiffness, loss = self._stiffness_in(chain.scalar), chain.scalar(self.loss)
        if self.law == "kelvin-voigt":
            return KelvinVoigt(stiffness, loss), None
        if self.law == "hunt-crossley":
            law = HuntCrossley(stiffness, loss)
            return law, NoPull(law) if self.loss else None
        return Hertz(stiffness), None

    def smooth_loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: all forces depend on the mode."""
        return ()

    def loads(self, chain: Chain, q: Pair, u: Pair, t: Scalar = 0.0) -> Loads:
        """Return no load: the force depends on the mode."""
        return ()
