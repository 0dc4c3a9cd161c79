"""`examples/engines/adapter.py`, by an adapter of a toy engine; the table of adapters."""

import math
import re
import sys
from pathlib import Path

import pytest

from twolink.conformance.harness_check import check_harness
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach
from twolink.engines.messages import Errored, Model, Parameters, Refused, States
from twolink.engines.session import Session

FOLDER = Path(__file__).parent.parent / "examples" / "engines"

# Closed forms of the evaluation suite's chains, from parameters.
TOY = """
import sys, warnings
sys.path.insert(0, {folder!r})
import numpy as np
from adapter import Engine, RefusedError, parameters_of, serve

class Toy(Engine):
    name, version, reads = "toy", "1", ("parameters",)

    def load(self, model):
        print("not a message")
        self.chain = parameters_of(model)
        if not all(mass > 0 for mass in self.chain["mass"]):
            raise RefusedError("a mass is not positive")

    def position(self, angles):
        (L1, L2), (first, second) = self.chain["length"], (angles[:, 0], angles.sum(axis=1))
        x = L1 * np.cos(first) + L2 * np.cos(second)
        y = L1 * np.sin(first) + L2 * np.sin(second)
        return np.stack([x, 0 * x, -y], axis=1)

    def potential_energy(self, angles):
        if not np.isfinite(angles).all():
            raise RefusedError(" ".join(["angles are", *map(str, angles.ravel())]))
        return angles[:, 0]

    def gravity_terms(self, angles):
        warnings.warn("of one mass alone")
        return angles * self.chain["mass"][0]

serve(Toy)
"""


@pytest.fixture
def command(tmp_path):
    script = tmp_path / "toy.py"
    script.write_text(TOY.format(folder=str(FOLDER)))
    return f"cmd: {sys.executable} {script}"


def test_an_adapter_keeps_to_the_protocol(command):
    checks = check_harness(attach(command), 30.0)
    assert [check.name for check in checks if not check.passed] == []


def test_right_answers_pass_and_warnings_are_passed_on(command):
    groups = {"evaluation": suite("evaluation")[:2]}
    report = conform(command, attach(command), groups)
    found = {result.id: result for result in report.results}
    assert found["evaluation/general/position"].verdict == "pass"
    terms = found["evaluation/general/gravity-terms"]
    assert terms.verdict == "missed"
    assert terms.warnings == ("UserWarning: of one mass alone",)


def test_numbers_that_are_not_finite_arrive_as_numbers(command):
    parameters = Parameters(
        mass=(1.0, math.nan),
        length=(1.0, 1.0),
        centre=((0.5, 0.0), (0.5, 0.0)),
        inertia=(0.1, 0.1),
        gravity=9.81,
    )
    with Session(attach(command), 30.0) as session:
        answer = session.load(Model(id="nan", parameters=parameters))
        assert answer == Refused(refused="a mass is not positive")
        sound = parameters.model_copy(update={"mass": (1.0, 1.0)})
        session.load(Model(id="sound", parameters=sound))
        states = States(angles=((math.inf, math.nan),))
        answer = session.ask("inf", "potential_energy", states)
        assert isinstance(answer, Errored)
        assert answer.message == "angles are inf nan"


def test_the_table_names_every_adapter():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"^\| `(\w+_adapter\.py)`", text, re.MULTILINE))
    assert named == {path.name for path in FOLDER.glob("*_adapter.py")}


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*_adapter.py")), ids=lambda path: path.stem)
def test_each_adapter_lists_the_traps_of_its_engine(path):
    assert "\nTraps: " in path.read_text(encoding="utf-8")
