"""Tasks in separate processes: each way to end, without leftover processes."""

import ctypes
import os
import signal
import subprocess
import sys
import time
import warnings

import numpy as np
import pytest

from twolink.engines.sandbox import run_sandboxed

SECONDS = 30.0


def add(first, second):
    print("adding")
    print("to stderr", file=sys.stderr)
    return first + second


def warn_twice():
    for _ in range(2):
        warnings.warn("mind the gap", stacklevel=1)
    return np.array([1.0, 2.0])


def refuse():
    raise ValueError("no such chain")


def give_what_cannot_be_sent():
    return lambda: None


def read_address_zero():
    ctypes.string_at(0)


def abort():
    os.abort()


def leave():
    os._exit(3)


def loop_for_ever():
    while True:
        pass


def loop_in_c():
    """Hold the interpreter's lock: no Python signal handler would ever run."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM, signal.SIGINT})
    ctypes.PyDLL(None).pause()


def fill_memory():
    held = []
    while True:
        held.append(np.ones(2**22))


def one_large_array():
    return np.ones(2**34).sum()


def start_another(file):
    """Start a process that would outlive this one, and write its process id."""
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    with open(file, "w") as output:
        output.write(str(child.pid))
    loop_for_ever()


def own_id():
    return os.getpid()


def is_alive(pid):
    """Whether a process runs; a zombie that waits to be reaped does not."""
    try:
        with open(f"/proc/{pid}/stat") as status:
            return status.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_result_and_output():
    outcome = run_sandboxed(add, 2, 3, seconds=SECONDS)
    assert (outcome.kind, outcome.result) == ("finished", 5)
    assert outcome.output.split("\n")[:2] == ["adding", "to stderr"]
    assert 0 <= outcome.seconds < SECONDS


def test_warnings_are_kept_once():
    outcome = run_sandboxed(warn_twice, seconds=SECONDS)
    assert outcome.warnings == ("UserWarning: mind the gap",)
    assert outcome.kind == "finished"
    assert outcome.result == pytest.approx([1.0, 2.0])


def test_an_exception_is_reported_with_its_message():
    outcome = run_sandboxed(refuse, seconds=SECONDS)
    assert (outcome.kind, outcome.said) == ("refused", "ValueError: no such chain")
    assert "in refuse" in outcome.output


def test_a_result_that_cannot_be_sent_is_refused():
    outcome = run_sandboxed(give_what_cannot_be_sent, seconds=SECONDS)
    assert outcome.kind == "refused"
    assert "pickle" in outcome.said


def test_a_task_that_cannot_be_imported_is_refused():
    class Hidden:
        def __reduce__(self):
            return (__import__, ("no_such_module",))

    outcome = run_sandboxed(add, Hidden(), 3, seconds=SECONDS)
    said = "ModuleNotFoundError: No module named 'no_such_module'"
    assert (outcome.kind, outcome.said) == ("refused", said)


@pytest.mark.parametrize(
    ("task", "said"),
    [(read_address_zero, "SIGSEGV"), (abort, "SIGABRT"), (leave, "exit code 3")],
)
def test_a_crash_is_reported_with_its_location(task, said):
    outcome = run_sandboxed(task, seconds=SECONDS)
    assert (outcome.kind, outcome.said) == ("crash", said)
    # Python's fault handler names the call, unless the process left on its own.
    assert (task is leave) != (f"in {task.__name__}" in outcome.output)


@pytest.mark.parametrize("task", [loop_for_ever, loop_in_c])
def test_a_hang_is_stopped_in_time(task):
    outcome = run_sandboxed(task, seconds=0.5)
    assert (outcome.kind, outcome.said) == ("hang", "stopped after 0.5 s")
    assert 0.5 <= outcome.seconds < 5


@pytest.mark.parametrize("task", [fill_memory, one_large_array])
def test_memory_has_its_limit(task):
    outcome = run_sandboxed(task, seconds=SECONDS, memory=2**29)
    assert outcome.kind == "out of memory", outcome
    assert "MemoryError" in outcome.said


@pytest.mark.slow
def test_nothing_is_left_behind(tmp_path):
    file = tmp_path / "process_id"
    outcome = run_sandboxed(start_another, str(file), seconds=2.0)
    assert outcome.kind == "hang"
    grandchild = int(file.read_text())
    until = time.monotonic() + 5
    while is_alive(grandchild) and time.monotonic() < until:
        time.sleep(0.02)
    assert not is_alive(grandchild)
    child = run_sandboxed(own_id, seconds=SECONDS).result
    assert child != os.getpid()
    assert not is_alive(child)


def test_the_process_goes_when_its_caller_is_killed(tmp_path):
    """The caller gets no chance to clean up: the task must not run on."""
    file = tmp_path / "process_id"
    program = (
        "from tests.engines.test_sandbox import write_id_and_loop\n"
        "from twolink.engines.sandbox import run_sandboxed\n"
        "if __name__ == '__main__':\n"
        f"    run_sandboxed(write_id_and_loop, {str(file)!r}, seconds=600.0)\n"
    )
    script = tmp_path / "caller.py"
    script.write_text(program)
    caller = subprocess.Popen([sys.executable, str(script)], env={**os.environ, "PYTHONPATH": "."})
    until = time.monotonic() + 20
    while not (file.exists() and file.read_text()) and time.monotonic() < until:
        time.sleep(0.05)
    caller.kill()
    caller.wait()
    until = time.monotonic() + 5
    while is_alive(int(file.read_text())) and time.monotonic() < until:
        time.sleep(0.02)
    assert not is_alive(int(file.read_text()))


def write_id_and_loop(file):
    with open(file, "w") as output:
        output.write(str(os.getpid()))
    loop_for_ever()
