"""This library passes every case with every formulation."""

from dataclasses import replace

import pytest

from twolink.engines.marks import Mark
from twolink.hardcases.catalogue import CASES
from twolink.hardcases.input_trial import InputTrial
from twolink.hardcases.record import Column
from twolink.hardcases.run import OURS, failed_by_us, outcome, scoreboard
from twolink.simulation.smooth.equations import EQUATIONS

LONG = {
    "natural-start",
    "chaos-100-s",
    "small-oscillation-1e6-s",
    "spin-1e5",
    "beats",
    "zero-gravity-1e5-s",
    "stiff-spring-1e10",
    "soft-torque",
    "bounces-1e4",
    "zeno-slow",
    "compliant-1e12",
    "urdf-deep",
    "urdf-100-mb",
    "urdf-file-100-mb",
    "scene-100-mb",
}
# They begin before all shorter tests. Each is tried with one formulation, as with all three, by
# `twolink hardcases`, they take minutes.
LONGEST = {
    "chaos-100-s": "kane",
    "small-oscillation-1e6-s": "lagrange",
    "zero-gravity-1e5-s": "momenta",
    "bounces-1e4": "lagrange",
}


def is_quick(case):
    in_a_process_of_its_own = isinstance(case.trial, InputTrial) and case.trial.hostile
    return case.name not in LONG and not in_a_process_of_its_own


@pytest.mark.parametrize("case", list(filter(is_quick, CASES)), ids=lambda case: case.name)
def test_every_formulation_passes(case):
    for formulation in EQUATIONS:
        found = outcome(case, Column(formulation))
        assert found.mark is Mark.PASS, f"{formulation}: {found.words}; {found.said}"


@pytest.mark.slow
@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, marks=[pytest.mark.long] if case.name in LONGEST else [], id=case.name)
        for case in CASES
        if not is_quick(case)
    ],
)
def test_every_formulation_passes_a_case_that_takes_long(case):
    columns = [own for own in OURS if own.name == LONGEST.get(case.name, own.name)]
    assert columns
    # Whether it passes does not depend on the speed of the machine.
    board = scoreboard([replace(case, seconds=4 * case.seconds)], columns)
    assert failed_by_us(board) == [], board[case.name]


def test_many_cases_take_long():
    assert sum(not is_quick(case) for case in CASES) > 30
