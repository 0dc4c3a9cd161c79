"""This library passes every case with every formulation."""

import pytest

from twolink.hardcases.catalogue import CASES
from twolink.hardcases.on_input import OnInput
from twolink.hardcases.record import FORMULATIONS, Column, Mark
from twolink.hardcases.run import outcome

LONG = {
    "chaos-100-s",
    "small-oscillation-1e6-s",
    "spin-1e5",
    "beats",
    "zero-gravity-1e5-s",
    "stiff-spring-1e10",
    "soft-torque",
    "bounces-1e4",
    "compliant-1e12",
    "urdf-deep",
    "urdf-100-mb",
    "urdf-file-100-mb",
    "scene-100-mb",
}


def marked(case):
    of_its_own = isinstance(case.trial, OnInput) and case.trial.hostile
    slow = [pytest.mark.slow] if case.name in LONG or of_its_own else []
    return pytest.param(case, id=case.name, marks=slow)


@pytest.mark.parametrize("case", [marked(case) for case in CASES])
def test_every_formulation_passes(case):
    for formulation in FORMULATIONS:
        found = outcome(case, Column(formulation))
        assert found.mark is Mark.PASS, f"{formulation}: {found.words}; {found.said}"
