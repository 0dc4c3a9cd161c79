"""The certificate of an arc: no event function falls before the arc's end.

On each step every event function is a polynomial. It is proven positive, or its first root is
isolated there. No event function is ever switched off: one that starts at zero, as a gap does after
an impact, is divided by its leading power of time.
"""

from __future__ import annotations

import itertools
import operator
import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

from twolink.contact.states import EventKind
from twolink.simulation.hybrid.bernstein import is_positive_until, margins_of, rounding_bound
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders
from twolink.simulation.hybrid.doubts import StepOfArc, doubt_of, near_to_zero, with_dip
from twolink.simulation.hybrid.event_functions import OF_FORCE
from twolink.simulation.hybrid.event_polynomials import EventPolynomials
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.polishing import horner, lowest
from twolink.simulation.hybrid.roots import Search, first_fall, spread_of_fall, with_rest
from twolink.simulation.hybrid.start_of_arc import StartOfArc
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.zeros import Zeros
from twolink.simulation.series import powers_of


class Finding(NamedTuple):
    """The first event on a block of steps: on which step, at which x in [0, 1] of it, and which.

    `trigger` is None if the clock reaches the end of the arc first. Where the event function is
    flat, round-off may move the event by the time `spread` (s).
    """

    place: int
    x: Any
    trigger: Trigger | None
    spread: float = 0.0


_HITS = EventKind.HITS

# A step after all of a block, and a place on it.
_NEVER = sys.maxsize, 0.0

# The number of the step of a suspect (below).
_STEP = operator.itemgetter(0)


class _Suspect(NamedTuple):
    """An event function that may be near to zero on a step: its number and its coefficients.

    `place` is the number of the step, and `bound` that on the error of the values. `bernstein` are
    the Bernstein coefficients in float64. It is `whole` if it was not divided by a power of time.
    If it is `proven` positive on the step, it cannot fall, and is searched for a near touch only.
    """

    place: int
    number: int
    polynomial: list[Any]
    bernstein: list[float]
    bound: float
    whole: bool
    proven: bool


class Certificate:
    """The event functions of one arc, as polynomials of its steps."""

    def __init__(
        self,
        system: HybridSystem,
        compiled: CompiledMode,
        mode: Mode,
        span: Any,
        orders: Orders = NO_ORDERS,
        state: HybridState | None = None,
    ) -> None:
        """Store the compiled mode and the time (s) after which the arc ends without an event.

        `orders` are those of event functions that, by the selection, grow from zero. With the
        `state` at the start a speed is known better, near a singular pose and on stiff surfaces.
        """
        self._system, self._compiled, self._mode, self._span = system, compiled, mode, span
        self._begins = 0.0 if state is None else float(state.t)
        self._triggers = compiled.layout.triggers
        self.functions = EventPolynomials(system, compiled, mode)
        # How near to zero event functions leave a doubt.
        near = system.near_to_zero.get(compiled)
        if near is None:
            near = tuple(near_to_zero(system, trigger) for trigger in self._triggers)
            system.near_to_zero[compiled] = near
        self._near, self._nearest = near, max(near, default=0.0)
        self._start = StartOfArc(system, compiled, mode, orders, state)
        self._zeros = Zeros(compiled, state)
        self._tails: dict[int, float] = {}
        # Gaps at the start, below round-off of a place, that division by time omits.
        self._omitted: dict[int, Any] = {}

    def first_event(self, block: Block, at_start: bool) -> tuple[Finding | None, tuple[Doubt, ...]]:
        """Return the first event on a block of steps, and the touches before it.

        `at_start` says that the block begins with the first step of the arc.
        """
        doubts: list[Doubt] = []
        suspects = self._suspects(block, at_start) if self._triggers else ()
        earliest = self._earliest(block, suspects, doubts) if suspects else None
        earliest = self._first_of_zeros(earliest)
        if self._compiled.clock is not None:
            clock, whole = self._compiled.clock, self._system.number(1)
            earliest = _end_by_clock(block, clock, self._span, earliest, whole) or earliest
        return earliest, tuple(doubts)

    def departed(self, found: Finding | None) -> frozenset[int]:
        """Return the contacts without a force that have left by an event, or so far."""
        return self._zeros.departed(*(_NEVER if found is None else (found.place, found.x)))

    def lowest(self, found: Finding | None) -> dict[Trigger, float]:
        """Return bounds from below on forces that are zero at the start, until an event or so far.

        They hold (N or N m) as long as the forces are zero.
        """
        every = self._zeros.lowest(sys.maxsize if found is None else found.place + 1)
        lowest = {self._triggers[number]: value for number, value in every.items() if value < 0}
        return {
            trigger: value / self._system.scales.force(trigger.index)
            for trigger, value in lowest.items()
            if trigger.kind in OF_FORCE and self._is_law(trigger)
        }

    def _is_law(self, trigger: Trigger) -> bool:
        """Return whether an event function of a force is that of a law, not of a pressed depth."""
        return trigger.kind is EventKind.BREAKS or self._system.elements[trigger.index].rigid

    def _first_of_zeros(self, earliest: Finding | None) -> Finding | None:
        """Return the first event, which may be that of a function that falls from zero."""
        fallen = self._zeros.fallen
        if fallen is None:
            return earliest
        if earliest is not None and (earliest.place, earliest.x) < (fallen.place, fallen.x):
            return earliest
        return Finding(fallen.place, fallen.x, self._triggers[fallen.number])

    def _suspects(self, block: Block, at_start: bool) -> list[_Suspect]:
        """Return the event functions that may be near to zero, in the order of the steps.

        Those that are proven positive and rise at first are left out: `lowest` finds no minimum of
        such a function.
        """
        every = self.functions.on(block)
        if at_start:
            self._deflate(every, block)
        _, functions, length = every.shape
        rounding = self._system.rounding
        margins, bernstein, bounds = margins_of(every.reshape(-1, length), rounding)
        zeros = self._zeros.steps(every)
        # The least margins by which event functions are certified.
        tails = self._tails if at_start else {}
        most = max(self._nearest, *tails.values()) if tails else self._nearest
        # In longer precisions the bounds in float64 do not suffice.
        known = every.dtype == bernstein.dtype
        found: list[_Suspect] = []
        for row, margin in enumerate(margins.tolist()):
            if margin > most:
                continue
            place, number = divmod(row, functions)
            tail = tails.get(number) if place == 0 else None
            least = tail if tail is not None else self._near[number]
            proven = margin > 0 and tail is None
            if proven and not every[place, number, 1] < 0:
                continue
            if not margin > least and place >= zeros.get(number, 0):
                polynomial = every[place, number].tolist()
                bound = float(bounds[row]) if known else rounding_bound(polynomial, rounding)
                found.append(
                    _Suspect(
                        place,
                        number,
                        polynomial,
                        bernstein[row].tolist(),
                        bound + (tail or 0.0),
                        tail is None,
                        proven,
                    )
                )
        return found

    def _earliest(
        self, block: Block, suspects: Sequence[_Suspect], doubts: list[Doubt]
    ) -> Finding | None:
        """Return the first event among the event functions that are not certified."""
        for on_step in _by_step(suspects):
            for suspect in on_step:
                if suspect.polynomial[0] < 0:
                    # The event function falls at the start of the step.
                    at_start = 0 * block.lengths[suspect.place]
                    return Finding(suspect.place, at_start, self._triggers[suspect.number])
            found = self._first_on_step(block, on_step, doubts)
            if found is not None:
                return found
        return None

    def _first_on_step(
        self, block: Block, suspects: Sequence[_Suspect], doubts: list[Doubt]
    ) -> Finding | None:
        """Return the first event among event functions that are positive at the start of a step.

        The touches before it are added to the doubts.
        """
        earliest: Finding | None = None
        first: _Suspect | None = None
        touches: list[tuple[float, Doubt]] = []
        for suspect in sorted(suspects, key=_guess) if len(suspects) > 1 else suspects:
            place, number, polynomial, *_ = suspect
            trigger = self._triggers[number]
            least = self._near[number]
            if earliest is not None and is_positive_until(
                polynomial, float(earliest.x), suspect.bound, least
            ):
                continue
            search, limit = _searched(suspect, least)
            if not suspect.whole and number in self._omitted:
                search = with_rest(search, polynomial, self._omitted[number])
            fall = search.fall
            shallow = suspect.whole and suspect.bernstein[-1] > -least
            if fall is not None and search.touch is None and shallow:
                search, limit = with_dip(search, polynomial, least, limit)
            if search.touch is not None or search.unsure:
                doubt = doubt_of(
                    self._on(block, place), trigger, polynomial, search, limit, suspect.bound
                )
                if doubt is not None:
                    touch = search.touch or 0.0
                    touches.append((touch if fall is None else min(touch, float(fall)), doubt))
            if fall is None:
                continue
            if earliest is None or first is None or (fall, number) < (earliest.x, first.number):
                earliest, first = Finding(place, fall, trigger), suspect
        until = 1.0 if earliest is None else float(earliest.x)
        doubts += [doubt for touch, doubt in touches if touch <= until]
        if earliest is None or first is None:
            return earliest
        # The spread of an event in double precision is measured by a longer one.
        exact = self._system.precision == "double"
        return earliest if exact else self._with_spread(block, earliest, first)

    def _with_spread(self, block: Block, found: Finding, suspect: _Suspect) -> Finding:
        """Return an event with the time by which round-off may move it.

        That of an event in long doubles is measured by a longer run, unless it is very flat.
        """
        power = 1 / 2 if self._system.precision == "quadruple" else 1 / 3
        steep = self._system.rounding**power
        share = spread_of_fall(suspect.polynomial, found.x, suspect.bound, steep)
        if not share:
            return found
        step, x = self._on(block, found.place), float(found.x)
        return found._replace(spread=step.time(x)[0] - step.time(max(x - share, 0.0))[0])

    def _on(self, block: Block, place: int) -> StepOfArc:
        """Return a step of the arc."""
        return StepOfArc(self._system, self._mode, self._compiled.clock, self._begins, block, place)

    def _deflate(self, every: Any, block: Block) -> None:
        """Divide event functions that start at zero by time, in place.

        The event function of jamming is monitored from either sign.
        """
        on_first_step = every[0].tolist()
        for number, trigger in enumerate(self._triggers):
            polynomial = on_first_step[number]
            small = self._system.scales.places_of_rounding[trigger.index]
            if trigger.kind is _HITS and polynomial[0] > small:
                continue
            if trigger.kind is EventKind.JAMS and polynomial[0] < 0:
                every[:, number] = -every[:, number]
                self.functions.turn(number)
                polynomial = [-c for c in polynomial]
            order = self._start.order(trigger, polynomial, block)
            if order is None:
                self._zeros.add(number, self._start.zero_size(trigger, polynomial, block))
            elif order:
                if trigger.kind is _HITS and order == 1 and polynomial[0] > 0:
                    # A gap is a variable of its own, known relative to its size.
                    self._omitted[number] = polynomial[0]
                row = every[0, number]
                row[:-order] = row[order:]
                row[-order:] = 0
                # The last terms estimate the truncation error of the series.
                self._tails[number] = float(abs(polynomial[-1])) + float(abs(polynomial[-2]))


def _end_by_clock(
    block: Block, clock: int, span: Any, earliest: Finding | None, whole: Any
) -> Finding | None:
    """Return where the clock reaches the end of the arc before the earliest event, or None.

    The arc ends at `span` (s); `whole` is 1. The clock rises until a point leaves its surface, and
    falls beyond: only the part of the step before the event counts.
    """
    place = len(block.lengths) - 1 if earliest is None else earliest.place
    until = whole if earliest is None else earliest.x
    row = block.coefficients[place, clock]
    polynomial = -row * powers_of(block.lengths[place : place + 1], len(row))
    polynomial[0] = polynomial[0] + span
    if horner(polynomial.tolist(), until) > 0:
        return None
    end = first_fall(polynomial, 0.0).fall
    return Finding(place, until if end is None or end > until else end, None)


def _by_step(suspects: Sequence[_Suspect]) -> Sequence[Sequence[_Suspect]]:
    """Return the event functions of each step together, in the order of the steps."""
    if len(suspects) < 2:
        return [suspects]
    return [tuple(group) for _, group in itertools.groupby(suspects, _STEP)]


def _guess(suspect: _Suspect) -> int:
    """Return a number that is the smaller, the earlier an event function seems to fall."""
    bernstein = suspect.bernstein
    if not suspect.proven:
        for place, value in enumerate(bernstein):
            if value <= 0:
                return place
    return len(bernstein)


def _searched(suspect: _Suspect, near: float) -> tuple[Search, float]:
    """Return the first fall and touch of an event function, and the bound by which it touches.

    One that comes as `near` to zero, if that is not zero, touches.
    """
    polynomial, bound = suspect.polynomial, suspect.bound
    if suspect.proven:
        search = Search()
    else:
        known = suspect.bernstein if isinstance(polynomial[0], float) else None
        search = first_fall(polynomial, bound, known)
    if search.fall is None and search.touch is None and near:
        return search._replace(touch=lowest(polynomial, near)), near
    return search, bound
