"""Motion with events: Taylor series from mode to mode, in any precision."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.scene import Scene
from twolink.simulation.compiled_mode import Segment, compiled_mode
from twolink.simulation.course import Course
from twolink.simulation.mode import Event, Impact
from twolink.simulation.run import MotionRun
from twolink.simulation.smooth.taylor import default_longest_step, number_type


@dataclass(frozen=True, kw_only=True)
class EventRun(MotionRun):
    """A motion with events: segments in one mode each, that follow each other in time."""

    segments: tuple[Segment, ...]
    struck: tuple[Impact, ...]
    open_to_choice: tuple[str, ...]
    order_asked: int | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """The beginnings of all modes that last, the first at 0 s; none if nothing makes modes."""
        if not self.segments[0].mode.names:
            return ()
        found: list[Event] = []
        for segment in self.segments:
            mode = segment.mode.told
            goes_on = bool(found) and found[-1].mode == mode
            if segment.end > segment.start and not goes_on:
                found.append(Event(float(segment.since), mode, float(segment.start)))
        return tuple(found)

    @property
    def log(self) -> tuple[Impact, ...]:
        """The impacts, in the order of time."""
        return self.struck

    @property
    def notes(self) -> tuple[str, ...]:
        """Where the laws of contact left a choice, in sentences."""
        return self.open_to_choice

    def mode_indices(self, times: Any) -> Any:
        """Return the index of the segment that each time (s) is in."""
        starts = np.array([float(segment.start) for segment in self.segments])
        return np.searchsorted(starts, times, side="right") - 1

    def dense(self) -> Callable[[Any], tuple[Any, Any]]:
        """Return q and u as functions of time (s): the very polynomials of this run's steps."""
        kind = number_type(self.precision)
        outputs: dict[int, Any] = {}

        def output_of(index: int) -> Any:
            if index not in outputs:
                segment = self.segments[index]
                compiled = compiled_mode(
                    self.scene.equipped,
                    segment.effects,
                    segment.mode,
                    self.formulation,
                    self.precision,
                    self.order_asked,
                    segment.sunk,
                )
                outputs[index] = compiled.output(segment, self.longest_step)
            return outputs[index]

        def at(times: Any) -> tuple[Any, Any]:
            values = np.empty((4, len(times)), dtype=self.q.dtype)
            indices = self.mode_indices(times)
            for index in np.unique(indices):
                chosen = indices == index
                moments = np.array([kind(t) for t in np.asarray(times)[chosen]])
                values[:, chosen] = output_of(int(index))(moments)
            return values[:2], values[2:]

        return at


def event_run(
    scene: Scene,
    times: Any,
    *,
    formulation: str = "lagrange",
    precision: str = "double",
    order: int | None = None,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> EventRun:
    """Return a scene's motion through its events at increasing times (s), the first of them 0.

    `progress` is told the share that is done. Raises `SimulationError` when the motion cannot be
    followed to the last time.
    """
    cap = longest_step or default_longest_step(scene)
    # Modes are written with speeds, so momenta are none of their variables.
    formulation = "kane" if formulation == "kane" else "lagrange"
    course = Course(scene, times, formulation, precision, order, cap)
    while not course.done:
        course.advance()
        if progress is not None:
            progress(course.now / scene.duration)
    followed = course.following
    states = np.array(followed.rows, dtype=followed.grid.dtype).T
    return EventRun(
        scene=scene,
        formulation=formulation,
        precision=precision,
        longest_step=cap,
        q=states[:2],
        u=states[2:],
        steps=followed.steps,
        order=followed.order,
        operations=course.operations,
        compile_seconds=course.compile_seconds,
        run_seconds=course.run_seconds,
        segments=tuple(course.segments),
        struck=course.log(),
        open_to_choice=tuple(course.notes),
        order_asked=order,
    )
