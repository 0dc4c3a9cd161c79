"""A run beside its judge: until when it is a motion, and which of two is the better result."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulation.hybrid import BOUNCE_TIMES as TIMES
from tests.simulation.hybrid import tampered
from twolink.arithmetic import exactly
from twolink.contact.states import EventKind
from twolink.integration.precisions import PRECISIONS
from twolink.simulation.hybrid.differences import MARGIN_OF_EQUALS
from twolink.simulation.hybrid.judged import JudgedRun, best_of
from twolink.simulation.hybrid.mode import Doubt, Trigger


def judged(kept, judge, error=0.0, accuracy=1e-9):
    return JudgedRun(kept, judge, np.full(len(TIMES), error), accuracy, float(TIMES[-1]))


def test_the_errors_are_the_difference_to_the_judge_and_a_margin(run, judge):
    off = tampered(run, 1.5, 0, 1e-5)
    found = JudgedRun.of(off, judge, TIMES, 1e-9)
    assert found.errors[TIMES < 1].max() < 1e-14
    assert found.worst == pytest.approx(1.1e-5, rel=1e-6)
    assert found.seconds > 0
    alike = JudgedRun.of(off, run, TIMES, 1e-9)
    assert alike.worst == pytest.approx(MARGIN_OF_EQUALS * 1e-5, rel=1e-6)


def test_errors_that_a_run_may_share_with_its_judge_are_added(run, judge):
    shared = np.linspace(0.0, 1e-9, len(TIMES))
    found = judged(run, judge, 1e-10).with_shared(shared)
    assert found.errors == pytest.approx(1e-10 + shared, rel=1e-15)


@pytest.mark.parametrize(
    ("failure", "exhausted", "known"), [("", False, 2.5), ("jam", False, 1.2), ("long", True, 2.5)]
)
def test_a_motion_is_known_until_the_laws_end_its_reference(run, judge, failure, exhausted, known):
    """A run that was only too long says nothing of the other one."""
    ended = replace(judge, failure=failure, exhausted=exhausted, reached=1.2 if failure else 2.5)
    assert judged(run, ended).known_until == known
    assert judged(run, ended).is_exhausted == exhausted


def test_a_run_suffices_if_it_is_accurate_and_reaches_as_far_as_its_judge(run, judge):
    assert judged(run, judge, 9e-10).is_perfect
    assert not judged(run, judge, 1.1e-9).suffices
    assert not judged(run, replace(judge, failure="jam", reached=1.2)).suffices
    both = (replace(each, failure="jam", reached=1.2) for each in (run, judge))
    early = judged(*both)
    assert early.suffices
    assert not early.is_perfect


@pytest.mark.parametrize(
    ("change", "within", "time", "expected"),
    [
        (np.inf, 0.0, 1.0, True),
        # A more accurate run may decide.
        (np.inf, 1e-15, 1.0, False),
        (1e-3, 0.0, 1.0, False),
        # The run ends before.
        (np.inf, 0.0, 2.5, False),
    ],
)
def test_a_judge_is_undecided_by_a_choice_at_its_own_round_off(
    run, judge, change, within, time, expected
):
    doubt = Doubt(time, Trigger(EventKind.HITS, 0), np.inf, change, time, within)
    unsure = replace(judge, doubts=(doubt,))
    assert judged(replace(run, reached=2.0), unsure, np.inf).is_undecided is expected
    assert not judged(run, unsure, 1e-3).is_undecided


def test_runs_start_apart_if_one_was_moved_onto_a_contact(run, judge):
    """Whatever the precisions: the roundings of their speeds are no difference."""
    (q1, q2), u = run.start
    assert judged(run, judge).apart == 0
    moved = replace(run, start=((q1 + 1e-9, q2), u))
    assert judged(moved, judge).apart == pytest.approx(1e-9, rel=1e-6)
    assert judged(moved, run).apart == pytest.approx(1e-9, rel=1e-6)
    third = np.longdouble(1) / 3
    starts = [
        replace(judge, start=((third, third), (number(third), third)))
        for number in (np.longdouble, float)
    ]
    exact = replace(starts[0], precision="quadruple", start=_in_113_bits(starts[0].start))
    assert judged(starts[0], exact).apart == 0
    assert judged(starts[1], exact).apart == pytest.approx(float(third - float(third)), rel=1e-6)


def _in_113_bits(start):
    number = PRECISIONS["quadruple"].number
    return tuple(tuple(exactly(x, number) for x in pair) for pair in start)


def test_the_work_of_a_judge_that_left_the_motion_does_not_end_the_search(run):
    wild = replace(run, steps=1_000_000)
    assert judged(run, wild).expected_work == run.steps + 4 * len(run.arcs)
    assert judged(wild, wild).expected_work == wild.steps + 4 * len(run.arcs)


def test_a_run_in_quadruple_precision_that_its_work_has_ended_limits_the_search(run, judge):
    ended = replace(judge, precision="quadruple", failure="too many modes", exhausted=True)
    assert judged(run, ended).is_limited
    assert judged(ended, ended).is_limited
    # Bounces that are left out do not end a run, and shorter numbers are no limit.
    assert not judged(run, replace(ended, failure="")).is_limited
    assert not judged(replace(run, failure="too many", exhausted=True), judge).is_limited


def test_of_runs_that_follow_another_motion_the_one_that_holds_longest_is_kept(run, judge):
    """Their errors at the end do not compare them."""

    def known_until(time, worst):
        found = judged(run, judge, 1e-12)
        return replace(found, errors=np.where(time > TIMES, 1e-12, worst))

    assert known_until(2.0, 30.0).rank > known_until(1.0, 10.0).rank
    assert known_until(2.0, np.inf).rank > known_until(1.0, 10.0).rank
    # Errors that are known to be small are better than those that are unknown.
    assert known_until(1.0, 1e-8).rank > known_until(2.0, np.inf).rank


def test_the_better_run_reaches_farther_or_is_more_accurate(run, judge):
    """The judge of the new one judges both: here it shows that the one before was right."""
    coarse, fine = judged(run, judge, 1e-6), judged(run, judge, 1e-7)
    assert best_of(None, coarse, TIMES) is coarse
    assert best_of(coarse, fine, TIMES) is fine
    assert best_of(fine, coarse, TIMES).worst == 1e-7
    short = judged(replace(run, reached=1.2), replace(judge, failure="jam", reached=1.2), 1e-12)
    assert best_of(fine, short, TIMES).worst == 1e-7
    wrong = judged(run, tampered(judge, 1.5, 0, 1e-3), 1e-5)
    assert best_of(fine, wrong, TIMES) is wrong
