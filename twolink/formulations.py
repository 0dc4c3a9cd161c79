"""The formulations of the equations of motion, in one registry.

Verification, simulation and hard cases take them from here. A new formulation is a module with the
functions of `EquationsOfMotion`, and an entry in `FORMULATIONS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from twolink import kane, lagrange
from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.chain import Chain, Point
from twolink.loads import Loads
from twolink.names import FormulationName


class EquationsOfMotion(Protocol):
    """The functions of a formulation, in absolute angles q (rad) and speeds u (rad/s).

    Each takes numbers of any type. `twolink.kane` and `twolink.lagrange` are implementations.
    """

    def __hash__(self) -> int:
        """Return a hash: compiled formulas are kept by their formulation."""

    def mass_matrix(self, chain: Chain, q: Pair) -> Matrix:
        """Return M (kg m²)."""

    def determinant(self, chain: Chain, q: Pair) -> Scalar:
        """Return det M (kg² m⁴), without cancellation."""

    def velocity_terms(self, chain: Chain, q: Pair, u: Pair) -> Pair:
        """Return C u (N m)."""

    def coriolis_matrix(self, chain: Chain, q: Pair, u: Pair) -> Matrix:
        """Return C (N m s)."""

    def generalized_active_force(self, chain: Chain, q: Pair, loads: Loads) -> Pair:
        """Return Q (N m) of loads."""

    def inverse_dynamics(self, chain: Chain, q: Pair, u: Pair, du: Pair, loads: Loads) -> Pair:
        """Return the generalized forces (N m) that are required beside loads."""

    def forward_dynamics(self, chain: Chain, q: Pair, u: Pair, loads: Loads) -> Pair:
        """Return du/dt (rad/s²) under loads."""

    def kinetic_energy(self, chain: Chain, q: Pair, u: Pair) -> Scalar:
        """Return T (J)."""


@dataclass(frozen=True)
class Formulation:
    """A derivation of the equations of motion and its function for a point's Jacobian."""

    name: str
    equations: EquationsOfMotion
    jacobian: Callable[[Chain, Pair, Point], tuple[Pair, Pair]]


FORMULATIONS: dict[FormulationName, Formulation] = {
    "kane": Formulation("Kane", kane, kane.partial_velocities),
    "lagrange": Formulation("Lagrange", lagrange, lagrange.position_gradients),
}
"""The formulations by the names that options take."""
