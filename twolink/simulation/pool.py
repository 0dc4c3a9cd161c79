"""Compiled integrators, each lent to one run at a time.

An integrator of heyoka has compiled code and the state of one motion. The code is shared by all
runs of similar scenes, in any thread and in callbacks of another run; the state is not.
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any


class _Loan:
    """An integrator that can be lent: a context that puts it back among the idle ones."""

    __slots__ = ("_idle", "_lent")

    def __init__(self, lent: Any, idle: list[_Loan]) -> None:
        self._lent, self._idle = lent, idle

    def __enter__(self) -> Any:
        return self._lent

    def __exit__(self, *exception: object) -> None:
        self._idle.append(self)


class IntegratorPool:
    """Copies of one compiled integrator, as many as were in use simultaneously.

    `original` is never lent, so that it can be copied at any time. A copy takes one or two
    milliseconds, a twentieth of a compilation. A `view` gives the object that is lent for each
    copy, once, by default the copy itself.
    """

    def __init__(self, original: Any, view: Callable[[Any], Any] | None = None) -> None:
        """Store a compiled integrator that has no other user."""
        self.original, self._view = original, view
        self._idle: list[_Loan] = []

    def lend(self) -> _Loan:
        """Lend an integrator exclusively, until the end of a `with` statement.

        Its state and time are those of its last run. The caller sets its state, its time and its
        parameters before use.
        """
        # No lock is needed; a forked process could inherit a locked one.
        try:
            return self._idle.pop()
        except IndexError:
            integrator = copy.deepcopy(self.original)
        return _Loan(integrator if self._view is None else self._view(integrator), self._idle)

    def __reduce__(self) -> tuple[Any, ...]:
        return IntegratorPool, (self.original, self._view)
