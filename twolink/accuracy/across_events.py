"""Errors across events: the error of event times and of the approach speed at events."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from twolink.accuracy.method_configurations import MeasuredRun
from twolink.accuracy.reference_trajectory import ReferenceTrajectory
from twolink.simulation.hybrid.mode import Impact


@dataclass(frozen=True)
class EventErrors:
    """Errors of the events of a run against the events of the reference.

    `time` is the largest error of an event's time (s): the error of the motion divided by the
    approach speed, plus the error of locating the event. `approach` is the largest error of an
    impact's approach speed (rad/s or m/s), each run evaluated at its own event, which isolates the
    error of integration. `matched` of the `all` events occur in both runs.
    """

    time: float
    approach: float
    matched: int
    all: int


def event_errors(exact: ReferenceTrajectory, result: MeasuredRun) -> EventErrors:
    """Return the errors of a run's events and impacts against the reference, in order."""
    pairs = list(_pairs(exact, result))
    times = [abs(theirs.time - ours.time) for ours, theirs in pairs]
    speeds = [
        abs(theirs.speeds[0] - ours.speeds[0]) for ours, theirs in pairs if isinstance(ours, Impact)
    ]
    return EventErrors(
        time=float(max(times, default=0.0)),
        approach=float(max(speeds, default=0.0)),
        matched=len(pairs),
        all=len(exact.events) + len(exact.impacts),
    )


def _pairs(exact: ReferenceTrajectory, result: MeasuredRun) -> Iterator[tuple[Any, Any]]:
    """Return the pairs of equal events, up to the first pair that differs."""
    for ours, theirs in zip(result.events, exact.events, strict=False):
        if ours.mode.kind != theirs.mode.kind:
            break
        yield ours, theirs
    for hit, true in zip(result.impacts, exact.impacts, strict=False):
        if hit.index != true.index or hit.regime != true.regime:
            break
        yield hit, true
