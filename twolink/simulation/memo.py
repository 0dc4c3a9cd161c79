"""Results of functions that are kept, and known to be there."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Generic, TypeVar

Result = TypeVar("Result")


class Memo(Generic[Result]):
    """The last results of a function, by its arguments.

    As `functools.lru_cache`, and it says for which arguments there is a result, which is not None.
    """

    def __init__(self, function: Callable[..., Result], size: int) -> None:
        """Begin without results; the last ones, so many, are kept."""
        self._function, self._size = function, size
        self._kept: dict[tuple[Hashable, ...], Result] = {}
        self._lock = Lock()

    def __contains__(self, arguments: tuple[Hashable, ...]) -> bool:
        """Return whether the result for some arguments is there."""
        return arguments in self._kept

    def __call__(self, *arguments: Hashable) -> Result:
        """Return the result for some arguments, computed if it is not there."""
        with self._lock:
            # The last one that was used is the last one to be dropped.
            found = self._kept.pop(arguments, None)
            if found is not None:
                self._kept[arguments] = found
        if found is None:
            found = self._function(*arguments)
            self._keep(arguments, found)
        return found

    def clear(self) -> None:
        """Drop all results."""
        self._kept.clear()

    def _keep(self, arguments: tuple[Hashable, ...], result: Result) -> None:
        with self._lock:
            self._kept[arguments] = result
            if len(self._kept) > self._size:
                del self._kept[next(iter(self._kept))]
