"""The steps of a run by Taylor series, as they are taken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.run import Array

# The most ends of steps that are kept of a run. Of longer ones every second, fourth … is kept.
_MOST_ENDS = 400_000

# Steps that are observed together. Numbers of so many are still in the cache of a core when they
# are used again; five times as many took 1.6 to 3.4 times as long for each step.
_OBSERVED_AT_ONCE = 1024


class Steps(NamedTuple):
    """Consecutive steps: starts and lengths (s), coefficients (n, 4, p + 1), and the last state.

    The starts are sums of two numbers in float64, `starts` and the small `rests`; all other numbers
    are in the precision of the run. The variables are those of the equations, q and u or q and p.
    """

    starts: Any
    rests: Any
    lengths: Any
    coefficients: Any
    end: Any

    def portions(self) -> Iterator[Steps]:
        """Yield the same steps, `_OBSERVED_AT_ONCE` at a time."""
        count = len(self.lengths)
        for first in range(0, count, _OBSERVED_AT_ONCE):
            after = first + _OBSERVED_AT_ONCE
            own = slice(first, after)
            end = self.end if after >= count else self.coefficients[after, :, 0].copy()
            yield Steps(
                self.starts[own], self.rests[own], self.lengths[own], self.coefficients[own], end
            )


Observer = Callable[[Steps], None]
"""A function that takes the steps of a run, some at a time; steps from 0 s begin a new run."""


class StepNotes:
    """The steps that an integrator takes: an observer receives them, and their ends are kept.

    `callback` is called by the integrator after each step, None if nothing is to be noted.
    """

    def __init__(self, integrator: Any, observe: Observer | None, *, ends: bool) -> None:
        """Store an integrator at the start of its run."""
        self._observe, self._wanted = observe, ends
        self._recorder = None if observe is None else _Recorder(integrator)
        self._ends = _Ends(integrator)
        self.callback = self._recorder or (self._ends.note if ends else None)

    def take(self) -> None:
        """Pass on the steps since the last call."""
        if self._recorder is None or self._observe is None:
            self._ends.take()
        elif self._recorder.has_steps:
            steps = self._recorder.steps()
            for portion in steps.portions():
                self._observe(portion)
            if self._wanted:
                self._ends.add(steps.starts, steps.coefficients[:, :, 0])

    @property
    def ends(self) -> tuple[Array, Any]:
        """The times (s) at which steps end, or begin, in float64, and the states, shape (n, 4)."""
        return self._ends.times, self._ends.states


class _Ends:
    """The ends of the steps of a run: `times` (s) in float64, and `states`, shape (n, 4).

    `note` is a callback of heyoka's integrators, for runs that are not recorded otherwise.
    """

    def __init__(self, integrator: Any) -> None:
        """Store an integrator at the start of its run."""
        state = integrator.state
        self._kind, self._stride = state.dtype, 1
        self.times, self.states = np.zeros(0), np.zeros((0, 4), self._kind)
        noted: tuple[list[Any], list[bytes]] = [], []
        note_time, note_state, copied = noted[0].append, noted[1].append, state.tobytes
        self._noted = noted

        def note(integrator: Any) -> bool:
            note_time(integrator.time)
            note_state(copied())
            return True

        self.note = note

    def take(self) -> None:
        """Add the ends that were noted."""
        times, states = self._noted
        if times:
            joined: Any = np.ndarray((len(times), 4), self._kind, b"".join(states))
            self.add(np.array(times, self._kind), joined)
            times.clear()
            states.clear()

    def add(self, times: Any, states: Any) -> None:
        """Add ends, of which only some are kept if they are very many."""
        kept = slice(None, None, self._stride)
        self.times = np.concatenate([self.times, times[kept].astype(float)])
        self.states = np.concatenate([self.states, states[kept]])
        if len(self.times) > _MOST_ENDS:
            self.times, self.states = self.times[::2], self.states[::2]
            self._stride *= 2


class _Recorder:
    """A callback of heyoka's integrators that keeps the steps until they are fetched."""

    def __init__(self, integrator: Any) -> None:
        """Store an integrator at the start of its run."""
        # A view of the integrator's own memory, whose bytes are copied faster than numbers.
        self._integrator, self._coefficients = integrator, integrator.tc
        self._begin()

    def _begin(self) -> None:
        self._from = self._integrator.time
        self._lengths: list[Any] = []
        self._taken: list[bytes] = []

    def __call__(self, integrator: Any) -> bool:
        """Keep a step, and let the integrator continue."""
        self._lengths.append(integrator.last_h)
        self._taken.append(self._coefficients.tobytes())
        return True

    @property
    def has_steps(self) -> bool:
        """Whether steps were taken since the last call of `steps`."""
        return bool(self._lengths)

    def steps(self) -> Steps:
        """Return the steps since the last call."""
        end = self._integrator.state.copy()
        lengths = np.array(self._lengths, end.dtype)
        # Equal steps are rounded alike: the sum of thousands in long doubles misses the times of
        # loads by more than a rounding of float64.
        longest = PRECISIONS["quadruple"]
        begin = longest.lengthened(np.array([self._from], end.dtype))
        exact = np.add.accumulate(np.concatenate([begin, longest.lengthened(lengths)]))[:-1]
        starts = exact.astype(float)
        rests = (exact - starts.astype(exact.dtype)).astype(float)
        shape = len(lengths), *self._coefficients.shape
        coefficients: Any = np.ndarray(shape, end.dtype, b"".join(self._taken))
        found = Steps(starts, rests, lengths, coefficients, end)
        self._begin()
        return found
