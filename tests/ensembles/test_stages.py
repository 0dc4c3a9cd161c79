import numpy as np
import pytest

from tests.ensembles.cases import starts
from tests.ensembles.falls import FALL
from twolink.effects import JointDamping
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import System
from twolink.ensembles.stages import Prepared, _Carried, _Followed, carries_errors, stages_of

SYSTEM = System(FALL.moving_chain, FALL.effects, ())


class Own(JointDamping):
    """An effect of one's own."""


def stages(keep, system=SYSTEM, count=3, **runs):
    asked = starts(count, runs={"accuracy": 1e-6, "duration": 10.0, **runs}, keep=keep)
    q, u = asked.family.starts(asked.values(0, asked.runs.count))
    prepared = Prepared(np.arange(len(q[0])), np.zeros((0, len(q[0]))), q, u)
    return stages_of(asked, system, prepared), asked


@pytest.mark.parametrize(
    ("keep", "kind"),
    [
        ({}, _Carried),
        ({"final": True, "energy": True}, _Carried),
        ({"first": [{"name": "flip"}]}, _Carried),
        ({"final": True, "extremes": True}, _Followed),
        ({"samples": 5}, _Followed),
    ],
)
def test_steps_carry_errors_where_few_of_them_are_kept(keep, kind):
    made, asked = stages(keep)
    assert isinstance(made, kind)
    assert carries_errors(asked, SYSTEM) == (kind is _Carried)


def test_runs_with_effects_of_ones_own_are_followed():
    own = System(FALL.moving_chain, (*FALL.effects, Own((0.1, 0.1))), ())
    assert isinstance(stages({"final": True}, own)[0], _Followed)


def test_runs_are_made_again_where_shorter_steps_help():
    made, asked = stages({"final": True}, count=20)
    first, last = made.trials(asked.accuracy)
    (before,) = made.runs(np.arange(400), first)
    assert len(before.lanes) == 400
    left = np.flatnonzero(before.errors > asked.accuracy)
    (after,) = made.runs(left, last)
    # The others have grown round-off, or are not better.
    assert 0 < len(after.lanes) < len(left)
    assert (after.errors < before.errors[after.lanes]).all()
    assert np.isin(after.lanes, left).all()
    assert not after.lost


def test_ends_are_those_of_runs_that_are_followed():
    runs = {"accuracy": 1e-8, "duration": 5.0}
    ends = rows_of(starts(6, runs=runs, keep={"final": True}), 0, 36).arrays
    steps = rows_of(starts(6, runs=runs, keep={"final": True, "extremes": True}), 0, 36).arrays
    known = np.isfinite(ends["error"]) & np.isfinite(steps["error"])
    assert known.sum() > 30
    apart = np.abs(np.concatenate([ends[k] - steps[k] for k in "qu"], axis=1)).max(axis=1)
    assert (apart <= ends["error"] + steps["error"])[known].all()


def test_first_times_are_those_of_runs_that_are_followed():
    runs = {"accuracy": 1e-8, "duration": 5.0}
    first = {"first": [{"name": "flip"}]}
    few = rows_of(starts(6, runs=runs, keep=first), 0, 36).arrays
    all_ = rows_of(starts(6, runs=runs, keep={**first, "extremes": True}), 0, 36).arrays
    assert np.array_equal(few["flip_verdict"], all_["flip_verdict"])
    happens = np.isfinite(few["flip_time"])
    assert 5 < happens.sum() < 36
    apart = np.abs(few["flip_time"] - all_["flip_time"])
    assert (apart <= few["flip_bound"] + all_["flip_bound"])[happens].all()
