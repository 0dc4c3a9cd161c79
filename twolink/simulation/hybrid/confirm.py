"""Decision of conditions that are zero within round-off, by higher derivatives of the motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple

from twolink.arithmetic import Scalar, sqrt
from twolink.contact.elements import ContactElement
from twolink.contact.states import EventKind
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import Candidate, Orders, Problem, States
from twolink.simulation.hybrid.compliant_state import CompliantState
from twolink.simulation.hybrid.conditions import Condition, Law, value_of
from twolink.simulation.hybrid.dynamics import (
    LocalEquations,
    Solution,
    local_equations,
    push_of,
    solve,
)
from twolink.simulation.hybrid.jet import Jet, Recording, leading_term
from twolink.simulation.hybrid.mode import Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.pose import Pose

# Terms of the shortest series by which conditions are decided; its last term is left out.
_FEW = 3

# The events that a law keeps from coming at once, and the order at which its value appears in their
# event functions: an acceleration is the second derivative of a place.
_EVENTS = {
    Law.SEPARATES: (EventKind.HITS, 2),
    Law.PUSHES: (EventKind.LEAVES, 0),
    Law.WITHIN_LIMIT: (EventKind.BREAKS, 0),
    Law.ACCELERATES: (EventKind.STOPS, 1),
}


class Delay(NamedTuple):
    """The time (s) for which a contradicted mode may still hold, and the event that ends it."""

    time: float
    trigger: Trigger


class _Leading(NamedTuple):
    """The order and the sign of the derivative that decides a condition.

    A condition that a derivative contradicts may hold for a `delay` (s), if derivatives of lower
    order are positive by less than their round-off. The condition has a `value` as it is computed.
    """

    order: int
    sign: int
    delay: float = 0.0
    value: float = 0.0


class Derivatives:
    """The motions from a state as power series in time: its modes share the equations of motion.

    `delays` has the contradicted modes that may still hold for a time.
    """

    def __init__(self, problem: Problem) -> None:
        """Store a problem; nothing is computed before it is needed."""
        self._problem = problem
        self.delays: dict[States, Delay] = {}

    def confirmed(self, candidate: Candidate) -> Orders | None:
        """Return the orders at which event functions grow from zero in a mode, None if one falls.

        Forces and gaps without any derivative beyond round-off are `Zero`.
        Undecided conditions must hold immediately afterwards, in the motion of that mode.
        """
        found: dict[Trigger, int | Zero]
        found = {_trigger(c): _EVENTS[c.law][1] for c in candidate.decided}
        if not candidate.undecided:
            return found
        try:
            leading = self._decided(candidate)
        except (ZeroDivisionError, OverflowError, ValueError):
            # The motion is not analytic: its events decide.
            return found
        ended = [Delay(own.delay, _trigger(c)) for c, own in leading.items() if own.sign < 0]
        first = min(ended, key=lambda delay: delay.time, default=None)
        if first is not None and first.time > 0:
            self.delays[candidate.states] = first
        for condition, (order, sign, _, value) in leading.items():
            if sign < 0 or (sign == 0 and condition.law is Law.ACCELERATES):
                return None
            if sign > 0:
                found[_trigger(condition)] = _EVENTS[condition.law][1] + order
            elif condition.law in (Law.PUSHES, Law.WITHIN_LIMIT, Law.SEPARATES):
                noise, q = self._problem.noise, self._problem.state.q
                found[_trigger(condition)] = noise.zero(condition, q, candidate.solution.du, value)
        return found

    def _noise_of(self, condition: Condition, candidate: Candidate) -> float:
        return self._problem.noise.of(condition, candidate.solution.du)

    def _decided(self, candidate: Candidate) -> dict[Condition, _Leading]:
        """Return the derivative that decides each undecided condition, where there is one.

        The search ends at the first sign that contradicts the mode.
        """
        problem, start = self._problem, self._start
        problem.system.expanded.add_one()
        noise = {c: self._noise_of(c, candidate) for c in candidate.undecided}
        rate = 1 / problem.system.longest_step
        with start.branch():
            solution = solve(start.equations, problem.system.elements, candidate.states)
            values = {
                c: value_of(
                    problem.system, start.equations, c, solution.du, solution.forces[c.number]
                )
                for c in candidate.undecided
            }
            for length in range(2, tolerances.JET_ORDER + 2):
                start.extend(solution)
                if length < _FEW:
                    continue
                found = {c: _leading(value, noise[c], rate) for c, value in values.items()}
                signs = [own.sign for own in found.values()]
                if all(signs) or min(signs) < 0:
                    break
        return found

    @cached_property
    def _start(self) -> _Start:
        return _started(self._problem)


def _leading(value: Jet | Scalar, noise: float, rate: float) -> _Leading:
    """Return the leading derivative of a value that is known within its noise.

    The delay is the first root if one lower derivative is positive, and twice the largest of such
    roots, a bound on it (Fujiwara), if several are.
    """
    terms = value.terms[:-1] if isinstance(value, Jet) else (value,)
    order, sign = leading_term(terms, noise, rate)
    if sign >= 0:
        return _Leading(order, sign, value=float(terms[0]))
    roots = [
        float(-term / terms[order]) ** (1 / (order - k))
        for k, term in enumerate(terms[:order])
        if term > 0
    ]
    return _Leading(order, sign, max(roots, default=0.0) * (2 if len(roots) > 1 else 1))


def _trigger(condition: Condition) -> Trigger:
    return Trigger(_EVENTS[condition.law][0], condition.number, condition.sense)


class _Start(NamedTuple):
    """A state as jets: q, u and time, with the equations of motion that follow."""

    recording: Recording
    q: tuple[Jet, Jet]
    u: tuple[Jet, Jet]
    t: Jet
    equations: LocalEquations

    @contextmanager
    def branch(self) -> Iterator[None]:
        """Take back, afterwards, what is made and extended within."""
        try:
            with self.recording.branch():
                yield
        finally:
            for jet in (*self.q, *self.u, self.t):
                jet.forget()

    def extend(self, solution: Solution) -> None:
        """Compute one more coefficient of all jets: each follows from those before it."""
        k = len(self.t.terms)
        for q, u, du in zip(self.q, self.u, solution.du, strict=True):
            q.terms.append(u.terms[k - 1] / k)
            known = du.terms[k - 1] if isinstance(du, Jet) else du if k == 1 else 0 * du
            u.terms.append(known / k)
        self.t.terms.append((1 if k == 1 else 0) + 0 * self.t.terms[0])
        self.recording.extend()


def _started(problem: Problem) -> _Start:
    """Return the state of a problem, with the first coefficients of its jets."""
    system, state, recording = problem.system, problem.state, Recording()
    q1, q2, u1, u2, t = (Jet((x,), recording) for x in (*state.q, *state.u, state.t))
    q, u = (q1, q2), (u1, u2)
    pose = Pose(system.chain, system.formulation, q)
    active = [terms is not None for terms in problem.equations.terms]
    equations = local_equations(
        pose, system.effects, system.elements, u, t, active, _pushes(problem, pose, u, active)
    )
    return _Start(recording, q, u, t, equations)


def _pushes(problem: Problem, pose: Pose, u: tuple[Jet, Jet], active: Sequence[bool]) -> list[Any]:
    """Return the forces (N) of pressed surfaces as jets, 0 for other elements."""
    found: list[Any] = []
    for is_active, element, own in zip(
        active, problem.system.elements, problem.state.compliant, strict=True
    ):
        if own is None or not is_active:
            found.append(0)
            continue
        root = _root(problem, pose, element, own)
        found.append(push_of(pose, element, own.plastic, u, root))
    return found


def _root(
    problem: Problem, pose: Pose, element: ContactElement, own: CompliantState
) -> Jet | Scalar | None:
    """Return √depth (m^½) of a pressed surface as a jet that starts at the value of the state.

    √depth is a variable of its own: the depth that follows from q differs from its square by
    round-off, which the stiffness of a surface turns into forces that matter here. None stands for
    the depth of q, where √depth is no variable, or zero.
    """
    if not own.sqrt_depth or element.normal is None:
        return None
    place = element.normal.coordinate(problem.system.chain, pose.q)
    # A point in A does not move.
    moved = place - place.terms[0] if isinstance(place, Jet) else 0
    root: Jet | Scalar = sqrt(own.sqrt_depth * own.sqrt_depth - moved)
    return root
