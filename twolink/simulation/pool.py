"""Compiled integrators, each lent to one run at a time.

An integrator of heyoka has compiled code and the state of one motion. The code is shared by all
runs of similar scenes, in any thread and in callbacks of another run; the state is not.
"""

from __future__ import annotations

import copy
from typing import Any


class _Loan:
    """An integrator on loan: a context that puts it back among the idle ones."""

    __slots__ = ("_idle", "_integrator")

    def __init__(self, integrator: Any, idle: list[Any]) -> None:
        self._integrator, self._idle = integrator, idle

    def __enter__(self) -> Any:
        return self._integrator

    def __exit__(self, *exception: object) -> None:
        self._idle.append(self._integrator)


class IntegratorPool:
    """Copies of one compiled integrator, as many as were in use simultaneously.

    `original` is never lent, so that it can be copied at any time. A copy takes one or two
    milliseconds, a twentieth of a compilation.
    """

    def __init__(self, original: Any) -> None:
        """Store a compiled integrator that has no other user."""
        self.original = original
        self._idle: list[Any] = []

    def lend(self) -> _Loan:
        """Lend an integrator exclusively, until the end of a `with` statement.

        Its state and time are those of its last run. The caller sets its state, its time and its
        parameters before use.
        """
        # No lock is needed; a forked process could inherit a locked one.
        try:
            integrator = self._idle.pop()
        except IndexError:
            integrator = copy.deepcopy(self.original)
        return _Loan(integrator, self._idle)

    def __reduce__(self) -> tuple[Any, ...]:
        return IntegratorPool, (self.original,)
