"""Following a motion through one stretch: the integrator runs, the samples it passes stay."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import Any

import numpy as np

from twolink.optional import heyoka
from twolink.simulation.compiled_mode import CompiledMode, Segment
from twolink.simulation.smooth.taylor import number_type, numbers

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
        # Times are float64 numbers in any precision, and are looked for as such.
        self._times: list[float] = np.asarray(times, dtype=float).tolist()
        self.rows: list[Any] = []
        self.steps = self.order = 0

    @property
    def end(self) -> Any:
        """The last of the times (s)."""
        return self.grid[-1]

    def in_time(self, integrator: Any, start: Any, until: Any) -> Any:
        """Run an integrator from a time to another (s), and return its outcome."""
        first, end = len(self.rows), bisect_right(self._times, until)
        early = max(bisect_right(self._times, start) - first, 0)
        late = min(end - bisect_left(self._times, until), end - first) if until > start else 0
        inside = self.grid[first + early : end - late]
        # The first time of a grid is where the integrator stands; the last is where it shall stop.
        ahead = np.concatenate([numbers([start], self._precision), inside, [until]])
        outcome, _, _, taken, _, values = integrator.propagate_grid(
            ahead, max_delta_t=self._kind(self._cap)
        )
        states = values[:, :4]
        # Of a motion that cannot begin there is no state at all; its outcome says so.
        self.rows += list(states[:1]) * early
        self.rows += list(states[1 : 1 + len(inside)])
        if len(states) == len(ahead):
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
        ended = segment._replace(end=now, last=integrator.time)
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
        return self.grid[len(self.rows) : bisect_right(self._times, until)]

    def _count(self, integrator: Any, taken: int) -> None:
        self.steps += taken
        self.order = integrator.order
