"""Inputs run, each in a fork of a process that has imported everything, and judged."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from tests.fuzz.dice import Input
from tests.processes import computed

PATIENCE, ASLEEP = 10.0, 600.0
"""Seconds of computing after which a command hangs, and of waiting: the machine may be busy."""

_CODES = {0, 1, 2, 129, 130, 143}
_SIGNALS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code (None where it hung), and its output."""

    code: int | None
    out: str
    err: str
    seconds: float


def run(given: Input, scratch: Path) -> Ended:
    """Run a command in a fork, with its streams in files."""
    streams = {name: scratch / f"std{name}" for name in ("out", "err")}
    begin = time.monotonic()
    # A signal that came between the fork and `_become` would end the campaign in the child, too.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
    child = os.fork()
    if child == 0:
        _become(given, streams, scratch / "out")
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    code = _awaited(child, given, begin)
    said = {
        name: file.read_bytes().decode(errors="replace") if file.exists() else ""
        for name, file in streams.items()
    }
    for file in streams.values():
        file.unlink(missing_ok=True)
    return Ended(code, said["out"], said["err"], time.monotonic() - begin)


def _become(given: Input, streams: dict[str, Path], folder: Path) -> None:
    """Be the command, in a folder; never returns."""
    code = 70
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _SIGNALS)
        for number, name in ((1, "out"), (2, "err")):
            handle = os.open(streams[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(handle, number)
            os.close(handle)
        os.chdir(folder)
        _shut(given.shut)
        os.environ.update(given.environment)
        tempfile.tempdir = given.environment.get("TMPDIR")
        sys.stdout = sys.__stdout__ = _stream(1)
        sys.stderr = sys.__stderr__ = _stream(2)
        code = _command(given.words) if given.call is None else given.call()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 70
    except KeyboardInterrupt:
        # The signal came before the command began: the command itself handles signals.
        code = 130
    except BaseException:
        import traceback

        os.write(2, traceback.format_exc().encode(errors="replace"))
    finally:
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        for stream in (sys.stdout, sys.stderr):
            try:
                stream.flush()
            except (OSError, ValueError, AttributeError):
                code = code or 70
        os._exit(code)


def _command(words: list[str]) -> int:
    from twolink.cli import main

    sys.argv = ["twolink", *words]
    main()
    return 0


def _stream(number: int):
    try:
        os.fstat(number)
    except OSError:
        return None
    return open(number, "w", encoding="utf-8", closefd=False)


def _shut(which: str) -> None:
    """Close streams, or fill them."""
    name, _, how = which.partition(" ")
    numbers = {"stdin": (0,), "stdout": (1,), "stderr": (2,), "all": (0, 1, 2), "": ()}[name]
    for number in numbers:
        if how == "closed":
            os.close(number)
        elif how == "full":
            os.dup2(os.open("/dev/full", os.O_WRONLY), number)
        else:
            theirs, ours = os.pipe()
            os.close(theirs)
            os.dup2(ours, number)


def _awaited(child: int, given: Input, begin: float) -> int | None:
    """Return the exit code of a process, or None if it had to be killed."""
    struck = given.interrupted is None
    while True:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status)
        waited = time.monotonic() - begin
        if not struck and waited > (given.interrupted or 0.0):
            os.kill(child, int(given.environment["SIGNAL"]))
            struck = True
        if waited > ASLEEP or computed(child) > PATIENCE:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return None
        time.sleep(0.005)


def faults(given: Input, ended: Ended, before: set[Path], scratch: Path) -> list[str]:
    """Return the faults of the end of a command."""
    found = []
    if ended.code is None:
        found.append(f"hangs after {PATIENCE:g} s of computing, or {ASLEEP:g} s")
    elif ended.code not in _CODES and not _killed_before_it_began(given, ended):
        found.append(f"exit code {ended.code}")
    if "Traceback" in ended.err + ended.out:
        found.append("a traceback")
    if given.refused and ended.code != 2:
        found.append(f"exit code {ended.code} where 2 is due")
    if given.refused is False and ended.code not in (0, 1):
        found.append(f"exit code {ended.code} where 0 is due")
    if given.refused and ended.err.count("\n") != 1:
        found.append(f"{ended.err.count(chr(10))} lines of a refusal")
    # A progress bar is drawn again and again, and erased.
    complaint = ended.err.rpartition("\x1b[2K")[2]
    if len(complaint) > 1500:
        found.append(f"{len(complaint)} characters of complaint")
    if "FORCE_COLOR" not in given.environment and "\x1b" in ended.out + ended.err:
        found.append("an escape sequence")
    # A store of results is a folder, whose files it may have.
    stores = [out for out in given.out if _is_store(out)]
    left = {path for path in scratch.rglob("*") if path not in before} - set(given.out)
    left = {path for path in left if not any(path.is_relative_to(store) for store in stores)}
    if left:
        found.append(f"left behind: {', '.join(sorted(path.name for path in left))}")
    if ended.code == 2:
        found += [f"{file.name} written" for file in given.out if _new(file, before)]
    return found


def _is_store(file: Path) -> bool:
    """Return whether a name is that of a store of results, or the file is one: Python takes any."""
    try:
        return file.suffix == ".zarr" or (file / "zarr.json").is_file()
    except OSError:
        return False


def _killed_before_it_began(given: Input, ended: Ended) -> bool:
    """Return whether the signal came before the command could take it."""
    return given.interrupted is not None and ended.code is not None and ended.code < 0


def _new(file: Path, before: set[Path]) -> bool:
    try:
        made = file.is_dir() if _is_store(file) else file.is_file()
        return made and file not in before
    except OSError:
        return False
