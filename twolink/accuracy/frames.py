"""Sets of errors in moving frames: rigorous bounds that grow as errors do.

The possible errors e of a motion are a parallelepiped {Q r : |r_i| ≤ ρ_i}. A step multiplies them
by the transition matrix Φ of the linearized equations, and adds an error. The next frame Q′ is the
orthogonal factor of Φ Q, whose columns are sorted by the length of their edges: long edges stay
edges, and are not wrapped in a box (R. J. Lohner, "Computation of guaranteed enclosures for the
solutions of ordinary initial and boundary value problems", 1992). ρ′ is proven in balls for the Q′
that was chosen; how it was computed does not matter.

Φ is that of e′ = P(t) e with polynomials P = Σ P_i tⁱ. Its Taylor coefficients follow from those of
P: (k + 1) Φ_{k+1} = Σ P_i Φ_{k−i}. On a disc |t| ≤ r its norm is at most
exp(Σ ‖P_i‖ r^{i+1}/(i + 1)), so that Cauchy's estimate bounds the terms left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

# Taylor coefficients of a transition matrix, and the disc of its norm, as a ratio to the step.
_TERMS, _DISC = 32, 4


@dataclass(frozen=True)
class Frame:
    """The errors {Q r : |r_i| ≤ ρ_i}: `basis` is Q, `inverse` contains Q⁻¹, `radii` are ρ."""

    basis: Any
    inverse: Any
    radii: tuple[Any, ...]

    @classmethod
    def around(cls, flint: Any, bounds: list[Any]) -> Frame:
        """Return the box of errors whose absolute values have bounds."""
        one = _identity(flint, len(bounds))
        return cls(one, one, tuple(bounds))

    def bounds(self) -> list[Any]:
        """Return bounds on the absolute values of the entries of all errors."""
        return _applied(self.basis, self.radii)

    def moved(self, jump: list[Any]) -> Frame:
        """Return the frame after the addition of anything whose absolute values have bounds."""
        added = _applied(self.inverse, jump)
        radii = [(x + y).upper() for x, y in zip(self.radii, added, strict=True)]
        return Frame(self.basis, self.inverse, tuple(radii))

    def after(self, flint: Any, transition: Any) -> Frame:
        """Return the frame that contains the products of a matrix of balls and the errors."""
        columns = transition * self.basis
        basis = _orthogonal(flint, columns, self.radii)
        inverse = basis.inv()
        return Frame(basis, inverse, tuple(_applied(inverse * columns, self.radii)))


def transition(flint: Any, coefficients: list[Any], length: Any, weights: list[Any]) -> Any:
    """Return balls with Φ after a time (s), of e′ = P(t) e; `coefficients` are the P_i.

    The terms left out are bounded in the norm with `weights`.
    """
    count = coefficients[0].nrows()
    one = _identity(flint, count)
    # In a time that is 1 at the end.
    P, scale = [], length
    for coefficient in coefficients:
        P.append(coefficient * scale)
        scale *= length
    found, terms = one, [one]
    for k in range(_TERMS):
        following = P[0] * terms[k]
        for i in range(1, min(k + 1, len(P))):
            following += P[i] * terms[k - i]
        terms.append(following * flint.arb(1) / (k + 1))
        found += terms[-1]
    exponent = sum(
        norm(part, weights) * flint.arb(_DISC) ** (i + 1) / (i + 1) for i, part in enumerate(P)
    )
    rest = exponent.exp() / (flint.arb(_DISC) ** _TERMS * (_DISC - 1))
    balls = [flint.arb(0, (rest * row / column).upper()) for row in weights for column in weights]
    return found + flint.arb_mat(count, count, balls)


def _identity(flint: Any, count: int) -> Any:
    return flint.arb_mat(count, count, [int(i == j) for i in range(count) for j in range(count)])


def norm(A: Any, weights: list[Any]) -> Any:
    """Return an upper bound on the largest |A x|_i/w_i of all |x_j| ≤ w_j."""
    totals = [
        (bound / weight).upper()
        for bound, weight in zip(_applied(A, weights), weights, strict=True)
    ]
    largest = totals[0]
    for total in totals[1:]:
        largest = largest.max(total)
    return largest


def _applied(matrix: Any, radii: Any) -> list[Any]:
    """Return bounds on the entries of matrix · r for all |r_i| ≤ ρ_i."""
    return [
        sum(abs(entry) * radius for entry, radius in zip(row, radii, strict=True)).upper()
        for row in matrix.tolist()
    ]


def _orthogonal(flint: Any, columns: Any, radii: Any) -> Any:
    """Return an almost orthogonal matrix of floats whose first column is along the longest edge."""
    middle = np.array([[float(entry.mid()) for entry in row] for row in columns.tolist()])
    lengths = np.hypot.reduce(middle, axis=0)
    # Logarithms: radii may be far below the least float64.
    sizes = [
        float((radius * float(length)).log().mid()) if radius * float(length) > 0 else -np.inf
        for radius, length in zip(radii, lengths, strict=True)
    ]
    order = np.argsort(sizes)[::-1]
    Q = np.linalg.qr(middle[:, order])[0]
    return flint.arb_mat(len(Q), len(Q), [float(x) for x in Q.flat])
