"""Runs that are repeated with shorter steps until none of these passes a change of the loads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from twolink.errors import IntegrationError

SHORTER_TO_RESOLVE = 1 / 4
"""The part of a step that passed a change for which a run is repeated."""

MOST_STEPS_TO_RESOLVE = 20_000
"""The steps over a motion, where steps are costly, beyond which a change is not resolved."""


class CheckedRun(NamedTuple):
    """A run, and the longest step (s) with which it is to be repeated.

    That is infinite if no step of the run passed a change of the loads.
    """

    run: Any
    longest_step: float


class RepeatError(Exception):
    """A run is ended before its end, as it is to be repeated with shorter steps."""

    def __init__(self, longest_step: float) -> None:
        """Store the longest step (s) with which it is to be repeated."""
        super().__init__(f"to be repeated with steps of {longest_step:.2g} s")
        self.longest_step = longest_step


class UnseenError(IntegrationError):
    """The steps of a run pass a change of the loads, however short they are made."""

    def __init__(self, message: str, run: Any = None) -> None:
        """Store the reason, and the run, which stays in its process."""
        super().__init__(message)
        self.run = run

    def __reduce__(self) -> tuple[type[UnseenError], tuple[str]]:
        """Return the copy for another process, without the run."""
        return UnseenError, (str(self),)


def unseen_change(length: float) -> str:
    """Return why an error is unknown where steps of a length (s) passed a change of the loads."""
    return (
        f"steps of {length:.2g} s pass a change of the loads; an effect that changes so fast must "
        "declare its shortest_time"
    )


def shortened_run(longest: float, shortest: float, made: Callable[[float], CheckedRun]) -> Any:
    """Return the run with the longest steps (s) that pass no change of the loads.

    `made` returns a run whose steps are no longer than a time (s), or raises `RepeatError`. Raises
    `UnseenError` where steps would be shorter than the `shortest` (s).
    """
    while True:
        try:
            run, needed = made(longest)
        except RepeatError as error:
            longest = error.longest_step
            continue
        if needed >= longest:
            return run
        if needed < shortest:
            raise UnseenError(unseen_change(longest), run)
        longest = needed
