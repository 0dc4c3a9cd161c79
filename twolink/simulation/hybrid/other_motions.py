"""Motions beside a mode: whether the motions of modes that the laws admit differ."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Mapping

from twolink.arithmetic import Pair
from twolink.contact.states import ContactState, EventKind
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.complementarity import Candidate, Orders, Problem, States, coincide
from twolink.simulation.hybrid.constraint import cramer
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.state import put
from twolink.simulation.hybrid.system import HybridSystem

# The events of contacts that open, and of elements that begin to slide: those have left the rest.
_DEPARTS = (EventKind.HITS, EventKind.STOPS)


@functools.lru_cache(maxsize=256)
def pairs_in_one_place(system: HybridSystem, *, alike: bool) -> tuple[tuple[int, int], ...]:
    """Return the pairs of contacts in one place whose friction is alike, or is not."""
    elements = system.elements
    return tuple(
        (first, other)
        for first, other in itertools.combinations(range(len(elements)), 2)
        if coincide(elements[first], elements[other], system.scene_chain)
        and (elements[first].limits(1) == elements[other].limits(1)) is alike
    )


def accelerates(problem: Problem, du: Pair) -> bool:
    """Return whether a link has an acceleration (rad/s²) beyond round-off."""
    return any(
        abs(float(own)) > problem.noise.along(row, du)
        for own, row in zip(du, ((1, 0), (0, 1)), strict=True)
    )


def departs(orders: Orders) -> bool:
    """Return whether contacts open, or elements begin to slide, in a mode with these orders."""
    return any(each.kind in _DEPARTS for each in orders)


def departures(
    problem: Problem, found: list[Candidate], orders: Mapping[States, Orders]
) -> tuple[States, ...]:
    """Return the modes in which the chain leaves its rest, at once or by a higher derivative.

    A contact that may open has all derivatives of its gap at zero where no load moves the chain.
    """
    at_once = other_motions(problem, found, (0.0, 0.0))
    moving = {
        states: {each: order for each, order in known.items() if not isinstance(order, Zero)}
        for states, known in orders.items()
    }
    return tuple(c.states for c in found if c.states in at_once or departs(moving[c.states]))


def other_motions(problem: Problem, found: list[Candidate], du: Pair) -> tuple[States, ...]:
    """Return the modes whose acceleration differs from du (rad/s²) by more than round-off."""
    free = cramer(problem.equations.M, problem.equations.r, problem.equations.det)
    size = max(abs(float(x)) for x in (*du, *free))
    return tuple(
        c.states
        for c in found
        if any(
            abs(float(x) - float(y)) > tolerances.SAME_MOTION * size
            for x, y in zip(c.solution.du, du, strict=True)
        )
    )


def other_slides(problem: Problem, states: States) -> Iterator[States]:
    """Yield the modes in which another contact in one place has the force of one that slides.

    Of contacts with different friction the laws do not determine which of them has the force.
    """
    system, touching = problem.system, problem.state.touching
    for pair in pairs_in_one_place(system, alike=False):
        for own, other in (pair, pair[::-1]):
            if states[own].slips and other in touching and states[other] is ContactState.OPEN:
                yield put(put(states, own, ContactState.OPEN), other, states[own])
