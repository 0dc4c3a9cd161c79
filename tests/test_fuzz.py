"""The fuzz campaign: hostile inputs are handled, and its checks fire on commands that are wrong."""

import functools
import os
import warnings
from pathlib import Path

import pytest

from tests.fuzz.__main__ import campaign
from tests.fuzz.calls import _called
from tests.fuzz.dice import Input
from tests.fuzz.run import Ended, faults, run
from twolink.errors import ParameterError


@pytest.mark.parametrize(
    ("given", "ended", "words"),
    [
        (Input([], refused=True), Ended(2, "", "twolink: no\n", 0.1), None),
        (Input([]), Ended(None, "", "", 60.0), "hangs"),
        (Input([]), Ended(70, "", "", 0.1), "exit code 70"),
        (Input([]), Ended(-11, "", "", 0.1), "exit code -11"),
        (Input([]), Ended(1, "", "Traceback (most", 0.1), "a traceback"),
        (Input([], refused=True), Ended(0, "", "a\n", 0.1), "exit code 0 where 2 is due"),
        (Input([], refused=False), Ended(2, "", "a\n", 0.1), "exit code 2 where 0 is due"),
        (Input([], refused=True), Ended(2, "", "a\nb\n", 0.1), "2 lines of a refusal"),
        (Input([]), Ended(2, "", "x" * 2000, 0.1), "2000 characters"),
        (Input([]), Ended(0, "\x1b[31m", "", 0.1), "an escape sequence"),
    ],
)
def test_each_fault_is_detected(given, ended, words, tmp_path):
    found = faults(given, ended, set(), tmp_path)
    assert found == [] if words is None else any(fault.startswith(words) for fault in found)


def test_files_that_are_left_are_seen(tmp_path):
    (tmp_path / ".twolink-1").touch()
    (tmp_path / "a.json").touch()
    given = Input([], out=(tmp_path / "a.json",))
    assert faults(given, Ended(0, "", "", 0.1), set(), tmp_path) == ["left behind: .twolink-1"]
    found = faults(given, Ended(2, "", "a\n", 0.1), set(), tmp_path)
    assert "a.json written" in found


def refuses():
    raise ParameterError("x must be 1; got 2")


def warns():
    warnings.warn("a library says so", stacklevel=1)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("function", "arguments", "code", "words"),
    [
        (int, {}, 0, ""),
        (refuses, {}, 2, "x must be 1; got 2\n"),
        (refuses, {"y": 1}, 2, "got an unexpected keyword argument 'y'\n"),
        (lambda: len(3), {}, 70, "TypeError"),
        (lambda: {}[0], {}, 70, "KeyError: 0"),
        (warns, {}, 70, "UserWarning: a library says so"),
    ],
)
def test_calls_are_judged_by_their_exit_code(function, arguments, code, words, tmp_path):
    (tmp_path / "out").mkdir()
    given = Input(["call"], call=functools.partial(_called, function, arguments))
    ended = run(given, tmp_path)
    assert ended.code == code
    assert words in ended.err
    assert bool(faults(given, ended, set(), tmp_path / "out")) == (code == 70)


@pytest.mark.slow
def test_forty_inputs():
    here = Path.cwd()
    lines, codes = campaign(40, seed=20261122)
    assert lines == []
    assert codes[0] > 4
    assert codes[2] > 16
    assert os.getcwd() == str(here)
