"""The marks of results."""

import math

import pytest

from twolink.engines.marks import Mark, Result
from twolink.hardcases.record import Outcome
from twolink.tables import Tone


@pytest.mark.parametrize(
    ("result", "mark", "words"),
    [
        (Result(0.0), Mark.PASS, "pass"),
        (Result(1.0, warned=True), Mark.PASS, "pass"),
        (Result(1.5), Mark.MISSED, "missed × 1.50"),
        (Result(10.0), Mark.MISSED, "missed × 10.0"),
        # Beyond ten times the bound an answer without a warning is a silent error.
        (Result(10.1), Mark.SILENT, "silently wrong"),
        (Result(1e6, warned=True), Mark.MISSED, "missed × 1e+06"),
        (Result(math.inf), Mark.SILENT, "silently wrong"),
        # NaN is not silent.
        (Result(math.inf, finite=False), Mark.MISSED, "missed × ∞"),
        (Result(math.nan), Mark.MISSED, "missed × ∞"),
    ],
)
def test_marks(result, mark, words):
    assert result.mark is mark
    assert Outcome.of(result, 0.1).words == words


def test_the_call_and_its_output_are_kept_where_it_failed():
    failed = Outcome.of(Result(99.0, said="far off"), 0.1, "call()", "output")
    assert (failed.said, failed.call, failed.output) == ("far off", "call()", "output")
    passed = Outcome.of(Result(0.5, said="near"), 0.1, "call()", "output")
    assert (passed.said, passed.call, passed.output) == ("near", "", "")


def test_marks_of_failures_are_in_one_tone():
    bad = {mark for mark in Mark if mark.tone is Tone.BAD}
    assert bad == {Mark.SILENT, Mark.CRASH, Mark.HANG, Mark.INVALID}
    assert Mark.PASS.tone is Tone.GOOD
    assert Mark.CANNOT.tone is Tone.SOFT
