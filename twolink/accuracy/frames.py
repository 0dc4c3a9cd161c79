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

import functools
from dataclasses import dataclass
from typing import Any

# Taylor coefficients of a transition matrix, and the least disc of its norm, in steps.
_TERMS, _DISC = 32, 4

# A larger disc is used while the exponent of its norm is below this, up to a radius.
_LARGE_EXPONENT, _MOST_LOG_OF_DISC = 8, 1000


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

    def bound_along(self, row: list[Any], factor: Any = 0, factors: list[Any] | None = None) -> Any:
        """Return a bound on |row · e + factor · c| for all errors e.

        `factors` are the values of c, linear in e, for the columns of the basis.
        """
        along = [sum(x * y for x, y in zip(row, column, strict=True)) for column in self.columns]
        if factors is not None:
            along = [x + factor * c for x, c in zip(along, factors, strict=True)]
        return sum(abs(x) * radius for x, radius in zip(along, self.radii, strict=True)).upper()

    @property
    def columns(self) -> list[list[Any]]:
        """The columns of the basis."""
        return [list(column) for column in zip(*self.basis.tolist(), strict=True)]

    def moved(self, jump: list[Any]) -> Frame:
        """Return the frame after the addition of anything whose absolute values have bounds."""
        added = _applied(self.inverse, jump)
        radii = [(x + y).upper() for x, y in zip(self.radii, added, strict=True)]
        return Frame(self.basis, self.inverse, tuple(radii))

    def after(
        self,
        flint: Any,
        matrix: Any,
        direction: list[Any] | None = None,
        factors: list[Any] | None = None,
    ) -> Frame:
        """Return the frame of matrix · e, or of matrix · e + direction · c, for all errors e.

        `factors` are the values of c, linear in e, for the columns of the basis. They are kept
        apart since a wide c does not widen the errors across the direction.
        """
        columns = matrix * self.basis
        if direction is None or factors is None:
            basis = _orthogonal(flint, columns, self.radii)
            inverse = basis.inv()
            return Frame(basis, inverse, tuple(_applied(inverse * columns, self.radii)))
        d, c = flint.arb_mat([[x] for x in direction]), flint.arb_mat([factors])
        basis = _orthogonal(flint, columns + d * c, self.radii)
        inverse = basis.inv()
        images = inverse * columns + (inverse * d) * c
        return Frame(basis, inverse, tuple(_applied(images, self.radii)))


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
    disc, exponent = _disc(flint, [norm(part, weights) for part in P])
    rest = exponent.exp() / (disc**_TERMS * (disc - 1))
    balls = [flint.arb(0, (rest * row / column).upper()) for row in weights for column in weights]
    return found + flint.arb_mat(count, count, balls)


def _disc(flint: Any, norms: list[Any]) -> tuple[Any, Any]:
    """Return the radius of a disc, in steps, and the exponent of the bound on Φ there.

    A short step has a large disc, and so a small rest.
    """

    def exponent(disc: Any) -> Any:
        return sum(size * disc ** (i + 1) / (i + 1) for i, size in enumerate(norms))

    disc = flint.arb(_DISC)
    while disc.log() < _MOST_LOG_OF_DISC and exponent(_DISC * disc) < _LARGE_EXPONENT:
        disc *= _DISC
    return disc, exponent(disc)


def _identity(flint: Any, count: int) -> Any:
    return flint.arb_mat(count, count, [int(i == j) for i in range(count) for j in range(count)])


def norm(A: Any, weights: list[Any]) -> Any:
    """Return an upper bound on the largest |A x|_i/w_i of all |x_j| ≤ w_j."""
    return largest([x / w for x, w in zip(_applied(A, weights), weights, strict=True)])


def largest(balls: list[Any]) -> Any:
    """Return an upper bound on all numbers in balls."""
    return functools.reduce(lambda one, other: one.max(other), balls).upper()


def _applied(matrix: Any, radii: Any) -> list[Any]:
    """Return bounds on the entries of matrix · r for all |r_i| ≤ ρ_i."""
    return [
        sum(abs(entry) * radius for entry, radius in zip(row, radii, strict=True)).upper()
        for row in matrix.tolist()
    ]


def _orthogonal(flint: Any, columns: Any, radii: Any) -> Any:
    """Return an almost orthogonal matrix of exact numbers, its first column along the longest edge.

    It has the precision of balls: edges may be so unlike that float64 would mix them.
    """
    vectors = [[entry.mid() for entry in column] for column in zip(*columns.tolist(), strict=True)]
    edges = [
        (_length(vector) * radius).mid() for vector, radius in zip(vectors, radii, strict=True)
    ]
    axes = _identity(flint, len(vectors)).tolist()
    least = flint.arb(2) ** (-flint.ctx.prec // 2)
    found: list[list[Any]] = []
    # The directions of edges that are nearly in the span of longer ones are left to the axes.
    for vector in [*(vectors[k] for k in _descending(edges)), *axes]:
        length = _length(vector)
        if len(found) < len(vectors) and length > 0:
            rest = _without(found, [x / length for x in vector])
            size = _length(rest)
            if size > least:
                found.append([(x / size).mid() for x in rest])
    return flint.arb_mat([list(row) for row in zip(*found, strict=True)])


def _descending(sizes: list[Any]) -> list[int]:
    """Return the order of exact numbers, the largest first."""

    def compare(i: int, j: int) -> int:
        return int(sizes[i] < sizes[j]) - int(sizes[i] > sizes[j])

    return sorted(range(len(sizes)), key=functools.cmp_to_key(compare))


def _without(basis: list[list[Any]], vector: list[Any]) -> list[Any]:
    """Return a vector without its parts along orthogonal unit vectors."""
    # The second pass removes the rounding of the first, relative to the remainder.
    for along in [*basis, *basis]:
        part = sum(x * y for x, y in zip(along, vector, strict=True))
        vector = [(x - part * y).mid() for x, y in zip(vector, along, strict=True)]
    return vector


def _length(vector: list[Any]) -> Any:
    return sum(x * x for x in vector).sqrt()
