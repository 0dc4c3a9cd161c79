"""A proven run: heyoka's polynomials, the frames of their errors, and the impacts between them.

The initial errors of a step are the final errors of the step before plus the jump between both
polynomials, computed in balls. A step in which a contact closes ends at the start of a short
bracket of the impact (`twolink.accuracy.gap_bound`), and the motion after it is followed back to
there (`twolink.accuracy.enclosed_impact`), where the next step begins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from threading import RLock
from typing import Any, NamedTuple

from twolink.accuracy.certain import Certain, UndecidedError
from twolink.accuracy.defect_bound import COARSE_BITS, DISC, Passage, Step, TubeLeftError
from twolink.accuracy.enclosed_impact import EnclosedImpact, rebound
from twolink.accuracy.frames import Frame
from twolink.accuracy.gap_bound import Bracket, GapBound, bracket
from twolink.accuracy.interval import Interval, interval
from twolink.accuracy.multiprecision import PreciseMotion, precise_motion
from twolink.contact.elements import RigidContact
from twolink.effects import contact_elements
from twolink.errors import SimulationError
from twolink.optional import flint
from twolink.scene import Scene

# Largest width for which a bound is proven (rad, rad/s).
TUBE = 2.0**-24

# The step after an impact is at most as long as the last flight, times this.
_LONGER = 4

# Digits of each step beyond those of the run.
_GUARD = 8

# python-flint has one precision of balls and one length of series for all threads, so proofs in
# several threads take turns.
ONE_AT_A_TIME = RLock()

# Bits of balls beyond those of the approximate motion, so that the proof adds little error.
_MORE_BITS = 64

State = tuple[Interval, Interval, Interval, Interval]


class Ended(NamedTuple):
    """A time (s) at which a proof ends before the run, and the reason.

    `undecided` is whether more digits may prove more.
    """

    time: float
    reason: str
    undecided: bool


@dataclass(frozen=True)
class ProvenRun:
    """States at the first of the requested times, impacts, and the reason of an early end.

    The approximate motion has precision `bits` and consists of `steps` of order `order`.
    """

    states: tuple[State, ...]
    impacts: tuple[EnclosedImpact, ...]
    ended: Ended | None
    bits: int
    order: int
    steps: int


class _Now(NamedTuple):
    """The end of a step: its time (s), q1, q2, u1, u2, the frame of errors, and known impacts.

    `last` (s) is near the time of the last impact, and `flight` (s) the time between the last two.
    `rebounds` is whether the step ended with an impact.
    """

    time: Any
    state: list[Any]
    frame: Frame
    last: Any
    impacts: tuple[EnclosedImpact, ...] = ()
    flight: float = math.inf
    rebounds: bool = False


@dataclass(frozen=True)
class _Course:
    """The motion to prove, and the constants of a run.

    Polynomials have `terms` coefficients, and bounds on errors `coarse_bits`. A run ends at flights
    that are shorter than `least` (s).
    """

    flint: Any
    scene: Scene
    chain: Any
    contacts: tuple[RigidContact, ...]
    motion: PreciseMotion
    terms: int
    least: float
    coarse_bits: int

    def advanced(self, now: _Now, target: float) -> tuple[_Now, bool]:
        """Return the end of the next step towards a time (s), and whether it is that time."""
        library, tube = self.flint, self.flint.arb(TUBE)
        longest = self.motion.longest_step
        if now.rebounds and now.flight < math.inf:
            longest = min(longest, self.motion.number(_LONGER * now.flight))
        q, length, arrived = approximation(library, self.motion, target, now.time, longest)
        step = Step(
            library,
            self.chain,
            self.scene.effects,
            q,
            now.time,
            length,
            library.ctx.prec,
            self.terms,
            self.coarse_bits,
        )
        jump = [abs(x - y).upper() for x, y in zip(step.state(0), now.state, strict=True)]
        frame = now.frame.moved(jump)
        passage = step.after(frame, tube)
        closing = self._first_closing(step, passage, frame)
        if closing is not None:
            return self._struck(now, step, *closing), False
        time = library.arb(target) if arrived else now.time + length
        state = step.state(length)
        return now._replace(time=time, state=state, frame=passage.frame, rebounds=False), arrived

    def accumulated(self, now: _Now) -> float:
        """Return the share of a run that ends where bounces accumulate, 0 if they do not."""
        if not 0 < now.flight < 1:
            return 0.0
        return min(1.0, math.log(now.flight) / math.log(self.least))

    def _first_closing(
        self, step: Step, passage: Passage, before: Frame
    ) -> tuple[RigidContact, Bracket] | None:
        """Return the contact that closes first in a step, with its bracket, or None."""
        bounds = [GapBound.of(step, contact, before, passage.errors) for contact in self.contacts]
        closing: tuple[GapBound, Bracket] | None = None
        until = step.length
        for bound in bounds:
            crossing = bound.first_crossing(until, step.bits)
            if crossing is not None:
                found = bracket(step, bound, crossing, before, self.flint.arb(TUBE))
                closing, until = (bound, found), found.end
        if closing is None:
            return None
        first, found = closing
        for other in bounds:
            if other is not first and other.first_crossing(found.end, step.bits) is not None:
                raise UndecidedError(
                    f"impacts on {first.contact.name} and {other.contact.name} may coincide"
                )
        return first.contact, found

    def _struck(self, now: _Now, step: Step, contact: RigidContact, short: Bracket) -> _Now:
        """Return the motion after an impact, at the middle of its bracket."""
        found = rebound(step, contact, short)
        # The bracket ends within the step, and so before the next time that is asked for.
        time = now.time + short.middle
        impacts = (*now.impacts, found.impact)
        flight = float((time - now.last).mid()) if now.impacts else math.inf
        after = _Now(time, found.state, found.frame, time, impacts, flight, True)
        if not found.opens:
            raise _EndsError(
                after, f"{contact.name} may stay closed after the impact", contact.restitution > 0
            )
        if flight < self.least:
            raise _EndsError(
                after,
                f"its bounces on {contact.name} follow each other within {self.least:.0e} s and "
                "accumulate",
            )
        places = math.ceil(self.motion.bits * math.log10(2))
        self.motion.restart(
            time.str(places, radius=False), [x.str(places, radius=False) for x in found.state]
        )
        return after


class _EndsError(Exception):
    """The proof ends at an impact; `undecided` is whether more digits may prove more."""

    def __init__(self, now: _Now, reason: str, undecided: bool = False) -> None:
        super().__init__(reason)
        self.now, self.undecided = now, undecided


def proven_run(
    scene: Scene,
    asked: tuple[float, ...],
    digits: int,
    least: float,
    report: Callable[[float], None],
) -> ProvenRun:
    """Return the states at times (s) around an approximate motion of a number of digits.

    It ends where two impacts follow each other within a time `least` (s).
    """
    library = flint()
    motion = precise_motion(scene, "momenta", digits)
    terms = max(math.ceil((digits + _GUARD) / math.log10(DISC)), motion.integrator.order + 2)
    steps, states, ended = 0, [], None
    with balls(library, motion.bits + _MORE_BITS, terms):
        arb = library.arb
        chain = scene.moving_chain.convert(arb)
        # Unit normals and bounds are balls too: rounded ones would be those of another surface.
        contacts: Any = contact_elements(scene.effects, chain)
        # Errors along a gap are as much smaller than others as the last flights are short.
        coarse = COARSE_BITS - (math.floor(math.log2(least)) if contacts else 0)
        course = _Course(library, scene, chain, contacts, motion, terms, least, coarse)
        start = [arb(x) for x in (*scene.q, *scene.u)]
        _check_start(chain, contacts, start)
        now = _Now(arb(0), start, Frame.around(library, [arb(0)] * 4), arb(0))
        try:
            for target in asked:
                arrived = target == 0
                while not arrived:
                    now, arrived = course.advanced(now, target)
                    steps += 1
                    # A run ends at its last time, or where bounces accumulate.
                    left = 1 - float(now.time.mid()) / asked[-1]
                    report(1 - left * (1 - course.accumulated(now)))
                states.append(tuple(map(interval, now.state, now.frame.bounds())))
        except _EndsError as end:
            now = end.now
            ended = Ended(float(now.time.mid()), str(end), end.undecided)
        except (UndecidedError, TubeLeftError) as doubt:
            ended = Ended(float(now.time.mid()), str(doubt), True)
    found: Any = tuple(states)
    return ProvenRun(found, now.impacts, ended, motion.bits, motion.integrator.order, steps)


def _check_start(chain: Any, contacts: tuple[RigidContact, ...], start: list[Any]) -> None:
    """Raise `SimulationError` unless all contacts are open in a state of exact balls."""
    for contact in contacts:
        gap = contact.normal.coordinate(chain, (Certain(start[0]), Certain(start[1])))
        if not (gap - contact.bound).ball > 0:
            raise SimulationError(
                "the scene of a rigorous enclosure must start away from all contacts; "
                f"{contact.name} is closed"
            )


def approximation(
    library: Any, motion: PreciseMotion, target: float, now: Any, longest: Any
) -> tuple[tuple[list[Any], list[Any]], Any, bool]:
    """Take a step towards a time (s); return q̂1, q̂2, its length, and whether it ends there.

    The step is at most `longest` (s).
    """
    integrator, arb = motion.integrator, library.arb
    left = motion.number(target) - integrator.time
    last = left <= longest
    length = motion.step(left if last else longest)
    arrived = bool(last and length == left)
    # Rounding of decimals is harmless: the polynomial is defined by the rounded numbers.
    q1, q2 = ([arb(str(c)).mid() for c in row] for row in integrator.tc[:2])
    return (q1, q2), (arb(target) - now if arrived else arb(str(length)).mid()), arrived


@contextmanager
def balls(library: Any, bits: int, terms: int) -> Iterator[None]:
    """Set the bits of balls and the terms of series within the block, then restore them."""
    with ONE_AT_A_TIME, library.ctx.workprec(bits):
        cap = library.ctx.cap
        library.ctx.cap = terms
        try:
            yield
        finally:
            library.ctx.cap = cap
