"""Compilation ahead of use, in a thread beside the runs.

heyoka releases Python's global lock while it compiles, so that another core compiles while a run
takes steps, or compiles as well.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Hashable
from contextlib import suppress
from threading import Event, Lock, Thread

from twolink.interruptible import begun

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


class CompilationThread:
    """Requests for compilations by their keys, which a thread makes one after another.

    The results are in the caches of the functions that compile. A caller that needs one `wait`s
    for it, and calls the function itself.
    """

    def __init__(self) -> None:
        """Begin without requests, and without a thread."""
        # The requests that were not cancelled, each with the event of its end, and those of them
        # that have not begun. The lock is that of the last and of the thread.
        self._coming: dict[Hashable, Event] = {}
        self._waiting: deque[tuple[Hashable, Callable[[], object]]] = deque()
        self._thread: Thread | None = None
        self._lock = Lock()
        self._process = os.getpid()
        self._is_open = True

    @property
    def works(self) -> bool:
        """Whether it is open in the process of the thread: a forked one has no copy of it."""
        return self._is_open and self._process == os.getpid()

    def request(self, key: Hashable, work: Callable[[], object]) -> None:
        """Do some work in the thread, after all that was requested before.

        Where no thread can be started, callers compile for themselves.
        """
        with self._lock:
            if not self.works or key in self._coming:
                return
            self._coming[key] = Event()
            self._waiting.append((key, work))
            if self._thread is None:
                try:
                    self._thread = begun(self._work, "compilation")
                except RuntimeError:
                    self._cancel(key)

    def keep(self, wanted: Callable[[Hashable], bool]) -> None:
        """Cancel the requests that have not begun, except those whose keys are wanted."""
        with self._lock:
            for key in [key for key, _ in self._waiting if not wanted(key)]:
                self._cancel(key)

    def wait(self, key: Hashable) -> None:
        """Cancel a request that has not begun, and wait for the end of one that has."""
        if not self.works:
            return
        with self._lock:
            self._cancel(key)
        if (ended := self._coming.get(key)) is not None:
            ended.wait()

    def close(self) -> None:
        """Cancel all requests that have not begun, and wait for the one in progress."""
        thread = self._thread if self.works else None
        if thread is not None:
            self.keep(lambda key: False)
        self._is_open = False
        if thread is not None:
            thread.join(_ENDING)

    def _cancel(self, key: Hashable) -> None:
        for request in self._waiting:
            if request[0] == key:
                self._waiting.remove(request)
                del self._coming[key]
                return

    def _work(self) -> None:
        """Do all that is requested, in its order."""
        while True:
            with self._lock:
                if not self._waiting:
                    self._thread = None
                    return
                key, work = self._waiting.popleft()
            with _COMPILING, suppress(BaseException):
                # The caller that needs the result compiles it again, and raises the error.
                work()
            self._coming[key].set()
