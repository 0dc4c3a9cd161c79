"""A chain in a pose: its mass matrix and the Jacobian rows of coordinates, each computed once."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import NamedTuple

from twolink.arithmetic import Matrix, Pair, Scalar
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.formulations import EquationsOfMotion
from twolink.simulation.hybrid.constraint import cramer


class CoordinateFormulas(NamedTuple):
    """The value (rad or m) and the Jacobian row of a coordinate, as functions of q.

    Its `speed` (rad/s or m/s) and its `bias`, the second derivative without accelerations, are
    functions of q and u.
    """

    value: Callable[[Pair], Scalar]
    row: Callable[[Pair], Pair]
    speed: Callable[[Pair, Pair], Scalar]
    bias: Callable[[Pair, Pair], Scalar]


class ChainFormulas(NamedTuple):
    """M11, M12, M22 (kg m²) and det M (kg² m⁴) as a function of q, and C u (N m) of q and u."""

    inertia: Callable[[Pair], tuple[Scalar, ...]]
    velocity_terms: Callable[[Pair, Pair], Pair]


class PoseFormulas:
    """The formulas of all poses of a chain, as functions of q (rad).

    Those of a chain of floats may be `compiled`, with the same results to the last bit: the steps
    of an impact evaluate them often.
    """

    def __init__(self, chain: Chain, formulation: EquationsOfMotion, compiled: bool) -> None:
        """Store a chain and a formulation."""
        self._chain, self._formulation, self._compiled = chain, formulation, compiled
        # The length of the stretched chain (m).
        self.lever = float(abs(chain.L1) + abs(chain.L2))
        # By identity: a coordinate takes longer to hash than its row to evaluate. The coordinate is
        # kept, so that no other has its number.
        self._known: dict[int, tuple[ConstraintCoordinate, CoordinateFormulas]] = {}
        make = _compiled_of_chain if compiled else _of_chain
        self.inertia, self.velocity_terms = make(chain, formulation)

    def of(self, coordinate: ConstraintCoordinate) -> CoordinateFormulas:
        """Return the formulas of a coordinate."""
        number = id(coordinate)
        known = self._known.get(number)
        if known is None:
            make = _compiled_formulas if self._compiled else _formulas
            known = coordinate, make(self._chain, self._formulation, coordinate)
            self._known[number] = known
        return known[1]


def _of_chain(chain: Chain, formulation: EquationsOfMotion) -> ChainFormulas:
    def inertia(q: Pair) -> tuple[Scalar, ...]:
        (M11, M12), (_, M22) = formulation.mass_matrix(chain, q)
        return M11, M12, M22, formulation.determinant(chain, q)

    def velocity_terms(q: Pair, u: Pair) -> Pair:
        return formulation.velocity_terms(chain, q, u)

    return ChainFormulas(inertia, velocity_terms)


def _formulas(
    chain: Chain, formulation: EquationsOfMotion, coordinate: ConstraintCoordinate
) -> CoordinateFormulas:
    """Return the formulas of a coordinate; its row is the generalized force of its unit loads."""
    loads = coordinate.unit_loads(chain)

    def value(q: Pair) -> Scalar:
        return coordinate.coordinate(chain, q)

    def row(q: Pair) -> Pair:
        return formulation.generalized_active_force(chain, q, loads)

    def speed(q: Pair, u: Pair) -> Scalar:
        return coordinate.speed(chain, q, u)

    def bias(q: Pair, u: Pair) -> Scalar:
        return coordinate.bias(chain, q, u)

    return CoordinateFormulas(value, row, speed, bias)


@functools.lru_cache(maxsize=64)
def _compiled_of_chain(chain: Chain, formulation: EquationsOfMotion) -> ChainFormulas:
    plain = _of_chain(chain, formulation)
    return ChainFormulas(*(Compiled(formula).of_floats for formula in plain))


@functools.lru_cache(maxsize=256)
def _compiled_formulas(
    chain: Chain, formulation: EquationsOfMotion, coordinate: ConstraintCoordinate
) -> CoordinateFormulas:
    plain = _formulas(chain, formulation, coordinate)
    return CoordinateFormulas(*(Compiled(formula).of_floats for formula in plain))


class Pose:
    """A chain in a pose q: its mass matrix and Jacobian rows, each computed once.

    `lever` is the length of the stretched chain (m).
    """

    __slots__ = ("_formulas", "_inertia", "_rows", "chain", "formulation", "lever", "q")

    def __init__(
        self,
        chain: Chain,
        formulation: EquationsOfMotion,
        q: Pair,
        formulas: PoseFormulas | None = None,
    ) -> None:
        """Store a chain and angles of any number type.

        The poses of one chain may share their `formulas`.
        """
        self.chain, self.formulation, self.q = chain, formulation, q
        self._formulas = formulas or PoseFormulas(chain, formulation, compiled=False)
        self.lever = self._formulas.lever
        self._rows: dict[int, Pair] = {}
        self._inertia: tuple[Matrix, Scalar] | None = None

    def row(self, coordinate: ConstraintCoordinate) -> Pair:
        """Return the Jacobian row of a coordinate."""
        number = id(coordinate)
        row = self._rows.get(number)
        if row is None:
            row = self._rows[number] = self._formulas.of(coordinate).row(self.q)
        return row

    def value(self, coordinate: ConstraintCoordinate, q: Pair) -> Scalar:
        """Return a coordinate (rad or m) in a pose q of the same chain."""
        return self._formulas.of(coordinate).value(q)

    def speed(self, coordinate: ConstraintCoordinate, u: Pair) -> Scalar:
        """Return the rate of a coordinate (rad/s or m/s)."""
        return self._formulas.of(coordinate).speed(self.q, u)

    def bias(self, coordinate: ConstraintCoordinate, u: Pair) -> Scalar:
        """Return the second derivative of a coordinate without accelerations (rad/s² or m/s²)."""
        return self._formulas.of(coordinate).bias(self.q, u)

    def velocity_terms(self, u: Pair) -> Pair:
        """Return C u (N m)."""
        return self._formulas.velocity_terms(self.q, u)

    @property
    def inertia(self) -> tuple[Matrix, Scalar]:
        """M (kg m²) and its determinant (kg² m⁴)."""
        known = self._inertia
        if known is None:
            M11, M12, M22, det = self._formulas.inertia(self.q)
            known = self._inertia = ((M11, M12), (M12, M22)), det
        return known

    def response(self, row: Pair, force: Pair) -> Scalar:
        """Return row · M⁻¹ force: the acceleration along a row that a unit of a force gives."""
        M, det = self._inertia or self.inertia
        x, y = cramer(M, force, det)
        return row[0] * x + row[1] * y

    def impulse_response(self, impulse: Pair) -> Pair:
        """Return M⁻¹ times a generalized impulse (N m s): the change of u (rad/s)."""
        M, det = self._inertia or self.inertia
        return cramer(M, impulse, det)
