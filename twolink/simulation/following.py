"""Following a motion through one stretch: the integrator runs, the samples it passes stay."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from twolink.optional import heyoka
from twolink.simulation.compiled_mode import CompiledMode, Segment
from twolink.simulation.taylor import number_type, numbers

# An end that the variable of integration never comes to: an event ends it.
_FOR_EVER = 1e9


class Following:
    """What has been found at the times asked for (s), and what it took: `steps` of an `order`.

    `rows` holds q and u at so many of the times in `grid` as have been passed.
    """

    def __init__(self, times: Any, precision: str, cap: float) -> None:
        """Take the times, and the longest step (s)."""
        self._kind, self._precision, self._cap = number_type(precision), precision, cap
        self.grid = numbers(times, precision)
        self._plain_grid = np.asarray(times, dtype=float)
        self.rows: list[Any] = []
        self.steps = self.order = 0

    @property
    def end(self) -> Any:
        """The last of the times (s)."""
        return self.grid[-1]

    def in_time(self, integrator: Any, start: Any, until: Any) -> Any:
        """Run an integrator from a time to another (s), and return its outcome."""
        wanted = self._wanted(until)
        early, late = int((wanted <= start).sum()), int((wanted == until).sum())
        inside = wanted[early : len(wanted) - late] if until > start else wanted[:0]
        # The first time of a grid is where the integrator stands; the last is where it shall stop.
        ahead = np.concatenate([numbers([start], self._precision), inside, [until]])
        outcome, _, _, taken, _, values = integrator.propagate_grid(
            ahead, max_delta_t=self._kind(self._cap)
        )
        states = values[:, :4]
        self.rows += [states[0]] * early
        self.rows += list(states[1 : 1 + len(inside)])
        if len(states) == len(ahead) and until > start:
            self.rows += [states[-1]] * late
        self._count(integrator, taken)
        return outcome

    def in_root_time(self, compiled: CompiledMode, segment: Segment) -> tuple[Any, Segment]:
        """Run the integrator of a mode that presses rooted cushions, set to a segment's start.

        Returns its outcome, and the segment with its end.
        """
        integrator = compiled.integrator
        outcome, _, _, taken, *_ = integrator.propagate_until(self._kind(_FOR_EVER))
        self._count(integrator, taken)
        in_time = -int(outcome.value) - 1 == len(compiled.watches)
        now = segment.end if in_time else segment.start + integrator.state[-1]
        ended = replace(segment, end=now, last=integrator.time)
        wanted = self._wanted(now)
        if len(wanted):
            state = [*integrator.state]
            self.rows += list(compiled.output(ended, self._cap)(wanted).T)
            integrator.state[:] = state
        return (heyoka().taylor_outcome.time_limit if in_time else outcome), ended

    def correct(self, now: Any, state: tuple[Any, ...]) -> None:
        """Let a sample at the very instant of an event be what comes after it."""
        if self.rows and self.grid[len(self.rows) - 1] == now:
            self.rows[-1] = np.array([*state])

    def _wanted(self, until: Any) -> Any:
        """Return the times (s) that are asked for next, up to one."""
        count = int(np.searchsorted(self._plain_grid, float(until), side="right"))
        wanted = self.grid[len(self.rows) : count]
        return wanted[wanted <= until]

    def _count(self, integrator: Any, taken: int) -> None:
        self.steps += taken
        self.order = integrator.order
