"""Compilation ahead of use: modes are compiled in a thread beside the runs that will need them.

A run and its judge enter the same kinds of modes, which take as long to compile as thousands of
steps. heyoka compiles without the interpreter: another core may do it meanwhile.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from types import TracebackType
from typing import Self

from twolink.simulation.hybrid.compile import Kind, Target, compiled_kind
from twolink.simulation.hybrid.compiled import CompiledMode


class Ahead:
    """The kinds of modes that runs have entered, and those that are compiled for the next runs.

    It is a context, at whose end nothing more is compiled.
    """

    def __init__(self) -> None:
        """Begin without modes."""
        self._entered: dict[Kind, None] = {}
        self._targets: tuple[Target, ...] = ()
        self._coming: dict[tuple[Kind, Target], Future[CompiledMode]] = {}
        self._thread = ThreadPoolExecutor(1, "compilation")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        # A compilation in progress, of some hundredths of a second, ends by itself.
        self._thread.shutdown(wait=False, cancel_futures=True)

    def expect(self, *targets: Target) -> None:
        """Compile all kinds of modes that runs have entered, and will enter, for the next runs.

        Those for the first of these come first. Nothing more is compiled for any other run.
        """
        for (_, target), coming in self._coming.items():
            if target not in targets:
                coming.cancel()
        self._targets = targets
        for target in targets:
            for kind in tuple(self._entered):
                self._request(kind, target)

    def compiled(self, kind: Kind, target: Target) -> CompiledMode:
        """Return the integrators of a kind of modes that a run enters."""
        if kind not in self._entered and kind.is_shared and not kind.optimised:
            self._entered[kind] = None
            for other in self._targets:
                if other != target:
                    self._request(kind, other)
        coming = self._coming.pop((kind, target), None)
        if coming is not None and not coming.cancel():
            wait([coming])
        return compiled_kind(kind, target)

    def _request(self, kind: Kind, target: Target) -> None:
        """Compile a kind of modes in the thread, after those that were requested before."""
        if (kind, target) not in self._coming:
            self._coming[kind, target] = self._thread.submit(compiled_kind, kind, target)
