"""Compilation ahead of use: modes are compiled in a thread beside the runs that will need them.

A run and its judge enter the same kinds of modes, and a kind takes as long to compile as hundreds
of steps. heyoka releases Python's global lock while it compiles, so that another core compiles
while a run takes steps.
"""

from __future__ import annotations

import os
from collections import deque
from contextlib import suppress
from threading import Event, Lock, Thread

from twolink.interruptible import begun
from twolink.simulation.hybrid.compile import compiled_kind
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.kind import Kind, Target

# Held while a thread compiles. A fork waits for it: the child would inherit the locks of a
# compilation in progress, without the thread that releases them.
_COMPILING = Lock()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(
        before=_COMPILING.acquire,
        after_in_parent=_COMPILING.release,
        after_in_child=_COMPILING.release,
    )

# Time (s) in which a compilation ends that is in progress.
_ENDING = 10.0

_Request = tuple[Kind, Target]


class Ahead:
    """The kinds of modes that runs have entered, and those that are compiled for the next runs."""

    def __init__(self) -> None:
        """Begin without modes."""
        self._entered: dict[Kind, None] = {}
        self._targets: tuple[Target, ...] = ()
        # The requests that were not cancelled, each with the event of its end, and those of them
        # that have not begun. The lock is that of the last and of the thread.
        self._coming: dict[_Request, Event] = {}
        self._waiting: deque[_Request] = deque()
        self._thread: Thread | None = None
        self._lock = Lock()
        self._process = os.getpid()
        self._is_open = True

    def close(self) -> None:
        """Cancel all compilations that have not begun, and wait for the one in progress.

        Runs that go on compile for themselves.
        """
        self.expect()
        thread = self._thread if self._has_thread else None
        self._is_open = False
        if thread is not None:
            thread.join(_ENDING)

    def expect(self, *targets: Target) -> None:
        """Compile for the next runs each kind of modes that a run has entered, or will enter.

        The first target is served first. Requests for other targets are cancelled.
        """
        self._targets = targets
        if not self._has_thread:
            return
        with self._lock:
            for request in tuple(self._waiting):
                if request[1] not in targets:
                    self._cancel(request)
        for target in targets:
            for kind in tuple(self._entered):
                self._request(kind, target)

    def compiled(self, kind: Kind, target: Target) -> CompiledMode:
        """Return the integrators of a kind of modes that a run enters.

        It waits for their compilation in progress, and raises what that raises.
        """
        if self._has_thread:
            if kind not in self._entered and kind.is_shared and not kind.optimised:
                self._entered[kind] = None
                for other in self._targets:
                    if other != target:
                        self._request(kind, other)
            self._await((kind, target))
        return compiled_kind(kind, target)

    @property
    def _has_thread(self) -> bool:
        """Whether it is open in the process of the thread: a forked one has no copy of it."""
        return self._is_open and self._process == os.getpid()

    def _await(self, request: _Request) -> None:
        """Cancel a request that has not begun, and wait for the end of one that has."""
        with self._lock:
            if request in self._waiting:
                self._cancel(request)
        if (ended := self._coming.get(request)) is not None:
            ended.wait()

    def _cancel(self, request: _Request) -> None:
        self._waiting.remove(request)
        del self._coming[request]

    def _request(self, kind: Kind, target: Target) -> None:
        """Compile a kind of modes in the thread, after those that were requested before.

        Where no thread can be started, runs compile for themselves.
        """
        request = kind, target
        with self._lock:
            if request in self._coming:
                return
            self._coming[request] = Event()
            self._waiting.append(request)
            if self._thread is None:
                try:
                    self._thread = begun(self._compile, "compilation")
                except RuntimeError:
                    self._cancel(request)

    def _compile(self) -> None:
        """Compile all requests, in their order."""
        while True:
            with self._lock:
                if not self._waiting:
                    self._thread = None
                    return
                kind, target = self._waiting.popleft()
            with _COMPILING, suppress(BaseException):
                # The run that needs the mode compiles it again, and raises the error.
                compiled_kind(kind, target)
            self._coming[kind, target].set()
