"""The course of a motion from mode to mode.

heyoka finds the time at which a mode ends, to rounding of the precision; there what came to rest
is set to rest exactly, what met an obstacle is struck, and the next mode takes over.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from time import perf_counter
from typing import Any

from twolink import kane, lagrange
from twolink.contact.elements import CompliantContact, RigidContact
from twolink.effects import breaks, effects_during
from twolink.errors import SimulationError
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.compiled_mode import CompiledMode, Segment, compiled_mode
from twolink.simulation.following import Following
from twolink.simulation.impact_log import impact_log
from twolink.simulation.mode import ContactState, Impact, Mode
from twolink.simulation.situation import Situation
from twolink.simulation.smooth.taylor import number_type, rounding
from twolink.simulation.striking import Strike
from twolink.simulation.watching import Kind, Watch

# Modes that follow each other without time passing: more would go on for ever.
_MOST_AT_ONCE = 8

# The moment for which what has just begun to move is not watched, in longest steps.
_UNWATCHED = 1e-5

# A press is followed for so long (s) at a time. heyoka's steps are as good as the largest of all
# that is computed beside them, and the time that is left is computed too.
_LONGEST_PRESS = 1.0


class Course:
    """A motion on its way: where it stands, in which mode, and what it has left behind."""

    def __init__(
        self,
        scene: Scene,
        times: Any,
        formulation: str,
        precision: str,
        order: int | None,
        cap: float,
    ) -> None:
        """Stand at the start of a scene, with steps of at most `cap` (s) to take."""
        kind = number_type(precision)
        self._scene, self._precision, self._kind = scene, precision, kind
        self._formulation, self._order_asked = formulation, order
        self._equipped = scene.equipped
        # Those of the effects that act now, by the kind of mode, and by what springs back.
        self._compiled: dict[tuple[Mode, frozenset[int]], CompiledMode] = {}
        self._breaks = [kind(t) for t in breaks(scene.effects) if t > 0]
        self._effects = effects_during(scene.effects, 0.0)
        self.following = Following(times, precision, cap)
        self._here = Situation(
            self._equipped.convert(kind),
            kane if formulation == "kane" else lagrange,
            self._effects,
            ((kind(scene.q[0]), kind(scene.q[1])), (kind(scene.u[0]), kind(scene.u[1]))),
            precision,
            kind,
        )
        self._shortest = cap * math.sqrt(rounding(precision))
        # For so long (s) what has just left zero is not watched.
        self._moment = kind(cap * _UNWATCHED)
        # When the mode is said to begin: after bounces too low to be seen, a little later.
        self._since = kind(0)
        # Until when the motion is followed in one go: to see the end of a short flight.
        self._horizon = kind(0)
        self._guards: dict[Watch, Any] = {}
        self._at_once = 0
        self.segments: list[Segment] = []
        self.strikes: list[Strike] = []
        self.notes: list[str] = []
        self.operations = 0
        self.compile_seconds = self.run_seconds = 0.0
        self._mode = self._here.free_mode
        self._strike()

    def _take_up_effects(self, t: float) -> None:
        """Let those effects act that do so from a time (s) on."""
        self._effects = effects_during(self._scene.effects, t)
        self._here.take_up(self._effects)
        self._compiled = {}

    @property
    def now(self) -> float:
        """Where the motion stands (s)."""
        return float(self._here.now)

    def log(self) -> tuple[Impact, ...]:
        """Return the log of the impacts so far."""
        return impact_log(self._here.modes.chain, self.strikes, self._precision)

    @property
    def done(self) -> bool:
        """Whether the last time is reached."""
        return bool(self._here.now >= self.following.end)

    def advance(self) -> None:
        """Follow the motion to the end of its mode, or to the last time."""
        here = self._here
        here.check_outside(self._mode)
        self._guards = {watch: t for watch, t in self._guards.items() if t > here.now}
        until = min([self.following.end, *self._guards.values(), *self._breaks[:1]])
        if here.now < self._horizon:
            until = min(until, self._horizon)
        roots, sunk = here.cushions.roots, here.cushions.sunk
        back = here.cushions.spring_back(rounding(self._precision))
        if back < math.inf:
            until = min(until, here.now + self._kind(back))
        if roots:
            until = min(until, here.now + _LONGEST_PRESS)
        start = here.now
        begun = perf_counter()
        resting = {Watch(Kind.HITS, index) for index in here.touched}
        unwatched = frozenset({*self._guards, *resting})
        compiled = self._compile()
        # Where each of the variables beside q and u is kept.
        kept = [(here.apart, index) for index in compiled.free.gaps]
        kept += [(sunk, index) for index in compiled.free.relaxing]
        kept += [(roots, index) for index in sorted(roots)]
        state = (*here.q, *here.u, *(place[index] for place, index in kept))
        if roots:
            state = (*state, self._kind(0))
        since = max(start, self._since)
        segment = Segment(
            self._mode, self._effects, start, until, state, unwatched, since, sunk=self._sunk
        )
        integrator = compiled.set_to(segment)
        self.compile_seconds += perf_counter() - begun
        begun = perf_counter()
        self.operations = max(self.operations, compiled.operations)
        if compiled.rooted:
            outcome, segment = self.following.in_root_time(compiled, segment)
            here.now = segment.end
        else:
            outcome = self.following.in_time(integrator, start, until)
            here.now = self._kind(integrator.time)
        self.run_seconds += perf_counter() - begun
        # As Python's floats, where that is what they are: with NumPy's all takes much longer.
        q1, q2, u1, u2, *others = integrator.state.tolist()
        here.q, here.u = (q1, q2), (u1, u2)
        for (place, index), value in zip(kept, others, strict=False):
            place[index] = value
        self.segments.append(segment._replace(end=here.now))
        if outcome != heyoka().taylor_outcome.time_limit:
            self._change_mode(outcome, compiled.watches, start)
            self.following.correct(here.now, (*here.q, *here.u))
        elif self._breaks and here.now >= self._breaks[0]:
            self._take_up_effects(float(self._breaks.pop(0)))
            here.settle(self._mode)
            self._enter({})

    def _compile(self) -> CompiledMode:
        """Return the integrator of the mode."""
        kind, sunk = self._mode.kind, self._sunk
        if (kind, sunk) not in self._compiled:
            self._compiled[kind, sunk] = compiled_mode(
                self._equipped,
                self._effects,
                kind,
                self._formulation,
                self._precision,
                self._order_asked,
                sunk,
            )
        return self._compiled[kind, sunk]

    @property
    def _sunk(self) -> frozenset[int]:
        """The surfaces that have been left, and still spring back."""
        depths = self._here.cushions.sunk
        return frozenset(i for i in depths if depths[i] != 0)

    def _change_mode(self, outcome: Any, watched: tuple[Watch, ...], start: Any) -> None:
        """Go on after what was watched for has come to pass."""
        here = self._here
        index = -int(outcome.value) - 1
        if not 0 <= index < len(watched):
            raise SimulationError(
                f"the motion could not be followed beyond {float(here.now):.6g} s "
                f"({outcome.name}); allowed are scenes whose motion stays finite"
            )
        self._at_once = self._at_once + 1 if here.now == start else 0
        if self._at_once > _MOST_AT_ONCE:
            raise SimulationError(
                f"modes follow each other without end at {float(here.now):.9g} s; allowed are "
                "scenes whose modes last"
            )
        here.settle(self._mode)
        watch = watched[index]
        if watch.kind is Kind.HITS:
            self._hit(watch.number)
        elif watch.kind in (Kind.REACHES, Kind.TURNS, Kind.CLEARS):
            self._change_law(watch)
        elif here.runs_into_something():
            self._strike()
        elif watch.kind is Kind.STOPS:
            here.stop(watch.number, self._mode)
            self._enter({})
        elif watch.kind is Kind.LEAVES:
            self._leave(watch.number)
        else:
            slips = ContactState.FORWARD if watch.sense > 0 else ContactState.BACKWARD
            self._enter({watch.number: slips, **here.pushed_by(watch.number, slips)})

    def _hit(self, number: int) -> None:
        """Press a cushion, or strike an obstacle."""
        here = self._here
        if isinstance(here.elements[number], CompliantContact):
            here.place(number)
            here.press(number)
            self._enter({})
        else:
            here.touched.add(number)
            self._strike()

    def _change_law(self, watch: Watch) -> None:
        """Go on with another law of a cushion that yields."""
        here = self._here
        if watch.kind is Kind.REACHES:
            # The force may jump, and what sticks break loose.
            here.cushions.reach(watch.number)
            self._enter({})
        else:
            if watch.kind is Kind.TURNS:
                here.cushions.turn(watch.number)
            else:
                here.cushions.clear(watch.number)
                here.apart[watch.number] = self._kind(0)
            self._mode = replace(self._mode, dents=here.cushions.dents)
            slides = bool(self._mode.states[watch.number].direction)
            if watch.kind is Kind.TURNS and slides and here.halts(watch.number, self._mode):
                # The slide comes to rest at the same instant, and may go on the other way.
                self._enter({})
        if here.runs_into_something():
            self._strike()

    def _leave(self, number: int) -> None:
        """Come off an obstacle or a cushion."""
        here = self._here
        if here.modes.wedges(number, self._mode.states[number], here.q):
            # Where a push presses on, no push left does not mean that it leaves.
            self._enter({})
            return
        if isinstance(here.elements[number], CompliantContact) and self._falls_back(number):
            self._enter({})
            return
        here.leave(number)
        self._enter({number: ContactState.OPEN})

    def _falls_back(self, number: int) -> bool:
        """Return whether what comes off a cushion is back on it before that can be seen.

        So it is where a press without damping comes back to where it began at rest.
        """
        here = self._here
        row = here.row(number)
        speed = row[0] * here.u[0] + row[1] * here.u[1]
        back = here.pull(number, here.free_mode)
        return bool(back > 0 and 2 * speed < self._shortest * back)

    def _strike(self) -> None:
        """Let all that is touched and run into be struck, and go on."""
        here = self._here
        pressed = {
            index for index in here.touched if isinstance(here.elements[index], CompliantContact)
        }
        near = here.near() | here.touched - pressed
        for index in sorted(near):
            here.place(index)
        struck = here.striking.impacts(here.q, here.u, near, float(here.now))
        here.u = struck.u
        self.strikes += struck.strikes
        here.touched = struck.resting | pressed
        # What has been given a speed is to be watched at once, whatever it did before.
        self._guards = {
            watch: t for watch, t in self._guards.items() if not here.is_moving(watch.number)
        }
        self._enter({})
        for index in sorted({strike.number for strike in struck.strikes} - struck.resting):
            self._rebound(index)

    def _rebound(self, index: int) -> None:
        """Let fly what has bounced, or let it rest where the bounces to come are over at once.

        From a speed v and under an acceleration −a they take the time 2v/a, e times that, e²
        times that, …: together 2v/a/(1 − e), with an error of the order of that time's square.
        They are left out where that is less than rounding.
        """
        here = self._here
        element = here.elements[index]
        assert isinstance(element, RigidContact)
        row = here.row(index)
        speed = row[0] * here.u[0] + row[1] * here.u[1]
        back = here.pull(index, self._mode)
        if back <= 0:
            return
        flight = 2 * speed / back
        lasting = flight / (1 - element.restitution) if element.restitution < 1 else None
        if lasting is None or lasting > self._shortest:
            # A step much longer than the flight would hide its end from heyoka's search for roots.
            self._horizon = here.now + 2 * flight
            return
        strike = here.striking.captured(index, here.q, here.u, float(here.now))
        self.strikes.append(strike)
        here.u = strike.u[1]
        here.touched.add(index)
        here.rest_on_all()
        self._enter({})
        self._since = here.now + lasting

    def _enter(self, known: dict[int, ContactState]) -> None:
        """Take up the mode that the state goes on in, given what is known of it."""
        here = self._here
        choices = {
            index: (known[index],) if index in known else here.choices(index, self._moment)
            for index in range(len(here.elements))
        }
        modes, kept = here.modes.consistent(here.q, here.u, here.now, choices, here.cushions.dents)
        if not kept and self._wedge(choices):
            return
        self._mode = self._mode if self._mode in modes else modes[0]
        self._say_if_open_to_choice(modes)
        for index in here.modes.barred_frictions(self._mode, here.q, here.u):
            self._mode = self._mode.pressed(index)
        self._guard(known, choices)
        here.keep_touched(self._mode)

    def _guard(self, known: Collection[int], choices: dict[int, tuple[ContactState, ...]]) -> None:
        """Do not watch for a moment what has just left zero, lest it cross it by rounding.

        In a moment a stiff cushion can do much: on one it is the shortest that there is, until that
        shows to go on without end. What breaks loose where static friction is no more than kinetic
        begins with no acceleration at all, and would be stopped by the first rounding.
        """
        here = self._here
        soon, sooner = here.now + self._moment, here.now + self._kind(self._shortest)
        for index, state in enumerate(self._mode.states):
            in_question = len(choices[index]) > 1 or here.now == 0
            if not (index in known or in_question):
                continue
            stiff = isinstance(here.elements[index], CompliantContact)
            until = sooner if stiff and self._at_once == 0 else soon
            if state.direction:
                self._guards[Watch(Kind.STOPS, index)] = until
            if state is ContactState.OPEN:
                self._guards[Watch(Kind.HITS, index)] = until

    def _wedge(self, choices: dict[int, tuple[ContactState, ...]]) -> bool:
        """Strike what slides on an obstacle that wedges it, and return whether there is any.

        Neither leaving nor sliding on is possible (Painlevé). What theory prescribes is an impact
        without collision: friction drives the point on until it no longer slides.
        """
        here = self._here
        for index, states in choices.items():
            sliding = next((state for state in states if state.direction), ContactState.OPEN)
            if len(states) > 1 and here.modes.wedges(index, sliding, here.q):
                here.u = here.striking.without_speed(index, here.q, here.u)
                strike = here.striking.impact(index, here.q, here.u, float(here.now))
                self.strikes.append(strike)
                here.u = strike.u[1]
                leaves = strike.speeds[1] != 0
                if leaves:
                    here.touched.discard(index)
                self._enter({})
                if leaves:
                    self._rebound(index)
                return True
        return False

    def _say_if_open_to_choice(self, modes: list[Mode]) -> None:
        """Note that more than one mode is possible, and which one is taken."""
        here = self._here
        if len(modes) > 1:
            others = "; or ".join(str(mode) for mode in modes if mode != self._mode)
            self.notes.append(
                f"At {float(here.now):.9g} s the laws of contact leave a choice (Painlevé): "
                f"{self._mode} is taken; or {others}."
            )
