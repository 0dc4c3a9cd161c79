"""Laws of compliant contact: the normal force as a function of depth and depth rate.

A law takes a depth and its square root. The root is a variable of the integration for Hertz's law:
δ^{3/2} has no Taylor series at δ = 0, while (√δ)³ has one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

from twolink.arithmetic import Scalar


class ContactLaw(Protocol):
    """A law of compliant contact; `uses_root` says that the force depends on the root of the depth.

    A surface that is released springs back at once if `relaxation` is None, else exponentially at
    this rate (1/s).
    """

    uses_root: bool

    @property
    def relaxation(self) -> float | None:
        """The rate (1/s) at which a released surface springs back, or None for at once."""

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return the normal force (N) at a depth (m), its root (m^½) and its rate (m/s)."""

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return the recoverable energy (J) at a depth."""


@dataclass(frozen=True)
class KelvinVoigt:
    """A spring beside a damper: k δ + c dδ/dt, with k in N/m and c in N s/m.

    The surface has no mass. Once released it follows k δ + c dδ/dt = 0: it springs back as
    exp(−k t/c), and a point that returns meets it at its current depth.
    """

    stiffness: float
    damping: float = 0.0
    uses_root = False

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
    uses_root = True
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

    For slow impacts e = 1 − 2/3 a v with the speed of approach v (K. H. Hunt and F. R. E. Crossley,
    Journal of Applied Mechanics 42, 1975).
    """

    stiffness: float
    dissipation: float = 0.0
    uses_root = True
    relaxation = None

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return K δ^{3/2} (1 + a dδ/dt) (N)."""
        return self.stiffness * (root * root * root) * (1 + self.dissipation * rate)

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return 2/5 K δ^{5/2} (J)."""
        return 2 * self.stiffness * (root * root * root) * depth / 5


class Phase(Enum):
    """The branch of the force law that a surface is on; the value is its description."""

    WHOLE = "elastic"
    YIELDS = "yields"
    FLOWS = "flows"
    DENTED = "is in its dent"
    SLACK = "does not push"

    @classmethod
    def _missing_(cls, value: object) -> Phase | None:
        """Return the phase that stored motions named by its two directions."""
        return cls.DENTED if value in ("springs back", "is pressed again") else None


@dataclass(frozen=True)
class PlasticState:
    """The history of a surface: its phase and its dent.

    The surface of a dent is `residual` (m) below the undamaged one and follows Hertz's law with
    `stiffness` (N/m^{3/2}) down to `deepest` (m), the largest depth so far.
    """

    phase: Phase
    stiffness: Scalar = 0.0
    residual: Scalar = 0.0
    deepest: Scalar = 0.0

    @property
    def is_kept(self) -> bool:
        """Whether there is a dent."""
        return self.phase is Phase.DENTED

    @property
    def numbers(self) -> tuple[Scalar, ...]:
        """The parameters of the dent; empty if there is none."""
        return (self.stiffness, self.residual, self.deepest) if self.is_kept else ()

    def with_numbers(self, numbers: tuple[Scalar, ...]) -> PlasticState:
        """Return a dent in the same phase with these numbers."""
        return PlasticState(self.phase, *numbers)


@dataclass(frozen=True)
class Branch:
    """A branch of a law, and the conditions that end it.

    The `law` takes the depth below `residual` (m). The branch ends when the root of that depth
    rises to `reach` (m^½), unless that is None, or when the depth rate falls to `rate` (m/s) for
    `turning` = 1, or rises to it for `turning` = −1.
    """

    law: ContactLaw
    residual: Scalar = 0.0
    reach: Scalar | None = None
    turning: int = 0
    rate: float = 0.0


class Hysteresis(Protocol):
    """The history dependence of a law: its branch for a dent, and the dent after each event."""

    def branch(self, dent: PlasticState) -> Branch:
        """Return the branch of the law for a dent."""

    def pressed(self, dent: PlasticState) -> PlasticState:
        """Return the dent after a point touches it."""

    def reached(self, dent: PlasticState) -> PlasticState:
        """Return the dent after its branch has ended at its reach."""

    def jump(self, dent: PlasticState) -> Scalar:
        """Return the depth (m), at the reach of its branch or beyond, at which the force jumps.

        It is infinite if the force is continuous; where the law ends counts as a jump.
        """

    def turned(self, dent: PlasticState, depth: Scalar) -> PlasticState:
        """Return the dent after its branch has ended by the depth rate, at a depth (m)."""


@dataclass(frozen=True)
class NoForce:
    """No force at any depth: the branch of a memoryless law on which it would pull."""

    uses_root = True
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

    def jump(self, dent: PlasticState) -> Scalar:
        """Return infinity: the force is continuous in the depth."""
        return math.inf

    def turned(self, dent: PlasticState, depth: Scalar) -> PlasticState:
        """Return the state on the other branch."""
        return PlasticState(Phase.WHOLE if dent.phase is Phase.SLACK else Phase.SLACK)
