"""The shipped URDF loads in five engines, and each finds the same machine in it.

For m = L = 1 the mass matrix over joint angles is Sᵀ [[4/3, c/2], [c/2, 1/3]] S, c = cos θ2.
"""

import importlib

import numpy as np
import pytest

from twolink import kinematics
from twolink.chain import Chain
from twolink.data import data_path

PATH = str(data_path("twolink.urdf"))
ANGLES = np.array([0.3, -0.7])
COUPLING = np.cos(ANGLES[1]) / 2
MASS_MATRIX = np.array([[5 / 3 + 2 * COUPLING, 1 / 3 + COUPLING], [1 / 3 + COUPLING, 1 / 3]])
END = kinematics.position(Chain.uniform_bars(), (0.3, 0.3 - 0.7), Chain.uniform_bars().D)
# The chain's x and y (downward) in a world with z up.
END_IN_WORLD = np.array([END[0], 0.0, -END[1]])


@pytest.fixture(autouse=True)
def no_complaints(capfd):
    """No engine, most of them C++, may have printed a warning or an error."""
    yield
    printed = "".join(capfd.readouterr()).lower()
    assert "warn" not in printed
    assert "error" not in printed


def test_pinocchio():
    pinocchio = importlib.import_module("pinocchio")
    model, _, visual = pinocchio.buildModelsFromUrdf(PATH)
    data = model.createData()
    q = np.array([f(angle) for angle in ANGLES for f in (np.cos, np.sin)])
    assert np.triu(pinocchio.crba(model, data, q)) == pytest.approx(np.triu(MASS_MATRIX), abs=1e-15)
    pinocchio.framesForwardKinematics(model, data, q)
    assert data.oMf[model.getFrameId("D")].translation == pytest.approx(END_IN_WORLD, abs=1e-15)
    assert all(model.existFrame(name) for name in ("A", "B", "C1", "C2", "D"))
    assert len(visual.geometryObjects) == 6


def test_yourdfpy():
    yourdfpy = importlib.import_module("yourdfpy")
    robot = yourdfpy.URDF.load(PATH)
    assert robot.actuated_joint_names == ["joint1", "joint2"]
    robot.update_cfg(ANGLES)
    assert robot.get_transform("D", "A")[:3, 3] == pytest.approx(END_IN_WORLD, abs=1e-15)
    assert robot.validate()


@pytest.mark.engines
def test_mujoco():
    mujoco = importlib.import_module("mujoco")
    model = mujoco.MjModel.from_xml_path(PATH)
    data = mujoco.MjData(model)
    data.qpos[:] = ANGLES
    mujoco.mj_forward(model, data)
    matrix = np.zeros((2, 2))
    mujoco.mj_fullM(model, data, matrix)
    assert matrix == pytest.approx(MASS_MATRIX, abs=1e-14)


@pytest.mark.engines
def test_pybullet():
    """Without the flag PyBullet forms inertias from the collision shapes, not from the file."""
    pybullet = importlib.import_module("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        body = pybullet.loadURDF(PATH, useFixedBase=True, flags=pybullet.URDF_USE_INERTIA_FROM_FILE)
        matrix = np.array(pybullet.calculateMassMatrix(body, list(ANGLES)))
        masses = [pybullet.getDynamicsInfo(body, i)[0] for i in range(pybullet.getNumJoints(body))]
    finally:
        pybullet.disconnect(client)
    assert matrix == pytest.approx(MASS_MATRIX, abs=1e-14)
    assert sorted(masses) == [0, 0, 0, 0, 0, 1, 1]


@pytest.mark.engines
def test_drake():
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(PATH)
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("ground"))
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, ANGLES)
    assert plant.CalcMassMatrix(context) == pytest.approx(MASS_MATRIX, abs=1e-14)
    end = plant.GetFrameByName("D").CalcPoseInWorld(context).translation()
    assert end == pytest.approx(END_IN_WORLD, abs=1e-14)
