"""Rigorous bound on the distance of the exact motion from a polynomial over one step.

The polynomial q̂(t) is arbitrary. By inverse dynamics it is the *exact* motion of the chain under
additional generalized forces D(t) = M q̂″ + C q̂′ − Q, its defect. The formulas of
`twolink.lagrange`, evaluated on `Series`, give D: its first coefficients in balls, and a bound on
all others, so that |D| ≤ `defect` is proven for the whole step.

With x = (q, u) exact, y = (q̂, q̂′) and e = x − y, e′ = A(t) e − (0, M⁻¹ D), where A(t) is a mean of
the Jacobian of the equations of motion over the line from y(t) to x(t) (mean value theorem in
integral form). While no |e_i| exceeds the `tube`, that line lies within the tube of y(t). The same
formulas, on dual numbers of series whose first coefficients are balls of the tube's width, give a
polynomial P(t) and a bound E on |A(t) − P(t)| during the step. With the transition matrix Φ of
e′ = P(t) e, e(h) = Φ e(0) + ∫ Φ(h, s) ((A − P) e − (0, M⁻¹ D)) ds: the first part moves a frame
(`twolink.accuracy.frames`), and the second is bounded by norms. A bound on |e| during the step, by
Gronwall's inequality, also proves that it stays in the tube: at the first exit time the bound would
still hold and be less than the tube. For the same reason the exact motion exists during the whole
step.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

from twolink import lagrange
from twolink.accuracy.dual import Dual, Slopes, slopes, variables
from twolink.accuracy.frames import Frame, largest, norm, transition
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

# Terms of the Jacobian along the motion, and number of parts of a piece on which M⁻¹ is bounded.
_TERMS, _PARTS = 18, 8

# A step is halved so often at most, where its boxes are too wide for a bound.
_MOST_HALVINGS = 8


class Passage(NamedTuple):
    """The frame of errors at the end of a time, and bounds on |e| during it."""

    frame: Frame
    errors: list[Any]


@dataclass(frozen=True)
class Step:
    """A polynomial motion over one step: coefficients of q̂1, q̂2 (exact balls), start, length (s).

    `terms` coefficients of the defect are computed with `bits`; the others are bounded. Errors are
    bounded with `coarse_bits`.
    """

    flint: Any
    chain: Chain
    effects: tuple[Effect, ...]
    q: Pair
    start: Any
    length: Any
    bits: int
    terms: int
    coarse_bits: int = COARSE_BITS

    @property
    def u(self) -> tuple[list[Any], list[Any]]:
        """The coefficients of u = q̂′ (rad/s)."""
        return _derivative(self.q[0]), _derivative(self.q[1])

    def state(self, time: Any) -> list[Any]:
        """Return q1, q2, u1, u2 of the polynomial at a time (s) after the start."""
        return [self.flint.arb_poly(c)(time) for c in (*self.q, *self.u)]

    def series(self) -> tuple[Pair, Pair]:
        """Return q̂ and û as series whose norms hold on a disc of `DISC` times the step."""
        (q1, q2), (u1, u2) = self.q, self.u
        radius = DISC * self.length
        q = self._series(q1, radius, self.terms), self._series(q2, radius, self.terms)
        return q, (self._series(u1, radius, self.terms), self._series(u2, radius, self.terms))

    def box(self, start: Any, end: Any, errors: list[Any]) -> list[Any]:
        """Return balls with q1, q2, u1, u2 between two times (s), with errors up to a bound."""
        centre = self.state(start.union(end))
        return [x + self.flint.arb(0, error) for x, error in zip(centre, errors, strict=True)]

    def after(self, frame: Frame, tube: Any, until: Any = None) -> Passage:
        """Return the frame of errors at a time (s) after the start, by default the end.

        `frame` is that at the start. Raises `TubeLeftError` if the errors cannot be proven to stay
        in the tube.
        """
        with self.flint.ctx.workprec(self.bits):
            defect = self._defect()
        with self.flint.ctx.workprec(self.coarse_bits):
            for pieces in (1 << k for k in range(_MOST_HALVINGS + 1)):
                length = (self.length if until is None else until) / pieces
                found = self._over(pieces, length, frame, defect, tube)
                if found is not None:
                    return found
        raise TubeLeftError("the proven bounds became too wide to continue")

    def _over(
        self, pieces: int, length: Any, frame: Frame, defect: Pair, tube: Any
    ) -> Passage | None:
        """Return the errors after pieces of a length (s); None if they are too long for a bound."""
        errors = frame.bounds()
        for piece in range(pieces):
            found = self._piece(frame, defect, tube, piece * length, length)
            if found is None:
                return None
            frame = found.frame
            errors = [x.max(y).upper() for x, y in zip(errors, found.errors, strict=True)]
        return Passage(frame, errors)

    def _piece(
        self, frame: Frame, defect: Pair, tube: Any, start: Any, length: Any
    ) -> Passage | None:
        """Return the errors a time (s) after a frame in the step, or None without a bound."""
        d = self._accelerations(defect, tube, start, length)
        P, spread = self._jacobian(tube, start, length)
        if not all(x.is_finite() for part in (*P, spread) for x in part.entries()):
            return None
        # Norms of (e_q, e_u/ω), in which angles and speeds weigh alike.
        weights = _weights(self.flint, P[0])
        size = sum(norm(part, weights) * length**i for i, part in enumerate(P))
        apart = norm(spread, weights)
        growth = ((size + apart) * length).exp()
        before = largest([x / w for x, w in zip(frame.bounds(), weights, strict=True)])
        highest = growth * (before + length * d / weights[-1])
        if not highest * largest(weights) < tube:
            return None
        added = growth * length * (apart * highest + d / weights[-1])
        flow = transition(self.flint, P, length, weights)
        end = frame.after(self.flint, flow).moved([(added * w).upper() for w in weights])
        return Passage(end, [(highest * w).upper() for w in weights])

    def _accelerations(self, defect: Pair, tube: Any, start: Any, length: Any) -> Any:
        """Return a bound on the entries of |M⁻¹ D| during a piece (rad/s²)."""
        found = []
        for part in range(_PARTS):
            within = (start + length * part / _PARTS).union(start + length * (part + 1) / _PARTS)
            q = [x + self.flint.arb(0, tube) for x in self.state(within)[:2]]
            found += accelerations(self.flint, self.chain, q, defect)
        return largest(found)

    def _jacobian(self, tube: Any, start: Any, length: Any) -> tuple[list[Any], Any]:
        """Return P, in the time since the start of a piece, and bounds on |A(t) − P(t)|.

        P is of matrices of exact numbers, and the bounds are a matrix.
        """
        P, spread = [self.flint.arb_mat(4, 4) for _ in range(_TERMS)], self.flint.arb_mat(4, 4)
        P[0][0, 2] = P[0][1, 3] = 1
        first = self._columns(start, tube, _TERMS)
        # The next coefficient at any time of the piece gives the remainder (Taylor's theorem).
        ever = self._columns(start.union(start + length), tube, _TERMS + 1)
        for by, row in product(range(4), (0, 1)):
            terms = [first[by][row].terms[i] for i in range(_TERMS)]
            for i, term in enumerate(terms):
                P[i][row + 2, by] = term.mid()
            remainder = abs(ever[by][row].terms[_TERMS]) * length**_TERMS
            widths = sum(term.rad() * length**i for i, term in enumerate(terms))
            spread[row + 2, by] = remainder + widths
        return P, spread

    def _columns(self, time: Any, tube: Any, terms: int) -> list[Pair]:
        """Return the Jacobian in the tube as series about a time (s), of balls if that is one."""
        wide = self.flint.arb(0, tube)
        x = []
        for coefficients in (*self.q, *self.u):
            value, *slopes = _shifted(self.flint, coefficients, time, terms)
            x.append(self._series([value + wide, *slopes], self.length, terms))
        t = self._series([self.start + time, self.flint.arb(1)], self.length, terms)
        return jacobian(self.chain, self.effects, x, t)

    def _defect(self) -> Pair:
        """Return upper bounds on |D1| and |D2| (N m) over the whole step."""
        radius = DISC * self.length
        q, u = self.series()
        du1, du2 = (self._series(_derivative(c), radius, self.terms) for c in self.u)
        t = self._series([self.start, self.flint.arb(1)], radius, self.terms)
        loads = smooth_loads(self.effects, self.chain, q, u, t)
        D1, D2 = lagrange.inverse_dynamics(self.chain, q, u, (du1, du2), loads)
        return self._largest(D1), self._largest(D2)

    def _series(self, coefficients: list[Any], radius: Any, terms: int) -> Series:
        size = self.flint.arb_poly([abs(c) for c in coefficients])(radius)
        return Series(self.flint.arb_series(coefficients, terms), size)

    def _largest(self, D: Series) -> Any:
        """Return an upper bound on a series over the step: Σ |D_i| hⁱ, and the norm's tail."""
        sizes = self.flint.arb_poly([abs(c) for c in D.terms.coeffs()])
        return (sizes(self.length) + D.norm / self.flint.arb(DISC) ** D.terms.prec).upper()


class TubeLeftError(SimulationError):
    """A bound exceeds the tube in which it must be proven."""


def jacobian(chain: Chain, effects: tuple[Effect, ...], state: list[Any], t: Any) -> list[Pair]:
    """Return the derivatives of u1′ and u2′ by q1, q2, u1 and u2, as scalars like those of x."""
    q1, q2, u1, u2 = variables(state)
    loads = smooth_loads(effects, chain, (q1, q2), (u1, u2), Dual(t, Slopes({})))
    du1, du2 = lagrange.forward_dynamics(chain, (q1, q2), (u1, u2), loads)
    return list(zip(slopes(du1, state), slopes(du2, state), strict=True))


def accelerations(flint: Any, chain: Chain, q: list[Any], defect: Pair) -> list[Any]:
    """Return bounds on |M⁻¹ D| over a box of angles (rad/s²)."""
    q1, q2 = (Series(flint.arb_series([x], 1), abs(x)) for x in q)
    (M11, M12), (_, M22) = lagrange.mass_matrix(chain, (q1, q2))
    det = _ball(lagrange.determinant(chain, (q1, q2)))
    D1, D2 = defect
    M11, M12, M22 = (abs(_ball(M)) for M in (M11, M12, M22))
    if not det > 0:
        return [flint.arb.pos_inf()] * 2
    return [((M22 * D1 + M12 * D2) / det).upper(), ((M11 * D2 + M12 * D1) / det).upper()]


def _weights(flint: Any, A: Any) -> list[Any]:
    """Return the sizes of q and u (1, 1, ω, ω) at which a Jacobian's norm is least, about."""
    stiffness = max(float(abs(A[row, by]).upper()) for row in (2, 3) for by in (0, 1))
    one, omega = flint.arb(1), flint.arb(max(1.0, stiffness**0.5))
    return [one, one, omega, omega]


def _shifted(flint: Any, coefficients: list[Any], time: Any, terms: int) -> list[Any]:
    """Return the first Taylor coefficients of a polynomial about a time."""
    polynomial, found = flint.arb_poly(coefficients), []
    for k in range(terms):
        found.append(polynomial(time))
        polynomial = polynomial.derivative() * (flint.arb(1) / (k + 1))
    return found


def _derivative(coefficients: list[Any]) -> list[Any]:
    return [power * c for power, c in enumerate(coefficients)][1:]


def _ball(x: Any) -> Any:
    """Return a number's ball: its first term if it is a series."""
    return x.terms[0] if isinstance(x, Series) else x
