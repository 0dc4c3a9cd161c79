"""Limits on the time and memory of a run, and estimates of both.

A run that exceeds a limit is refused before it begins, if that is known, and otherwise on its way.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, thread_time
from typing import NoReturn

from twolink.errors import TooMuchError
from twolink.inputs import as_number, nearest_float, refuse


@dataclass(frozen=True)
class Limits:
    """The most that a call may take: seconds of computing, of all its runs, and bytes of memory.

    If `seconds` is infinite, the work for modes and that in 113 bits are not limited either. Both
    must be positive, and may be infinite; any other value raises `ParameterError`.
    """

    seconds: float = 3600.0
    memory: float = 4e9

    def __post_init__(self) -> None:
        """Check both numbers, and keep them as floats."""
        for name in ("seconds", "memory"):
            given = getattr(self, name)
            number = nearest_float(as_number(name, given))
            if not number > 0:
                refuse(name, given, "a positive number, or infinity")
            object.__setattr__(self, name, number)

    @property
    def are_lifted(self) -> bool:
        """Whether a run may take any time, and any work for modes and in 113 bits."""
        return math.isinf(self.seconds)

    def check_memory(self, description: str, size: float) -> None:
        """Raise `TooMuchError` if something would take more bytes than are allowed."""
        if size > self.memory:
            raise TooMuchError(
                f"{description} would take about {in_bytes(size)} of memory; the limit is "
                f"{in_bytes(self.memory)}{LIFTED}"
            )

    def check_time(self, description: str, seconds: float) -> None:
        """Raise `TooMuchError` if something is known to take more seconds than are allowed."""
        if seconds > self.seconds:
            raise TooMuchError(
                f"{description} would take {in_time(seconds)}; the limit is {in_time(self.seconds)}"
                f"{LIFTED}"
            )

    def timed(
        self, description: str, progress: Callable[[float], None] | None = None
    ) -> Callable[[float], None]:
        """Return a progress callback that ends a run whose estimated time is too long.

        It is that of a `Budget` for one run.
        """
        return Budget(self, description).timed(progress)

    def check_growth(self, description: str, forecast: Forecast, share: float, size: float) -> None:
        """Raise `TooMuchError` if the final size is estimated to be larger than the limit.

        `size` (bytes) is the present one, at a share of the run. The estimate counts as soon as a
        part of the limit is in use.
        """
        total = max(forecast.total(share, size), size)
        if total > self.memory and size > _USED * self.memory:
            raise TooMuchError(
                f"{description} would take about {in_bytes(total)} of memory ({share:.1%} are "
                f"done); the limit is {in_bytes(self.memory)}{LIFTED}"
            )


UNLIMITED = Limits(math.inf, math.inf)
DEFAULT_LIMITS = Limits()

LIFTED = " (--force lifts it, and limits=UNLIMITED in Python)"
"""How a limit is lifted, for a message."""

# Seconds of computing from which an estimate is made, and the most of them in the limit.
_WINDOW, _OF_LIMIT = 1.5, 1 / 4

# Seconds between two readings of a thread's clock: a reading is a system call, up to 0.3 ms in a
# virtual machine, and a run with impacts reports after each of them.
_READING = 0.02

# A part of a run may be far slower than the rest, such as bounces that accumulate. An estimate
# ends a run when this share of the limit is spent, or when the pace since the start exceeds the
# limit by this factor.
_SURE, _FAR = 1 / 60, 1000.0

# Likewise, many short bounces may need more memory than the rest of a run.
_USED = 1 / 8


class Budget:
    """The computing time that all runs for one purpose may take together."""

    def __init__(self, limits: Limits, description: str) -> None:
        """Begin with nothing spent; the description is the subject of a message."""
        self._limits, self._description = limits, description
        self._clocks: list[_ThreadClock] = []

    def timed(self, progress: Callable[[float], None] | None = None) -> Callable[[float], None]:
        """Return a progress callback of a run, which begins now, that ends it if it takes too long.

        It is called in the thread that computes, with the share that is done, and passes it on to
        `progress`. Raises `TooMuchError`.
        """
        limit = self._limits.seconds
        if self._limits.are_lifted:
            return progress or (lambda share: None)
        forecast, clock = Forecast(min(_WINDOW, _OF_LIMIT * limit)), _ThreadClock()
        self._clocks.append(clock)

        def report(share: float) -> None:
            spent = clock.spent()
            before = sum(other.last for other in self._clocks) - spent
            total = before + max(forecast.total(share, spent), spent)
            far = spent > _FAR * limit * share
            if total > limit and (far or before + spent > _SURE * limit):
                self._end(total)
            if progress is not None:
                progress(share)

        return report

    def _end(self, total: float) -> NoReturn:
        estimate = f"about {in_time(total)} of computing"
        if not math.isfinite(total):
            estimate = "more time than can be estimated"
        raise TooMuchError(
            f"{self._description} would take {estimate}; the limit is "
            f"{in_time(self._limits.seconds)}{LIFTED}"
        )


class _ThreadClock:
    """The processor time of the thread (s), at most `_READING` of wall time old.

    Until the first reading it is wall time, so that a short run reads no clock of its thread. The
    `last` reading can be seen from every thread.
    """

    def __init__(self) -> None:
        """Begin at 0."""
        self._begun = self._read = perf_counter()
        self._start: float | None = None
        self.last = 0.0

    def spent(self) -> float:
        """Return the processor time since the beginning (s)."""
        now = perf_counter()
        if now - self._read >= _READING:
            read = thread_time()
            if self._start is None:
                self._start = read - (now - self._begun)
            self._read, self.last = now, read - self._start
        return self.last


class Forecast:
    """Estimate of the final time or memory of a run, from its pace in the last two windows.

    A window ends when the run has spent `window` in it. The lesser of two estimates counts: a
    part of a run may be slower than the rest.
    """

    def __init__(self, window: float) -> None:
        """Begin at a share of 0 with nothing spent."""
        self._window = window
        self._last = (0.0, 0.0)
        self._estimates = (0.0, 0.0)

    def total(self, share: float, spent: float) -> float:
        """Return an estimate of all that will be spent: 0 as long as there is none."""
        done, before = self._last
        if spent - before >= self._window:
            gained = share - done
            left = math.inf if gained <= 0 else max(1 - share, 0.0) * (spent - before) / gained
            self._estimates = (self._estimates[1], spent + left)
            self._last = (share, spent)
        return min(self._estimates)


def in_bytes(size: float) -> str:
    """Return a number of bytes in words."""
    for unit, factor in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size:.3g} bytes"


def in_time(seconds: float) -> str:
    """Return a number of seconds in words."""
    if seconds < 60:
        return f"{seconds:.3g} s"
    for unit, factor in (("years", 31_557_600.0), ("days", 86_400.0), ("hours", 3600.0)):
        if seconds >= 2 * factor:
            return f"{seconds / factor:.3g} {unit}"
    return f"{seconds / 60:.3g} minutes"
