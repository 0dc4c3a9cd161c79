"""Rigorous bound on the distance of the exact motion from a polynomial over one step.

The polynomial q̂(t) is arbitrary. By inverse dynamics it is the *exact* motion of the chain under
additional generalized forces D(t) = M q̂″ + C q̂′ − Q, its defect. The formulas of
`twolink.lagrange`, evaluated on `Series`, give D: its first coefficients in balls, and a bound on
all others, so that |D| ≤ `defect` is proven for the whole step.

With x = (q, u) exact, y = (q̂, q̂′) and e = x − y, e′ = A(t) e − (0, M⁻¹ D), where A(t) is a mean of
the Jacobian of the equations of motion over the line from y(t) to x(t) (mean value theorem in
integral form). While no |e_i| exceeds the `tube`, that line lies in a box around the polynomial,
over which the same formulas, with two terms, give balls that contain every entry of the Jacobian.
Hence a_ii ≤ B_ii and |a_ij| ≤ B_ij for a constant matrix B on each piece of the step, and the
solution of v′ = B v + d with v(0) ≥ |e(0)| bounds |e|, entry by entry (the comparison theorem for
quasimonotone systems: B has no negative off-diagonal entry). The bound also proves that |e| stays
in the tube: at the first exit time the bound would still hold and be less than the tube. For the
same reason the exact motion exists during the whole step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from twolink import lagrange
from twolink.accuracy.series import Series
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.errors import SimulationError

# Bits of boxes, bounds and Jacobians, which only need a correct width.
COARSE_BITS = 64

# Ratio of the disc of the norms to the step. By heyoka's choice of steps, successive coefficients
# of the polynomial decrease by e².
DISC = 5

# Number of pieces of a step; more are used if boxes are too wide for a bound.
_PIECES, _MOST_PIECES = 4, 256


@dataclass(frozen=True)
class Step:
    """A polynomial motion over one step: coefficients of q̂1, q̂2 (exact balls), start, length (s).

    `terms` coefficients of the defect are computed with `bits`; the others are bounded.
    """

    flint: Any
    chain: Chain
    effects: tuple[Effect, ...]
    q: Pair
    start: Any
    length: Any
    bits: int
    terms: int

    @property
    def u(self) -> tuple[list[Any], list[Any]]:
        """The coefficients of u = q̂′ (rad/s)."""
        return _derivative(self.q[0]), _derivative(self.q[1])

    def state(self, time: Any) -> list[Any]:
        """Return q1, q2, u1, u2 of the polynomial at a time (s) after the start."""
        return [self.flint.arb_poly(c)(time) for c in (*self.q, *self.u)]

    def after(self, bounds: list[Any], tube: Any) -> list[Any]:
        """Return bounds on |e| at the end (rad, rad/s), given bounds at the start."""
        with self.flint.ctx.workprec(self.bits):
            defect = self._defect()
        with self.flint.ctx.workprec(COARSE_BITS):
            pieces = _PIECES
            while pieces <= _MOST_PIECES:
                grown = self._grown(bounds, defect, tube, pieces)
                if grown is not None:
                    return grown
                pieces *= 2
        raise TubeLeftError("the proven bounds became too wide to continue")

    def _defect(self) -> Pair:
        """Return upper bounds on |D1| and |D2| (N m) over the whole step."""
        radius = DISC * self.length
        q, u = self.q, self.u
        q1, q2, u1, u2, du1, du2 = (
            self._series(c, radius) for c in (*q, *u, _derivative(u[0]), _derivative(u[1]))
        )
        t = self._series([self.start, self.flint.arb(1)], radius)
        loads = smooth_loads(self.effects, self.chain, (q1, q2), (u1, u2), t)
        D1, D2 = lagrange.inverse_dynamics(self.chain, (q1, q2), (u1, u2), (du1, du2), loads)
        return self._largest(D1), self._largest(D2)

    def _series(self, coefficients: list[Any], radius: Any) -> Series:
        norm = self.flint.arb_poly([abs(c) for c in coefficients])(radius)
        return Series(self.flint.arb_series(coefficients, self.terms), norm)

    def _largest(self, D: Series) -> Any:
        """Return an upper bound on a series over the step: Σ |D_i| hⁱ, and the norm's tail."""
        sizes = self.flint.arb_poly([abs(c) for c in D.terms.coeffs()])
        return (sizes(self.length) + D.norm / self.flint.arb(DISC) ** D.terms.prec).upper()

    def _grown(self, bounds: list[Any], defect: Pair, tube: Any, pieces: int) -> list[Any] | None:
        """Return the bounds at the end, or None if boxes are too wide."""
        length = self.length / pieces
        for piece in range(pieces):
            within = (piece * length).union((piece + 1) * length)
            box = [x + self.flint.arb(0, tube) for x in self.state(within)]
            t = self.start + within
            B = comparison(self.flint, self.chain, self.effects, box, t)
            d = accelerations(self.flint, self.chain, box, defect)
            if not all(entry.is_finite() for entry in (*d, *(e for row in B for e in row))):
                return None
            # |e| stays below this during the step, even if B has a negative diagonal.
            steepest = _largest_of([sum(abs(e) for e in row) for row in B])
            highest = (steepest * length).exp() * (_largest_of(bounds) + length * _largest_of(d))
            if not highest < tube:
                return None
            bounds = grown(self.flint, B, d, bounds, length)
        return bounds


class TubeLeftError(SimulationError):
    """A bound exceeds the tube in which it must be proven."""


def comparison(
    flint: Any, chain: Chain, effects: tuple[Effect, ...], box: list[Any], t: Any
) -> list[list[Any]]:
    """Return B: bounds on the Jacobian over a box, of absolute values off the diagonal (1/s, …)."""
    zero, one = flint.arb(0), flint.arb(1)
    rows: list[list[Any]] = [[zero, zero, one, zero], [zero, zero, zero, one], [], []]
    for by in range(4):
        q1, q2, u1, u2 = (
            Series(flint.arb_series([x, int(index == by)], 2), abs(x))
            for index, x in enumerate(box)
        )
        time = Series(flint.arb_series([t], 2), abs(t))
        loads = smooth_loads(effects, chain, (q1, q2), (u1, u2), time)
        for row, du in enumerate(
            lagrange.forward_dynamics(chain, (q1, q2), (u1, u2), loads), start=2
        ):
            slope = du.terms[1]
            rows[row].append(slope.upper() if row == by else slope.abs_upper())
    return rows


def accelerations(flint: Any, chain: Chain, box: list[Any], defect: Pair) -> list[Any]:
    """Return bounds on |M⁻¹ D| over a box (rad/s²) in the last entries; those of angles are 0."""
    q1, q2 = (Series(flint.arb_series([x], 1), abs(x)) for x in box[:2])
    (M11, M12), (_, M22) = lagrange.mass_matrix(chain, (q1, q2))
    det = _ball(lagrange.determinant(chain, (q1, q2)))
    D1, D2 = defect
    M11, M12, M22 = (abs(_ball(M)) for M in (M11, M12, M22))
    zero = flint.arb(0)
    if not det > 0:
        return [zero, zero, *[flint.arb.pos_inf()] * 2]
    return [
        zero,
        zero,
        ((M22 * D1 + M12 * D2) / det).upper(),
        ((M11 * D2 + M12 * D1) / det).upper(),
    ]


def grown(flint: Any, B: list[list[Any]], d: list[Any], bounds: list[Any], length: Any) -> Any:
    """Return the solution of v′ = B v + d after a time (s), as upper bounds."""
    # A single exponential, of [[B, d/s], [0, 0]] applied to (v, s). Its error is absolute, so s is
    # as large as v and d.
    s = _largest_of([*bounds, *d])
    if not s > 0:
        return bounds
    rows = [[entry * length for entry in (*row, x / s)] for row, x in zip(B, d, strict=True)]
    matrix = flint.arb_mat([*rows, [0] * 5]).exp()
    v = flint.arb_mat(5, 1, [*bounds, s])
    return [entry.upper() for entry in (matrix * v).entries()[:4]]


def _derivative(coefficients: list[Any]) -> list[Any]:
    return [power * c for power, c in enumerate(coefficients)][1:]


def _ball(x: Any) -> Any:
    """Return a number's ball: its first term if it is a series."""
    return x.terms[0] if isinstance(x, Series) else x


def _largest_of(balls: list[Any]) -> Any:
    largest = balls[0]
    for ball in balls[1:]:
        largest = largest.max(ball)
    return largest
