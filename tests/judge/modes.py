"""The modes of friction and contact, found by trying every combination of states.

In a moving mode at most one direction is held; two independent ones bring the chain to rest. A
mode of rest is allowed if any distribution of forces within the laws holds the chain.
"""

from dataclasses import dataclass
from enum import Enum
from itertools import combinations, product

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import linprog

from tests.judge.equations import Contact, Friction, dot, plus, solve_mass


class JudgeGivesUp(Exception):  # noqa: N818
    """The laws leave no motion, or a choice: the scene is outside of the judge's range."""


class State(Enum):
    """The state of a friction or a contact."""

    OPEN = 0
    CLOSED = 0.5
    STICKS = 0.25
    FORWARD = 1
    BACKWARD = -1


SLIPS = {State.FORWARD: 1.0, State.BACKWARD: -1.0}

# A speed (m/s, rad/s) below this is zero, and likewise a gap (m, rad).
ZERO_SPEED = 1e-12
ZERO_GAP = 1e-11
# A condition whose value is below this part of its terms is decided by looking ahead.
UNDECIDED = 1e-9
# For these times (s) a candidate is followed to decide on it.
LOOK_AHEAD = (1e-6, 1e-5, 1e-4, 1e-3)


@dataclass(frozen=True)
class Mode:
    """A state for each friction and contact; in a mode of rest nothing moves at all."""

    states: tuple[State, ...]
    rest: bool = False


def sign_of_speed(row, u):
    """Return +1, −1, or 0 for a speed row · u that is zero but for rounding."""
    value = dot(row, u)
    size = (1 + abs(row[0]) + abs(row[1])) * max(1.0, abs(u[0]), abs(u[1]))
    return 0 if abs(value) <= ZERO_SPEED * size else int(np.sign(value))


def always_parallel(first, second):
    """Return whether the rows of two directions are parallel in every pose."""
    for q in ((0.31, 1.27), (2.13, -0.77), (-1.91, 0.43)):
        (a, b), (c, d) = first.row(q), second.row(q)
        if abs(a * d - b * c) > 1e-9 * (abs(a) + abs(b)) * (abs(c) + abs(d)):
            return False
    return True


class Motion:
    """The motion in a mode: accelerations, the constraint force, and all conditions.

    `possible` is False for combinations that are no moving mode: with two directions held, or
    with something left out that moves along the held direction only.
    """

    def __init__(self, system, mode, q):
        self.system, self.mode = system, mode
        self.held = [i for i, s in enumerate(mode.states) if self._is_held(i, s)]
        rows = {i: system.elements[i].direction.row(q) for i in self.held}
        self.lead = max(self.held, key=lambda i: np.hypot(*rows[i]), default=None)
        self.possible = not mode.rest and self._is_possible()

    def _is_held(self, index, state):
        if isinstance(self.system.elements[index], Friction):
            return state is State.STICKS
        return state is not State.OPEN

    def _is_possible(self):
        elements, states = self.system.elements, self.mode.states
        if self.lead is None:
            return True
        for i in self.held:
            contact = isinstance(elements[i], Contact)
            if contact and (states[i] is State.STICKS or (states[i] in SLIPS and self.held != [i])):
                return False
            if not always_parallel(elements[self.lead].direction, elements[i].direction):
                return False
        return True

    def leaves_out(self, index):
        """Return whether an element moves along the held direction only, and is not held."""
        if self.lead is None or index in self.held:
            return False
        elements = self.system.elements
        return always_parallel(elements[self.lead].direction, elements[index].direction)

    def forces(self, t, q, u):
        """Return r (N m) with the friction of slipping elements, but without contact forces."""
        r = self.system.smooth_forces(t, q, u)
        for element, state in zip(self.system.elements, self.mode.states, strict=True):
            if isinstance(element, Friction) and state in SLIPS:
                r = plus(r, -SLIPS[state] * element.kinetic, element.direction.row(q))
        return r

    def lead_row_and_force(self, q):
        """Return the held row, and the generalized force of a unit of its constraint force."""
        element, state = self.system.elements[self.lead], self.mode.states[self.lead]
        row = element.direction.row(q)
        if isinstance(element, Contact) and state in SLIPS:
            return row, plus(row, -SLIPS[state] * element.kinetic, element.tangent.row(q))
        return row, row

    def solve(self, t, q, u):
        """Return du (rad/s²), the force λ along the held direction, and its response G.

        M du = r + λ F with row · du + drift = 0, so that G λ = −(drift + row · M⁻¹ r) with
        G = row · M⁻¹ F. Without a held direction λ and G are None.
        """
        M = self.system.mass_matrix(q)
        free = solve_mass(M, self.forces(t, q, u))
        if self.lead is None:
            return free, None, None
        row, force = self.lead_row_and_force(q)
        response = solve_mass(M, force)
        G = dot(row, response)
        drift = self.system.elements[self.lead].direction.drift(q, u)
        lam = -(drift + dot(row, free)) / G
        return plus(free, lam, response), lam, G

    def bounds(self, q):
        """Return the least and the largest λ that the held elements can give together.

        Friction gives up to its static limit either way; a contact pushes without limit.
        """
        low = high = 0.0
        R = self.system.elements[self.lead].direction.row(q)
        for i in self.held:
            element = self.system.elements[i]
            k = dot(element.direction.row(q), R) / dot(R, R)
            if isinstance(element, Friction):
                low, high = low - abs(k) * element.static, high + abs(k) * element.static
            else:
                high = high + np.where(k > 0, np.inf, 0.0)
                low = low - np.where(k < 0, np.inf, 0.0)
        return low, high

    def watched(self, t, q, u):
        """Return values that must not become negative, by label, as (value, its round-off)."""
        found = {}
        if self.lead is not None:
            _, lam, G = self.solve(t, q, u)
            low, high = self.bounds(q)
            for label, value, bound in (("low", lam - low, low), ("high", high - lam, high)):
                if np.all(np.isfinite(bound)):
                    found[label, self.lead] = value, 1e-13 * (1 + np.max(np.abs(lam)))
            found["painleve", self.lead] = G, 0.0
        for i, (element, state) in enumerate(
            zip(self.system.elements, self.mode.states, strict=True)
        ):
            if state in SLIPS:
                along = element.direction if isinstance(element, Friction) else element.tangent
                speed = dot(along.row(q), u)
                found["slips", i] = SLIPS[state] * speed, 1e-14 * (1 + np.max(np.abs(u)))
            elif state is State.OPEN:
                found["open", i] = element.gap(q), 1e-15
        return found


class Instant:
    """A state of the chain at a time, in which the next mode is wanted."""

    def __init__(self, system, t, q, u):
        self.system, self.t, self.q, self.u = system, t, q, u
        self.M = system.mass_matrix(q)
        elements = system.elements
        self.rows = [element.direction.row(q) for element in elements]
        self.drifts = [element.direction.drift(q, u) for element in elements]
        slides = [e.direction if isinstance(e, Friction) else e.tangent for e in elements]
        self.along = [d and (d.row(q), d.drift(q, u)) for d in slides]
        r = system.smooth_forces(t, q, u)
        limits = [
            e.static * (abs(row[0]) + abs(row[1]))
            for e, row in zip(elements, self.rows, strict=True)
            if isinstance(e, Friction)
        ]
        self.force_size = abs(r[0]) + abs(r[1]) + sum(limits)
        self.force_size += 1e-3 * system.load_size + 1e-12
        M11, _, M22 = self.M
        det = M11 * M22 - self.M[1] ** 2
        self.acceleration_size = self.force_size * max(M11, M22) / det
        self.touches = [isinstance(e, Contact) and self._touches(i) for i, e in enumerate(elements)]

    def _touches(self, index):
        """Return whether a contact is touched with no normal speed."""
        near = abs(self.system.elements[index].gap(self.q)) <= ZERO_GAP
        return near and sign_of_speed(self.rows[index], self.u) == 0

    def choices(self, index):
        """Return the states that an element may have here."""
        element = self.system.elements[index]
        is_friction = isinstance(element, Friction)
        if not is_friction and not self.touches[index]:
            return [State.OPEN]
        leaving = [] if is_friction else [State.OPEN]
        if not is_friction and (element.tangent is None or element.guided):
            return [State.CLOSED, *leaving]
        moves = sign_of_speed(self.along[index][0], self.u)
        if moves:
            return [State.FORWARD if moves > 0 else State.BACKWARD, *leaving]
        return [State.STICKS, State.FORWARD, State.BACKWARD, *leaving]

    def at_rest(self, index):
        """Return whether an element has no sliding speed here."""
        return self.along[index] is not None and not sign_of_speed(self.along[index][0], self.u)

    def slides(self, index):
        """Return whether something slides here."""
        return self.along[index] is not None and not self.at_rest(index)

    def rest_mode(self):
        """Return the mode in which everything is held, or None if the chain moves."""
        if max(abs(self.u[0]), abs(self.u[1])) > ZERO_SPEED or self._rank_of_holds() < 2:
            return None
        states = [self.choices(i)[0] for i in range(len(self.system.elements))]
        return Mode(tuple(states), rest=True)

    def _rank_of_holds(self):
        rows = [
            rows
            for i, element in enumerate(self.system.elements)
            if isinstance(element, Friction) or self.touches[i]
            for rows in self.rows_of_holds(i)
        ]
        return np.linalg.matrix_rank(np.array(rows), tol=1e-9) if rows else 0

    def rows_of_forces(self, index):
        """Return the rows of the forces of an element: one, or two for a rough contact."""
        element = self.system.elements[index]
        if isinstance(element, Contact) and element.tangent is not None:
            return [self.rows[index], self.along[index][0]]
        return [self.rows[index]]

    def rows_of_holds(self, index):
        """Return the rows along which an element can hold: one, or two for a rough contact."""
        element = self.system.elements[index]
        if isinstance(element, Contact) and element.tangent is not None and not element.guided:
            return [self.rows[index], self.along[index][0]]
        return [self.rows[index]]


def rest_margin(system, mode, t, q):
    """Return by how much of all forces the chain could be held better; negative if it is not held.

    By linear programming: the largest s such that forces exist that hold the chain and keep their
    laws with s to spare. A point of link 1, whose two rows are parallel, may wedge the link.
    """
    instant = Instant(system, t, q, (0.0, 0.0))
    rows, limits = [], []
    for i, element in enumerate(system.elements):
        if isinstance(element, Contact) and mode.states[i] is State.OPEN:
            continue
        first = len(rows)
        rows += instant.rows_of_forces(i)
        if isinstance(element, Friction):
            size = element.static / instant.force_size
            limits += [({first: 1.0}, size), ({first: -1.0}, size)]
            continue
        limits.append(({first: -1.0}, 0.0))
        if len(rows) == first + 2:
            mu = element.static
            limits += [({first + 1: sense, first: -mu}, 0.0) for sense in (1.0, -1.0)]
    r = np.array(system.smooth_forces(t, q, (0.0, 0.0))) / instant.force_size
    return _largest_margin(np.array(rows), limits, r)


def _largest_margin(rows, limits, r):
    """Return the largest s with Σ f row = −r and, for each limit, Σ c f + s ≤ size."""
    n = len(rows)
    A = np.zeros((len(limits), n + 1))
    for k, (coefficients, _) in enumerate(limits):
        A[k, n] = 1.0
        for j, c in coefficients.items():
            A[k, j] = c
    result = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=A,
        b_ub=[size for _, size in limits],
        A_eq=np.hstack([rows.T, np.zeros((2, 1))]),
        b_eq=-r,
        bounds=[(None, None)] * n + [(None, 1.0)],
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    return float(result.x[n]) if result.success else -1.0


def next_mode(system, t, q, u):
    """Return the mode in which a state goes on."""
    instant = Instant(system, t, q, u)
    rest = instant.rest_mode()
    if rest is not None and _rest_holds(system, rest, t, q):
        return rest
    found = []
    for states in product(*(instant.choices(i) for i in range(len(system.elements)))):
        motion = Motion(system, Mode(states), q)
        if motion.possible and not _leaves_something_out(instant, motion):
            solution = _admissible(instant, motion)
            if solution is not None and not _is_blocked(instant, motion):
                found.append((motion, solution))
    if not found:
        sliding = [i for i, near in enumerate(instant.touches) if near and instant.slides(i)]
        raise JudgeGivesUp("painleve" if sliding else "no mode")
    return _the_one(instant, found).mode


def _leaves_something_out(instant, motion):
    """Return whether something at rest is not held though it cannot move: held is the same."""
    elements = instant.system.elements
    return any(
        motion.leaves_out(i) and (instant.touches[i] or isinstance(elements[i], Friction))
        for i in range(len(elements))
    )


def _rest_holds(system, mode, t, q):
    """Return whether the chain is held at rest, now and in the next moment."""
    margin = rest_margin(system, mode, t, q)
    if abs(margin) > UNDECIDED or not system.depends_on_time:
        return margin >= -UNDECIDED
    for h in LOOK_AHEAD:
        margin = rest_margin(system, mode, t + h, q)
        if abs(margin) > 1e-12:
            return margin > 0
    return True


def conditions(instant, motion, solution):
    """Return the conditions on a mode's forces and accelerations, as (label, value, its size)."""
    du, lam, _ = solution
    found = []
    if motion.lead is not None:
        low, high = motion.bounds(instant.q)
        size = instant.force_size / np.hypot(*motion.lead_row_and_force(instant.q)[1])
        found.append((("low", motion.lead), lam - low, size))
        found.append((("high", motion.lead), high - lam, size))
    for i, state in enumerate(motion.mode.states):
        if state in SLIPS and instant.at_rest(i):
            row, drift = instant.along[i]
            value, label = SLIPS[state] * (dot(row, du) + drift), ("slips", i)
        elif state is State.OPEN and instant.touches[i]:
            row, drift = instant.rows[i], instant.drifts[i]
            value, label = dot(row, du) + drift, ("open", i)
        else:
            continue
        size = (1 + abs(row[0]) + abs(row[1])) * instant.acceleration_size + abs(drift)
        found.append((label, value, size))
    return found


def _admissible(instant, motion):
    """Return the solution of a mode that keeps the laws now and in the next moment, or None."""
    if motion.lead is not None:
        row, force = motion.lead_row_and_force(instant.q)
        G = dot(row, solve_mass(instant.M, force))
        if abs(G) <= 1e-12 * max(instant.M[0], instant.M[2]) / instant.M[0] / instant.M[2]:
            return None
    solution = motion.solve(instant.t, instant.q, instant.u)
    undecided = []
    for label, value, size in conditions(instant, motion, solution):
        if value < -UNDECIDED * size:
            return None
        if value <= UNDECIDED * size:
            undecided.append(label)
    if undecided and not _lasts(instant, motion, undecided):
        return None
    return solution


def _lasts(instant, motion, labels):
    """Return whether conditions that are zero to rounding become positive if a mode is followed."""
    for h in LOOK_AHEAD:
        q, u = followed(motion, instant.t, instant.q, instant.u, h)
        watched = motion.watched(instant.t + h, q, u)
        values = []
        for label in labels:
            if label[0] == "open":
                # The speed decides earlier than the gap.
                row = instant.system.elements[label[1]].direction.row(q)
                values.append((dot(row, u), 2e-15 * (1 + abs(u[0]) + abs(u[1]))))
            elif label in watched:
                values.append(watched[label])
        if any(value < -noise for value, noise in values):
            return False
        if all(value > noise for value, noise in values):
            return True
    return True


def followed(motion, t, q, u, h):
    """Return q and u after a time h (s) in a mode."""

    def rates(time, y):
        du, _, _ = motion.solve(time, y[:2], y[2:])
        return [y[2], y[3], du[0], du[1]]

    run = solve_ivp(
        rates, (t, t + h), [*q, *u], method="DOP853", rtol=1e-13, atol=1e-18, first_step=h / 2
    )
    y = run.y[:, -1].tolist()
    return tuple(y[:2]), tuple(y[2:])


def _is_blocked(instant, motion):
    """Return whether something starts to slip that its static limit can hold, all else the same."""
    return any(
        state in SLIPS and instant.at_rest(i) and _could_stick(instant, motion, i)
        for i, state in enumerate(motion.mode.states)
    )


def _could_stick(instant, motion, index):
    """Return whether an element's static limit can hold it while the others do as in a mode."""
    element, t, q, u = instant.system.elements[index], instant.t, instant.q, instant.u
    states = list(motion.mode.states)
    is_friction = isinstance(element, Friction)
    states[index] = State.STICKS if is_friction else State.OPEN
    if is_friction:
        states[index] = State.OPEN  # It gives no kinetic force; its row is added below.
    others = Motion(instant.system, Mode(tuple(states)), q)
    others.held = motion.held if is_friction else []
    others.lead = motion.lead if is_friction else None
    r = others.forces(t, q, u)
    held = [] if others.lead is None else [(*others.lead_row_and_force(q), others.lead)]
    held = [(row, force, instant.drifts[i]) for row, force, i in held]
    own = [(instant.rows[index], instant.rows[index], instant.drifts[index])]
    if not is_friction:
        row, drift = instant.along[index]
        own.append((row, row, drift))
    given = holding_forces(instant.M, r, held + own)
    if given is None:
        return False
    if is_friction:
        return abs(given[-1]) <= element.static * (1 - UNDECIDED)
    return given[0] > 0 and abs(given[1]) <= element.static * given[0] * (1 - UNDECIDED)


def holding_forces(M, r, holds):
    """Return the forces that keep rows (row, force, drift) from moving, or None if undetermined."""
    if len(holds) > 2:
        return None
    A = np.array([[dot(row, solve_mass(M, force)) for _, force, _ in holds] for row, _, _ in holds])
    b = [-drift - dot(row, solve_mass(M, r)) for row, _, drift in holds]
    size = np.abs(A).max()
    if size == 0 or abs(np.linalg.det(A / size)) < 1e-10:
        return None
    return np.linalg.solve(A, b)


def _the_one(instant, found):
    """Return the motion to take among admissible ones: they agree, or a rule decides."""
    if _agree(instant, found):
        return found[0][0]
    still = [
        item
        for item in found
        if not any(s in SLIPS and instant.at_rest(i) for i, s in enumerate(item[0].mode.states))
    ]
    if still and _agree(instant, still):
        return still[0][0]
    first = _most_exceeded(instant)
    if first is not None:
        chosen = [item for item in found if item[0].mode.states[first] in SLIPS]
        if chosen and _agree(instant, chosen):
            return chosen[0][0]
    raise JudgeGivesUp("ambiguous")


def _agree(instant, found):
    """Return whether all motions have the same accelerations."""
    size = instant.acceleration_size
    return all(
        max(abs(a[1][0][k] - b[1][0][k]) for k in (0, 1)) <= 1e-7 * size
        for a, b in combinations(found, 2)
    )


def _most_exceeded(instant):
    """Return the element whose limit is exceeded by the largest factor if all at rest are held.

    Return None where the forces are not determined, by more than two rows.
    """
    holds, owners = [], []
    r = instant.system.smooth_forces(instant.t, instant.q, instant.u)
    for i, element in enumerate(instant.system.elements):
        choices = instant.choices(i)
        if isinstance(element, Friction) and choices[0] in SLIPS:
            r = plus(r, -SLIPS[choices[0]] * element.kinetic, instant.rows[i])
        elif choices[0] is State.STICKS or choices[0] is State.CLOSED:
            rows = instant.rows_of_holds(i)
            drifts = [instant.drifts[i], instant.along[i] and instant.along[i][1]]
            for row, drift in zip(rows, drifts, strict=False):
                holds.append((row, row, drift))
                owners.append(i)
    given = holding_forces(instant.M, r, holds) if holds else None
    if given is None:
        return None
    factors = {}
    for i in set(owners):
        element, forces = instant.system.elements[i], given[[k == i for k in owners]]
        if isinstance(element, Friction):
            factors[i] = abs(forces[0]) / element.static
        elif len(forces) == 2:
            factors[i] = abs(forces[1]) / (element.static * forces[0]) if forces[0] > 0 else np.inf
    return max(factors, key=factors.get) if factors else None
