"""Contact elements: dry friction, rigid contact and compliant contact.

A `ContactEffect` returns its elements; the simulation combines their states into modes, separated
by exact events. Each class defines the constraints of its states, the forces that are known in
them, and the events that end them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.contact.coordinates import ConstraintCoordinate
from twolink.contact.force_laws import Branch, ContactLaw, Hysteresis, PlasticState
from twolink.contact.states import ContactState, EventKind, pressed, slipping


class Terms(NamedTuple):
    """A coordinate c at an instant: its Jacobian `row`, and `bias` with c'' = row · du + bias."""

    row: Pair
    bias: Scalar


class ElementTerms(NamedTuple):
    """An element at an instant: its coordinates (None where absent), and a compliant force (N)."""

    normal: Terms | None
    tangent: Terms | None
    push: Scalar


class Constraint(NamedTuple):
    """The constraint row · du + bias = 0, enforced by a multiple of the load `force` (N m)."""

    row: Pair
    bias: Scalar
    force: Pair


class ContactForces(NamedTuple):
    """Forces of an element along its normal and its tangent (N, or N m at a joint)."""

    normal: Scalar
    tangential: Scalar


NO_FORCES = ContactForces(0, 0)


class ContactElement(ABC):
    """A dry friction or a contact.

    `normal` is the coordinate whose value may not fall below `bound` (None for friction without
    a contact); `tangent` the coordinate along which friction acts (None for a smooth contact).
    """

    name: str
    normal: ConstraintCoordinate | None
    tangent: ConstraintCoordinate | None
    bound: Scalar
    rigid = False
    reachable = True

    @property
    def principal(self) -> ConstraintCoordinate:
        """The coordinate that names the element: the normal if there is one, else the tangent."""
        coordinate = self.normal or self.tangent
        assert coordinate is not None
        return coordinate

    @property
    def rough(self) -> bool:
        """Whether friction acts along the tangent."""
        return self.tangent is not None

    @property
    def hysteretic(self) -> bool:
        """Whether the static friction limit is above the kinetic one."""
        return False

    @property
    def compliant(self) -> ContactLaw | None:
        """The force law of the undamaged surface, or None for a rigid element."""
        return None

    @property
    def hysteresis(self) -> Hysteresis | None:
        """The history dependence of the force law, or None."""
        return None

    def branch(self, plastic: PlasticState | None) -> Branch:
        """Return the branch of a compliant law for a state of the surface."""
        law, memory = self.compliant, self.hysteresis
        assert law is not None
        return Branch(law) if memory is None or plastic is None else memory.branch(plastic)

    @abstractmethod
    def limits(self, normal_force: Scalar) -> Pair:
        """Return the kinetic and the static friction limit (N, N m) at a normal force (N)."""

    @abstractmethod
    def options(self, touching: bool, direction: int) -> tuple[ContactState, ...]:
        """Return the possible states, sticking first.

        `direction` is the sign of the sliding speed, 0 at rest.
        """

    @abstractmethod
    def constraints(self, state: ContactState, terms: ElementTerms) -> tuple[Constraint, ...]:
        """Return the constraints that a state enforces."""

    @abstractmethod
    def applied(self, state: ContactState, terms: ElementTerms) -> tuple[Pair, ...]:
        """Return the generalized forces (N m) that are known in a state."""

    @abstractmethod
    def forces(
        self, state: ContactState, terms: ElementTerms, multipliers: tuple[Scalar, ...]
    ) -> ContactForces:
        """Return the forces in a state, given the multipliers of its constraints."""

    def events(
        self, state: ContactState, plastic: PlasticState | None = None
    ) -> tuple[tuple[EventKind, int], ...]:
        """Return the kinds of events that end a state, each with its sense (0 where it has none).

        `plastic` is the state of a surface that yields.
        """
        if state is ContactState.OPEN:
            return ((EventKind.HITS, 0),) if self.reachable else ()
        found: list[tuple[EventKind, int]] = []
        if self.normal is not None:
            found.append((EventKind.LEAVES, 0))
        if state.slips:
            found.append((EventKind.STOPS, state.direction))
        if state is ContactState.STICKS:
            found += [(EventKind.BREAKS, 1), (EventKind.BREAKS, -1)]
        return tuple(found)

    def holds(self, state: ContactState) -> tuple[ConstraintCoordinate, ...]:
        """Return the coordinates whose speed the element holds at zero in a state."""
        return ()


def _scaled(row: Pair, factor: Scalar) -> Pair:
    return factor * row[0], factor * row[1]


_AT_REST = (
    ContactState.STICKS,
    ContactState.FORWARD,
    ContactState.BACKWARD,
    pressed(1),
    pressed(-1),
)


@dataclass(frozen=True)
class DryFriction(ContactElement):
    """Friction along `tangent` with constant limits: `kinetic` while it moves, `static` at rest.

    Both limits are generalized forces (N m or N).
    """

    name: str
    tangent: ConstraintCoordinate
    kinetic: Scalar
    static: Scalar
    normal = None
    bound = 0

    @property
    def hysteretic(self) -> bool:
        """Whether the static friction limit is above the kinetic one."""
        return bool(self.static > self.kinetic)

    def limits(self, normal_force: Scalar) -> Pair:
        """Return the kinetic and the static limit, which do not depend on a normal force."""
        return self.kinetic, self.static

    def options(self, touching: bool, direction: int) -> tuple[ContactState, ...]:
        """Return the possible states, sticking first."""
        return (slipping(direction),) if direction else _AT_REST

    def constraints(self, state: ContactState, terms: ElementTerms) -> tuple[Constraint, ...]:
        """Return the constraint of sticking."""
        if state is not ContactState.STICKS:
            return ()
        row, bias = terms.tangent  # type: ignore[misc]
        return (Constraint(row, bias, row),)

    def applied(self, state: ContactState, terms: ElementTerms) -> tuple[Pair, ...]:
        """Return the force of kinetic or saturated friction."""
        assert terms.tangent is not None
        return (
            ()
            if state is ContactState.STICKS
            else (_scaled(terms.tangent.row, self._known(state)),)
        )

    def forces(
        self, state: ContactState, terms: ElementTerms, multipliers: tuple[Scalar, ...]
    ) -> ContactForces:
        """Return the friction force, along the tangent."""
        return ContactForces(0, multipliers[0] if multipliers else self._known(state))

    def holds(self, state: ContactState) -> tuple[ConstraintCoordinate, ...]:
        """Return the tangent if the element sticks."""
        return (self.tangent,) if state is ContactState.STICKS else ()

    def _known(self, state: ContactState) -> Scalar:
        return -state.direction * (self.static if state.pressed else self.kinetic)


@dataclass(frozen=True)
class _Contact(ContactElement):
    """A contact of either kind, with Coulomb friction of coefficients `kinetic` and `static`."""

    name: str
    normal: ConstraintCoordinate
    bound: Scalar

    kinetic = 0
    static = 0

    @property
    def hysteretic(self) -> bool:
        """Whether the static friction limit is above the kinetic one."""
        return bool(self.static > self.kinetic)

    def limits(self, normal_force: Scalar) -> Pair:
        """Return μ N of both coefficients (N)."""
        return self.kinetic * normal_force, self.static * normal_force

    def _friction(self, state: ContactState) -> Scalar:
        """Return T/N of a state that determines it, else 0."""
        if not state.direction:
            return 0
        return -state.direction * (self.static if state.pressed else self.kinetic)

    def holds(self, state: ContactState) -> tuple[ConstraintCoordinate, ...]:
        """Return the coordinates whose speed the element holds at zero in a state."""
        if state is ContactState.STICKS and self.tangent is not None:
            return (self.normal, self.tangent) if self.rigid else (self.tangent,)
        return (self.normal,) if self.rigid and state is not ContactState.OPEN else ()


@dataclass(frozen=True)
class RigidContact(_Contact):
    """A unilateral constraint: a coordinate (rad or m) must not be below `bound`.

    `restitution` is the coefficient e and `law` the impact law. A rough contact has a `tangent`,
    the direction of sliding, and friction coefficients μ. It is not `reachable`, and has no
    impacts, if the point can touch the surface but not get beyond it.
    """

    restitution: Scalar
    tangent: ConstraintCoordinate | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    law: str = "stronge"
    reachable: bool = True
    rigid = True

    def options(self, touching: bool, direction: int) -> tuple[ContactState, ...]:
        """Return the possible states, sticking first."""
        if not touching:
            return (ContactState.OPEN,)
        if self.tangent is None:
            return ContactState.CLOSED, ContactState.OPEN
        if direction:
            return slipping(direction), ContactState.OPEN
        return (*_AT_REST, ContactState.CLOSED, ContactState.OPEN)

    def constraints(self, state: ContactState, terms: ElementTerms) -> tuple[Constraint, ...]:
        """Return the constraint along the normal; its force includes the friction of a slide."""
        if state is ContactState.OPEN:
            return ()
        row, bias = terms.normal  # type: ignore[misc]
        if terms.tangent is None:
            return (Constraint(row, bias, row),)
        along, along_bias = terms.tangent
        if state is ContactState.STICKS:
            return Constraint(row, bias, row), Constraint(along, along_bias, along)
        s = self._friction(state)
        return (Constraint(row, bias, (row[0] + s * along[0], row[1] + s * along[1])),)

    def applied(self, state: ContactState, terms: ElementTerms) -> tuple[Pair, ...]:
        """Return no force: every force of a rigid contact enforces a constraint."""
        return ()

    def forces(
        self, state: ContactState, terms: ElementTerms, multipliers: tuple[Scalar, ...]
    ) -> ContactForces:
        """Return N and T from the multipliers."""
        if state is ContactState.OPEN:
            return NO_FORCES
        normal = multipliers[0]
        if state is ContactState.STICKS:
            return ContactForces(normal, multipliers[1])
        return ContactForces(normal, self._friction(state) * normal)

    def events(
        self, state: ContactState, plastic: PlasticState | None = None
    ) -> tuple[tuple[EventKind, int], ...]:
        """Return the events of a contact, and the jamming of a rough slide."""
        jams = ((EventKind.JAMS, 0),) if state.slips else ()
        return (*super().events(state, plastic), *jams)


@dataclass(frozen=True)
class CompliantContact(_Contact):
    """A compliant surface: `law` gives the normal force of a coordinate (rad or m) below `bound`.

    With `memory` the law depends on the history, and `law` is that of the undamaged surface.
    """

    law: ContactLaw
    tangent: ConstraintCoordinate | None = None
    kinetic: Scalar = 0
    static: Scalar = 0
    memory: Hysteresis | None = None
    reachable: bool = True

    @property
    def compliant(self) -> ContactLaw | None:
        """The force law of the undamaged surface."""
        return self.law

    @property
    def hysteresis(self) -> Hysteresis | None:
        """The history dependence of the force law, or None."""
        return self.memory

    def options(self, touching: bool, direction: int) -> tuple[ContactState, ...]:
        """Return the possible states, sticking first."""
        if not touching:
            return (ContactState.OPEN,)
        if self.tangent is None:
            return (ContactState.CLOSED,)
        return (slipping(direction),) if direction else (*_AT_REST, ContactState.CLOSED)

    def constraints(self, state: ContactState, terms: ElementTerms) -> tuple[Constraint, ...]:
        """Return the constraint of sticking."""
        if state is not ContactState.STICKS:
            return ()
        along, bias = terms.tangent  # type: ignore[misc]
        return (Constraint(along, bias, along),)

    def applied(self, state: ContactState, terms: ElementTerms) -> tuple[Pair, ...]:
        """Return the normal force of the law, and the friction force if the state determines it."""
        if state is ContactState.OPEN:
            return ()
        assert terms.normal is not None
        given = [_scaled(terms.normal.row, terms.push)]
        if state.direction and terms.tangent is not None:
            given.append(_scaled(terms.tangent.row, self._friction(state) * terms.push))
        return tuple(given)

    def forces(
        self, state: ContactState, terms: ElementTerms, multipliers: tuple[Scalar, ...]
    ) -> ContactForces:
        """Return the normal force of the law, and the friction."""
        if state is ContactState.OPEN:
            return NO_FORCES
        known = self._friction(state) * terms.push
        return ContactForces(terms.push, multipliers[0] if multipliers else known)

    def events(
        self, state: ContactState, plastic: PlasticState | None = None
    ) -> tuple[tuple[EventKind, int], ...]:
        """Return the events of a contact, and those that end a branch of the law."""
        found = list(super().events(state, plastic))
        if state is ContactState.OPEN:
            kept = plastic is not None and plastic.is_kept
            return (*found, (EventKind.CLEARS, 0)) if kept else tuple(found)
        branch = self.branch(plastic)
        found += [(EventKind.REACHES, 0)] if branch.reach is not None else []
        found += [(EventKind.TURNS, branch.turning)] if branch.turning else []
        return tuple(found)
