"""Errors across events, in two parts: when an event is, and what the motion is like when it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from twolink.accuracy.truth import Truth
from twolink.accuracy.ways import Outcome


@dataclass(frozen=True)
class EventErrors:
    """How far the events of a run err, those of the truth counted one by one.

    `time` is the largest error of an event's time (s): it is the error of the motion divided by
    how fast the event is approached, and the error of finding the event. `approach` is the largest
    error of the speed at which anything is struck (rad/s or m/s), each run at its own event: so
    it is the error of the integration alone. `matched` events of `all` were there in both.
    """

    time: float
    approach: float
    matched: int
    all: int


def event_errors(exact: Truth, outcome: Outcome) -> EventErrors:
    """Return the errors of a run's events and impacts against the true ones, in their order."""
    pairs = list(_pairs(exact, outcome))
    times = [abs(theirs.time - ours.time) for ours, theirs in pairs]
    speeds = [
        abs(theirs.speeds[0] - ours.speeds[0]) for ours, theirs in pairs if hasattr(ours, "speeds")
    ]
    return EventErrors(
        time=float(max(times, default=0.0)),
        approach=float(max(speeds, default=0.0)),
        matched=len(pairs),
        all=len(exact.events) + len(exact.impacts),
    )


def _pairs(exact: Truth, outcome: Outcome) -> Iterator[tuple[Any, Any]]:
    """Return the events that both have, up to where one has another than the other."""
    for ours, theirs in zip(outcome.events, exact.events, strict=False):
        if ours.mode.kind != theirs.mode.kind:
            break
        yield ours, theirs
    for hit, true in zip(outcome.impacts, exact.impacts, strict=False):
        if hit.index != true.index or hit.regime != true.regime:
            break
        yield hit, true
