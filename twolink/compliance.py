"""Laws of compliant contact: the normal force of a depth, and of the rate at which it grows.

A depth is handed in with its square root, which is the variable of its own that Hertz's law asks
for: (depth)^{3/2} has no Taylor series where depth begins, root³ has.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from twolink.arithmetic import Scalar


class ContactLaw(Protocol):
    """A law of compliant contact; `rooted` says that it takes the root of the depth."""

    rooted: bool

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return the normal force (N) at a depth (m), its root (m^½) and its rate (m/s)."""

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return the energy (J) that is stored at a depth, and given back."""


@dataclass(frozen=True)
class KelvinVoigt:
    """A spring beside a damper: k δ + c dδ/dt, with k in N/m and c in N s/m."""

    stiffness: float
    damping: float = 0.0
    rooted = False

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

    stiffness: float
    rooted = True

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

    def force(self, depth: Scalar, root: Scalar, rate: Scalar) -> Scalar:
        """Return K δ^{3/2} (1 + a dδ/dt) (N)."""
        return self.stiffness * (root * root * root) * (1 + self.dissipation * rate)

    def stored(self, depth: Scalar, root: Scalar) -> Scalar:
        """Return 2/5 K δ^{5/2} (J)."""
        return 2 * self.stiffness * (root * root * root) * depth / 5
