"""The import suite in MuJoCo, Drake and PyBullet: their known faults, strictly, and repairs."""

import functools

import pytest

from tests.import_suite.index import FOLDER, VALID, named
from tests.import_suite.table import isolated, verdict, verdicts
from twolink.urdf import read_planar_urdf
from twolink.urdf.repair import repair_urdf

pytestmark = [pytest.mark.engines, pytest.mark.filterwarnings("ignore")]

# Results of engines on unrepaired files: "agrees" but for these. docs/bugs.md explains each.
# PyBullet takes frames without inertial to weigh 1 kg, and all files but one have such frames.
KNOWN = {
    ("mujoco", "thin-rods"): "refuses",
    ("mujoco", "millimetres"): "refuses",
    ("drake", "fixed-joint-mimics"): "refuses",
    ("pybullet", "kilometres"): "refuses",
}
PYBULLET_AGREES = ("frames-of-zero-mass",)

# Remaining differences after a repair: limits of the engines' own scale.
AFTER_REPAIR = {("mujoco", "millimetres"): "refuses", ("pybullet", "kilometres"): "refuses"}


@functools.cache
def found(engine: str, name: str) -> tuple[str, str]:
    (test,) = (test for test in VALID if named(test) == name)
    as_is, repaired = verdicts(test, engine)
    return as_is.split()[0].rstrip(":"), repaired.split()[0].rstrip(":")


@pytest.mark.parametrize("name", [named(test) for test in VALID])
@pytest.mark.parametrize("engine", ["mujoco", "drake", "pybullet"])
def test_valid_files_as_they_stand(engine, name):
    usual = "wrong" if engine == "pybullet" and name not in PYBULLET_AGREES else "agrees"
    assert found(engine, name)[0] == KNOWN.get((engine, name), usual)


@pytest.mark.parametrize("name", [named(test) for test in VALID])
@pytest.mark.parametrize("engine", ["mujoco", "drake", "pybullet"])
def test_repaired_files(engine, name):
    assert found(engine, name)[1] == AFTER_REPAIR.get((engine, name), "agrees")


@pytest.mark.parametrize("engine", ["mujoco", "drake", "pybullet"])
def test_repairable_files(engine):
    """Every invalid file that can be repaired is then the plain arm, in every engine."""
    from tests.import_suite.index import INVALID
    from twolink.urdf.repair import repair_file

    (plain,) = (test for test in VALID if named(test) == "plain")
    # The arm's joints have other names where two had the same, or one had none.
    for test in INVALID:
        if test["repairable"]:
            text = repair_file(FOLDER / test["file"]).text
            assert verdict(engine, text, plain["parameters"]) == "agrees", test["id"]


def test_pybullet_misreads_vectors_over_two_lines():
    """A line break inside of a vector ends it, without a refusal."""
    (test,) = (test for test in VALID if named(test) == "vector-over-two-lines")
    sound = repair_urdf(read_planar_urdf(FOLDER / test["file"]).xml).text
    broken = sound.replace('xyz="1  0 0"', 'xyz="1\n0 0"')
    assert broken != sound
    assert verdict("pybullet", sound, test["parameters"]) == "agrees"
    assert verdict("pybullet", broken, test["parameters"]).startswith("wrong")


@pytest.mark.parametrize("name", ["two-joints-of-one-name", "two-roots", "two-parents"])
def test_pybullet_crashes(name):
    assert isolated("pybullet", f"invalid/{name}.urdf") == "crashes (signal 11)"


@pytest.mark.parametrize(
    ("engine", "name"),
    [
        ("pinocchio", "decimal-comma"),
        ("pinocchio", "nan-mass"),
        ("pinocchio", "infinite-mass"),
        ("pinocchio", "xacro-expression"),
        ("pybullet", "decimal-comma"),
        ("pybullet", "two-coordinates"),
        ("pybullet", "limit-of-words"),
        ("pybullet", "xacro-expression"),
    ],
)
def test_engines_accept_non_numbers(engine, name):
    assert isolated(engine, f"invalid/{name}.urdf") == "accepts"
