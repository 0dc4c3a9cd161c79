"""Programs in child processes: lines in turn, limits, and how they ended."""

import contextlib
import sys

import pytest

from twolink.engines.child import Child
from twolink.engines.faults import EngineFault, FaultKind

LIMIT = 10.0


def program(code, **limits):
    return contextlib.closing(Child([sys.executable, "-I", "-S", "-c", code], **limits))


def test_a_line_for_a_message():
    with program(
        "import sys\nfor line in sys.stdin: print(line.upper(), end='', flush=True)"
    ) as child:
        assert child.exchanged(b"one\n", LIMIT) == b"ONE"
        assert child.exchanged(b"two\n", LIMIT) == b"TWO"
        assert child.unread == ""
        assert child.ended == ""


def test_two_lines_for_one_message():
    with program("print('first'); print('second')") as child:
        assert child.exchanged(b"", LIMIT) == b"first"
        assert child.unread == r"'second\\n'"
        assert child.exchanged(b"", LIMIT) == b"second"


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
def test_no_line(code, kind, ended):
    limit = 1.0 if kind is FaultKind.HANG else LIMIT
    with program(code) as child, pytest.raises(EngineFault) as caught:
        child.exchanged(b"", limit)
    assert (caught.value.kind, child.ended) == (kind, ended)


def test_the_output_is_complete_once_it_is_closed():
    code = "import sys; sys.stderr.write('x' * 30000 + 'end'); print('done')"
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


def test_its_last_message():
    with program("import sys; sys.exit(sys.stdin.readline() != 'stop\\n')") as child:
        assert child.stop(b"stop\n", LIMIT)
