"""From the name of an engine to a transport.

`cmd: …` is a program, `fmu:FILE` an FMU, `module:object` or a registered name a Python engine.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import os
import shlex
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from twolink.engines.contract import Engine
from twolink.engines.fmu_engine import FmuEngine
from twolink.engines.in_process import InProcess
from twolink.engines.process import ProcessTransport
from twolink.engines.registry import ENGINES, by_name
from twolink.engines.transport import Transport
from twolink.errors import EngineError
from twolink.text import one_line, quoted

GROUP = "twolink.engines"
"""The group of entry points by which packages register engines."""

_COMMAND = "cmd:"
_FMU = "fmu:"


def attach(
    engine: str, *, memory: int = 4 * 2**30, in_process: bool = False
) -> Callable[[], Transport]:
    """Return a function that starts an engine.

    A Python engine and an FMU run in a child process with a limit on memory (bytes), unless
    `in_process`. Raises `EngineError` for a name that is not known, a command that cannot be found,
    or a file that is no FMU of a chain.
    """
    if engine.startswith(_COMMAND):
        command = _command(engine.removeprefix(_COMMAND))
        return lambda: ProcessTransport(command, memory)
    path = _path_of(engine)
    if path.startswith(_FMU):
        # The file is read here, so that a wrong one is refused; its binary is not loaded.
        python_engine(path)
    if in_process:
        return lambda: InProcess(python_engine(path))
    served = [sys.executable, "-m", "twolink.engines.serve", path]
    return lambda: ProcessTransport(served, memory)


def python_engine(path: str) -> Engine:
    """Return the engine `module:object`, a class of engines or one itself, or that of `fmu:FILE`.

    Raises `EngineError`.
    """
    if path.startswith(_FMU):
        file = path.removeprefix(_FMU).strip()
        if not file:
            raise EngineError("fmu: must be followed by the name of a file; got none")
        return FmuEngine(Path(file))
    module, _, name = path.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError) as error:
        raise EngineError(f"engine {quoted(path)} cannot be imported: {error}") from error
    if isinstance(found, type):
        found = found()
    if not isinstance(found, Engine):
        raise EngineError(
            f"engine {quoted(path)} must be a twolink.conformance.contract.Engine;"
            f" got {quoted(found)}"
        )
    found.check_installed()
    return found


def files_of(engine: str) -> tuple[Path, ...]:
    """Return the files that the name of an engine names, whether they exist or not.

    They are that of an FMU, or all words of a command, as an interpreter has its program in one.
    """
    if engine.startswith(_COMMAND):
        with suppress(ValueError):
            return tuple(map(Path, shlex.split(engine.removeprefix(_COMMAND))))
    return (Path(engine.removeprefix(_FMU).strip()),) if engine.startswith(_FMU) else ()


def registered() -> dict[str, str]:
    """Return the registered engines by name, as `module:object`."""
    entries = importlib.metadata.entry_points(group=GROUP)
    kinds = {engine.name: type(engine) for engine in ENGINES}
    own = {name: f"{kind.__module__}:{kind.__qualname__}" for name, kind in kinds.items()}
    return own | {entry.name: entry.value for entry in entries}


def _path_of(engine: str) -> str:
    if engine.startswith(_FMU):
        return engine
    if ":" in engine and all(part.isidentifier() for part in engine.replace(":", ".").split(".")):
        return engine
    try:
        return by_name(engine, registered())
    except EngineError as error:
        also = "or 'module:object', or 'cmd: COMMAND' for a program, or fmu:FILE"
        raise EngineError(f"{error}; {also}") from error


def _command(text: str) -> list[str]:
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise EngineError(f"the command of an engine must be words; got {text!r}") from error
    if not words:
        raise EngineError("the command of an engine must be words; got none")
    if not _is_there(words[0]):
        raise EngineError(f"{one_line(words[0], 200)}: there is no such command")
    return words


def _is_there(program: str) -> bool:
    from shutil import which

    return which(program) is not None or os.access(program, os.X_OK)
