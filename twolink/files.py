"""Files: read within bounds, written whole or not at all, and cleaned up after a kill.

A temporary file has a name that begins with `.twolink-` beside a file, or `twolink-` in the folder
for temporary files, and is locked while the process that made it lives. One that is not locked
was left by a killed process, and the next process removes it.
"""

from __future__ import annotations

import atexit
import errno
import os
import secrets
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import takewhile
from pathlib import Path

from twolink.errors import FileError
from twolink.text import one_line

try:
    import fcntl
except ImportError:  # Windows has no such locks, and nothing is cleaned up there.
    fcntl = None  # type: ignore[assignment]

_BESIDE = ".twolink-"
_FOLDER = "twolink-"

# Temporary files and folders that exist, or may exist, each with the process that makes it and the
# function that removes it.
_PRESENT: dict[Path, tuple[int, Callable[[Path], None]]] = {}

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
_REASONS = {
    errno.ENOENT: "there is no file of this name",
    errno.ENOTDIR: "there is no file of this name, for a part of its path is no folder",
    errno.ELOOP: "is a loop of links",
    errno.ENAMETOOLONG: "is a name that is too long for a file",
}
_MARKS = (
    (b"\xef\xbb\xbf", "UTF-8"),
    (b"\xff\xfe", "UTF-16"),
    (b"\xfe\xff", "UTF-16"),
)


def read_bytes(path: Path, largest: int) -> bytes:
    """Return the content of a regular file of at most `largest` bytes.

    Raises `FileError` whose sentence begins with the fault and leaves out the file's name: for
    folders, pipes, devices, loops of links, names that no file can have, and larger files.
    """
    check_readable(path, largest)
    try:
        with path.open("rb") as stream:
            content = stream.read(largest + 1)
    except OSError as error:
        raise FileError(_unreadable(error)) from error
    _check_size(len(content), largest)
    return content


def check_readable(path: Path, largest: int) -> None:
    """Raise `FileError` for anything but a regular file of at most `largest` bytes.

    It is not opened, since opening a pipe may block, and opening a device may affect it.
    """
    try:
        found = path.stat()
    except OSError as error:
        raise FileError(_unreadable(error)) from error
    except ValueError as error:
        raise FileError("has a NUL character in its name; must be the name of a file") from error
    kind = _kind(found.st_mode)
    if kind:
        raise FileError(f"must be a regular file; got {kind}")
    _check_size(found.st_size, largest)


def check_no_mark(content: bytes) -> None:
    """Raise `FileError` for text that begins with a byte order mark."""
    for mark, encoding in _MARKS:
        if content.startswith(mark):
            raise FileError(
                f"must be UTF-8 text without a byte order mark; got a mark of {encoding}"
            )


def _unreadable(error: OSError) -> str:
    reason = _REASONS.get(error.errno or 0)
    return f"{reason or f'cannot be read ({error.strerror})'}; must be a file that can be read"


def _check_size(size: int, largest: int) -> None:
    if size > largest:
        raise FileError(f"must be at most {largest / 2**20:.4g} MB; got a larger file")


def _kind(mode: int) -> str:
    """Return the kind of anything but a regular file; empty for a regular file."""
    named = next((words for test, words in _KINDS if test(mode)), "something else")
    return "" if stat.S_ISREG(mode) else named


def check_writable(path: Path) -> None:
    """Raise `FileError` where a file could not be written by `atomic_write`."""
    target = _target(path)
    try:
        with _temporary_file(target):
            pass
    except OSError as error:
        raise _unwritable(path, error) from error


def check_folder(path: Path) -> None:
    """Raise `FileError` where a folder could not be made, or not written to if it exists."""
    try:
        nearest = next(place for place in (path, *path.absolute().parents) if _is_there(place))
        with scratch_folder("check", str(nearest)):
            pass
    except OSError as error:
        raise _unwritable(path, error) from error


def _is_there(path: Path) -> bool:
    """Return whether a path exists; unlike `Path.exists`, raise `OSError` if that is unknown."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    return True


def is_same_file(one: Path, other: Path) -> bool:
    """Return whether two names, or the links that they are, lead to one file that exists."""
    try:
        return one.samefile(other)
    except (OSError, ValueError):
        return False


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary file beside `path`, which takes its place once all is written.

    If anything goes wrong, or the work is interrupted, `path` is as it was before. Links are
    followed; a file that was there keeps its permissions, and a new one has those that the umask
    leaves. Raises `FileError` where it cannot be written, also when the disk is full.
    """
    target = _target(path)
    try:
        _clean(target.parent, _BESIDE, Path.unlink)
        with _temporary_file(target) as temporary:
            yield temporary
            _sync(temporary)
            temporary.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from error


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Yield a folder, which is made with its parents if it does not exist.

    If anything goes wrong, folders that were made are removed again, unless something is in them.
    Raises `FileError` where the folder cannot be made.
    """
    whole = path.absolute()
    made = list(takewhile(lambda place: not os.path.lexists(place), (whole, *whole.parents)))
    try:
        try:
            whole.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise _unwritable(path, error) from error
        yield path
    except BaseException:
        with suppress(OSError):
            for folder in made:
                folder.rmdir()
        raise


def _unwritable(path: Path, error: OSError) -> FileError:
    reason = _REASONS.get(error.errno or 0) or error.strerror or error
    return FileError(f"{one_line(path, 300)}: cannot be written ({reason})")


def _target(path: Path) -> Path:
    """Return the file to write, where links lead to; raise `FileError` where there can be none."""
    name = one_line(path, 300)
    try:
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise FileError(f"{name}: its folder does not exist; must be in a folder that does")
        with suppress(FileNotFoundError):
            there = target.stat()
            if kind := _kind(there.st_mode) or _kind_of_stream(there):
                raise FileError(f"{name}: must be a regular file, or a new one; got {kind}")
            # It is replaced, and not written to: its folder alone would decide.
            if not os.access(target, os.W_OK):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise _unwritable(path, error) from error
    except ValueError as error:
        raise FileError(f"{name}: has a NUL character; must be the name of a file") from error
    return target


def _kind_of_stream(there: os.stat_result) -> str:
    """Return which of its own streams a file is, such as /dev/stdout: it cannot be replaced."""
    for number, words in ((1, "the standard output"), (2, "the standard error")):
        with suppress(OSError):
            if os.path.samestat(there, os.fstat(number)):
                return words
    return ""


@contextmanager
def scratch_folder(kind: str, parent: str | None = None) -> Iterator[Path]:
    """Yield a new folder for temporary files, which is removed with all that is in it.

    Folders of this `kind` that processes have left behind which were killed are removed before.
    """
    place = Path(parent or tempfile.gettempdir())
    prefix = f"{_FOLDER}{kind}-"
    _clean(place, prefix, _remove_tree)
    with _temporary(place, prefix, _new_folder, _remove_tree) as folder:
        yield folder


@contextmanager
def _temporary_file(target: Path) -> Iterator[Path]:
    """Yield a new file beside a target, with the permissions that the target shall have."""

    def made(path: Path) -> int:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        with suppress(FileNotFoundError):
            # By its number: its name may be gone already.
            os.chmod(handle, stat.S_IMODE(target.stat().st_mode))
        return handle

    with _temporary(target.parent, _BESIDE, made, _remove_file) as path:
        yield path


def _new_folder(path: Path) -> int:
    path.mkdir(mode=0o700)
    return os.open(path, os.O_RDONLY)


def _remove_file(path: Path) -> None:
    path.unlink(missing_ok=True)


@contextmanager
def _temporary(
    place: Path, prefix: str, make: Callable[[Path], int], remove: Callable[[Path], None]
) -> Iterator[Path]:
    """Yield a new file or folder, which is locked and afterwards removed.

    `make` returns its handle. Its name is known before it exists, so that an interrupt at any
    moment leaves nothing, or leaves it to `remove_interrupted`.
    """
    while True:
        path, handle = place / f"{prefix}{secrets.token_hex(8)}", None
        _PRESENT[path] = os.getpid(), remove
        try:
            handle = make(path)
            # Another process may have cleaned it up before it was locked.
            if locked(handle) and path.exists():
                yield path
                return
        finally:
            remove(path)
            if handle is not None:
                os.close(handle)
            _PRESENT.pop(path, None)


@atexit.register
def remove_interrupted() -> None:
    """Remove temporary files of this process whose own removal a signal has interrupted.

    To be called where the process does no other work any more.
    """
    for path, (process, remove) in list(_PRESENT.items()):
        if process == os.getpid():
            with suppress(OSError):
                remove(path)
            _PRESENT.pop(path, None)


def locked(handle: int) -> bool:
    """Return whether a file or folder is now locked by this process, and was not by another."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        # A file system without locks: nothing on it is cleaned up.
        return True
    return True


def _clean(folder: Path, prefix: str, remove: Callable[[Path], None]) -> None:
    """Remove temporary files of killed processes from a folder."""
    if fcntl is None:
        return
    with suppress(OSError):
        for left in folder.glob(f"{prefix}*"):
            with suppress(OSError):
                _remove_unlocked(left, remove)


def _remove_unlocked(left: Path, remove: Callable[[Path], None]) -> None:
    handle = os.open(left, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    try:
        mine = os.fstat(handle).st_uid == os.geteuid()
        if mine:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            remove(left)
    finally:
        os.close(handle)


def _remove_tree(folder: Path) -> None:
    # Processes that are just dying may still write for a moment.
    for _ in range(50):
        shutil.rmtree(folder, ignore_errors=True)
        if not os.path.lexists(folder):
            return
        time.sleep(0.02)


def _sync(file: Path) -> None:
    """Wait until a file is on the disk: some file systems say only then that they are full."""
    with file.open("rb") as stream:
        try:
            os.fsync(stream.fileno())
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTSUP):
                raise
