"""Simulators read URDF by their own readers: the import suite is put to them as to any engine."""

import numpy as np
import pytest

from tests.simulators import simulator_named
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach
from twolink.engines.faults import CannotError, ModelRefusedError
from twolink.engines.marks import Mark
from twolink.engines.messages import Model
from twolink.engines.urdf_reading import check_joints
from twolink.scene import Scene, scene_file

# PyBullet takes frames without inertial to weigh 1 kg: see docs/bugs.md.
RIGHT = [
    ("scipy", "import/plain"),
    *(pytest.param("mujoco", "import/general", marks=pytest.mark.engines),),
    *(pytest.param("drake", "import/general", marks=pytest.mark.engines),),
    *(pytest.param("pybullet", "import/frames-of-zero-mass", marks=pytest.mark.engines),),
]


@pytest.mark.parametrize(("engine", "name"), RIGHT)
def test_mass_matrix_and_forward_dynamics_of_a_file(engine, name):
    groups = tuple(group for group in suite("import") if group.id == name)
    found = conform(engine, attach(engine, in_process=True), {"import": groups})
    marks = {each.quantity: each.mark for each in found.results if each.mark is not Mark.CANNOT}
    expected = ("read", "mass_matrix", "forward_dynamics")
    assert marks == dict.fromkeys(expected, Mark.PASS), found.failed


@pytest.mark.engines
@pytest.mark.parametrize(
    ("name", "mark"),
    [("zero-axis", Mark.PASS), ("negative-mass", Mark.PASS), ("kilometres", Mark.REFUSED)],
)
def test_pybullet_refuses_a_file_by_its_first_dynamics_function(name, mark):
    groups = tuple(group for group in suite("import") if group.id == f"import/{name}")
    found = conform("pybullet", attach("pybullet", in_process=True), {"import": groups})
    (read,) = found.results
    assert (read.mark, read.said) == (mark, "calculateMassMatrix fails")


def test_a_chain_of_parameters_is_written_for_the_reader():
    (group,) = (group for group in suite("evaluation") if group.id == "evaluation/general")
    found = conform("scipy", attach("scipy", in_process=True), {"evaluation": (group,)})
    assert next(r.mark for r in found.results if r.quantity == "mass_matrix") is Mark.PASS


def test_quantities_of_parameters_are_refused_for_a_scene():
    engine = simulator_named("scipy")
    engine.load(Model(id="x", scene=Scene.load(scene_file("free_fall")).to_toml()))
    rows = np.zeros((1, 2))
    with pytest.raises(CannotError, match="of parameters, not of a scene"):
        engine.mass_matrix(rows)
    with pytest.raises(CannotError, match="of parameters, not of a scene"):
        engine.forward_dynamics(rows, rows, rows)
    with pytest.raises(ModelRefusedError):
        engine.load(Model(id="x", scene="[chain]"))


@pytest.mark.parametrize(
    ("count", "names", "words"),
    [
        (3, ("a", "b", "c"), "3 degrees of freedom"),
        (2, ("a", "c"), "the joints that move are a, c"),
    ],
)
def test_joints_that_are_not_those_of_the_model(count, names, words):
    model = Model(id="x", urdf="<robot>", joints=("a", "b"))
    with pytest.raises(ModelRefusedError, match=words):
        check_joints(model, count, names)
    assert check_joints(model, 2, ("b", "a")) == ("a", "b")
