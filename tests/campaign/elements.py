"""Frictions, obstacles and cushions of a scene, rebuilt from the parameters of its effects.

Nothing here is taken from the simulator: a fault in its geometry cannot hide behind itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink import Chain, Scene, kinematics, lagrange

FRICTION, OBSTACLE, CUSHION = "friction", "obstacle", "cushion"

Law = Callable[[Any, Any], Any]
"""Normal force (N) of a depth (m) and of the rate (m/s) at which it grows."""


@dataclass(frozen=True)
class Way:
    """A way to move: of the joint A or B (with a sense), or of a point along a unit vector."""

    of: str
    vector: tuple[float, float] = (0.0, 0.0)
    sense: int = 0

    def coordinate(self, chain: Chain, q: Any) -> Any:
        """Return the joint's angle times its sense (rad), or the point's place (m)."""
        if self.sense:
            return self.sense * (q[0] if self.of == "A" else q[1] - q[0])
        x, y = kinematics.position(chain, (q[0], q[1]), getattr(chain, self.of))
        return self.vector[0] * x + self.vector[1] * y

    def row(self, chain: Chain, q: Any) -> Any:
        """Return the derivatives of the coordinate by q1 and q2, shape (2, n)."""
        if self.sense:
            one = np.ones_like(q[0])
            return self.sense * np.array([one, 0 * one] if self.of == "A" else [-one, one])
        first, second = lagrange.position_gradients(chain, (q[0], q[1]), getattr(chain, self.of))
        x, y = self.vector
        zero = np.zeros_like(q[0])
        return np.array([x * first[0] + y * first[1] + zero, x * second[0] + y * second[1] + zero])

    def speed(self, chain: Chain, q: Any, u: Any) -> Any:
        """Return the coordinate's rate (rad/s or m/s)."""
        row = self.row(chain, q)
        return row[0] * u[0] + row[1] * u[1]

    def reach(self, chain: Chain) -> float:
        """Return the largest change of the coordinate per change of any angle (m/rad or 1)."""
        if self.sense:
            return 1.0 if self.of == "A" else 2.0
        point = getattr(chain, self.of)
        along = math.hypot(point.along, point.across)
        return along if point.link == 1 else chain.L1 + along


@dataclass(frozen=True)
class Element:
    """A dry friction, a rigid obstacle or a cushion, as the documentation of effects has it.

    `kinetic` and `static` are forces or torques (N, N m) of a friction, and coefficients of the
    others. `law` is that of a cushion, while nothing yields; `relaxation` (1/s) is how fast one
    springs back, None: at once. `gains` says that the law of restitution may create energy.
    """

    name: str
    kind: str
    way: Way
    bound: float = 0.0
    tangent: Way | None = None
    kinetic: float = 0.0
    static: float = 0.0
    restitution: float = 0.0
    law: Law | None = None
    stored: Law | None = None
    relaxation: float | None = None
    yields: bool = False
    gains: bool = False

    @property
    def slides(self) -> Way | None:
        """The way along which friction acts, None where there is none."""
        return self.way if self.kind == FRICTION else self.tangent


def elements(scene: Scene) -> list[Element]:
    """Return the frictions, obstacles and cushions of a scene, in the order of its effects."""
    found: list[Element] = []
    for effect in scene.effects:
        maker = _MAKERS.get(type(effect).__name__)
        found += maker(effect) if maker else []
    return found


def _of_joint_friction(effect: Any) -> list[Element]:
    static = effect.kinetic if effect.static is None else effect.static
    return [
        Element(joint, FRICTION, Way(joint, sense=1), kinetic=kinetic, static=most)
        for joint, kinetic, most in zip("AB", effect.kinetic, static, strict=True)
        if most != 0
    ]


def _of_end_force(effect: Any) -> list[Element]:
    static = effect.friction if effect.static is None else effect.static
    size = abs(effect.normal)
    if static == 0 or effect.sliding is not None:
        return []
    way = Way("D", (1.0, 0.0))
    return [Element("D", FRICTION, way, kinetic=effect.friction * size, static=static * size)]


def _of_joint_stop(effect: Any) -> list[Element]:
    ends = (("lower", effect.lower, 1), ("upper", effect.upper, -1))
    return [
        Element(
            f"{effect.joint} on its {name} stop",
            OBSTACLE,
            Way(effect.joint, sense=sense),
            bound=sense * angle,
            restitution=effect.restitution,
        )
        for name, angle, sense in ends
        if angle is not None
    ]


def _of_half_plane(effect: Any, kind: str, **more: Any) -> list[Element]:
    size = math.hypot(*effect.normal)
    x, y = effect.normal[0] / size, effect.normal[1] / size
    static = effect.friction if effect.static is None else effect.static
    return [
        Element(
            f"{point} on {effect.name}",
            kind,
            Way(point, (x, y)),
            bound=x * effect.point[0] + y * effect.point[1],
            tangent=Way(point, (-y, x)) if static else None,
            kinetic=effect.friction,
            static=static,
            **more,
        )
        for point in effect.on
    ]


def _of_surface(effect: Any) -> list[Element]:
    gains = effect.law in ("newton", "newton-routh") and effect.friction > 0
    return _of_half_plane(effect, OBSTACLE, restitution=effect.restitution, gains=gains)


def _of_compliant_surface(effect: Any) -> list[Element]:
    k, loss = _stiffness(effect), effect.loss
    if effect.law == "elasto-plastic":
        elastic = _hertz_like(k, 0.0)
        return _of_half_plane(effect, CUSHION, law=elastic, yields=True)
    if effect.law == "kelvin-voigt":
        return _of_half_plane(
            effect,
            CUSHION,
            law=lambda d, rate: k * d + loss * rate,
            stored=lambda d, rate: k * d * d / 2,
            relaxation=k / loss if loss else None,
        )
    return _of_half_plane(
        effect,
        CUSHION,
        law=_hertz_like(k, loss),
        stored=lambda d, rate: 0.4 * k * np.maximum(d, 0) ** 2.5,
    )


def _hertz_like(k: float, loss: float) -> Law:
    """Return Hertz's law, or Hunt and Crossley's."""
    return lambda d, rate: k * np.maximum(d, 0) ** 1.5 * (1 + loss * rate)


def _stiffness(effect: Any) -> float:
    """Return the stiffness that is given, or Hertz's 4/3 E* √R of the ball (N/m^{3/2})."""
    if effect.stiffness is not None:
        return float(effect.stiffness)
    bodies = zip(effect.modulus, effect.poisson, strict=True)
    modulus = 1 / sum((1 - nu * nu) / E for E, nu in bodies)
    return float(4 / 3 * modulus * math.sqrt(effect.radius))


_MAKERS: dict[str, Callable[[Any], list[Element]]] = {
    "JointFriction": _of_joint_friction,
    "EndForce": _of_end_force,
    "JointStop": _of_joint_stop,
    "Surface": _of_surface,
    "CompliantSurface": _of_compliant_surface,
}
