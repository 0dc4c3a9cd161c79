"""The marks of the scoreboard: which finding gets which."""

import math

import pytest

from twolink.hardcases.record import Finding, Mark, Outcome


@pytest.mark.parametrize(
    ("finding", "mark", "words"),
    [
        (Finding(0.0), Mark.PASS, "pass"),
        (Finding(1.0, warned=True), Mark.PASS, "pass"),
        (Finding(1.5), Mark.MISSED, "missed × 1.50"),
        (Finding(10.0), Mark.MISSED, "missed × 10.0"),
        # Beyond ten times the bound it matters whether a word was said.
        (Finding(10.1), Mark.SILENT, "silently wrong"),
        (Finding(1e6, warned=True), Mark.MISSED, "missed × 1e+06"),
        (Finding(math.inf), Mark.SILENT, "silently wrong"),
        # NaN speaks for itself.
        (Finding(math.inf, finite=False), Mark.MISSED, "missed × ∞"),
        (Finding(math.nan), Mark.MISSED, "missed × ∞"),
    ],
)
def test_marks(finding, mark, words):
    assert finding.mark is mark
    assert Outcome.of(finding, 0.1).words == words


def test_the_call_and_its_output_are_kept_where_it_failed():
    failed = Outcome.of(Finding(99.0, said="far off"), 0.1, "call()", "output")
    assert (failed.said, failed.call, failed.output) == ("far off", "call()", "output")
    passed = Outcome.of(Finding(0.5, said="near"), 0.1, "call()", "output")
    assert (passed.said, passed.call, passed.output) == ("near", "", "")
