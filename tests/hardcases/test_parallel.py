"""Parallel cases: the same outcomes as in one process, without leftover processes."""

import os
import signal
import subprocess
import sys
import time

import pytest

from twolink.hardcases.catalogue import case_named
from twolink.hardcases.parallel import parallel_scoreboard
from twolink.hardcases.run import OURS, scoreboard

NAMES = ("aligned", "zeno", "nan-angle")


def marks(board):
    return {name: {column: found.mark for column, found in row.items()} for name, row in board}


@pytest.mark.slow
def test_the_parallel_scoreboard_is_the_serial_one():
    cases = [case_named(name) for name in NAMES]
    reports = []
    board = parallel_scoreboard(cases, OURS, lambda done, running: reports.append((done, running)))
    assert tuple(board) == NAMES
    assert marks(board.items()) == marks(scoreboard(cases, OURS).items())
    assert reports[0][0] == 0
    assert {name for _, running in reports for name in running} == set(NAMES)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_an_interrupt_ends_all_processes(number, tmp_path):
    arguments = ["hardcases", "--case", "small-oscillation-1e6-s", "--case", "chaos-100-s"]
    command = "from twolink.cli import app; app()"
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    process = subprocess.Popen(
        [sys.executable, "-c", command, *arguments, "--json", str(tmp_path / "board.json")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        env=environment,
    )
    until = time.monotonic() + 60
    while len(session(process.pid)) < 3 and time.monotonic() < until:
        time.sleep(0.1)
    assert len(session(process.pid)) >= 3
    time.sleep(2)
    process.send_signal(number)
    _, errors = process.communicate(timeout=60)
    assert process.returncode != 0
    assert b"Traceback" not in errors
    until = time.monotonic() + 20
    while session(process.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert session(process.pid) == []
    assert not (tmp_path / "board.json").exists()


def session(number: int) -> list[int]:
    """Return the processes of a session, from /proc, without zombies."""
    found = []
    for entry in os.listdir("/proc"):
        if not entry.isdigit():
            continue
        try:
            with open(f"/proc/{entry}/stat") as file:
                state, _, _, belongs = file.read().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(belongs) == number and state != "Z":
            found.append(int(entry))
    return found
