"""What makes a motion nonsmooth: dry friction, and obstacles.

An effect that is not smooth hands these over (`nonsmooth(chain)`), and the simulation makes modes
of them, with exact events in between. Nothing here is a steep curve through zero.
"""

from __future__ import annotations

from dataclasses import dataclass

from twolink.arithmetic import Scalar
from twolink.compliance import ContactLaw, Memory
from twolink.directions import Direction


@dataclass(frozen=True)
class DryFriction:
    """Resistance to motion along a direction: `kinetic` while it moves, at most `static` at rest.

    Both are generalized forces (N m or N). `name` says what moves.
    """

    name: str
    direction: Direction
    kinetic: Scalar
    static: Scalar


@dataclass(frozen=True)
class Obstacle:
    """A bound that a direction's coordinate (rad or m) may not fall below.

    `name` says what meets what, `restitution` is e of an impact. An obstacle that is rough has a
    `tangent`, the direction of sliding along it, and coefficients μ of friction, `kinetic` and
    `static`; `law` is then the law of restitution.
    """

    name: str
    direction: Direction
    bound: Scalar
    restitution: Scalar
    tangent: Direction | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    law: str = "stronge"


@dataclass(frozen=True)
class Cushion:
    """A bound beyond which a compliant `law` pushes back; it may be rough as an obstacle is.

    With a `memory`, `law` is that of a surface that is whole, and others take its place.
    """

    name: str
    direction: Direction
    bound: Scalar
    law: ContactLaw
    tangent: Direction | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    memory: Memory | None = None


Element = DryFriction | Obstacle | Cushion
