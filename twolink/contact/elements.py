"""What makes a motion nonsmooth: dry friction, and obstacles.

An effect that is not smooth hands these over (`nonsmooth(chain)`), and the simulation makes modes
of them, with exact events in between. Nothing here is a steep curve through zero.
"""

from __future__ import annotations

from dataclasses import dataclass

from twolink.arithmetic import Scalar
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.force_laws import ContactLaw, Hysteresis


@dataclass(frozen=True)
class DryFriction:
    """Resistance to motion along a direction: `kinetic` while it moves, at most `static` at rest.

    Both are generalized forces (N m or N). `name` says what moves.
    """

    name: str
    direction: ConstraintCoordinate
    kinetic: Scalar
    static: Scalar


@dataclass(frozen=True)
class RigidContact:
    """A bound that a direction's coordinate (rad or m) may not fall below.

    `name` says what meets what, `restitution` is e of an impact. An obstacle that is rough has a
    `tangent`, the direction of sliding along it, and coefficients μ of friction, `kinetic` and
    `static`; `law` is then the law of restitution.
    """

    name: str
    direction: ConstraintCoordinate
    bound: Scalar
    restitution: Scalar
    tangent: ConstraintCoordinate | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    law: str = "stronge"


@dataclass(frozen=True)
class CompliantContact:
    """A bound beyond which a compliant `law` pushes back; it may be rough as an obstacle is.

    With a `memory`, `law` is that of a surface that is whole, and others take its place.
    """

    name: str
    direction: ConstraintCoordinate
    bound: Scalar
    law: ContactLaw
    tangent: ConstraintCoordinate | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    memory: Hysteresis | None = None


ContactElement = DryFriction | RigidContact | CompliantContact
