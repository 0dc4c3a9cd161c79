"""The trial of each conceivable mode by the laws: those that violate none are the candidates."""

from __future__ import annotations

from collections.abc import Iterator

from twolink.arithmetic import Scalar
from twolink.contact.elements import NO_FORCES, ContactForces
from twolink.contact.states import ContactState
from twolink.simulation.hybrid.complementarity import (
    Candidate,
    Conceivable,
    Problem,
    States,
    conceivable,
    is_independent,
    is_solvable,
)
from twolink.simulation.hybrid.conditions import Condition, Law, value_of
from twolink.simulation.hybrid.dynamics import Share, accelerated, share_of, solve


class Trials:
    """The modes of a problem, each solved until a condition is violated.

    The shares of the elements in the equations are computed once for each of their states, and the
    forces of an element once a condition asks for them. A mode is solved once, although it may be
    conceivable in several passes.
    """

    def __init__(self, problem: Problem) -> None:
        """Compute the shares of the elements in all their states."""
        self._problem = problem
        elements, terms = problem.system.elements, problem.equations.terms
        self._shares = [
            [share_of(element, state, own) for state in options]
            for element, own, options in zip(elements, terms, problem.options, strict=True)
        ]
        self._independent: dict[tuple[tuple[int, ContactState], ...], bool] = {}
        self._known: dict[States, Candidate | None] = {}

    @property
    def count(self) -> int:
        """The number of modes that were solved so far."""
        return len(self._known)

    def candidates(
        self, with_pressed: bool, sticking_first: bool = True, *, beginning: bool = True
    ) -> Iterator[Candidate]:
        """Yield the modes that violate no law: those with or without saturated friction.

        If sticking comes first, no element begins to slide that could stick (rule 1 of selection).
        Without `beginning` no element begins to slide at all.
        """
        for mode in conceivable(self._problem, with_pressed):
            if mode.begins and not beginning:
                continue
            if mode.states not in self._known:
                self._known[mode.states] = self._tried(mode)
            candidate = self._known[mode.states]
            if candidate is not None and not (sticking_first and self._could_stick(mode.states)):
                yield candidate

    def _is_independent(self, mode: Conceivable, shares: list[Share]) -> bool:
        """Return whether the constraints of a mode are independent; others may have the same."""
        found = self._independent.get(mode.bound)
        if found is None:
            found = self._independent[mode.bound] = is_independent(self._problem, shares)
        return found

    def _tried(self, mode: Conceivable) -> Candidate | None:
        """Return a mode as a candidate, or None at the first condition that it violates."""
        problem = self._problem
        shares = [own[place] for own, place in zip(self._shares, mode.places, strict=True)]
        if not self._is_independent(mode, shares):
            return None
        system, equations, noise = problem.system, problem.equations, problem.noise
        du, multipliers = accelerated(equations, shares)
        values: list[float] = []
        forces, owner = NO_FORCES, -1
        for condition in mode.conditions:
            # The conditions of one element follow each other.
            if condition.number != owner:
                owner = condition.number
                forces = self._forces(mode, owner, multipliers)
            value = float(value_of(system, equations, condition, du, forces))
            # The noise is not negative, and takes longer than the value.
            if value < 0 and value < -noise.of(condition, du):
                return None
            values.append(value)
        decided: list[Condition] = []
        unsure: list[Condition] = []
        for condition, value in zip(mode.conditions, values, strict=True):
            (decided if value > noise.of(condition, du) else unsure).append(condition)
        solution = solve(equations, system.elements, mode.states)
        return Candidate(mode.states, solution, tuple(decided), tuple(unsure))

    def _forces(
        self, mode: Conceivable, index: int, multipliers: tuple[Scalar, ...]
    ) -> ContactForces:
        """Return the forces of one element in a mode."""
        terms = self._problem.equations.terms[index]
        assert terms is not None
        own = multipliers[mode.firsts[index] : mode.firsts[index + 1]]
        return self._problem.system.elements[index].forces(mode.states[index], terms, own)

    def _could_stick(self, states: States) -> bool:
        """Return whether an element that begins to slide could stick instead."""
        problem, elements = self._problem, self._problem.system.elements
        for index, state in enumerate(states):
            options = problem.options[index]
            begins = state.slips and not problem.directions[index] and len(options) > 1
            if not (begins and ContactState.STICKS in options and elements[index].hysteretic):
                continue
            instead = (*states[:index], ContactState.STICKS, *states[index + 1 :])
            if not is_solvable(problem, instead):
                continue
            du, every = solve(problem.equations, elements, instead)
            limits = [Condition(Law.WITHIN_LIMIT, index, sense) for sense in (1, -1)]
            margin = min(
                float(value_of(problem.system, problem.equations, limit, du, every[index]))
                for limit in limits
            )
            if margin > problem.noise.of(limits[0], du):
                return True
        return False
