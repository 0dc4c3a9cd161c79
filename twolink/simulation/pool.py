"""Compiled integrators, each lent to one run at a time.

An integrator of heyoka has compiled code and the state of one motion. The code is shared by all
runs of similar scenes, in any thread and in callbacks of another run; the state is not.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class IntegratorPool:
    """Copies of one compiled integrator, as many as were in use simultaneously.

    `original` is never lent, so that it can be copied at any time. A copy takes one or two
    milliseconds, a twentieth of a compilation.
    """

    def __init__(self, original: Any) -> None:
        """Store a compiled integrator that has no other user."""
        self.original = original
        self._idle: list[Any] = []

    @contextmanager
    def lend(self) -> Iterator[Any]:
        """Lend an integrator exclusively; its state and time are those of its last run.

        The caller sets its state, its time and its parameters before use.
        """
        # No lock is needed; a forked process could inherit a locked one.
        try:
            integrator = self._idle.pop()
        except IndexError:
            integrator = copy.deepcopy(self.original)
        try:
            yield integrator
        finally:
            self._idle.append(integrator)

    def __reduce__(self) -> tuple[Any, ...]:
        return IntegratorPool, (self.original,)
