"""Programs in child processes: lines in turn, limits, and how they ended."""

import contextlib
import subprocess
import sys
import time

import pytest

from twolink.engines.child import Child, Printed, value_of
from twolink.engines.faults import EngineFault, FaultKind

LIMIT = 10.0


def program(code, **limits):
    return contextlib.closing(Child([sys.executable, "-I", "-S", "-c", code], **limits))


def test_each_message_is_answered_by_one_line():
    with program(
        "import sys\nfor line in sys.stdin: print(line.upper(), end='', flush=True)"
    ) as child:
        assert child.exchanged(b"one\n", LIMIT) == b"ONE"
        assert child.exchanged(b"two\n", LIMIT) == b"TWO"
        assert child.unread == ""
        assert child.ended == ""


def test_a_second_line_for_one_message_is_unread():
    with program("print('first'); print('second')") as child:
        assert child.exchanged(b"", LIMIT) == b"first"
        assert child.unread == r"'second\\n'"
        assert child.exchanged(b"", LIMIT) == b"second"


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("code", "kind", "ended"),
    [
        ("import os; os.abort()", FaultKind.CRASH, "SIGABRT"),
        ("import sys; sys.exit(3)", FaultKind.CRASH, "exit code 3"),
        ("print('half', end='')", FaultKind.CUT, "exit code 0"),
        ("import time; time.sleep(60)", FaultKind.HANG, "SIGKILL"),
        ("while True: print('x' * 2**20, end='')", FaultKind.FLOOD, "SIGKILL"),
    ],
)
def test_a_child_without_an_answer_is_a_fault_of_its_kind(code, kind, ended):
    limit = 1.0 if kind is FaultKind.HANG else LIMIT
    with program(code) as child, pytest.raises(EngineFault) as caught:
        child.exchanged(b"", limit)
    assert (caught.value.kind, child.ended) == (kind, ended)


def test_the_output_is_complete_once_it_is_closed():
    code = "import sys; sys.stderr.write('x' * 30000 + 'end'); sys.stderr.flush(); print('done')"
    with program(code) as child:
        child.exchanged(b"", LIMIT)
    assert len(child.output) == 20_000
    assert child.output.endswith("xend")


def test_memory_has_its_limit():
    with (
        program("x = bytearray(2**29); print('there')", memory=2**28) as child,
        pytest.raises(EngineFault, match="MemoryError"),
    ):
        child.exchanged(b"", LIMIT)


def test_a_program_that_is_not_there():
    with (
        contextlib.closing(Child(["/no/such/program"])) as child,
        pytest.raises(EngineFault, match=r"exit code 1; /no/such/program: No such file"),
    ):
        child.exchanged(b"", LIMIT)


def test_a_child_receives_the_last_message():
    with program("import sys; sys.exit(sys.stdin.readline() != 'stop\\n')") as child:
        assert child.stop(b"stop\n", LIMIT)


@pytest.mark.slow
def test_value_of_returns_the_value_that_a_module_tells(tmp_path, monkeypatch):
    """Its time begins when it is ready, and its standard error is kept."""
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:.")
    (tmp_path / "slow_start.py").write_text(
        "import sys, time\nfrom twolink.engines.child import tell\n"
        "time.sleep(0.5)\ntell(lambda: sys.argv[1:])"
    )
    (tmp_path / "lost.py").write_text(
        "import ctypes\nfrom twolink.engines.child import tell\ntell(lambda: ctypes.string_at(0))"
    )
    assert value_of("slow_start", "a", "b c", seconds=0.4) == ["a", "b c"]
    with pytest.raises(EngineFault, match="SIGSEGV") as caught:
        value_of("lost", seconds=LIMIT)
    assert "string_at" in caught.value.output
    with pytest.raises(EngineFault, match="No module named nowhere"):
        value_of("nowhere", seconds=LIMIT)


def is_alive(pid):
    """Whether a process runs; a zombie that waits to be reaped does not."""
    try:
        with open(f"/proc/{pid}/stat") as status:
            return status.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def ends(pid):
    until = time.monotonic() + 5
    while is_alive(pid) and time.monotonic() < until:
        time.sleep(0.02)
    return not is_alive(pid)


# It starts a process that would outlive it, and prints both ids.
PARENT = (
    "import os, subprocess, sys, time\n"
    "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
    "print(os.getpid(), child.pid, flush=True)\n"
    "time.sleep(600)"
)


@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")
def test_a_child_is_ended_with_its_descendants():
    with program(PARENT) as child:
        ids = [int(word) for word in child.exchanged(b"", LIMIT).split()]
        with pytest.raises(EngineFault, match=r"no answer within 0\.2 s"):
            child.exchanged(b"", 0.2)
    assert all(map(ends, ids))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="processes are looked for in /proc")
def test_the_child_ends_when_its_caller_is_killed():
    """The caller gets no chance to clean up: the program must not run on."""
    code = (
        "import sys\nfrom twolink.engines.child import Child\n"
        "child = Child([sys.executable, '-c', sys.argv[1]])\n"
        "print(child.exchanged(b'', 10.0).decode(), flush=True)\nchild.exchanged(b'', 600.0)"
    )
    sleeper = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
    command = [sys.executable, "-c", code, sleeper]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as caller:
        pid = int(caller.stdout.readline())
        assert is_alive(pid)
        caller.kill()
    assert ends(pid)


def test_warnings_that_are_printed():
    """Line by line, however they come in pieces; the first is made safe and short."""
    printed = Printed()
    for piece in (b"hello\n[WAR", b"NING] nan in \x1b[31mQACC\nfine\n", b"b3Err", b"or: lost"):
        printed.add(piece)
    assert (printed.warnings, printed.first) == (1, r"[WARNING] nan in \x1b[31mQACC")
    printed.finish()
    printed.finish()
    assert printed.warnings == 2
    assert printed.end.startswith(b"hello")
    printed.forget()
    printed.add(b"b3Warning[file.cpp,126]:\nNo inertial data\nfine\n")
    assert printed.first == "b3Warning[file.cpp,126]: No inertial data"
    printed.forget()
    assert (printed.warnings, printed.first) == (0, "")
    for _ in range(40):
        printed.add(b"error " + b"x" * 1000)
    assert printed.warnings == 0
    assert len(printed.end) == 20_000
    printed.finish()
    assert printed.warnings == 1
    assert len(printed.first) < 210


def test_a_child_that_ends_before_it_takes_a_long_message():
    """Its input is still watched when its output ends, and is no output to be read."""
    code = "import os, time; os.close(1); time.sleep(0.3); os._exit(3)"
    with program(code) as child, pytest.raises(EngineFault, match="exit code 3") as caught:
        child.exchanged(b"x" * 2**20, LIMIT)
    assert caught.value.kind is FaultKind.CRASH
