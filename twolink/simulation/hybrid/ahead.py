"""Compilation of modes ahead of use, in a thread beside the runs that will need them.

A run and its judge enter the same kinds of modes, and a kind takes as long to compile as hundreds
of steps.
"""

from __future__ import annotations

from functools import partial

from twolink.simulation.compilation_thread import CompilationThread
from twolink.simulation.hybrid.compile import compiled_kind
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.kind import Kind, Target


class Ahead:
    """The kinds of modes that runs have entered, and those that are compiled for the next runs."""

    def __init__(self) -> None:
        """Begin without modes."""
        self._entered: dict[Kind, None] = {}
        self._targets: tuple[Target, ...] = ()
        self._thread = CompilationThread()

    def close(self) -> None:
        """Cancel all compilations that have not begun, and wait for the one in progress.

        Runs that go on compile for themselves.
        """
        self._thread.close()

    def expect(self, *targets: Target) -> None:
        """Compile for the next runs each kind of modes that a run has entered, or will enter.

        The first target is served first. Requests for other targets are cancelled.
        """
        self._targets = targets
        if not self._thread.works:
            return
        entered = tuple(self._entered)
        wanted = {(kind, target) for kind in entered for target in targets}
        self._thread.keep(wanted.__contains__)
        for target in targets:
            for kind in entered:
                self._request(kind, target)

    def compiled(self, kind: Kind, target: Target) -> CompiledMode:
        """Return the integrators of a kind of modes that a run enters.

        It waits for their compilation in progress, and raises what that raises.
        """
        if self._thread.works:
            if kind not in self._entered and kind.is_shared and not kind.optimised:
                self._entered[kind] = None
                for other in self._targets:
                    if other != target:
                        self._request(kind, other)
            self._thread.wait((kind, target))
        return compiled_kind(kind, target)

    def _request(self, kind: Kind, target: Target) -> None:
        """Compile a kind of modes in the thread, after those that were requested before."""
        self._thread.request((kind, target), partial(compiled_kind, kind, target))
