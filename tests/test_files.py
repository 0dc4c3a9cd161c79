"""Files: read within bounds, written whole or not at all, and cleaned up after a kill."""

import os
import signal
import socket
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twolink import files
from twolink.errors import FileError
from twolink.files import (
    atomic_write,
    check_folder,
    check_no_mark,
    check_readable,
    check_writable,
    is_same_file,
    new_folder,
    read_bytes,
    scratch_folder,
)


def test_a_file_is_replaced_when_all_is_written(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("old")
    with atomic_write(file) as temporary:
        temporary.write_text("new")
        assert file.read_text() == "old"
    assert file.read_text() == "new"
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize("fault", [RuntimeError, KeyboardInterrupt])
def test_a_failed_write_leaves_the_old_file(tmp_path, fault):
    file = tmp_path / "a.txt"
    file.write_text("old")

    def interrupted():
        with atomic_write(file) as temporary:
            temporary.write_text("half")
            raise fault

    with pytest.raises(fault):
        interrupted()
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


def write(file, text="new"):
    with atomic_write(file) as temporary:
        temporary.write_text(text)


@pytest.mark.parametrize("mask", [0o000, 0o022, 0o077, 0o027])
def test_a_new_file_has_the_permissions_that_the_umask_leaves(mask, tmp_path):
    before = os.umask(mask)
    try:
        write(tmp_path / "a")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o666 & ~mask


def test_a_file_that_was_there_keeps_its_permissions(tmp_path):
    file = tmp_path / "a"
    file.touch(0o600)
    write(file)
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_a_file_has_many_names(tmp_path, monkeypatch):
    file, other, link = tmp_path / "a", tmp_path / "b", tmp_path / "link"
    file.touch()
    other.touch()
    link.symlink_to(file)
    monkeypatch.chdir(tmp_path)
    for name in (file, link, Path("a"), tmp_path / ".." / tmp_path.name / "a"):
        assert is_same_file(file, name)
        assert is_same_file(name, file)
        assert not is_same_file(name, other)
    for none in (tmp_path / "none", Path("a\0"), Path("a" * 5000), file / "a"):
        assert not is_same_file(none, file)
        assert not is_same_file(none, none)


def test_links_are_followed(tmp_path):
    (tmp_path / "far").mkdir()
    link = tmp_path / "link"
    link.symlink_to("far/file")
    for text in ("new", "newer"):
        write(link, text)
        assert link.is_symlink()
        assert (tmp_path / "far" / "file").read_text() == text
    assert sorted(p.name for p in (tmp_path / "far").iterdir()) == ["file"]


def test_a_name_as_long_as_a_file_system_takes_it(tmp_path):
    file = tmp_path / ("x" * 255)
    write(file)
    assert file.read_text() == "new"


@pytest.fixture
def things(tmp_path):
    """Special files, by name."""
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").touch()
    with socket.socket(socket.AF_UNIX) as held:
        here = os.getcwd()
        os.chdir(tmp_path)
        held.bind("socket")
        os.chdir(here)
        yield tmp_path


WORDS = {
    "fifo": "a pipe",
    "loop": "is a loop of links",
    "folder": "a folder",
    "socket": "a socket",
    "/dev/zero": "a device",
    "/dev/null": "a device",
    "a\0b": "has a NUL character",
    "x" * 300: "is a name that is too long",
}


@pytest.mark.parametrize("name", [*WORDS, "none", "file/below"])
def test_each_kind_of_unreadable_file_has_its_own_message(name, things):
    words = WORDS.get(name, "there is no file of this name")
    for check in (lambda path: read_bytes(path, 100), lambda path: check_readable(path, 100)):
        with pytest.raises(FileError) as caught:
            check(things / name)
        assert words in str(caught.value)


@pytest.mark.parametrize("name", [*WORDS, "none/file", "file/below"])
def test_unwritable_paths_are_refused_and_left_unchanged(name, things):
    words = WORDS.get(name, "its folder does not exist")
    before = sorted(path.name for path in things.iterdir())
    for attempt in (check_writable, write):
        with pytest.raises(FileError) as caught:
            attempt(things / name)
        assert words in str(caught.value)
        assert "\0" not in str(caught.value)
    assert sorted(path.name for path in things.iterdir()) == before
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_the_standard_output_is_not_replaced(tmp_path):
    program = (
        "from pathlib import Path; from twolink.files import check_writable\n"
        "check_writable(Path('/dev/stdout'))"
    )
    with (tmp_path / "out").open("wb") as out:
        run = subprocess.run(
            [sys.executable, "-c", program],
            stdout=out,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert "the standard output" in run.stderr


def test_a_folder_that_refuses_new_files_is_detected(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        check_writable(Path("/proc/x.json"))


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    file = tmp_path / "a"
    with file.open("wb") as stream:
        stream.truncate(10**12)
    with pytest.raises(FileError, match="must be at most"):
        read_bytes(file, 2**20)


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff"])
def test_byte_order_marks_are_named(mark):
    check_no_mark(b"abc")
    with pytest.raises(FileError, match="got a mark of UTF-"):
        check_no_mark(mark + b"abc")


def test_a_full_disk_is_one_sentence_and_nothing_is_left(tmp_path, monkeypatch):
    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match=r"a: cannot be written \(No space left on device\)"):
        write(tmp_path / "a")
    assert list(tmp_path.iterdir()) == []


HOLDS = """
import sys, time
from pathlib import Path
from twolink.files import scratch_folder, atomic_write
with atomic_write(Path(sys.argv[1])) as file, scratch_folder("kind", sys.argv[2]) as folder:
    file.write_text("half")
    (folder / "inside").write_text("half")
    print("ready", flush=True)
    time.sleep(60)
"""


def test_leftovers_of_a_killed_process_are_removed_by_the_next(tmp_path):
    beside, scratch = tmp_path / "beside", tmp_path / "scratch"
    beside.mkdir()
    scratch.mkdir()
    (beside / ".twolinkish").touch()
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(beside / "a"), str(scratch)], stdout=subprocess.PIPE
    )
    assert process.stdout.readline() == b"ready\n"
    # While it lives, its files are left alone.
    write(beside / "b")
    with scratch_folder("kind", str(scratch)) as folder:
        assert len(list(scratch.iterdir())) == 2
        assert not list(folder.iterdir())
    assert len(list(beside.iterdir())) == 3
    process.send_signal(signal.SIGKILL)
    process.communicate()
    write(beside / "b")
    with scratch_folder("kind", str(scratch)):
        assert len(list(scratch.iterdir())) == 1
    assert sorted(path.name for path in beside.iterdir()) == [".twolinkish", "b"]
    assert list(scratch.iterdir()) == []


def test_a_scratch_folder_is_removed_with_its_contents(tmp_path):
    with scratch_folder("kind", str(tmp_path)) as folder:
        (folder / "deep" / "deeper").mkdir(parents=True)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_cleaned_up_before_it_is_locked_is_made_again(tmp_path, monkeypatch):
    lock, taken = files.locked, []

    def stolen(handle):
        if not taken:
            taken.append(handle)
            next(tmp_path.glob(".twolink-*")).unlink()
        return lock(handle)

    monkeypatch.setattr(files, "locked", stolen)
    write(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "new"


@pytest.mark.slow
def test_many_writers_of_one_file(tmp_path):
    program = (
        "import sys; from pathlib import Path; from twolink.files import atomic_write\n"
        "for n in range(200):\n"
        "    with atomic_write(Path(sys.argv[1])) as file:\n"
        "        file.write_text(sys.argv[2] * 1000)\n"
    )
    file = tmp_path / "a"
    writers = [
        subprocess.Popen([sys.executable, "-c", program, str(file), letter]) for letter in "abc"
    ]
    end = time.monotonic() + 60
    while any(writer.poll() is None for writer in writers):
        assert time.monotonic() < end
        if file.exists():
            assert len(set(file.read_text())) == 1
            assert len(file.read_text()) == 1000
    assert [writer.returncode for writer in writers] == [0, 0, 0]
    assert list(tmp_path.iterdir()) == [file]


def test_a_new_folder_is_removed_again_if_nothing_came_into_it(tmp_path):
    (tmp_path / "there").mkdir()

    def fails(folder, *, after):
        with new_folder(folder):
            assert folder.is_dir()
            after(folder)
            raise KeyboardInterrupt

    for name in ("there", "there/a/b", "c"):
        with pytest.raises(KeyboardInterrupt):
            fails(tmp_path / name, after=lambda folder: None)
    assert [path.name for path in tmp_path.rglob("*")] == ["there"]
    with pytest.raises(KeyboardInterrupt):
        fails(tmp_path / "d" / "e", after=lambda folder: (folder / "file").touch())
    assert (tmp_path / "d" / "e" / "file").exists()
    with new_folder(tmp_path / "f" / "g"):
        pass
    assert (tmp_path / "f" / "g").is_dir()


def test_a_folder_that_cannot_be_made_is_one_sentence(things):
    for name in ("file", "file/below", "x" * 300):
        with pytest.raises(FileError, match="cannot be written"), new_folder(things / name):
            pass


def test_a_folder_is_checked_without_making_it(things):
    for name in ("new", "new/below", "folder"):
        check_folder(things / name)
    for name in ("file", "file/below", "x" * 300):
        with pytest.raises(FileError, match="cannot be written"):
            check_folder(things / name)
    assert not (things / "new").exists()
    assert not list((things / "folder").iterdir())


def test_a_file_that_may_not_be_written_is_not_replaced(tmp_path, monkeypatch):
    file = tmp_path / "a"
    file.write_text("old")
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != file)
    with pytest.raises(FileError, match=r"a: cannot be written \(Permission denied\)"):
        write(file)
    assert file.read_text() == "old"


def test_the_reason_is_that_of_the_system(tmp_path, monkeypatch):
    def read_only(*_):
        raise OSError(30, os.strerror(30))

    monkeypatch.setattr(os, "open", read_only)
    with pytest.raises(FileError, match=r"a: cannot be written \(Read-only file system\)"):
        check_writable(tmp_path / "a")


@pytest.mark.parametrize(
    "make", [files.atomic_write, lambda path: files.scratch_folder("t", path.parent)]
)
def test_an_interrupt_just_after_a_file_was_made_leaves_nothing(make, tmp_path, monkeypatch):
    """Its name is known before: also an interrupt before anything is returned finds it."""

    def opens(*arguments):
        monkeypatch.undo()
        os.close(os.open(*arguments))
        raise KeyboardInterrupt

    monkeypatch.setattr(files.os, "open", opens)
    with pytest.raises(KeyboardInterrupt), make(tmp_path / "a.txt"):
        pytest.fail("nothing was made")
    assert list(tmp_path.iterdir()) == []


def test_a_signal_during_the_removal_of_a_file_leaves_it_to_the_end(tmp_path, monkeypatch):
    unlink = Path.unlink

    def interrupted(path, missing_ok=False):
        monkeypatch.setattr(Path, "unlink", unlink)
        raise SystemExit(129)

    def write():
        with files.atomic_write(tmp_path / "a.txt"):
            monkeypatch.setattr(Path, "unlink", interrupted)
            raise OSError

    with pytest.raises(SystemExit):
        write()
    (left,) = tmp_path.iterdir()
    assert left.name.startswith(".twolink-")
    files.remove_interrupted()
    assert not list(tmp_path.iterdir())


def test_files_of_another_process_are_left_to_it(tmp_path, monkeypatch):
    with files.atomic_write(tmp_path / "a.txt") as temporary:
        monkeypatch.setattr(os, "getpid", lambda: -1)
        files.remove_interrupted()
        assert temporary.exists()
        temporary.write_text("a")
    assert (tmp_path / "a.txt").read_text() == "a"
