"""The modes of a motion that is not smooth: who slips which way, who sticks, who touches.

In a mode the motion is smooth. What slips is resisted by a known force, what sticks or rests is
held by whatever force that takes: a constraint, whose row and whose force are the generalized
force of a unit load, by Kane's partial velocities or by Lagrange's gradients. A mode ends where
its forces or speeds leave what the laws of friction and contact allow. What follows is the mode
that is consistent with them: what rests is pushed and not pulled, what sticks is held by less than
the static limit, what starts to slip starts against its friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from types import ModuleType
from typing import NamedTuple

from twolink.arithmetic import Matrix, Pair, Scalar, sqrt
from twolink.chain import Chain
from twolink.contact.coordinates import ConstraintCoordinate, JointCoordinate
from twolink.contact.elements import CompliantContact, DryFriction, RigidContact
from twolink.contact.force_laws import Branch, PlasticState
from twolink.effects import Effect, nonsmooth, smooth_loads
from twolink.errors import SimulationError
from twolink.loads import Force, Load, Loads, Torque
from twolink.simulation.constrained import (
    Constraint,
    cramer,
    parallel,
    rests,
    same_way,
    solved_with_one,
    solved_with_two,
)
from twolink.simulation.mode import ContactState, Mode

# Two constraints bring the chain to rest; with more of them their forces are open.
_MOST_CONSTRAINTS = 2


# The rate (1/s) at which what has left its constraint by rounding is pulled back.
_PULL = 8.0

# A mode whose forces offend the laws by less than this part of all that acts keeps them.
_KEPT = 1e-9
# Accelerations that differ by more than this part of those of a free chain are others.
_OTHER = 1e-6


class Held(NamedTuple):
    """What a friction or an obstacle gives (N, N m): along its direction, and its tangent."""

    normal: Scalar
    tangential: Scalar


class Solution(NamedTuple):
    """du/dt (rad/s²) in a mode, and what each friction and obstacle gives."""

    du: Pair
    held: tuple[Held, ...]


class Modes:
    """The modes of a chain under effects of which some are not smooth, by one formulation."""

    def __init__(self, chain: Chain, effects: tuple[Effect, ...], formulation: ModuleType) -> None:
        """Take the chain (in numbers of the wanted kind), the effects, and the formulation."""
        self.chain = chain
        self.effects = effects
        self.formulation = formulation
        self.elements = nonsmooth(effects, chain)
        self._q: Pair | None = None
        # By the directions' identities, with these: a direction takes longer to hash than its row.
        self._rows: dict[int, tuple[ConstraintCoordinate, Pair]] = {}
        self._inertia: tuple[Matrix, Scalar] | None = None
        self.names = tuple(element.name for element in self.elements)
        rubbing = [e.direction for e in self.elements if isinstance(e, DryFriction)]
        for element in self.elements:
            if isinstance(element, DryFriction) and rubbing.count(element.direction) > 1:
                raise SimulationError(
                    f"{element.name} has dry friction twice; allowed is one for each"
                )

    def row(self, direction: ConstraintCoordinate, q: Pair) -> Pair:
        """Return the Jacobian of a direction: the generalized force of its unit loads."""
        self._stand_at(q)
        known = self._rows.get(id(direction))
        if known is not None:
            return known[1]
        loads = direction.unit_loads(self.chain)
        found: Pair = self.formulation.generalized_active_force(self.chain, q, loads)
        self._rows[id(direction)] = direction, found
        return found

    def inertia(self, q: Pair) -> tuple[Matrix, Scalar]:
        """Return M (kg m²) and its determinant (kg² m⁴)."""
        self._stand_at(q)
        if self._inertia is None:
            M = self.formulation.mass_matrix(self.chain, q)
            self._inertia = M, self.formulation.determinant(self.chain, q)
        return self._inertia

    def _stand_at(self, q: Pair) -> None:
        """Forget what was computed in another pose: about one pose there are many questions."""
        if q is not self._q:
            self._q, self._rows, self._inertia = q, {}, None

    def accelerations(self, mode: Mode, q: Pair, u: Pair, t: Scalar) -> Pair:
        """Return du/dt (rad/s²) in a mode."""
        return self.solution(mode, q, u, t).du

    def solution(
        self, mode: Mode, q: Pair, u: Pair, t: Scalar, roots: Mapping[int, Scalar] | None = None
    ) -> Solution:
        """Return du/dt in a mode, and the forces that keep up its constraints.

        `roots` of the depths in rooted cushions may be given by number; else they are those of q.
        """
        pushed = self._pushed(mode, q, u, roots or {})
        loads = smooth_loads(self.effects, self.chain, q, u, t) + self._kinetic_loads(mode)
        loads = (*loads, *self._cushion_loads(mode, pushed))
        Q1, Q2 = self.formulation.generalized_active_force(self.chain, q, loads)
        Cu1, Cu2 = self.formulation.velocity_terms(self.chain, q, u)
        r = Q1 - Cu1, Q2 - Cu2
        constraints = self._constraints(mode, q, u)
        flat = [constraint for group in constraints for constraint in group]
        if len(flat) == _MOST_CONSTRAINTS:
            # The chain is at rest, and shall stay so exactly: there is nothing to pull back.
            constraints = self._constraints(mode, q, u, pull=0)
            flat = [constraint for group in constraints for constraint in group]
        M, det = self.inertia(q)
        if not flat:
            return Solution(cramer(M, r, det), self._held(mode, constraints, [], pushed))
        solve = solved_with_one if len(flat) == 1 else solved_with_two
        du, multipliers = solve(M, r, *flat)
        return Solution(du, self._held(mode, constraints, multipliers, pushed))

    def _pushed(
        self, mode: Mode, q: Pair, u: Pair, roots: Mapping[int, Scalar]
    ) -> dict[int, Scalar]:
        """Return the normal forces (N) of the cushions that are pressed, by number."""
        found = {}
        for index, (element, state) in enumerate(zip(self.elements, mode.states, strict=True)):
            if isinstance(element, CompliantContact) and state is not ContactState.OPEN:
                rate = -element.direction.speed(self.chain, q, u)
                branch = self.branch(mode, index)
                if index in roots:
                    root = roots[index]
                    depth = root * root
                else:
                    surface = element.bound - branch.residual
                    inside = surface - element.direction.coordinate(self.chain, q)
                    depth = (inside + abs(inside)) / 2 if element.law.rooted else inside
                    root = sqrt(depth) if element.law.rooted else 0
                found[index] = branch.law.force(depth, root, rate)
        return found

    def branch(self, mode: Mode, index: int) -> Branch:
        """Return the part of a cushion's law that holds in a mode."""
        cushion, dent = self.elements[index], mode.dent(index)
        assert isinstance(cushion, CompliantContact)
        if cushion.memory is None or dent is None:
            return Branch(cushion.law)
        return cushion.memory.branch(dent)

    def _cushion_loads(self, mode: Mode, pushed: Mapping[int, Scalar]) -> Loads:
        """Return the forces of pressed cushions, and their friction where they are slid along."""
        loads: list[Load] = []
        for index, normal in pushed.items():
            element, state = self.elements[index], mode.states[index]
            assert isinstance(element, CompliantContact)
            loads += [_scaled(x, normal) for x in element.direction.unit_loads(self.chain)]
            if state.direction and element.tangent is not None:
                s = -state.direction * element.kinetic * normal
                loads += [_scaled(x, s) for x in element.tangent.unit_loads(self.chain)]
        return tuple(loads)

    def loads(self, solution: Solution, q: Pair, u: Pair, t: Scalar) -> Loads:
        """Return all that acts, what frictions and obstacles give included."""
        given: list[Load] = []
        for element, held in zip(self.elements, solution.held, strict=True):
            given += [_scaled(x, held.normal) for x in element.direction.unit_loads(self.chain)]
            if not isinstance(element, DryFriction) and element.tangent is not None:
                along = element.tangent.unit_loads(self.chain)
                given += [_scaled(x, held.tangential) for x in along]
        return smooth_loads(self.effects, self.chain, q, u, t) + tuple(given)

    def _kinetic_loads(self, mode: Mode) -> Loads:
        """Return the forces of dry friction (not of contacts) where it slips."""
        return tuple(
            _scaled(load, -state.direction * element.kinetic)
            for element, state in zip(self.elements, mode.states, strict=True)
            if isinstance(element, DryFriction) and state.direction
            for load in element.direction.unit_loads(self.chain)
        )

    def _constraints(
        self, mode: Mode, q: Pair, u: Pair, pull: float = _PULL
    ) -> list[list[Constraint]]:
        """Return the constraints of each friction and obstacle in a mode: none, one or two."""
        found: list[list[Constraint]] = []
        for element, state in zip(self.elements, mode.states, strict=True):
            slips = isinstance(element, DryFriction) and state.direction
            if state is ContactState.OPEN or slips:
                found.append([])
                continue
            if isinstance(element, CompliantContact):
                found.append([])
                if state is ContactState.STICKS and element.tangent is not None:
                    tangent, tangent_drift = self._kept(element.tangent, q, u, pull)
                    found[-1].append(Constraint(tangent, tangent_drift, tangent))
                continue
            bound = element.bound if isinstance(element, RigidContact) else None
            row, drift = self._kept(element.direction, q, u, pull, bound)
            if isinstance(element, DryFriction) or element.tangent is None:
                found.append([Constraint(row, drift, row)])
                continue
            tangent, tangent_drift = self._kept(element.tangent, q, u, pull)
            if state is ContactState.STICKS:
                sticking = Constraint(tangent, tangent_drift, tangent)
                found.append([Constraint(row, drift, row), sticking])
                continue
            s = -state.direction * element.kinetic
            force = row[0] + s * tangent[0], row[1] + s * tangent[1]
            found.append([Constraint(row, drift, force)])
        return found

    def _kept(
        self,
        direction: ConstraintCoordinate,
        q: Pair,
        u: Pair,
        pull: float,
        bound: Scalar | None = None,
    ) -> tuple[Pair, Scalar]:
        """Return the row and the drift of a constraint that is kept up for long.

        A joint that is held does not move at all. A point that is held moves by the rounding of
        each step: a pull back, zero where there is nothing to pull, keeps that from adding up.
        """
        row, drift = self._row_and_drift(direction, q, u)
        if isinstance(direction, JointCoordinate) or pull == 0:
            return row, drift
        drift = drift + 2 * pull * direction.speed(self.chain, q, u)
        if bound is not None:
            drift = drift + pull * pull * (direction.coordinate(self.chain, q) - bound)
        return row, drift

    def _row_and_drift(
        self, direction: ConstraintCoordinate, q: Pair, u: Pair
    ) -> tuple[Pair, Scalar]:
        return self.row(direction, q), direction.drift(self.chain, q, u)

    def _held(
        self,
        mode: Mode,
        constraints: list[list[Constraint]],
        multipliers: list[Scalar],
        pushed: Mapping[int, Scalar],
    ) -> tuple[Held, ...]:
        """Return what each friction and obstacle gives, from the multipliers of the constraints."""
        left = iter(multipliers)
        found = []
        for index, group in enumerate(constraints):
            element, state = self.elements[index], mode.states[index]
            values = [next(left) for _ in group]
            if isinstance(element, CompliantContact):
                values = [pushed.get(index, 0), *values]
            normal = values[0] if values else 0
            tangential: Scalar = values[1] if len(values) > 1 else 0
            if isinstance(element, DryFriction) and state.direction:
                normal = -state.direction * element.kinetic
            if not isinstance(element, DryFriction) and state.direction:
                tangential = -state.direction * element.kinetic * normal
            found.append(Held(normal, tangential))
        return tuple(found)

    def consistent(
        self,
        q: Pair,
        u: Pair,
        t: Scalar,
        choices: Mapping[int, tuple[ContactState, ...]],
        dents: tuple[PlasticState | None, ...] = (),
    ) -> tuple[list[Mode], bool]:
        """Return the modes that a state may go on in, and whether they keep the laws.

        `choices` has the states that come into question for each friction and obstacle, by its
        number: one for those that move or are known, several for those at rest; `dents` is what
        they remember. But for rounding
        one mode keeps the laws of friction and contact, unless a surface is rough enough to wedge
        what slides on it (Painlevé): then there may be none, and the least wrong one is returned,
        or several that differ in what they do.
        """
        every = [choices[index] for index in range(len(self.elements))]
        at_rest = [index for index, states in enumerate(every) if len(states) > 1]
        candidates = [Mode(self.names, states, dents) for states in product(*every)]
        if not at_rest:
            return candidates, True
        faults = [self.fault(mode, at_rest, q, u, t) for mode in candidates]
        allowed = _KEPT * self._size_of_forces(q, u, t)
        kept = [mode for mode, fault in zip(candidates, faults, strict=True) if fault <= allowed]
        least = candidates[min(range(len(faults)), key=faults.__getitem__)]
        if least not in kept:
            return [least], False
        return [least, *self._others(least, kept, q, u, t)], True

    def _others(self, least: Mode, kept: list[Mode], q: Pair, u: Pair, t: Scalar) -> list[Mode]:
        """Return those of the modes that are kept to which give other accelerations."""
        ours = self.accelerations(least, q, u, t)
        size = max(abs(float(x)) for x in self._free_accelerations(q, u, t)) or 1.0
        found = []
        for mode in kept:
            du = self.accelerations(mode, q, u, t)
            apart = max(abs(float(x) - float(y)) for x, y in zip(ours, du, strict=True))
            if apart > _OTHER * size:
                found.append(mode)
        return found

    def _free_accelerations(self, q: Pair, u: Pair, t: Scalar) -> Pair:
        return self.accelerations(Mode(self.names, (ContactState.OPEN,) * len(self.names)), q, u, t)

    def _size_of_forces(self, q: Pair, u: Pair, t: Scalar) -> float:
        """Return the sum of all that acts (N m), for what is small beside it."""
        loads = smooth_loads(self.effects, self.chain, q, u, t)
        Q = self.formulation.generalized_active_force(self.chain, q, loads)
        Cu = self.formulation.velocity_terms(self.chain, q, u)
        return sum(abs(float(x)) for x in (*Q, *Cu))

    def wedges(self, index: int, state: ContactState, q: Pair) -> bool:
        """Return whether a push on what slides along an obstacle would press it on even more.

        Then row · M⁻¹ (normal + friction) is negative: Painlevé's case.
        """
        element = self.elements[index]
        if not isinstance(element, RigidContact) or element.tangent is None or not state.direction:
            return False
        row, tangent = self.row(element.direction, q), self.row(element.tangent, q)
        s = -state.direction * element.kinetic
        force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        return bool(self.response(row, force, q) < 0)

    def fault(self, mode: Mode, at_rest: list[int], q: Pair, u: Pair, t: Scalar) -> float:
        """Return by how much (N m) a mode offends the laws of friction and contact, or 0.

        `at_rest` has the numbers of the frictions and obstacles whose state is in question. An
        acceleration that has the wrong sign counts as the force that would be missing.
        """
        flat = [c for group in self._constraints(mode, q, u) for c in group]
        if len(flat) > _MOST_CONSTRAINTS or parallel(flat):
            return float("inf")
        du, held = self.solution(mode, q, u, t)
        faults = [0.0]
        for index in at_rest:
            element, state = self.elements[index], mode.states[index]
            row = self.row(element.direction, q)
            long = max(abs(float(row[0])), abs(float(row[1])))
            force = float(held[index].normal)
            if state is ContactState.STICKS and isinstance(element, DryFriction):
                faults.append(long * (abs(force) - float(element.static)))
            elif isinstance(element, DryFriction):
                # What rests starts against static friction; kinetic friction comes after.
                start = state.direction * self._missing_force(element.direction, q, u, du)
                faults.append(long * (float(element.static - element.kinetic) - start))
            elif isinstance(element, CompliantContact):
                faults += self._faults_of_sliding(element, state, held[index], q, u, du)
            elif state is ContactState.OPEN:
                faults.append(long * -self._missing_force(element.direction, q, u, du))
            else:
                faults.append(long * -force)
                faults += self._faults_of_sliding(element, state, held[index], q, u, du)
        return max(faults)

    def barred_frictions(self, mode: Mode, q: Pair, u: Pair) -> list[int]:
        """Return the numbers of the frictions that would slip, were it not for an obstacle."""
        rows = [c.row for group in self._constraints(mode, q, u) for c in group]
        return [
            index
            for index, (element, state) in enumerate(zip(self.elements, mode.states, strict=True))
            if isinstance(element, DryFriction)
            and state.direction
            and any(same_way(row, self.row(element.direction, q)) for row in rows)
        ]

    def _faults_of_sliding(
        self,
        element: RigidContact | CompliantContact,
        state: ContactState,
        held: Held,
        q: Pair,
        u: Pair,
        du: Pair,
    ) -> list[float]:
        """Return by how much (N m) what touches offends Coulomb's law."""
        if element.tangent is None:
            return []
        row = self.row(element.tangent, q)
        long = max(abs(float(row[0])), abs(float(row[1])))
        if state is ContactState.STICKS:
            beyond = abs(float(held.tangential)) - float(element.static) * float(held.normal)
            return [long * beyond]
        if state.direction and rests(row, u):
            start = self._missing_force(element.tangent, q, u, du)
            return [long * -state.direction * start]
        return []

    def _missing_force(self, direction: ConstraintCoordinate, q: Pair, u: Pair, du: Pair) -> float:
        """Return a direction's acceleration, as the force (N, N m) along it that would give it."""
        row, drift = self._row_and_drift(direction, q, u)
        return float((row[0] * du[0] + row[1] * du[1] + drift) / self.response(row, row, q))

    def response(self, row: Pair, force: Pair, q: Pair) -> Scalar:
        """Return row · M⁻¹ force: the acceleration along a row that a unit of a force gives."""
        M, det = self.inertia(q)
        x, y = cramer(M, force, det)
        return row[0] * x + row[1] * y


def _scaled(load: Load, factor: Scalar) -> Load:
    if isinstance(load, Torque):
        return Torque(load.link, factor * load.moment)
    x, y = load.components
    return Force(load.point, (factor * x, factor * y))
