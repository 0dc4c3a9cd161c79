"""Imports of a command in less time: without side effects of libraries, or beside other work.

They change the garbage collector and the environment, so only where `main` has begun a process for
the command, and not where a command runs inside another program.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from importlib import import_module

from twolink.interruptible import begun

# Time (s) in which the imports of a thread end, unless they wait for each other without end.
_PATIENCE = 1.0

_OWN_PROCESS = ContextVar("own_process", default=False)

# NumPy's OpenBLAS would start a thread for each core, which first waits busily for some 50 ms: it
# has no use for matrices as small as ours. Pydantic would search all installed packages for
# plugins, which have no part in reading a scene.
_ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "PYDANTIC_DISABLE_PLUGINS": "1"}


@contextmanager
def own_process() -> Iterator[None]:
    """Run a command that is all the work of this process; it begins without collecting garbage."""
    before = _OWN_PROCESS.set(True)
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        _OWN_PROCESS.reset(before)


def begin_command() -> None:
    """Collect garbage from now on, but not among the objects that imports have made until now.

    Almost all of these live as long as the process, and collections would look through them.
    """
    if _OWN_PROCESS.get():
        gc.freeze()
        gc.enable()


@contextmanager
def importing() -> Iterator[None]:
    """Import libraries within, and read input, without collecting garbage.

    Libraries start no threads and search for no plugins; processes that are started later have the
    environment of the user. Not for long work: what it leaves stays in memory.
    """
    if not _OWN_PROCESS.get():
        yield
        return
    gc.disable()
    try:
        with _environment():
            yield
    finally:
        begin_command()


@contextmanager
def _environment() -> Iterator[None]:
    """Set variables for libraries that are imported within, unless the user has set them."""
    unset = [name for name in _ENVIRONMENT if name not in os.environ]
    os.environ.update({name: _ENVIRONMENT[name] for name in unset})
    try:
        yield
    finally:
        for name in unset:
            os.environ.pop(name, None)


@contextmanager
def imported_meanwhile(*modules: str) -> Iterator[None]:
    """Import modules in a thread during the block, which waits for them at its end.

    After an error in the block it waits for a second only.

    LLVM and the integrators run without Python's lock, so where there is a second core, imports
    take no time beside them. An error of an import is left to the next import of the module.
    """

    def import_all() -> None:
        with suppress(ImportError):
            for name in modules:
                import_module(name)

    thread = begun(import_all)
    try:
        yield
        thread.join()
    except BaseException:
        # An import that was interrupted leaves its module locked, and the thread may need it.
        thread.join(_PATIENCE)
        raise
