"""Runs that are repeated with shorter steps until none of these passes a change of the loads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

MOST_STEPS_TO_SEE = 20_000
"""Steps over a motion that are short enough to see a change, if any are and a step is costly."""


class Looked(NamedTuple):
    """A run, and the longest step (s) that would see a change which one of its steps passed.

    That is infinite if none did.
    """

    run: Any
    longest_step: float


class UnseenError(Exception):
    """The steps of a run pass a change of the loads, however short they are made."""

    def __init__(self, run: Any, length: float) -> None:
        """Store the run, and the length of the steps (s)."""
        super().__init__(unseen_change(length))
        self.run = run


def unseen_change(length: float) -> str:
    """Return why an error is unknown where steps of a length (s) passed a change of the loads."""
    return (
        f"steps of {length:.2g} s pass a change of the loads; an effect that changes so fast must "
        "declare its shortest_time"
    )


def shortened_run(longest: float, shortest: float, made: Callable[[float], Looked]) -> Any:
    """Return the run with the longest steps (s) that pass no change of the loads.

    `made` returns a run whose steps are no longer than a time (s). Raises `UnseenError` where steps
    would be shorter than the `shortest` (s).
    """
    while True:
        run, seeing = made(longest)
        if seeing >= longest:
            return run
        if seeing < shortest:
            raise UnseenError(run, longest)
        longest = seeing
