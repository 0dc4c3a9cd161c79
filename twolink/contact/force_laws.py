"""Laws of compliant contact: the normal force of a depth, and of the rate at which it grows.

A depth is handed in with its square root, which is the variable of its own that Hertz's law asks
for: (depth)^{3/2} has no Taylor series where depth begins, root³ has.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from twolink.arithmetic import Scalar


class ContactLaw(Protocol):
    """A law of compliant contact; `rooted` says that it takes the root of the depth.

    What is no longer pressed springs back at once, or by so much of its depth in a second as
    `relaxation` says (1/s), where that is not None.
    """

    rooted: bool

    @property
    def relaxation(self) -> float | None:
        """How fast (1/s) the surface springs back by itself, or None: at once."""

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return the normal force (N) at a depth (m), its root (m^½) and its rate (m/s)."""

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return the energy (J) that is stored at a depth, and given back."""


@dataclass(frozen=True)
class KelvinVoigt:
    """A spring beside a damper: k δ + c dδ/dt, with k in N/m and c in N s/m.

    The surface has no mass. When nothing presses it any more it follows k δ + c dδ/dt = 0, so it
    springs back as exp(−k t/c), and what comes down again meets it where it then is.
    """

    stiffness: float
    damping: float = 0.0
    rooted = False

    @property
    def relaxation(self) -> float | None:
        """k/c (1/s); None without a damper."""
        return self.stiffness / self.damping if self.damping else None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return k δ + c dδ/dt (N)."""
        return self.stiffness * depth + self.damping * rate

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return k δ²/2 (J)."""
        return self.stiffness * depth * depth / 2


@dataclass(frozen=True)
class Hertz:
    """An elastic ball against a plane: K δ^{3/2}, with K in N/m^{3/2}.

    K = 4/3 E* √R, of the ball's radius R (m) and 1/E* = Σ (1 − ν²)/E of both bodies (Pa⁻¹)
    (K. L. Johnson, Contact Mechanics, 1985, equation 4.22).
    """

    stiffness: Scalar
    rooted = True
    relaxation = None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return K δ^{3/2} (N)."""
        return self.stiffness * (root * root * root)

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return 2/5 K δ^{5/2} (J)."""
        return 2 * self.stiffness * (root * root * root) * depth / 5


@dataclass(frozen=True)
class HuntCrossley:
    """Hertz's law with loss: K δ^{3/2} (1 + a dδ/dt), with a in s/m.

    For slow impacts e = 1 − 2/3 a v, v the speed of approach (K. H. Hunt and F. R. E. Crossley,
    Journal of Applied Mechanics 42, 1975).
    """

    stiffness: float
    dissipation: float = 0.0
    rooted = True
    relaxation = None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return K δ^{3/2} (1 + a dδ/dt) (N)."""
        return self.stiffness * (root * root * root) * (1 + self.dissipation * rate)

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return 2/5 K δ^{5/2} (J)."""
        return 2 * self.stiffness * (root * root * root) * depth / 5


class Phase(Enum):
    """The branch of its law on which a surface is; the value is its behaviour."""

    WHOLE = "elastic"
    YIELDS = "yields"
    FLOWS = "flows"
    SPRINGS_BACK = "springs back"
    SLACK = "does not push"
    PRESSED_AGAIN = "is pressed again"


@dataclass(frozen=True)
class PlasticState:
    """The memory of a surface: its phase, and the dent that it has kept.

    A dent's surface is `residual` (m) below the one that was, and is pressed with the `stiffness`
    (N/m^{3/2}) of Hertz's law until it is `deepest` (m) below it, as deep as it has been.
    """

    phase: Phase
    stiffness: Scalar = 0.0
    residual: Scalar = 0.0
    deepest: Scalar = 0.0

    @property
    def is_kept(self) -> bool:
        """Whether there is a dent, so that its numbers count."""
        return self.phase in (Phase.SPRINGS_BACK, Phase.PRESSED_AGAIN)

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The numbers in which dents differ; none if there is no dent."""
        return (self.stiffness, self.residual, self.deepest) if self.is_kept else ()

    def with_numbers(self, numbers: tuple[Scalar, ...]) -> PlasticState:
        """Return a dent in the same phase with these numbers."""
        return PlasticState(self.phase, *numbers)


@dataclass(frozen=True)
class Branch:
    """The part of a law that holds now: from which depth, up to which, and until what turns.

    The `law` takes the depth below `residual` (m). It holds until the root of that depth rises to
    `reach` (m^½), if to any, or until the rate of the depth falls to `rate` (m/s) where `turning`
    is 1, and rises to it where `turning` is −1: at the rate 0 the point turns.
    """

    law: ContactLaw
    residual: Scalar = 0.0
    reach: Scalar | None = None
    turning: int = 0
    rate: float = 0.0


class Hysteresis(Protocol):
    """How a law depends on what has been: on a dent, which is changed where a branch ends."""

    def branch(self, dent: PlasticState) -> Branch:
        """Return the part of the law that holds for a dent."""

    def pressed(self, dent: PlasticState) -> PlasticState:
        """Return the dent when it is touched."""

    def reached(self, dent: PlasticState) -> PlasticState:
        """Return the dent when its branch has come to its reach."""

    def turned(self, dent: PlasticState, depth: Scalar) -> PlasticState:
        """Return the dent when the point turns at a depth (m) below the whole surface."""


@dataclass(frozen=True)
class NoForce:
    """No force at any depth: the branch of a memoryless law on which it would pull."""

    rooted = True
    relaxation = None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return 0 N."""
        return 0 * root

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return 0 J."""
        return 0 * root


@dataclass(frozen=True)
class NoPull:
    """Hunt and Crossley's law where it pushes, and no force where it would pull.

    It would pull on a point that comes out faster than 1/a, a the dissipation (s/m).
    """

    law: HuntCrossley

    def branch(self, dent: PlasticState) -> Branch:
        """Return the law, or no force, until the rate of the depth passes −1/a."""
        limit = -1 / self.law.dissipation
        if dent.phase is Phase.SLACK:
            return Branch(NoForce(), turning=-1, rate=limit)
        return Branch(self.law, turning=1, rate=limit)

    def pressed(self, dent: PlasticState) -> PlasticState:
        """Return the state of a surface that pushes."""
        return PlasticState(Phase.WHOLE)

    def reached(self, dent: PlasticState) -> PlasticState:
        """Return the same state: no branch ends at a depth."""
        return dent

    def turned(self, dent: PlasticState, depth: Scalar) -> PlasticState:
        """Return the state on the other branch."""
        return PlasticState(Phase.WHOLE if dent.phase is Phase.SLACK else Phase.SLACK)
