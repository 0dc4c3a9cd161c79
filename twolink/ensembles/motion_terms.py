"""The Taylor series of a motion in q and p, by nine products of series where gravity acts.

The speeds are not those of M⁻¹ as a series times p. M(q) u = p is solved for one coefficient of u
after the other, with M as it is at the start of the step: with c, the part of M12 that varies,

    M(q_0) u_k = p_k − Σ_{j=1..k} c_j (u2_{k−j}, u1_{k−j})

The products c u1 and c u2 are also those by which s' = c (u2 − u1), and with s u1 and s u2,
c' = −s (u2 − u1). The fifth is (s u1) u2, which acts on both links; gravity adds two for each link.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.ensembles.comparisons import size
from twolink.ensembles.terms import Series, convolved
from twolink.simulation.smooth.equations import ahead_and_across, gathered_force, mass


class MassMatrix(NamedTuple):
    """M11, M12 and M22 (kg m²) of a pose, and the same entries of the inverse."""

    entries: tuple[Any, Any, Any]
    inverse: tuple[Any, Any, Any]

    @classmethod
    def of(cls, chain: Chain, q: Pair, c_and_s: Pair) -> MassMatrix:
        """Return the mass matrix, with a single division."""
        M11, M12, M22, determinant = mass(chain, q, c_and_s)
        reciprocal = 1.0 / determinant
        return cls((M11, M12, M22), (M22 * reciprocal, -(M12 * reciprocal), M11 * reciprocal))

    def speeds(self, p: Any) -> Pair:
        """Return M⁻¹ p."""
        (first, second), (A11, A12, A22) = p, self.inverse
        return A11 * first + A12 * second, A12 * first + A22 * second

    def sizes_of_momenta(self, u: Any) -> Pair:
        """Return |M| |u|."""
        (first, second), (M11, M12, M22) = map(size, u), self.entries
        return M11 * first + size(M12) * second, size(M12) * first + M22 * second


class MotionTerms(NamedTuple):
    """The series of q (rad), p (kg m²/s), u (rad/s) and dp/dt (N m) from the start of a step.

    `mass` is the mass matrix there, and `across` is s = −∂M12/∂q2.
    """

    q: tuple[Series, Series]
    p: tuple[Series, Series]
    u: tuple[Series, Series]
    forces: tuple[Any, Any]
    mass: MassMatrix
    across: Any


def motion_terms(
    chain: Chain, effects: tuple[Effect, ...], q: Pair, p: Pair, t: Any
) -> MotionTerms:
    """Return the series of a motion from expressions of q, p and the time (s).

    Raises `TypeError` where an effect has functions that `Series` does not have.
    """
    c_and_s = ahead_and_across(chain, q)
    matrix = MassMatrix.of(chain, q, c_and_s)
    found: list[Pair] = []
    c_u: tuple[Series, Series]
    s_u: tuple[Series, Series]

    def speeds(k: int) -> Pair:
        while len(found) <= k:
            found.append(_speeds(matrix, momenta, c, u, len(found)))
        return found[k]

    u = Series(lambda k: speeds(k)[0]), Series(lambda k: speeds(k)[1])
    c: Series = _integral(c_and_s[0], lambda k: s_u[0].term(k) - s_u[1].term(k))
    s: Series = _integral(c_and_s[1], lambda k: c_u[1].term(k) - c_u[0].term(k))
    c_u = _product(c, u[0]), _product(c, u[1])
    s_u = s * u[0], s * u[1]
    angles = _integral(q[0], u[0].term), _integral(q[1], u[1].term)
    time = Series(lambda k: t if k == 0 else float(k == 1))
    Q1, Q2 = gathered_force(chain, angles, smooth_loads(effects, chain, angles, u, time))
    turning = s_u[0] * u[1]
    forces = turning + Q1, Q2 - turning
    momenta = _integral(p[0], forces[0].term), _integral(p[1], forces[1].term)
    return MotionTerms(angles, momenta, u, forces, matrix, c_and_s[1])


def _integral(start: Any, slope: Any) -> Series:
    """Return the series of a value at the start and of a derivative."""
    return Series(lambda k: slope(k - 1) / k if k else start, slope)


def _product(c: Series, u: Series) -> Series:
    """Return c u, of which the terms after the first are a sum that u depends on."""

    def term(k: int) -> Any:
        first = c.term(0) * u.term(k)
        return first + convolved(c.term, u.term, k, least=1) if k else first

    return Series(term)


def _speeds(matrix: MassMatrix, p: Any, c: Series, u: Any, k: int) -> Pair:
    """Return the k-th coefficients of both speeds from lower ones."""
    first, second = p[0].term(k), p[1].term(k)
    if k:
        first = first - convolved(c.term, u[1].term, k, least=1)
        second = second - convolved(c.term, u[0].term, k, least=1)
    return matrix.speeds((first, second))
