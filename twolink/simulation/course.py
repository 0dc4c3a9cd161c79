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
from twolink.arithmetic import Pair
from twolink.directions import Direction
from twolink.effects import breaks, effects_during
from twolink.errors import SimulationError
from twolink.nonsmooth import Cushion, DryFriction, Element, Obstacle
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.compiled_mode import CompiledMode, Segment, compiled_mode
from twolink.simulation.constrained import rests, same_way
from twolink.simulation.cushions import Cushions
from twolink.simulation.following import Following
from twolink.simulation.impact_log import impact_log
from twolink.simulation.mode import Impact, Mode, State
from twolink.simulation.modes import Modes
from twolink.simulation.striking import Strike, Striking
from twolink.simulation.taylor import number_type, rounding
from twolink.simulation.watching import Kind, Watch

# Modes that follow each other without time passing: more would go on for ever.
_MOST_AT_ONCE = 8

# The moment for which what has just begun to move is not watched, in longest steps.
_UNWATCHED = 1e-5

# A press is followed for so long (s) at a time. heyoka's steps are as good as the largest of all
# that is computed beside them, and the time that is left is computed too.
_LONGEST_PRESS = 1.0

# So far inside, in units of rounding, is more than rounding.
_INSIDE = 1e4

# So near, in units of rounding of where things are, is touching.
_NEAR = 64


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
        self._scene, self._precision, self._kind, self._cap = scene, precision, kind, cap
        self._formulation, self._order_asked = formulation, order
        text = kane if formulation == "kane" else lagrange
        self._equipped = scene.equipped
        self._text, self._chain = text, self._equipped.convert(kind)
        # Those of the effects that act now, by the kind of mode.
        self._compiled: dict[Mode, CompiledMode] = {}
        self._breaks = [kind(t) for t in breaks(scene.effects) if t > 0]
        self._take_up_effects(0.0)
        self.following = Following(times, precision, cap)
        self._q: Pair = (kind(scene.q[0]), kind(scene.q[1]))
        self._u: Pair = (kind(scene.u[0]), kind(scene.u[1]))
        self._now = kind(0)
        self._resolution = rounding(precision)
        self._shortest = cap * math.sqrt(self._resolution)
        # What is touched and not moving away or towards, though it may not push.
        self._touched: set[int] = set()
        # When the mode is said to begin: after bounces too low to be seen, a little later.
        self._since = kind(0)
        # Until when the motion is followed in one go: to see the end of a short flight.
        self._horizon = kind(0)
        # How far away the obstacles are: variables of their own, not differences of positions.
        self._apart: dict[int, Any] = {}
        self._cushions = Cushions(self._modes.elements, kind)
        self._guards: dict[Watch, Any] = {}
        self._at_once = 0
        self.segments: list[Segment] = []
        self.strikes: list[Strike] = []
        self.notes: list[str] = []
        self.operations = 0
        self.compile_seconds = self.run_seconds = 0.0
        self._begin()

    def _take_up_effects(self, t: float) -> None:
        """Let those effects act that do so from a time (s) on."""
        self._effects = effects_during(self._scene.effects, t)
        self._modes = Modes(self._chain, self._effects, self._text)
        self._striking = Striking(self._modes)
        self._compiled = {}

    @property
    def now(self) -> float:
        """Where the motion stands (s)."""
        return float(self._now)

    def log(self) -> tuple[Impact, ...]:
        """Return the log of the impacts so far."""
        return impact_log(self._chain, self.strikes, self._precision)

    @property
    def done(self) -> bool:
        """Whether the last time is reached."""
        return bool(self._now >= self.following.end)

    def _begin(self) -> None:
        """Refuse a start inside an obstacle, and strike what is run into at once."""
        for number, element in enumerate(self._modes.elements):
            if isinstance(element, DryFriction):
                continue
            gap = self._apart[number] = self._gap(number)
            # A start is given in float64, and is on an obstacle to its rounding.
            if self._is_near(element, gap, rounding("double")):
                self._place(number)
                if isinstance(element, Cushion) and not self._recedes(element):
                    self._press(number)
            elif gap < 0:
                raise SimulationError(
                    f"{element.name}: the scene starts {-float(gap):.6g} inside; allowed is a "
                    "start on its outside, or on it"
                )
        self._mode = self._free_mode()
        self._strike()

    def _press(self, number: int) -> None:
        """Begin to press a cushion: at no depth, or hardly any if it is touched at rest."""
        cushion = self._modes.elements[number]
        row = self._modes.row(cushion.direction, self._q)
        self._touched.add(number)
        least = math.sqrt(self._resolution) if rests(row, self._u) else 0.0
        self._cushions.press(number, least)

    def _recedes(self, element: Any) -> bool:
        row = self._modes.row(element.direction, self._q)
        return not rests(row, self._u) and bool(row[0] * self._u[0] + row[1] * self._u[1] > 0)

    def _free_mode(self) -> Mode:
        """Return the mode in which nothing is touched."""
        open_all = (State.OPEN,) * len(self._modes.elements)
        return Mode(self._modes.names, open_all, self._cushions.dents)

    def _gap(self, number: int) -> Any:
        """Return how far an obstacle is away (rad or m)."""
        direction = self._modes.elements[number].direction
        here = direction.coordinate(self._modes.chain, self._q)
        return here - self._cushions.surface(number)

    def _place(self, number: int) -> None:
        """Move q by rounding, so that an obstacle is touched exactly."""
        direction = self._modes.elements[number].direction
        self._q = self._striking.placed(direction, self._cushions.surface(number), self._q)
        self._apart[number] = self._kind(0)

    def _is_near(self, obstacle: Any, gap: Any, resolution: float | None = None) -> bool:
        """Return whether a gap is no more than rounding."""
        size = max(1.0, abs(float(obstacle.bound)))
        return bool(abs(gap) <= _NEAR * (resolution or self._resolution) * size)

    def _near(self) -> set[int]:
        """Return the obstacles that are touched, but for rounding."""
        return {
            index
            for index, element in enumerate(self._modes.elements)
            if isinstance(element, Obstacle) and self._is_near(element, self._apart[index])
        }

    def advance(self) -> None:
        """Follow the motion to the end of its mode, or to the last time."""
        self._check_outside()
        self._guards = {watch: t for watch, t in self._guards.items() if t > self._now}
        until = min([self.following.end, *self._guards.values(), *self._breaks[:1]])
        if self._now < self._horizon:
            until = min(until, self._horizon)
        roots, sunk = self._cushions.roots, self._cushions.sunk
        if roots:
            until = min(until, self._now + _LONGEST_PRESS)
        start = self._now
        begun = perf_counter()
        resting = {Watch(Kind.HITS, index) for index in self._touched}
        unwatched = frozenset({*self._guards, *resting})
        compiled = self._compile()
        # Where each of the variables beside q and u is kept.
        kept = [(self._apart, index) for index in compiled.free.gaps]
        kept += [(sunk, index) for index in compiled.free.relaxing]
        kept += [(roots, index) for index in sorted(roots)]
        state = (*self._q, *self._u, *(place[index] for place, index in kept))
        if roots:
            state = (*state, self._kind(0))
        since = max(start, self._since)
        segment = Segment(self._mode, self._effects, start, until, state, unwatched, since)
        integrator = compiled.set_to(segment)
        self.compile_seconds += perf_counter() - begun
        begun = perf_counter()
        self.operations = max(self.operations, compiled.operations)
        if compiled.rooted:
            outcome, segment = self.following.in_root_time(compiled, segment)
            self._now = segment.end
        else:
            outcome = self.following.in_time(integrator, start, until)
            self._now = self._kind(integrator.time)
        self.run_seconds += perf_counter() - begun
        # As Python's floats, where that is what they are: with NumPy's all takes much longer.
        q1, q2, u1, u2, *others = integrator.state.tolist()
        self._q, self._u = (q1, q2), (u1, u2)
        for (place, index), value in zip(kept, others, strict=False):
            place[index] = value
        self.segments.append(segment._replace(end=self._now))
        if outcome != heyoka().taylor_outcome.time_limit:
            self._change_mode(outcome, compiled.watches, start)
            self.following.correct(self._now, (*self._q, *self._u))
        elif self._breaks and self._now >= self._breaks[0]:
            self._take_up_effects(float(self._breaks.pop(0)))
            self._settle()
            self._enter({})

    def _compile(self) -> CompiledMode:
        """Return the integrator of the mode."""
        kind = self._mode.kind
        if kind not in self._compiled:
            self._compiled[kind] = compiled_mode(
                self._equipped,
                self._effects,
                kind,
                self._formulation,
                self._precision,
                self._order_asked,
            )
        return self._compiled[kind]

    def _check_outside(self) -> None:
        """Refuse to go on inside an obstacle: an impact that was missed is not passed over."""
        for index, state in enumerate(self._mode.states):
            if state is not State.OPEN:
                continue
            element, gap = self._modes.elements[index], self._apart[index]
            assert not isinstance(element, DryFriction)
            if gap < -_INSIDE * rounding("double") * max(1.0, abs(float(element.bound))):
                raise SimulationError(
                    f"{element.name}: at {float(self._now):.9g} s it is {-float(gap):.3g} inside, "
                    "which must not be; allowed are scenes whose contact can be followed"
                )

    def _change_mode(self, outcome: Any, watched: tuple[Watch, ...], start: Any) -> None:
        """Go on after what was watched for has come to pass."""
        index = -int(outcome.value) - 1
        if not 0 <= index < len(watched):
            raise SimulationError(
                f"the motion could not be followed beyond {float(self._now):.6g} s "
                f"({outcome.name}); allowed are scenes whose motion stays finite"
            )
        self._at_once = self._at_once + 1 if self._now == start else 0
        if self._at_once > _MOST_AT_ONCE:
            raise SimulationError(
                f"modes follow each other without end at {float(self._now):.9g} s; allowed are "
                "scenes whose modes last"
            )
        self._settle()
        watch = watched[index]
        if watch.kind is Kind.HITS:
            self._hit(watch.number)
        elif watch.kind in (Kind.REACHES, Kind.TURNS, Kind.CLEARS):
            self._change_law(watch)
        elif self._runs_into_something():
            self._strike()
        elif watch.kind is Kind.STOPS:
            self._stop(watch.number)
        elif watch.kind is Kind.LEAVES:
            self._leave(watch.number)
        else:
            element = self._modes.elements[watch.number]
            slips = State.FORWARD if watch.sense > 0 else State.BACKWARD
            self._enter({watch.number: slips, **self._pushed_by(element, slips)})

    def _hit(self, number: int) -> None:
        """Press a cushion, or strike an obstacle."""
        if isinstance(self._modes.elements[number], Cushion):
            self._place(number)
            self._press(number)
            self._enter({})
        else:
            self._touched.add(number)
            self._strike()

    def _change_law(self, watch: Watch) -> None:
        """Go on with another law of a cushion that yields."""
        if watch.kind is Kind.REACHES:
            # The force may jump, and what sticks break loose.
            self._cushions.reach(watch.number)
            self._enter({})
        else:
            if watch.kind is Kind.TURNS:
                self._cushions.turn(watch.number)
            else:
                self._cushions.clear(watch.number)
                self._apart[watch.number] = self._kind(0)
            self._mode = replace(self._mode, dents=self._cushions.dents)
        if self._runs_into_something():
            self._strike()

    def _stop(self, number: int) -> None:
        """Bring to rest what slipped."""
        element = self._modes.elements[number]
        slides = element.direction if isinstance(element, DryFriction) else element.tangent
        assert slides is not None
        self._u = self._striking.stopped([slides, *self._barred()], self._q, self._u)
        self._enter({})

    def _leave(self, number: int) -> None:
        """Come off an obstacle or a cushion."""
        if self._modes.wedges(number, self._mode.states[number], self._q):
            # Where a push presses on, no push left does not mean that it leaves.
            self._enter({})
            return
        self._touched.discard(number)
        if isinstance(self._modes.elements[number], Cushion):
            self._cushions.leave(number, -self._gap(number))
        self._apart[number] = self._kind(0)
        self._enter({number: State.OPEN})

    def _pushed_by(self, element: Any, slips: State) -> dict[int, State]:
        """Return what is touched and would be pushed by a friction that breaks loose this way."""
        if not isinstance(element, DryFriction):
            return {}
        row = self._modes.row(element.direction, self._q)
        pushed = {}
        for index in self._touched:
            across = self._modes.row(self._modes.elements[index].direction, self._q)
            against = slips.direction * (row[0] * across[0] + row[1] * across[1]) < 0
            if against and same_way(row, across):
                pushed[index] = State.CLOSED
        return pushed

    def _barred(self) -> list[Direction]:
        """Return the directions in which the mode lets nothing move."""
        found = []
        for element, state in zip(self._modes.elements, self._mode.states, strict=True):
            if isinstance(element, Obstacle) and state is not State.OPEN:
                found.append(element.direction)
            if state is State.STICKS:
                slides = element.direction if isinstance(element, DryFriction) else element.tangent
                assert slides is not None
                found.append(slides)
        return found

    def _settle(self) -> None:
        """Set to rest exactly what the mode holds at rest, where it is so to rounding."""
        self._u = self._striking.stopped(self._barred(), self._q, self._u)

    def _runs_into_something(self) -> bool:
        """Return whether what is touched is also approached: by chance two events may coincide."""
        return any(
            self._striking.approached(index, self._q, self._u)
            for index in self._near() - self._touched
        )

    def _strike(self) -> None:
        """Let all that is touched and run into be struck, and go on."""
        elements = self._modes.elements
        pressed = {index for index in self._touched if isinstance(elements[index], Cushion)}
        near = self._near() | self._touched - pressed
        for index in sorted(near):
            self._place(index)
        struck = self._striking.impacts(self._q, self._u, near, float(self._now))
        self._u = struck.u
        self.strikes += struck.strikes
        self._touched = struck.resting | pressed
        # What has been given a speed is to be watched at once, whatever it did before.
        self._guards = {
            watch: t for watch, t in self._guards.items() if not self._is_moving(watch.number)
        }
        self._enter({})
        for index in sorted({strike.number for strike in struck.strikes} - struck.resting):
            self._rebound(index)

    def _is_moving(self, index: int) -> bool:
        direction = self._modes.elements[index].direction
        return not rests(self._modes.row(direction, self._q), self._u)

    def _rebound(self, index: int) -> None:
        """Let fly what has bounced, or let it rest where the bounces to come are over at once.

        From a speed v and under an acceleration −a they take the time 2v/a, e times that, e²
        times that, …: together 2v/a/(1 − e), with an error of the order of that time's square.
        They are left out where that is less than rounding.
        """
        element = self._modes.elements[index]
        assert isinstance(element, Obstacle)
        row = self._modes.row(element.direction, self._q)
        speed = row[0] * self._u[0] + row[1] * self._u[1]
        du = self._modes.accelerations(self._mode, self._q, self._u, self._now)
        drift = element.direction.drift(self._modes.chain, self._q, self._u)
        back = -(row[0] * du[0] + row[1] * du[1] + drift)
        if back <= 0:
            return
        flight = 2 * speed / back
        lasting = flight / (1 - element.restitution) if element.restitution < 1 else None
        if lasting is None or lasting > self._shortest:
            # A step much longer than the flight would hide its end from heyoka's search for roots.
            self._horizon = self._now + 2 * flight
            return
        strike = self._striking.captured(index, self._q, self._u, float(self._now))
        self.strikes.append(strike)
        self._u = strike.u[1]
        self._touched.add(index)
        self._enter({})
        self._since = self._now + lasting

    def _enter(self, known: dict[int, State]) -> None:
        """Take up the mode that the state goes on in, given what is known of it."""
        choices = {}
        for index, element in enumerate(self._modes.elements):
            choices[index] = (known[index],) if index in known else self._choices(index, element)
        dents = self._cushions.dents
        modes, kept = self._modes.consistent(self._q, self._u, self._now, choices, dents)
        if not kept and self._wedge(choices):
            return
        self._mode = self._mode if self._mode in modes else modes[0]
        self._say_if_open_to_choice(modes)
        for index in self._modes.barred_frictions(self._mode, self._q, self._u):
            self._mode = self._mode.pressed(index)
        self._guard(known, choices)
        self._keep_touched()

    def _guard(self, known: Collection[int], choices: dict[int, tuple[State, ...]]) -> None:
        """Do not watch for a moment what has just left zero, lest it cross it by rounding.

        In a moment a stiff cushion can do much: of what touches one all is watched, until that
        shows to go on without end.
        """
        for index, state in enumerate(self._mode.states):
            in_question = len(choices[index]) > 1 or self._now == 0
            if not (index in known or in_question):
                continue
            stiff = isinstance(self._modes.elements[index], Cushion)
            if state.direction and not (stiff and self._at_once == 0):
                self._guards[Watch(Kind.STOPS, index)] = self._soon
            if state is State.OPEN:
                self._guards[Watch(Kind.HITS, index)] = self._soon

    @property
    def _soon(self) -> Any:
        """When what has just left zero is watched again (s)."""
        return self._now + self._kind(self._cap * _UNWATCHED)

    def _wedge(self, choices: dict[int, tuple[State, ...]]) -> bool:
        """Strike what slides on an obstacle that wedges it, and return whether there is any.

        Neither leaving nor sliding on is possible (Painlevé). What theory prescribes is an impact
        without collision: friction drives the point on until it no longer slides.
        """
        for index, states in choices.items():
            sliding = next((state for state in states if state.direction), State.OPEN)
            if len(states) > 1 and self._modes.wedges(index, sliding, self._q):
                self._u = self._striking.without_speed(index, self._q, self._u)
                strike = self._striking.impact(index, self._q, self._u, float(self._now))
                self.strikes.append(strike)
                self._u = strike.u[1]
                leaves = strike.speeds[1] != 0
                if leaves:
                    self._touched.discard(index)
                self._enter({})
                if leaves:
                    self._rebound(index)
                return True
        return False

    def _say_if_open_to_choice(self, modes: list[Mode]) -> None:
        """Note that more than one mode is possible, and which one is taken."""
        if len(modes) > 1:
            others = "; or ".join(str(mode) for mode in modes if mode != self._mode)
            self.notes.append(
                f"At {float(self._now):.9g} s the laws of contact leave a choice (Painlevé): "
                f"{self._mode} is taken; or {others}."
            )

    def _choices(self, index: int, element: Element) -> tuple[State, ...]:
        """Return the states that come into question, the most restful first."""
        slides = element.direction if isinstance(element, DryFriction) else element.tangent
        if not isinstance(element, DryFriction) and index not in self._touched:
            return (State.OPEN,)
        leaving = (State.OPEN,) if isinstance(element, Obstacle) else ()
        if slides is None:
            return (State.CLOSED, *leaving)
        row, u = self._modes.row(slides, self._q), self._u
        if max(abs(row[0]), abs(row[1])) <= self._resolution:
            # A chain that is stretched along a direction cannot move its end that way yet: where it
            # will slide shows a moment later.
            row, u = self._moved_on(slides)
        if rests(row, u):
            return (State.STICKS, State.FORWARD, State.BACKWARD, *leaving)
        forward = row[0] * u[0] + row[1] * u[1] > 0
        return (State.FORWARD if forward else State.BACKWARD, *leaving)

    def _moved_on(self, direction: Direction) -> tuple[Pair, Pair]:
        """Return the row of a direction, and u, when the chain has moved freely for a moment."""
        (q1, q2), (u1, u2) = self._q, self._u
        free = self._free_mode()
        du1, du2 = self._modes.accelerations(free, self._q, self._u, self._now)
        h = self._kind(self._cap * _UNWATCHED)
        q = q1 + h * (u1 + h * du1 / 2), q2 + h * (u2 + h * du2 / 2)
        return self._modes.row(direction, q), (u1 + h * du1, u2 + h * du2)

    def _keep_touched(self) -> None:
        """Forget what is touched no longer; what is held off it by others is touched still."""
        kept = set()
        for index in self._touched:
            if self._mode.states[index] is not State.OPEN:
                continue
            element = self._modes.elements[index]
            row = self._modes.row(element.direction, self._q)
            du = self._modes.accelerations(self._mode, self._q, self._u, self._now)
            if rests(row, self._u) and rests(row, du):
                kept.add(index)
        pushing = {index for index in self._touched if self._mode.states[index] is not State.OPEN}
        self._touched = kept | pushing
