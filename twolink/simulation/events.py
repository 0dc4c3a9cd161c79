"""Motion with events: Taylor series from mode to mode, in any precision.

Each mode is compiled when it is first entered. heyoka finds the time at which it ends, to rounding
of the precision; there the joint that came to rest is set to rest exactly, and the next mode takes
over.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.joint_friction import JointFriction
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.mode import Event, Mode
from twolink.simulation.modes import FrictionModes, split_friction
from twolink.simulation.run import MotionRun
from twolink.simulation.taylor import TOLERANCES, default_longest_step, heyoka, number_type

# Modes that follow each other without time passing: more would go on for ever.
_MOST_AT_ONCE = 8

# The moment for which a joint that has just broken loose is not watched, in longest steps.
_UNWATCHED = 1e-3


@dataclass(frozen=True)
class _Segment:
    """A stretch of the motion in one mode, from a start to an end (s), from q and u.

    `starting` is a joint that has just broken loose, whose coming to rest is not watched.
    """

    mode: Mode
    start: Any
    end: Any
    state: tuple[Any, ...]
    starting: int | None


@dataclass(frozen=True, kw_only=True)
class EventRun(MotionRun):
    """A motion with events: segments in one mode each, that follow each other in time."""

    segments: tuple[_Segment, ...]

    @property
    def events(self) -> tuple[Event, ...]:
        """The beginnings of all modes that last, the first at 0 s."""
        found: list[Event] = []
        for segment in self.segments:
            goes_on = bool(found) and found[-1].mode == segment.mode
            if segment.end > segment.start and not goes_on:
                found.append(Event(float(segment.start), segment.mode))
        return tuple(found)

    def mode_indices(self, times: Any) -> Any:
        """Return the index of the segment that each time (s) is in."""
        starts = np.array([float(segment.start) for segment in self.segments])
        return np.searchsorted(starts, times, side="right") - 1

    def dense(self) -> Callable[[Any], tuple[Any, Any]]:
        """Return q and u as functions of time (s): the very polynomials of this run's steps."""
        kind = number_type(self.precision)
        outputs = []
        for segment in self.segments:
            integrator, _ = _ready(self.scene, segment, self.precision)
            *_, output, _ = integrator.propagate_until(
                segment.end, c_output=True, max_delta_t=kind(self.longest_step)
            )
            outputs.append(output)

        def at(times: Any) -> tuple[Any, Any]:
            values = np.empty((4, len(times)), dtype=self.q.dtype)
            indices = self.mode_indices(times)
            for index, output in enumerate(outputs):
                chosen = indices == index
                if chosen.any():
                    moments = np.array([kind(t) for t in np.asarray(times)[chosen]])
                    values[:, chosen] = np.array(output(moments)).T
            return values[:2], values[2:]

        return at


def event_run(
    scene: Scene, times: Any, *, precision: str = "double", longest_step: float | None = None
) -> EventRun:
    """Return a scene's motion with stick and slip at increasing times (s), the first of them 0.

    Raises `SimulationError` when the motion cannot be followed to the last time.
    """
    course = _Course(scene, times, precision, longest_step or default_longest_step(scene))
    while not course.done:
        course.advance()
    return course.run()


class _Course:
    """A motion on its way: where it stands, in which mode, and what it has left behind."""

    def __init__(self, scene: Scene, times: Any, precision: str, cap: float) -> None:
        kind = number_type(precision)
        smooth, friction = split_friction(scene.effects)
        assert friction is not None
        self._scene, self._precision, self._kind, self._cap = scene, precision, kind, cap
        self._modes = FrictionModes(scene.chain.convert(kind), smooth, friction)
        self._grid = np.array([kind(t) for t in times])
        self._q: Pair = (kind(scene.q[0]), kind(scene.q[1]))
        self._u: Pair = (kind(scene.u[0]), kind(scene.u[1]))
        self._now = kind(0)
        self._mode = self._modes.mode_at(self._q, self._u, self._now)
        self._starting: int | None = None
        self._at_once = 0
        self._rows: list[Any] = []
        self._segments: list[_Segment] = []
        self._steps = self._order = self._operations = 0
        self._compile_seconds = self._run_seconds = 0.0

    @property
    def done(self) -> bool:
        """Whether the last time is reached."""
        return bool(self._now >= self._grid[-1])

    def advance(self) -> None:
        """Follow the motion to the end of its mode, or to the last time."""
        until = self._grid[-1]
        if self._starting is not None:
            # A joint that has just broken loose may hardly move at first, so that rounding alone
            # could bring it to rest: for a moment nobody looks.
            until = min(until, self._now + self._kind(self._cap * _UNWATCHED))
        start = self._now
        begun = perf_counter()
        segment = _Segment(self._mode, start, until, (*self._q, *self._u), self._starting)
        integrator, names = _ready(self._scene, segment, self._precision)
        self._compile_seconds += perf_counter() - begun
        begun = perf_counter()
        outcome = self._integrate(integrator, start, until)
        self._run_seconds += perf_counter() - begun
        self._now = self._kind(integrator.time)
        q1, q2, u1, u2 = integrator.state
        self._q, self._u = (q1, q2), (u1, u2)
        self._segments.append(replace(segment, end=self._now))
        if outcome != heyoka().taylor_outcome.time_limit:
            self._change_mode(outcome, names, start)
        elif self._starting is not None:
            self._enter(None)

    def _integrate(self, integrator: Any, start: Any, until: Any) -> Any:
        """Run an integrator, keep what it finds at the times asked for, and return its outcome."""
        wanted = [t for t in self._grid[len(self._rows) :] if t <= until]
        # The first time of a grid is where the integrator stands; the last is where it shall stop.
        ahead = [start, *(t for t in wanted if start < t < until), until]
        outcome, _, _, taken, _, values = integrator.propagate_grid(
            np.array(ahead), max_delta_t=self._kind(self._cap)
        )
        self._rows += [values[ahead.index(t)] for t in wanted if ahead.index(t) < len(values)]
        self._steps += taken
        self._order = integrator.order
        self._operations = max(self._operations, len(integrator.decomposition) - 8)
        return outcome

    def _change_mode(self, outcome: Any, names: list[tuple[int, int]], start: Any) -> None:
        """Go on after a joint came to rest, or broke loose."""
        index = -int(outcome.value) - 1
        if not 0 <= index < len(names):
            raise SimulationError(
                f"the motion could not be followed beyond {float(self._now):.6g} s "
                f"({outcome.name}); allowed are scenes whose motion stays finite"
            )
        self._at_once = self._at_once + 1 if self._now == start else 0
        if self._at_once > _MOST_AT_ONCE:
            raise SimulationError(
                f"stick and slip follow each other without end at {float(self._now):.9g} s; "
                "allowed are scenes whose modes last"
            )
        joint, direction = names[index]
        if direction == 0:
            # At rest exactly, not to rounding.
            u1, u2 = self._u
            self._u = (0 * u1, u2) if joint == 0 else (u1, u1)
            self._enter(None)
        else:
            self._enter(joint, {joint: direction})

    def _enter(self, starting: int | None, directions: dict[int, int] | None = None) -> None:
        """Take up the mode that the state goes on in."""
        self._starting = starting
        self._mode = self._modes.mode_at(self._q, self._u, self._now, directions)

    def run(self) -> EventRun:
        """Return all that was left behind."""
        found = np.array(self._rows, dtype=self._grid.dtype).T
        return EventRun(
            scene=self._scene,
            # The modes are written with Lagrange's equations.
            formulation="lagrange",
            precision=self._precision,
            longest_step=self._cap,
            q=found[:2],
            u=found[2:],
            steps=self._steps,
            order=self._order,
            operations=self._operations,
            compile_seconds=self._compile_seconds,
            run_seconds=self._run_seconds,
            segments=tuple(self._segments),
        )


def _ready(scene: Scene, segment: _Segment, precision: str) -> tuple[Any, list[tuple[int, int]]]:
    """Return a mode's integrator, set to a segment's start, and its events by index.

    An event is a joint (0 for A, 1 for B) and the direction in which it breaks loose, 0 if it
    comes to rest.
    """
    integrator, names = _compiled(
        scene.chain,
        scene.effects,
        segment.mode,
        segment.starting,
        precision,
        scene.chain._exact_inertia,
    )
    integrator.state[:] = segment.state
    integrator.time = segment.start
    if names:
        integrator.reset_cooldowns()
    return integrator, names


@functools.lru_cache(maxsize=64)
def _compiled(
    chain: Chain,
    effects: tuple[Effect, ...],
    mode: Mode,
    starting: int | None,
    precision: str,
    exact_inertia: Pair | None,
) -> tuple[Any, list[tuple[int, int]]]:
    hy = heyoka()
    kind = number_type(precision)
    smooth, friction = split_friction(effects)
    assert isinstance(friction, JointFriction)
    modes = FrictionModes(chain.convert(kind), smooth, friction)
    q1, q2, u1, u2 = hy.make_vars("q1", "q2", "u1", "u2")
    q, u = (q1, q2), (u1, u2)
    rates = modes.accelerations(mode, q, u, hy.time)
    torques = modes.holding_torques(mode, q, u, hy.time)
    falling = hy.event_direction.negative
    events, names = [], []
    for joint, direction in enumerate(mode):
        if direction is None or joint == starting:
            continue
        if direction == 0:
            # Friction holds against the load; the joint starts the way the load pushes.
            for starts in (1, -1):
                margin = friction.holding[joint] + starts * torques[joint]
                if _is_constant(margin):
                    continue
                events.append(hy.t_event(margin, direction=falling, fp_type=kind))
                names.append((joint, starts))
        else:
            speed = u1 if joint == 0 else u2 - u1
            events.append(hy.t_event(direction * speed, direction=falling, fp_type=kind))
            names.append((joint, 0))
    expressions = [hy.expression(rate) if not isinstance(rate, hy.expression) else rate
                   for rate in (*u, *rates)]  # fmt: skip
    integrator = hy.taylor_adaptive(
        list(zip((q1, q2, u1, u2), expressions, strict=True)),
        np.array([kind(0)] * 4),
        tol=kind(TOLERANCES[precision]),
        fp_type=kind,
        t_events=events,
    )
    return integrator, names


def _is_constant(value: Any) -> bool:
    """Return whether a number or an expression is the same always: such an event never comes."""
    try:
        float(str(value))
    except ValueError:
        return False
    return True
