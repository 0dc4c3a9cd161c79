"""Runs that are repeated with shorter steps, for runs that are numbers."""

import math
import pickle

import pytest

from twolink.simulation.shortened import (
    CheckedRun,
    RepeatError,
    UnseenError,
    shortened_run,
    unseen_change,
)


def seeing_below(change, made):
    """Return a function whose run is its longest step, and sees a change by a fifth of that."""

    def run(longest):
        made.append(longest)
        return CheckedRun(longest, math.inf if longest <= change else longest / 5)

    return run


@pytest.mark.parametrize(
    ("change", "steps"), [(2.0, [1.0]), (0.1, [1.0, 0.2, 0.04]), (0.04, [1.0, 0.2, 0.04])]
)
def test_steps_are_shortened_until_they_see_a_change(change, steps):
    made = []
    assert shortened_run(1.0, 0.01, seeing_below(change, made)) == made[-1]
    assert made == pytest.approx(steps)


def test_a_run_that_is_ended_is_repeated_with_shorter_steps():
    made = []

    def run(longest):
        made.append(longest)
        if longest > 0.1:
            raise RepeatError(longest / 4)
        return CheckedRun(longest, math.inf)

    assert shortened_run(1.0, 0.01, run) == made[-1]
    assert made == [1.0, 0.25, 0.0625]


def test_a_change_that_a_step_of_the_same_length_sees_is_not_passed():
    assert shortened_run(1.0, 0.01, lambda longest: CheckedRun("run", 1.0)) == "run"


def test_the_last_run_is_kept_where_no_step_sees_the_change():
    made = []
    with pytest.raises(UnseenError, match=r"steps of 0\.04 s pass a change") as caught:
        shortened_run(1.0, 0.01, seeing_below(0.0, made))
    assert caught.value.run == made[-1] == pytest.approx(0.04)
    assert str(caught.value) == unseen_change(0.04)
    assert "must declare its shortest_time" in unseen_change(0.04)


def test_the_error_is_sent_to_other_processes_without_its_run():
    error = UnseenError(unseen_change(0.04), lambda: "a run that cannot be sent")
    sent = pickle.loads(pickle.dumps(error))
    assert type(sent) is UnseenError
    assert str(sent) == str(error)
    assert sent.run is None
