"""The equations of motion as first-order equations, in the variables an integrator likes.

Three sets of variables describe the same motion: (q, u) with Kane's equations, (q, u) with
Lagrange's, and (q, p) with the momenta p = M u, in which the equations are shortest. The text is
that of `twolink.kane` and `twolink.lagrange`, for numbers of any kind: evaluated on heyoka's
expressions it is compiled, on floats or arrays it is a function.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

from twolink import kane, lagrange
from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads


@dataclass(frozen=True)
class SpeedEquations:
    """q and u as variables: dq/dt = u, and du/dt by one formulation's forward dynamics."""

    name: str
    formulation: ModuleType

    def rates(
        self, chain: Chain, effects: tuple[Effect, ...], q: Pair, u: Pair, t: Scalar
    ) -> tuple[Pair, Pair]:
        """Return dq/dt (rad/s) and du/dt (rad/s²)."""
        loads = smooth_loads(effects, chain, q, u, t)
        return u, self.formulation.forward_dynamics(chain, q, u, loads)

    def from_speeds(self, chain: Chain, q: Pair, u: Pair) -> Pair:
        """Return the second pair of variables of a state: u itself."""
        return u

    def to_speeds(self, chain: Chain, q: Any, second: Any) -> Any:
        """Return u (rad/s) of the second pair of variables: u itself."""
        return second


@dataclass(frozen=True)
class MomentumEquations:
    """q and p as variables: dq/dt = M⁻¹ p, and dp/dt = ∂T/∂q + Q, by (6.9)."""

    name: str = "momenta"

    def rates(
        self, chain: Chain, effects: tuple[Effect, ...], q: Pair, p: Pair, t: Scalar
    ) -> tuple[Pair, Pair]:
        """Return dq/dt (rad/s) and dp/dt (N m)."""
        u = self.to_speeds(chain, q, p)
        slope1, slope2 = lagrange.energy_gradient(chain, q, u)
        loads = smooth_loads(effects, chain, q, u, t)
        Q1, Q2 = lagrange.generalized_active_force(chain, q, loads)
        return u, (slope1 + Q1, slope2 + Q2)

    def from_speeds(self, chain: Chain, q: Pair, u: Pair) -> Pair:
        """Return p = ∂T/∂u (kg m²/s)."""
        return lagrange.momenta(chain, q, u)

    def to_speeds(self, chain: Chain, q: Any, p: Any) -> Pair:
        """Return u = M⁻¹ p (rad/s), by Cramer's rule."""
        (M11, M12), (M21, M22) = lagrange.mass_matrix(chain, q)
        p1, p2 = p
        det = lagrange.determinant(chain, q)
        return (M22 * p1 - M12 * p2) / det, (M11 * p2 - M21 * p1) / det


Equations = SpeedEquations | MomentumEquations

# The first is the default: it was measured to cost least (benchmarks/simulation.py).
EQUATIONS: dict[str, Equations] = {
    "momenta": MomentumEquations(),
    "lagrange": SpeedEquations("lagrange", lagrange),
    "kane": SpeedEquations("kane", kane),
}
