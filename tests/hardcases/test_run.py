"""The runner reports every outcome of a case and continues with the others."""

import dataclasses
import json
import time
import warnings

import pytest

from tests.simulators import simulator_named
from twolink.engines.marks import Mark, Result
from twolink.engines.registry import SIMULATORS
from twolink.errors import EngineError, SimulationError
from twolink.hardcases.catalogue import CASES, case_named
from twolink.hardcases.record import Case, Column
from twolink.hardcases.run import columns, document, failed_by_us, outcome, scoreboard
from twolink.hardcases.trajectory_trial import Answer, TrajectoryTrial
from twolink.simulation.smooth.equations import EQUATIONS


class Trial:
    """A trial that calls a given function."""

    def __init__(self, does):
        self.does = does

    def ours(self, formulation, check):
        return self.does(check)


def case(does, seconds=60.0):
    return Case("a case", "smooth", "it", "this", "here", "so", Trial(does), seconds)


def refuse(check):
    raise SimulationError("it must be so; got another")


def crash(check):
    raise ZeroDivisionError("division by zero")


def warn(check):
    warnings.warn("overflow", RuntimeWarning, stacklevel=1)
    return Result(0.0)


def hang(check):
    while True:
        check()


def wait(check):
    while True:
        time.sleep(0.01)
        check()


def work_on_a_busy_machine(check):
    """Twice the limit by the clock, and little of it at work."""
    time.sleep(0.4)
    check()
    return Result(0.1)


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("does", "mark", "said"),
    [
        (lambda check: Result(0.1), Mark.PASS, ""),
        (lambda check: Result(20.0, said="far"), Mark.SILENT, "far"),
        (refuse, Mark.REFUSED, "it must be so; got another"),
        (crash, Mark.CRASH, "ZeroDivisionError: division by zero"),
        (warn, Mark.CRASH, "RuntimeWarning: overflow"),
        (hang, Mark.HANG, "stopped after 0.2 s of processor time"),
        pytest.param(
            *(wait, Mark.HANG, "stopped after 4 s, most of them waiting"), marks=pytest.mark.slow
        ),
        (work_on_a_busy_machine, Mark.PASS, ""),
    ],
)
def test_each_result_of_a_case_has_its_mark(does, mark, said):
    found = outcome(case(does, seconds=0.2), Column("kane"))
    assert found.mark is mark
    assert said in found.said
    assert found.call == ("" if mark is Mark.PASS else "a case with kane")


def test_the_scoreboard_continues_after_a_failure():
    cases = [dataclasses.replace(case(does), name=does.__name__) for does in (crash, warn, refuse)]
    started = []
    board = scoreboard(
        cases, (Column("kane"), Column("lagrange")), lambda one, column: started.append(one.name)
    )
    assert started == ["crash", "crash", "warn", "warn", "refuse", "refuse"]
    assert len(failed_by_us(board)) == 6
    table = document(board, cases)
    assert json.loads(json.dumps(table)) == table
    assert table["cases"]["crash"]["outcomes"]["kane"]["mark"] == "crash"
    assert table["cases"]["crash"]["hard"] == "it"


def test_columns():
    names = [column.name for column in columns()]
    assert tuple(names[:3]) == tuple(EQUATIONS)
    assert set(names[3:]) == {engine.name for engine in SIMULATORS if not engine.missing()}
    assert [column.name for column in columns(["KANE", "heyoka"])] == ["kane", "heyoka"]
    assert [column.name for column in columns(["pinocchio"])] == ["SciPy over Pinocchio"]
    with pytest.raises(EngineError, match="engine must be one of momenta, lagrange, kane, "):
        columns(["ode"])
    with pytest.raises(EngineError, match=r"engine must be one of .*; got 's'"):
        columns(["s"])


def test_an_engine_that_cannot_express_a_scene_is_not_run():
    heyoka = simulator_named("heyoka")
    found = outcome(case_named("zeno"), Column(heyoka.name, heyoka))
    assert found.mark is Mark.CANNOT
    assert "joint_stop" in found.said
    found = outcome(case_named("scene-100-mb"), Column(heyoka.name, heyoka))
    assert (found.mark, found.said) == (Mark.CANNOT, "scene files are this library's own")


@pytest.mark.slow
def test_an_engine_runs_in_a_separate_process():
    """heyoka alone, from the natural start, at a tolerance for which it takes an order of 8."""
    heyoka = simulator_named("heyoka")
    column = Column(heyoka.name, heyoka)
    found = outcome(case_named("natural-start"), column)
    assert found.mark is Mark.SILENT
    assert found.call.startswith("heyoka, taylor: prepared(scene)(tolerance 0.001, 0.0001")
    assert outcome(case_named("point-masses"), column).mark is Mark.PASS


@pytest.mark.slow
def test_an_engine_that_returns_nan_silently():
    """Pinocchio answers a NaN with NaNs: not refused, but no finite answer either."""
    pinocchio = simulator_named("SciPy over Pinocchio")
    found = outcome(case_named("nan-angle"), Column(pinocchio.name, pinocchio))
    assert found.mark is Mark.MISSED
    assert "it is accepted; the answer is [nan, nan]" in found.said
    found = outcome(case_named("urdf-truncated"), Column(pinocchio.name, pinocchio))
    assert found.mark is Mark.PASS


def test_an_incomplete_answer_is_rejected():
    trial = next(case.trial for case in CASES if isinstance(case.trial, TrajectoryTrial))
    answer = Answer(trial.scene, *(trial_array() for _ in range(3)), accuracy=1e-9)
    assert not answer.finite


def trial_array():
    import numpy as np

    return np.zeros((2, 3))
