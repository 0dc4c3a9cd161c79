"""The suite of random states: any engine beside Kane and Lagrange, as `twolink verify` compares."""

import numpy as np
import pytest

from tests.conformance.arm import Arm
from twolink.conformance.random_states import STATES
from twolink.conformance.runner import conform
from twolink.conformance.suites import VERIFY, items
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.in_process import InProcess
from twolink.engines.marks import Mark
from twolink.engines.pinocchio_engine import PinocchioEngine


def results(engine, *quantities):
    suites = {VERIFY: quantities} if quantities else items([VERIFY])
    return conform("engine", lambda: InProcess(engine), suites).results


def test_pinocchio_agrees_with_every_formulation():
    found = results(PinocchioEngine())
    assert {each.mark for each in found} == {Mark.PASS}
    assert max(each.factor for each in found) < 1
    names = [each.id for each in found]
    assert len(set(names)) == len(names)
    assert {"verify/mass-matrix/kane", "verify/mass-matrix/lagrange"} <= set(names)
    assert "verify/position/kinematics" in names


def test_only_the_wrong_quantities_of_an_engine_fail():
    class Wrong(PinocchioEngine):
        def velocity_terms(self, angles, speeds):
            return -super().velocity_terms(angles, speeds)

        def potential_energy(self, angles):
            return super().potential_energy(angles) + 17.0

        def position(self, angles):
            return super().position(angles) + 1e-9

    found = results(Wrong(), "mass_matrix", "velocity_terms", "potential_energy", "position")
    assert [each.mark for each in found] == [
        *(Mark.PASS, Mark.PASS),
        *(Mark.SILENT, Mark.SILENT),
        Mark.PASS,
        Mark.SILENT,
    ]
    assert found[2].factor > 1e6
    assert "it differs from Kane by" in found[2].said
    assert "angles" in found[2].said


def test_binary32_has_its_own_bound():
    class Single(PinocchioEngine):
        def mass_matrix(self, angles):
            return super().mass_matrix(angles).astype(np.float32)

    assert {each.mark for each in results(Single(), "mass_matrix")} == {Mark.SILENT}
    Single.precision = "binary32"
    assert {each.mark for each in results(Single(), "mass_matrix")} == {Mark.PASS}


@pytest.mark.parametrize(
    ("error", "mark", "said"),
    [
        (CannotError("not today"), Mark.CANNOT, "not today"),
        (ValueError("no"), Mark.REFUSED, "ValueError: no"),
    ],
)
def test_errors_of_one_quantity_do_not_affect_the_others(error, mark, said):
    class Failing(PinocchioEngine):
        def mass_matrix(self, angles):
            assert len(angles) == STATES
            raise error

    first, *others = results(Failing(), "mass_matrix", "gravity_terms")
    assert (first.mark, first.said) == (mark, said)
    assert {each.mark for each in others} == {Mark.PASS}


def test_engines_that_do_not_read_the_file():
    class Planar(Arm):
        reads = ("parameters",)

    (found,) = results(Planar(), "mass_matrix")
    assert (found.mark, found.said) == (Mark.CANNOT, "the engine reads parameters only")

    class Fussy(PinocchioEngine):
        answers = ("mass_matrix",)

        def load(self, model):
            raise ModelRefusedError("no ground")

    found, other = results(Fussy(), "mass_matrix", "gravity_terms")
    assert found.mark is Mark.REFUSED
    assert "no ground" in found.said
    assert (other.mark, other.said) == (Mark.CANNOT, "the engine does not answer this quantity")

    class Short(PinocchioEngine):
        def mass_matrix(self, angles):
            return np.zeros(3)

    (found,) = results(Short(), "mass_matrix")
    assert found.mark is Mark.INVALID
