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

PATIENCE, ASLEEP = 10.0, 600.0
"""Seconds of computing after which a command hangs, and of waiting: the machine may be busy."""

_CODES = {0, 1, 2, 129, 130, 143}


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
    child = os.fork()
    if child == 0:
        _become(given, streams, scratch / "out")
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
        # It came before the command began; the command itself lets none out, as a test shows.
        code = 130
    except BaseException:
        import traceback

        os.write(2, traceback.format_exc().encode(errors="replace"))
    finally:
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
        if waited > ASLEEP or _computed(child) > PATIENCE:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return None
        time.sleep(0.005)


def _computed(process: int) -> float:
    """Return the seconds that a process has computed."""
    with open(f"/proc/{process}/stat", encoding="utf-8") as stream:
        fields = stream.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def faults(given: Input, ended: Ended, before: set[Path], scratch: Path) -> list[str]:
    """Return the fault of the end of a command, or nothing."""
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
    if len(ended.err) > 1500:
        found.append(f"{len(ended.err)} characters of complaint")
    if "FORCE_COLOR" not in given.environment and "\x1b" in ended.out + ended.err:
        found.append("an escape sequence")
    left = {path for path in scratch.rglob("*") if path not in before} - set(given.out)
    if left:
        found.append(f"left behind: {', '.join(sorted(path.name for path in left))}")
    if ended.code == 2:
        found += [f"{file.name} written" for file in given.out if _new(file, before)]
    return found


def _killed_before_it_began(given: Input, ended: Ended) -> bool:
    """Return whether the signal came before the command could take it."""
    return given.interrupted is not None and ended.code is not None and ended.code < 0


def _new(file: Path, before: set[Path]) -> bool:
    try:
        return file.is_file() and file not in before
    except OSError:
        return False
