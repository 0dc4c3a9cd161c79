"""Capabilities that an engine names: wrong ones are refused, and not left out of the questions."""

import pytest

from tests.conformance.arm import Arm
from twolink.conformance.capabilities import mistake_in
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.answering import about
from twolink.engines.in_process import InProcess
from twolink.engines.messages import Method
from twolink.errors import EngineError


class Misspelt(Arm):
    answers = ("mass_matrix", "gravity_term")


class Twice(Arm):
    methods = (Method(name="rk4"), Method(name="euler"), Method(name="rk4", parameter="tolerance"))


@pytest.mark.parametrize(
    ("engine", "said"),
    [
        (Misspelt, "answers must be of mass_matrix, .*, jacobian; got gravity_term$"),
        (Twice, "methods must have different names; got rk4 several times$"),
    ],
)
def test_wrong_capabilities_are_refused(engine, said):
    groups = tuple(group for group in suite("evaluation") if group.id == "evaluation/bars")
    with pytest.raises(EngineError, match=f"^the engine's {said}"):
        conform("arm", lambda: InProcess(engine()), {"evaluation": groups})


def test_right_capabilities_have_no_mistake():
    assert mistake_in(about(Arm())) == ""
