"""Engines in child processes: each kind of failure is identified in time, and the run goes on."""

import json
import os
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from twolink.conformance.report import document
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.faults import EngineFault, FaultKind
from twolink.engines.marks import Mark
from twolink.engines.messages import Model, Start, Started
from twolink.engines.process import ProcessTransport
from twolink.errors import EngineError

ROGUE = Path(__file__).parent / "rogue.py"
LIMIT = 8.0

# Mode, the mark of the mass matrix, and words of the reason.
FAULTS = [
    ("crash", Mark.CRASH, "crash: SIGSEGV"),
    ("exit", Mark.CRASH, "crash: exit code 3; no licence"),
    ("memory", Mark.CRASH, "crash: exit code 1; MemoryError"),
    ("cut", Mark.CRASH, 'death in mid-line: exit code 0, in the middle of the line \'{"seq": 1'),
    ("flood", Mark.INVALID, "flood: "),
    ("flood of lines", Mark.INVALID, "flood: it writes without end"),
    ("banner", Mark.INVALID, "no message of the protocol: an answer must be one JSON object"),
    ("nan", Mark.INVALID, 'numbers must be JSON, with "nan" and "inf" as strings; got NaN'),
    ("nan as a word", Mark.MISSED, "values are not finite"),
    (
        "length",
        Mark.INVALID,
        "wrong length: values of mass_matrix must be 6 × 2 × 2 numbers; got 5",
    ),
    (
        "shape",
        Mark.INVALID,
        "wrong length: values of mass_matrix must be 6 × 2 × 2 numbers; got 6 × 2",
    ),
    ("ragged", Mark.INVALID, "wrong length: values of mass_matrix must be numbers in rows"),
    ("words", Mark.INVALID, "wrong length: values of mass_matrix must be numbers in rows"),
    ("other question", Mark.INVALID, "answer to another question: seq must be 1, as asked; got 2"),
    ("lie", Mark.SILENT, "times its bound"),
    ("no schema", Mark.INVALID, "no message of the protocol: confidence: extra inputs"),
    ("error", Mark.REFUSED, "singular"),
    ("skip", Mark.CANNOT, "not yet"),
]


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """The right answers to the first group of the evaluation suite, in a file."""
    file = tmp_path_factory.mktemp("rogue") / "answers.json"
    tests = suite("evaluation")[0].tests
    found = {test.quantity: numbers(test.values) for test in tests if not test.needs}
    file.write_text(json.dumps(found))
    return file


def numbers(value):
    return [numbers(entry) for entry in value] if isinstance(value, list) else float(value)


PYTHON = (sys.executable, "-I", "-S")


def reported(mode, answers, seconds=LIMIT):
    groups = {"evaluation": suite("evaluation")[:1]}
    command = [*PYTHON, str(ROGUE), mode, str(answers)]
    return conform("rogue", lambda: ProcessTransport(command, 2**29), groups, seconds=seconds)


def results(mode, answers, seconds=LIMIT):
    return {each.quantity: each for each in reported(mode, answers, seconds).results}


@contextmanager
def running(*command):
    """A child that is started, and closed in the end."""
    transport = ProcessTransport(command)
    try:
        yield transport
    finally:
        transport.close()


def program(code):
    return running(*PYTHON, "-c", code)


@pytest.mark.slow
@pytest.mark.parametrize(("mode", "mark", "words"), FAULTS, ids=[mode for mode, _, _ in FAULTS])
def test_faults_have_different_marks_and_the_run_continues(mode, mark, words, answers):
    found = results(mode, answers)
    failed = found.pop("mass_matrix")
    assert failed.mark is mark
    assert words in failed.said
    assert {result.mark for result in found.values()} == {Mark.PASS}


def test_warnings_on_the_standard_error_are_reported(answers):
    """Those of its start do not count, and no test is judged by them."""
    report = reported("warn", answers)
    assert {result.mark for result in report.results} == {Mark.PASS}
    assert report.printed == (2, "[warning] the model is nearly singular")
    assert document(report)["printed"]["warnings"] == 2
    assert reported("exit", answers).printed == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mode", "words"),
    [
        ("hang", "no answer within 1.5 s"),
        ("hang in a line", "in the middle of the line '{\"seq\":'"),
    ],
)
def test_a_hang_ends_at_its_limit(mode, words, answers):
    begin = time.monotonic()
    found = results(mode, answers, seconds=1.5)
    assert time.monotonic() - begin < 20
    assert found["mass_matrix"].mark is Mark.HANG
    assert words in found["mass_matrix"].said
    assert found["jacobian"].mark is Mark.PASS


def test_unrequested_output_invalidates_the_next_answer(answers):
    """It is noticed at the next question, which is then lost."""
    found = results("twice", answers)
    assert found["mass_matrix"].mark is Mark.PASS
    assert found["velocity_terms"].mark is Mark.INVALID
    assert found["velocity_terms"].said.startswith("output that was not asked for: it wrote")
    assert found["gravity_terms"].mark is Mark.PASS


@pytest.mark.parametrize(
    ("mode", "words"),
    [("start", "crash: exit code 1; no display"), ("version", "version must be 1; got 2")],
)
def test_an_engine_that_does_not_start(mode, words, answers):
    with pytest.raises(EngineError, match="the engine does not start") as caught:
        results(mode, answers)
    assert words in str(caught.value)


def test_a_program_that_cannot_be_run(tmp_path):
    """It is there, and is no program."""
    file = tmp_path / "engine"
    file.write_text("")
    with (
        running(str(file)) as transport,
        pytest.raises(EngineFault, match="Permission denied") as caught,
    ):
        transport.ask(Start(), LIMIT)
    assert caught.value.kind is FaultKind.CRASH


@pytest.mark.slow
def test_children_of_a_child_end_with_it(tmp_path):
    file = tmp_path / "pid"
    code = (
        "import subprocess, sys, time\n"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)'])\n"
        f"open({str(file)!r}, 'w').write(str(child.pid))\n"
        "time.sleep(60)"
    )
    with program(code) as transport, pytest.raises(EngineFault, match="hang"):
        transport.ask(Start(), 3.0)
    assert has_ended(int(file.read_text()))


def has_ended(pid):
    for _ in range(100):
        try:
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
            os.kill(pid, 0)
        except (FileNotFoundError, ProcessLookupError):
            return True
        time.sleep(0.05)
    return False


@pytest.mark.slow
def test_a_large_question_to_a_child_that_does_not_read():
    """Writing to a full pipe does not block beyond the limit."""
    with program("import time; time.sleep(60)") as transport:
        begin = time.monotonic()
        with pytest.raises(EngineFault, match="hang"):
            transport.ask(Model(id="large", urdf="x" * 2**22), 1.0)
        assert time.monotonic() - begin < 10


def test_a_large_answer_is_read_whole():
    code = (
        "import sys\n"
        "sys.stdin.readline()\n"
        'print(\'{"version": 1, "engine": {"name": "x", "version": "1", "reads": ["urdf"], '
        '"answers": ["\' + "x" * 5000000 + \'"]}}\')'
    )
    with program(code) as transport:
        answer = transport.ask(Start(), LIMIT)
    assert isinstance(answer, Started)
    assert [len(name) for name in answer.engine.answers] == [5_000_000]
