"""The rows of docs/interruptions.md: each way to end a command early, for each command."""

import ctypes
import errno
import itertools
import os
import re
import resource
import signal
import socket
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from tests.viz.films import pretended_browser, processes_with
from twolink import files
from twolink.cli import app
from twolink.data import data_path

pytestmark = pytest.mark.slow

DOCUMENT = Path(__file__).parent.parent / "docs" / "interruptions.md"
SCENES = data_path("scenes")
FREE_FALL, CONTACT = SCENES / "free_fall.toml", SCENES / "bounce_to_rest.toml"
URDF = data_path("twolink.urdf")

VERDICT = Path(__file__).parent / "conformance" / "verdict.json"
CONFORM = ("conform", "pinocchio", "--suite", "evaluation")

# Every command that writes, as the table names it, with as little to do as possible; and the first
# file that it writes into the folder {out}.
WRITERS = {
    "simulate --out": (["simulate", CONTACT, "--samples", 50, "--out", "{out}/a.csv"], "a.csv"),
    "verify --json": (["verify", "--states", 3, "--json", "{out}/a.json"], "a.json"),
    "hardcases --json": (
        ["hardcases", "--case", "aligned", "--ours", "--json", "{out}/a.json"],
        "a.json",
    ),
    "plot --out": (["plot", FREE_FALL, "--kind", "angles", "--out", "{out}/a.svg"], "a.svg"),
    "reference --out": (["reference", FREE_FALL, "--digits", 8, "--out", "{out}/a.json"], "a.json"),
    "sensitivity --out": (
        ["sensitivity", FREE_FALL, "--by", "q1", "--samples", 50, "--out", "{out}/a.csv"],
        "a.csv",
    ),
    "urdf repair --out": (["urdf", "repair", URDF, "--out", "{out}/a.urdf"], "a.urdf"),
    "urdf write --out": (["urdf", "write", "--out", "{out}/a.urdf"], "a.urdf"),
    "urdf convert --out": (
        ["urdf", "convert", URDF, "--to", "mjcf", "--out", "{out}/a.xml"],
        "a.xml",
    ),
    "conform --json": ([*CONFORM, "--json", "{out}/a.json"], "a.json"),
    "conform --junit": ([*CONFORM, "--junit", "{out}/a.xml"], "a.xml"),
    "harness --out": (["harness", "c", "--out", "{out}/a.c"], "a.c"),
    "golden --out": (
        ["golden", "--suite", "evaluation", "--out", "{out}/new"],
        "new/evaluation/bars.json",
    ),
    "scoreboard --out": (["scoreboard", VERDICT, "--out", "{out}/new"], "new/index.html"),
    "record --out": (["record", CONTACT, "--fps", 1, "--out", "{out}/a.html"], "a.html"),
    "report --out": (
        ["report", FREE_FALL, "--states", 3, "--budget", 1, "--out", "{out}/new"],
        "new/index.html",
    ),
    "accuracy --out": (
        ["accuracy", FREE_FALL, "--methods", "rk4", "--budget", 1, "--out", "{out}/new"],
        "new/accuracy.json",
    ),
    "drift --out": (
        ["drift", "small_swings", "--seconds", 100, "--methods", "rk4", "--out", "{out}/new"],
        "new/drift.json",
    ),
    "plot --kind all": (
        ["plot", CONTACT, "--kind", "all", "--states", 3, "--out", "{out}/a.svg"],
        "a-angles.svg",
    ),
    "reference SCENE SCENE --out": (
        ["reference", FREE_FALL, SCENES / "general.toml", "--digits", 8, "--out", "{out}/new"],
        "new/free_fall.json",
    ),
}
# A command whose output is continued; tests/ensembles/test_run.py interrupts it.
STORES = {"sweep --out": ["sweep", "{out}/../sweep.toml", "--workers", 1, "--out", "{out}/a.zarr"]}
SWEEP = """
scene = "free_fall"
axes = [{parameter = "start.q.0", values = [0.0, 0.1]}]
runs = {duration = 0.5}
keep = {final = true}
"""
FILM = ["record", CONTACT, "--fps", 10, "--size", "160x160", "--out", "{out}/a.mp4"]
OTHERS = {
    "view": (["view", FREE_FALL, "--no-browser"], ("twolink.cli.view", "film_of")),
    "scenes": (["scenes"], ("twolink.cli.scenes", "print_table")),
    "urdf show": (["urdf", "show", URDF], ("twolink.urdf.description", "read_description")),
}

# The same with much to do: the commands are interrupted while they compute.
LONG = {
    "simulate --out": {50: 200_000},
    "verify --json": {3: 300_000},
    "plot --kind all": {3: 300_000},
    "record --out": {1: 120},
    "reference --out": {8: 60},
    "sensitivity --out": {50: 100_000},
    "report --out": {3: 300_000},
    "accuracy --out": {1: 100},
    "drift --out": {100: 100_000},
    "hardcases --json": {"aligned": "zeno"},
}
SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129, signal.SIGKILL: -9}
# These stand for the rest in the default run.
QUICK = {"simulate --out", "verify --json", "urdf write --out", "scenes", "urdf show"}


def marked(names):
    """Parameters of which most are slow, and some need an engine."""
    return [
        pytest.param(
            name,
            marks=[
                *([pytest.mark.slow] if name not in QUICK else []),
                *([pytest.mark.engines] if name == "urdf convert --out" else []),
            ],
        )
        for name in names
    ]


def in_folder(words, out):
    return [str(word).replace("{out}", str(out)) for word in words]


@pytest.fixture(autouse=True, scope="module")
def _signals_are_heard():
    """Let processes hear SIGHUP, also where the tests run under `nohup`, which they inherit."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


_STARTED = []


@pytest.fixture(autouse=True)
def _no_process_is_left():
    """End the processes of a test that failed: the next test must not meet them."""
    yield
    while _STARTED:
        process = _STARTED.pop()
        process.kill()
        process.communicate()


def started(words, out, *, program=("-m", "twolink.cli"), **options):
    process = subprocess.Popen(
        [sys.executable, *program, *in_folder(words, out)],
        stdout=options.pop("stdout", subprocess.DEVNULL),
        stderr=subprocess.PIPE,
        text=True,
        # Where no file can be longer than a few bytes, Python would leave broken .pyc files.
        env={
            **os.environ,
            "TMPDIR": str(out.parent / "tmp"),
            "PYTHONDONTWRITEBYTECODE": "1",
            **options.pop("environment", {}),
        },
        **options,
    )
    _STARTED.append(process)
    return process


def wait_until(process, condition):
    """Wait for a condition, or for the end of a process."""
    end = time.monotonic() + 120
    while process.poll() is None and not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def catches(process, number):
    """Return whether a process has a handler for a signal: a command has begun."""
    status = Path(f"/proc/{process.pid}/status").read_text()
    return bool(int(re.search(r"SigCgt:\t(\w+)", status)[1], 16) & 1 << (number - 1))


@pytest.fixture
def out(tmp_path):
    (tmp_path / "tmp").mkdir()
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def left_beside(out):
    return [path.name for path in out.rglob(".*")]


def commands(group, prefix=""):
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


def test_the_table_has_every_command_and_each_of_its_rows_is_tested():
    text = DOCUMENT.read_text(encoding="utf-8")
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    named = {name for row in rows for name in re.findall("`([^`]+)`", row)}
    assert named == {*WRITERS, *STORES, *OTHERS}
    for name, command in commands(get_command(app)):
        writes = any("--out" in option.opts or option.name == "json_file" for option in
                     command.params)  # fmt: skip
        found = [entry for entry in named if entry == name or entry.startswith(f"{name} ")]
        assert found, name
        assert all(entry in {*WRITERS, *STORES} for entry in found) == writes, name


def test_every_tested_command_works(out):
    """Or the tests below would show nothing; the quickest of each kind stand for the rest."""
    for name in ("urdf write --out", "drift --out"):
        words, target = WRITERS[name]
        result = CliRunner().invoke(app, in_folder(words, out))
        assert result.exit_code == 0, result.output
        assert (out / target).stat().st_size > 100
    assert left_beside(out) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize("name", LONG)
def test_signals_during_the_work_leave_the_target_as_before(name, number, out):
    words, target = WRITERS[name]
    words = [LONG[name].get(word, word) for word in words]
    (out / target).parent.mkdir(parents=True, exist_ok=True)
    (out / target).write_text("before")
    process = started(words, out)
    wait_until(process, lambda: catches(process, signal.SIGTERM))
    time.sleep(1.0)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    # The last: the work was done, and the process about to end.
    assert process.returncode in (SIGNALS[number], 0, 1, -number), said
    check_target_after_signal(number, said, out)
    if process.returncode == SIGNALS[number]:
        content = (out / target).read_text()
        assert content == "before" or len(content) > 100


# Every file is held just before it takes the place of its target.
HOLD = """
import sys, time
from twolink import files
from twolink.cli import app

def hold(file):
    print("written", flush=True)
    # A signal between a check of Python for signals and one long sleep would wait for its end.
    for _ in range(1200):
        time.sleep(0.05)

files._sync = hold
app(sys.argv[1:])
"""


def each_with_a_signal():
    """Yield each command with one signal, in turn, and the first command with all of them."""
    first, *others = WRITERS
    for number in SIGNALS:
        yield pytest.param(first, number, id=f"{first}-{number.name}")
    for name, number in zip(others, itertools.cycle(SIGNALS)):
        yield pytest.param(name, number, id=f"{name}-{number.name}")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), list(each_with_a_signal()))
def test_signals_at_the_last_moment_leave_the_target_as_before(name, number, out):
    words, target = WRITERS[name]
    (out / target).parent.mkdir(parents=True, exist_ok=True)
    (out / target).write_text("before")
    process = started(words, out, program=("-c", HOLD), stdout=subprocess.PIPE)
    assert any(line == "written\n" for line in process.stdout)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == SIGNALS[number], said
    check_target_after_signal(number, said, out)
    assert (out / target).read_text() == "before"


def check_target_after_signal(number, said, out):
    assert "Traceback" not in said
    if number != signal.SIGKILL:
        assert left_beside(out) == []
        assert list((out.parent / "tmp").iterdir()) == []
    # The next command that writes there cleans up.
    for folder in [out, *(path for path in out.rglob("*") if path.is_dir())]:
        result = CliRunner().invoke(app, ["urdf", "write", "--out", f"{folder}/next.urdf"])
        assert result.exit_code == 0
    assert left_beside(out) == []


def no_space():
    """Files of more than a few bytes cannot be written: as on a disk that is full."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))


@pytest.mark.parametrize("name", marked(WRITERS))
def test_a_full_disk_is_one_sentence_and_leaves_nothing(name, out):
    process = started(WRITERS[name][0], out, preexec_fn=no_space)
    _, said = process.communicate(timeout=240)
    assert process.returncode == 1, said
    assert said.count("\n") == 1
    assert said.startswith("twolink: ")
    assert "File too large" in said
    assert list(out.iterdir()) == []
    assert list((out.parent / "tmp").iterdir()) == []


@pytest.mark.parametrize("name", STORES)
def test_a_full_disk_begins_no_store(name, out):
    (out.parent / "sweep.toml").write_text(SWEEP)
    process = started(STORES[name], out, preexec_fn=no_space)
    _, said = process.communicate(timeout=240)
    assert process.returncode == 1, said
    assert re.fullmatch(r"twolink: .*a\.zarr: cannot be made \(File too large\)\n", said)
    assert list(out.iterdir()) == []
    assert list((out.parent / "tmp").iterdir()) == []
    process = started(STORES[name], out)
    _, said = process.communicate(timeout=240)
    assert process.returncode == 0, said


def without_privileges():
    """Give up the privilege of root to write where nobody may."""
    drop_from_bounding_set, override = 24, 1
    ctypes.CDLL(None).prctl(drop_from_bounding_set, override, 0, 0, 0)


@pytest.mark.parametrize("name", marked(WRITERS))
def test_a_folder_that_cannot_be_written_to_is_refused_before_any_work(name, out):
    out.chmod(0o500)
    process = started(WRITERS[name][0], out, preexec_fn=without_privileges)
    _, said = process.communicate(timeout=120)
    out.chmod(0o700)
    assert process.returncode == 2, said
    assert said.count("\n") == 1
    assert re.match(
        r"twolink: --(out|json|junit).*(Permission denied|can be written to or made)", said
    )
    assert list(out.iterdir()) == []
    assert list((out.parent / "tmp").iterdir()) == []


def fails(error):
    def failing(*_, **__):
        raise error

    return failing


def opens_nothing_new(code):
    """Return an `os.open` that makes no file."""

    def opens(path, flags, *mode, **options):
        if flags & os.O_CREAT and "out" in str(path):
            raise OSError(code, os.strerror(code))
        return os_open(path, flags, *mode, **options)

    os_open = os.open
    return opens


@pytest.mark.parametrize("code", [errno.EROFS, errno.ENOSPC, errno.EDQUOT], ids=errno.errorcode.get)
@pytest.mark.parametrize("name", marked(WRITERS))
def test_a_file_system_that_refuses_new_files_is_one_sentence(name, code, out, monkeypatch):
    """A single file is refused before any work; a folder is found out at its first file."""
    monkeypatch.setattr(files.os, "open", opens_nothing_new(code))
    words, target = WRITERS[name]
    result = CliRunner().invoke(app, in_folder(words, out))
    assert result.exit_code == (1 if target.startswith("new/") else 2), result.output
    assert result.stderr.count("\n") == 1
    assert f"cannot be written ({os.strerror(code)})" in result.stderr
    assert list(out.iterdir()) == []


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), r"cannot be written \(No space left"),
        (OSError(errno.EROFS, os.strerror(errno.EROFS)), r"cannot be written \(Read-only file"),
        (MemoryError(), r"there is not enough memory"),
    ],
    ids=["full", "read-only", "memory"],
)
@pytest.mark.parametrize("name", marked(WRITERS))
def test_faults_at_the_last_moment_leave_the_target_as_before(name, error, words, out, monkeypatch):
    monkeypatch.setattr(files, "_sync", fails(error))
    result = CliRunner().invoke(app, in_folder(WRITERS[name][0], out))
    assert result.exit_code == 1, result.output
    assert re.search(words, result.stderr)
    assert result.stderr.count("\n") == 1
    assert list(out.iterdir()) == []


@pytest.mark.parametrize("name", OTHERS)
def test_memory_that_ends_while_nothing_is_written_is_one_sentence(name, monkeypatch):
    words, (module, function) = OTHERS[name]
    # Commands have the names of their modules, and hide them in the package.
    monkeypatch.setattr(import_module(module), function, fails(MemoryError()))
    result = CliRunner().invoke(app, in_folder(words, ""))
    assert result.exit_code == 1
    assert result.stderr == "twolink: there is not enough memory (none is left)\n"


@pytest.mark.parametrize("name", marked([*WRITERS, "scenes", "urdf show"]))
def test_a_full_standard_output_is_one_sentence(name, out):
    with Path("/dev/full").open("w") as full:
        process = started({**WRITERS, **OTHERS}[name][0], out, stdout=full)
        _, said = process.communicate(timeout=240)
    assert process.returncode == 1
    assert said == "twolink: the standard output cannot be written to (No space left on device)\n"
    assert left_beside(out) == []


def test_memory_that_is_refused_is_one_sentence(out):
    process = started(
        ["plot", FREE_FALL, "--kind", "angles", "--samples", "99999999999", "--out", "{out}/a.svg"],
        out,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30)),
    )
    _, said = process.communicate(timeout=120)
    assert process.returncode in (1, 2)
    assert said.count("\n") == 1
    assert said.startswith("twolink: ")
    assert list(out.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["full", "terminated"])
def test_a_film_that_is_not_finished_leaves_nothing(fault, out):
    """By a browser that answers with plain pictures, and by ffmpeg."""
    browser = pretended_browser(out.parent, pause=0.3)
    process = started(
        FILM,
        out,
        environment={"TWOLINK_BROWSER": str(browser)},
        preexec_fn=no_space if fault == "full" else None,
    )
    if fault == "terminated":
        # The encoder runs, and frames are on their way.
        wait_until(process, lambda: processes_with(str(out / ".twolink-")))
        process.terminate()
    _, said = process.communicate(timeout=120)
    assert process.returncode == (1 if fault == "full" else 143), said
    assert said.count("\n") == (1 if fault == "full" else 0)
    assert list(out.iterdir()) == []
    assert list((out.parent / "tmp").iterdir()) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_view_that_ends_frees_its_port(number, out):
    process = started(["view", FREE_FALL, "--no-browser"], out, stdout=subprocess.PIPE)
    port = int(process.stdout.readline().strip().rstrip("/").rpartition(":")[2])
    process.send_signal(number)
    process.communicate(timeout=60)
    assert process.returncode == (-9 if number == signal.SIGKILL else 0)
    with socket.socket() as free:
        free.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        free.bind(("127.0.0.1", port))


def test_a_view_whose_address_cannot_be_printed_serves_nothing(out):
    with Path("/dev/full").open("w") as full:
        process = started(["view", FREE_FALL, "--no-browser"], out, stdout=full)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 1
    assert said == "twolink: the standard output cannot be written to (No space left on device)\n"
