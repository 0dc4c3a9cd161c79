"""The rows of docs/interruptions.md: each way to end a command early, for each kind of command."""

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from twolink.data import data_path

DOCUMENT = Path(__file__).parent.parent / "docs" / "interruptions.md"
SCENES = data_path("scenes")
FREE_FALL, CONTACT = SCENES / "free_fall.toml", SCENES / "bounce_to_rest.toml"

# One command of each row, and its files in the folder {out}; each works for a while.
WRITERS = {
    "simulate --out": (
        ["simulate", CONTACT, "--samples", "200000", "--out", "{out}/a.csv"],
        "a.csv",
    ),
    "verify --json": (["verify", "--states", "300000", "--json", "{out}/a.json"], "a.json"),
    "plot --out": (["plot", CONTACT, "--kind", "all", "--out", "{out}/a.svg"], None),
    "record --out": (["record", CONTACT, "--fps", "120", "--out", "{out}/a.html"], "a.html"),
    "reference": (["reference", FREE_FALL, "--digits", "60", "--out", "{out}/a.json"], "a.json"),
    "report --out": (["report", FREE_FALL, "--states", "20", "--out", "{out}"], "index.html"),
}
SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129, signal.SIGKILL: -9}


def started(words, out, **options):
    words = [str(word).replace("{out}", str(out)) for word in words]
    return subprocess.Popen(
        [sys.executable, "-m", "twolink.cli", *words],
        stdout=options.pop("stdout", subprocess.DEVNULL),
        stderr=subprocess.PIPE,
        text=True,
        # Where no file can be longer than a few bytes, Python would leave broken .pyc files.
        env={
            **os.environ,
            "TMPDIR": str(out.parent / "tmp"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        **options,
    )


@pytest.fixture
def out(tmp_path):
    (tmp_path / "tmp").mkdir()
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def test_every_command_of_the_table_is_tested():
    text = DOCUMENT.read_text(encoding="utf-8")
    assert all(f"`{name}" in text for name in WRITERS)
    assert "tests/test_interruptions.py" in text


@pytest.mark.slow
@pytest.mark.parametrize("number", SIGNALS, ids=lambda number: number.name)
@pytest.mark.parametrize("name", WRITERS)
def test_signals_leave_the_target_whole_or_as_before(name, number, out):
    words, target = WRITERS[name]
    if target is not None:
        (out / target).write_text("before")
    process = started(words, out)
    time.sleep(2.5)
    process.send_signal(number)
    _, said = process.communicate(timeout=60)
    assert process.returncode in (SIGNALS[number], 0, 1)
    assert "Traceback" not in said
    left = [path.name for path in out.iterdir() if path.name.startswith(".")]
    if number != signal.SIGKILL:
        assert left == []
        assert list((out.parent / "tmp").iterdir()) == []
    if target is not None and process.returncode == SIGNALS[number]:
        content = (out / target).read_text()
        assert content == "before" or len(content) > 100
    # The next command that writes there cleans up.
    run = started(["verify", "--states", "3", "--json", "{out}/next.json"], out)
    run.communicate(timeout=60)
    assert run.returncode == 0
    assert not [path for path in out.iterdir() if path.name.startswith(".")]


def smallest(name):
    """The command of a row with less to do."""
    return [
        {"200000": "50", "300000": "3", "120": "1", "60": "8"}.get(str(word), str(word))
        for word in WRITERS[name][0]
    ]


def no_space():
    """Files of more than a few bytes cannot be written: as on a disk that is full."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))


@pytest.mark.parametrize("name", [n for n in WRITERS if n != "report --out"])
def test_a_full_disk_is_one_sentence_and_leaves_nothing(name, out):
    process = started(smallest(name), out, preexec_fn=no_space)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 1, said
    assert said.count("\n") == 1
    assert said.startswith("twolink: ")
    assert "cannot be written (File too large)" in said
    assert list(out.iterdir()) == []
    assert list((out.parent / "tmp").iterdir()) == []


@pytest.mark.parametrize("name", [n for n in WRITERS if n != "report --out"])
def test_a_full_standard_output_is_one_sentence(name, out):
    with Path("/dev/full").open("w") as full:
        process = started(smallest(name), out, stdout=full)
        _, said = process.communicate(timeout=120)
    assert process.returncode == 1
    assert said == "twolink: the standard output cannot be written to (No space left on device)\n"
    assert not [path for path in out.iterdir() if path.name.startswith(".")]


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
