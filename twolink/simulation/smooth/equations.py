"""The equations of motion as first-order systems, in three choices of variables.

Three sets of variables describe the same motion: (q, u) with Kane's equations, (q, u) with
Lagrange's, and (q, p) with the momenta p = M u, in which the equations are shortest. The
formulas are those of `twolink.kane` and `twolink.lagrange`, for numbers of any type: heyoka's
expressions give compiled code, floats or arrays give values.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.arithmetic import Pair, Scalar, cos, sin
from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.errors import SimulationError
from twolink.formulations import FORMULATIONS
from twolink.integration.expressions import plain, precise
from twolink.loads import Loads, Torque
from twolink.names import EQUATIONS_NAMES, EquationsName, FormulationName
from twolink.optional import heyoka
from twolink.text import choice
from twolink.values import Content


@dataclass(frozen=True)
class SpeedEquations:
    """q and u as variables: dq/dt = u, and du/dt by one formulation's forward dynamics.

    `in_speeds` is the name of that formulation.
    """

    in_speeds: FormulationName

    def rates(
        self, chain: Chain, effects: tuple[Effect, ...], q: Pair, u: Pair, t: Scalar
    ) -> tuple[Pair, Pair]:
        """Return dq/dt (rad/s) and du/dt (rad/s²)."""
        loads = smooth_loads(effects, chain, q, u, t)
        return u, FORMULATIONS[self.in_speeds].equations.forward_dynamics(chain, q, u, loads)

    def from_speeds(self, chain: Chain, q: Pair, u: Pair) -> Pair:
        """Return the second pair of variables of a state: u itself."""
        return u

    def to_speeds(self, chain: Chain, q: Any, second: Any) -> Any:
        """Return u (rad/s) of the second pair of variables: u itself."""
        return second

    def rounded_speeds(self, chain: Chain, q: Any, u: Any) -> Any:
        """Return the sizes (rad/s) whose relative rounding is that of a speed: u's own."""
        return np.abs(u)

    def largest_rounded_speed(self, chain: Chain, angle: float, speed: float) -> float:
        """Return the largest of `rounded_speeds` up to an angle (rad) and a speed (rad/s): this."""
        return speed

    def rounded_starts(self, chain: Chain, q: Any, u: Any) -> Any:
        """Return the sizes whose relative rounding is that of `from_speeds`, which is exact."""
        return np.zeros_like(u)

    def sizes_of_speeds(self, chain: Chain, q: Any, sizes: Any) -> Any:
        """Return sizes (rad/s) of u from those of the variables: the same."""
        return sizes

    def largest_speed(self, chain: Chain) -> float:
        """Return the largest speed (rad/s) of variables of size 1: 1."""
        return 1.0

    def solved(self, chain: Chain, q: Any, u: Any, forces: Any) -> Any:
        """Return the sizes (rad/s²) whose relative rounding is that of du/dt.

        They are |M⁻¹| (|Q| + |C u| + |M| |du/dt|): all terms are rounded, those of M as well, and
        cancel where M is ill-conditioned. `forces` are Q (N m). Kane's formulas have four products
        of sines and cosines of both angles, and the others those of the angle between the links.
        """
        (Q1, Q2), (u1, u2), both = forces, u, ahead_and_across(chain, q)
        entries, across = mass(chain, q, both), both[1]
        du = _speeds(entries, (Q1 + across * u2 * u2, Q2 - across * u1 * u1))
        M11, M12, M22, det = sizes = tuple(map(np.abs, entries))
        angle = 4.0 if self.in_speeds == "kane" else np.abs(q[1] - q[0])
        rounded = _by_elbow(chain) * angle
        of_M = _sizes_of_momenta((M11, M12 + rounded, M22, det), du)
        across = np.abs(across) + rounded
        terms = np.abs(Q1) + across * u2 * u2, np.abs(Q2) + across * u1 * u1
        return _sizes_of_speeds(sizes, of_M + np.array(terms))

    def by_forces(self, chain: Chain, q: Any, forces: Any) -> Any:
        """Return the part of du/dt (rad/s²) by generalized forces (N m)."""
        return _speeds(mass(chain, q, ahead_and_across(chain, q)), forces)


@dataclass(frozen=True)
class MomentumEquations:
    """q and p as variables: dq/dt = M⁻¹ p, and dp/dt = ∂T/∂q + Q, by (6.9).

    These are Lagrange's equations with combined constants, so that an integrator has as few
    operations as equations of this chain written by hand. `in_speeds` is the formulation that
    replaces them where speeds must be variables, as in the modes of contact and friction.
    """

    in_speeds: FormulationName = "lagrange"

    def rates(
        self, chain: Chain, effects: tuple[Effect, ...], q: Pair, p: Pair, t: Scalar
    ) -> tuple[Pair, Pair]:
        """Return dq/dt (rad/s) and dp/dt (N m)."""
        both = ahead_and_across(chain, q)
        u1, u2 = _speeds(mass(chain, q, both), p)
        slope = both[1] * (u1 * u2)
        Q1, Q2 = gathered_force(chain, q, smooth_loads(effects, chain, q, (u1, u2), t))
        return (u1, u2), (Q1 + slope, Q2 - slope)

    def from_speeds(self, chain: Chain, q: Pair, u: Pair) -> Pair:
        """Return p = ∂T/∂u (kg m²/s)."""
        return lagrange.momenta(chain, q, u)

    def to_speeds(self, chain: Chain, q: Any, p: Any) -> Pair:
        """Return u = M⁻¹ p (rad/s), by Cramer's rule."""
        return _speeds(mass(chain, q, ahead_and_across(chain, q)), p)

    def rounded_speeds(self, chain: Chain, q: Any, u: Any) -> Any:
        """Return the sizes (rad/s) whose relative rounding is that of a speed: |M⁻¹| |M| |u|.

        Each term of p = M u is rounded, and M⁻¹ enlarges that where M is ill-conditioned.
        """
        entries = _sizes_of_mass(chain, q)
        rounded = _rounded_mass(chain, q, entries)
        return _sizes_of_speeds(entries, _sizes_of_momenta(rounded, u))

    def sizes_of_speeds(self, chain: Chain, q: Any, sizes: Any) -> Any:
        """Return sizes (rad/s) of u from those of p (kg m²/s): |M⁻¹| |p|."""
        return _sizes_of_speeds(_sizes_of_mass(chain, q), sizes)

    def largest_speed(self, chain: Chain) -> float:
        """Return the largest speed (rad/s) of variables of size 1, in any pose."""
        return largest_inverse(Content((chain,)))

    def largest_rounded_speed(self, chain: Chain, angle: float, speed: float) -> float:
        """Return a bound on `rounded_speeds` (rad/s) up to a size of angles (rad) and of speeds."""
        bound, by_angle = largest_mass(Content((chain,)))
        return self.largest_speed(chain) * (bound + 2 * by_angle * angle) * speed

    def rounded_starts(self, chain: Chain, q: Any, u: Any) -> Any:
        """Return the sizes (kg m²/s) whose relative rounding is that of `from_speeds`: |M| |u|."""
        return _sizes_of_momenta(_rounded_mass(chain, q, _sizes_of_mass(chain, q)), u)

    def solved(self, chain: Chain, q: Any, u: Any, forces: Any) -> Any:
        """Return the sizes whose relative rounding is that of dp/dt, without M⁻¹: |Q| (N m)."""
        return np.abs(forces)

    def by_forces(self, chain: Chain, q: Any, forces: Any) -> Any:
        """Return the part of dp/dt (N m) by generalized forces: themselves."""
        return forces


# Poses in which the mass matrix is looked at, and a factor for those between.
_POSES, _BETWEEN_POSES = 65, 1.1

_Mass = tuple[Scalar, Scalar, Scalar, Scalar]


def _speeds(entries: _Mass, p: Any) -> Pair:
    """Return M⁻¹ p (rad/s) by Cramer's rule."""
    p1, p2 = p
    M11, M12, M22, det = entries
    return (M22 * p1 - M12 * p2) / det, (M11 * p2 - M12 * p1) / det


def _sizes_of_mass(chain: Chain, q: Any) -> _Mass:
    """Return |M11|, |M12|, |M22| and det M."""
    M11, M12, M22, det = (np.abs(x) for x in mass(chain, q, ahead_and_across(chain, q)))
    return M11, M12, M22, det


def _rounded_mass(chain: Chain, q: Any, sizes: _Mass) -> _Mass:
    """Return the sizes whose relative rounding is that of M, from its own `sizes`.

    M12 depends on a difference of angles, whose rounding counts also where M12 is small.
    """
    M11, M12, M22, det = sizes
    return M11, M12 + _by_elbow(chain) * np.abs(q[1] - q[0]), M22, det


def _by_elbow(chain: Chain) -> Any:
    """Return the size (kg m²) of the part of M12 that depends on the pose."""
    _, a, b = chain.C2
    return np.abs(chain.m2 * chain.L1) * np.hypot(a, b)


def _sizes_of_momenta(sizes: _Mass, u: Any) -> Any:
    """Return |M| |u| (kg m²/s)."""
    M11, M12, M22, _ = sizes
    u1, u2 = np.abs(u)
    return np.array([M11 * u1 + M12 * u2, M12 * u1 + M22 * u2])


def _sizes_of_speeds(sizes: _Mass, p: Any) -> Any:
    """Return |M⁻¹| p (rad/s) of sizes p."""
    M11, M12, M22, det = sizes
    p1, p2 = p
    return np.array([M22 * p1 + M12 * p2, M11 * p2 + M12 * p1]) / det


def mass(chain: Chain, q: Pair, both: Pair) -> _Mass:
    """Return M11, M12, M22 (kg m²) and det M (kg² m⁴), a constant and the square of m2 L1 h.

    `both` are those of `ahead_and_across`.
    """
    if chain.rotors:
        (M11, M12), (_, M22) = lagrange.mass_matrix(chain, q)
        return M11, M12, M22, lagrange.determinant(chain, q)
    ahead, across = both
    link1, M22 = lagrange.pivot_inertia(chain), lagrange.elbow_inertia(chain)
    carried = chain.m2 * chain.L1 * chain.L1
    return link1 + carried, ahead, M22, link1 * M22 + carried * chain.I_C2 + across * across


@functools.lru_cache(maxsize=64)
def largest_inverse(chain: Content) -> float:
    """Return a bound on the row sums of |M⁻¹| (1/(kg m²)) in all poses of a chain."""
    M11, M12, M22, det = _in_all_poses(chain)
    return float(_BETWEEN_POSES * ((np.maximum(M11, M22) + M12) / np.abs(det)).max())


@functools.lru_cache(maxsize=64)
def largest_mass(chain: Content) -> tuple[float, float]:
    """Return a bound on the row sums of M (kg m²) in all poses, and by what it grows by an angle.

    The second is for the sizes whose relative rounding is that of M, by the angle (rad) between the
    links.
    """
    (given,) = chain.objects
    M11, M12, M22, _ = _in_all_poses(chain)
    bound = _BETWEEN_POSES * (np.maximum(M11, M22) + M12).max()
    return float(bound), float(_by_elbow(given.convert(float)))


def _in_all_poses(chain: Content) -> _Mass:
    """Return `_sizes_of_mass` in poses from each of which M changes little to the next.

    M depends on the angle between the links. Its determinant may be least in a narrow range, where
    the centre of link 2 is in line with link 1.
    """
    (given,) = chain.objects
    own = given.convert(float)
    _, a, b = own.C2
    in_line = -math.atan2(b, a) + math.pi * np.arange(2)
    elbow = np.concatenate([np.linspace(0.0, 2 * math.pi, _POSES), in_line])
    return _sizes_of_mass(own, (np.zeros_like(elbow), elbow))


def sizes_of_momentum_rates(chain: Chain, q: Any, p: Any) -> Any:
    """Return the sizes of all terms of dq/dt and dp/dt but those of loads, shape (4, n)."""
    s1, s2 = _sizes_of_speeds(_sizes_of_mass(chain, q), np.abs(p))
    slope = _by_elbow(chain) * s1 * s2
    return np.array([s1, s2, slope, slope])


def ahead_and_across(chain: Chain, q: Pair) -> Pair:
    """Return m2 L1 times the coordinates of C2 relative to B along and across link 1 (kg m²).

    The first is the part of M12 that depends on the pose.
    """
    _, a, b = chain.C2
    elbow, first = q[1] - q[0], chain.m2 * chain.L1
    s, c = sin(elbow), cos(elbow)
    return first * a * c - first * b * s, first * a * s + first * b * c


def gathered_force(chain: Chain, q: Pair, loads: Loads) -> Pair:
    """Return Q_1 and Q_2 (N m), each with one sine and one cosine for all forces.

    A force (X, Y) at (a, b) of a link gives cos(q) (a Y − b X) − sin(q) (a X + b Y); one on link 2
    also acts on link 1, at B. Constants are summed before they multiply a sine or cosine.
    """
    zero = chain.scalar(0)
    along, across, moment = [zero, zero], [zero, zero], [zero, zero]
    for load in loads:
        link = load.link if isinstance(load, Torque) else load.point.link
        if isinstance(load, Torque):
            moment[link - 1] = moment[link - 1] + chain.scalar(load.moment)
            continue
        X, Y = chain.scalars(load.components)
        _, a, b = load.point
        points = [(0, a, b)] if link == 1 else [(0, chain.L1, 0), (1, a, b)]
        for k, a_k, b_k in points:
            along[k] = along[k] + (a_k * X + b_k * Y)
            across[k] = across[k] + (a_k * Y - b_k * X)
    Q1, Q2 = (
        moment[k] + (cos(q[k]) * across[k] - sin(q[k]) * along[k]) if loads else 0 for k in (0, 1)
    )
    return Q1, Q2


Equations = SpeedEquations | MomentumEquations

EQUATIONS: dict[EquationsName, Equations] = {
    name: MomentumEquations() if name == "momenta" else SpeedEquations(name)
    for name in EQUATIONS_NAMES
}
"""The equations by the names that options take, the cheapest first."""


def expressions_of(
    equations: EquationsName, chain: Chain, effects: tuple[Effect, ...], number: Any
) -> list[tuple[Any, Any]]:
    """Return heyoka's variables q1, q2, x1, x2, each with its rate, for numbers of a type.

    The numbers of the chain are of that type, or expressions.
    """
    hy = heyoka()
    variables = hy.make_vars("q1", "q2", "x1", "x2")
    q1, q2, x1, x2, t = (precise(each, number) for each in (*variables, hy.time))
    first, second = EQUATIONS[equations].rates(chain, effects, (q1, q2), (x1, x2), t)
    return list(zip(variables, map(plain, (*first, *second)), strict=True))


def equations_named(name: str) -> EquationsName:
    """Return a name of `EQUATIONS`; raises `SimulationError` for any other."""
    for known in EQUATIONS:
        if name == known:
            return known
    raise SimulationError(choice("formulation", name, EQUATIONS))
