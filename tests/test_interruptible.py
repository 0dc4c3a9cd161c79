"""Calls beside which the caller waits: results, errors, and Ctrl-C."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from weakref import WeakSet

import pytest

from twolink import interruptible
from twolink.interruptible import begun, end_process, side_by_side


def test_results_come_in_order():
    assert side_by_side(lambda go_on: 1, lambda go_on: 2) == [1, 2]


def test_the_first_error_ends_the_others():
    ended = threading.Event()

    def fails(go_on):
        raise ValueError("wrong")

    def waits(go_on):
        try:
            while True:
                go_on()
                time.sleep(0.001)
        finally:
            time.sleep(0.1)
            ended.set()

    with pytest.raises(ValueError, match="wrong"):
        side_by_side(waits, fails)
    # A program that ends while one of them computes would be aborted.
    assert ended.is_set()


def test_ctrl_c_is_answered_during_an_unresponsive_call():
    released = threading.Event()
    ended = threading.Event()

    def deaf(go_on):
        released.wait(30)
        try:
            go_on()
        finally:
            ended.set()

    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    start = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        side_by_side(deaf)
    assert time.monotonic() - start < 5
    assert not ended.is_set()
    released.set()
    assert ended.wait(5)


ABANDONS = """
import sys, threading, time
from twolink import interruptible
from twolink.interruptible import end_process, side_by_side
interruptible._ENDING = 0.1

def fails(go_on):
    raise ValueError("wrong")

def computes(go_on):
    started.set()
    end = time.monotonic() + 60
    while time.monotonic() < end:
        sum(range(10_000))

started = threading.Event()
try:
    side_by_side(computes, lambda go_on: started.wait() and fails(go_on))
except ValueError as error:
    sys.stdout.write(f"{error} and said")
    end_process(3)
"""


def test_a_process_exits_while_abandoned_calls_still_run():
    """With its exit code, and with all that was printed."""
    start = time.monotonic()
    run = subprocess.run(
        [sys.executable, "-c", ABANDONS], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stdout, run.stderr) == (3, "wrong and said", "")
    assert time.monotonic() - start < 50


@pytest.mark.parametrize("code", [0, 130, None, "words"])
def test_a_process_without_abandoned_calls_exits_normally(code):
    with pytest.raises(SystemExit) as caught:
        end_process(code)
    assert caught.value.code == code


VANISHING = """
import atexit, sys, threading, time
from twolink import interruptible
atexit.register(print, "last steps")
interruptible.side_by_side(lambda go_on: 1)
while interruptible._any_left():
    time.sleep(0.001)
if sys.argv[1] == "left":
    # As a thread that has ended for Python, and not yet for the system.
    interruptible._NUMBERS.add(threading.get_native_id())
interruptible.end_process(130)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are seen on Linux")
@pytest.mark.parametrize(("thread", "said"), [("left", ""), ("gone", "last steps\n")])
def test_a_thread_that_is_still_ending_is_not_joined(thread, said):
    """It would abort the interpreter's last steps."""
    run = subprocess.run(
        [sys.executable, "-c", VANISHING, thread], capture_output=True, text=True, check=False
    )
    assert (run.returncode, run.stdout, run.stderr) == (130, said, "")


def test_a_thread_counts_before_it_is_begun(monkeypatch):
    """A signal may end the process while the system begins it."""
    seen = []
    start = threading.Thread.start

    def started(thread):
        seen.append(interruptible._any_left())
        start(thread)

    # Threads of other tests may still exist.
    monkeypatch.setattr(interruptible, "_THREADS", WeakSet())
    monkeypatch.setattr(interruptible, "_NUMBERS", set())
    monkeypatch.setattr(threading.Thread, "start", started)
    begun(lambda: seen.append(interruptible._any_left())).join()
    assert seen == [True, True]


def test_a_thread_that_cannot_be_started_is_forgotten(monkeypatch):
    def started(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(interruptible, "_THREADS", WeakSet())
    monkeypatch.setattr(threading.Thread, "start", started)
    with pytest.raises(RuntimeError):
        begun(int)
    assert not interruptible._THREADS


def test_a_process_that_exits_searches_for_no_garbage():
    program = (
        "import atexit, gc\n"
        "from twolink.interruptible import end_process\n"
        "gc.disable()\n"
        "class Ring:\n"
        "    def __del__(self):\n"
        "        print('found')\n"
        "ring = Ring()\n"
        "ring.itself = ring\n"
        "del ring\n"
        "atexit.register(print, 'last steps')\n"
        "end_process(0)\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout == "last steps\n"
