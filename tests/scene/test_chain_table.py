"""Scenes with a URDF: joint angles, gravity's component in the plane, and notes."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.scene.test_scene import TEXT, assert_it_reads_back, with_urdf
from tests.urdf.drawing import arm, at, axis, joint
from twolink.cli import app
from twolink.coordinates import JointConvention
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.errors import SceneError
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.urdf import parse_planar_urdf

BACKWARDS = arm(
    shoulder=joint("shoulder", "ground", "upper", inside=at("0 0 0", "0 0.3 0") + axis("0 -2 0")),
    elbow=joint("elbow", "upper", "lower", inside=at("1 0 0", "0 -0.7 0")),
)
HORIZONTAL = arm(
    shoulder=joint("shoulder", "ground", "upper", inside=axis("0 0 1")),
    elbow=joint("elbow", "upper", "lower", inside=axis("0 0 1") + at("1 0 0")),
)
OBLIQUE = arm(shoulder=joint("shoulder", "ground", "upper", inside=at("0 0 0", "0.3 0 0")))


def with_start(folder: Path, start: str, urdf: str = BACKWARDS, more: str = "") -> Scene:
    """Return the scene of a URDF with another [start] table."""
    file = with_urdf(folder, more, urdf)
    file.write_text(file.read_text().replace("q = [0.1, 0.2]", start))
    return Scene.load(file)


def test_a_start_in_joint_angles(tmp_path):
    scene = with_start(tmp_path, "theta = [0.4, -0.9]\nomega = [1.0, 2.0]")
    read = parse_planar_urdf(BACKWARDS)
    assert scene.joints == read.joints
    assert read.joints.sign == (-1, 1)
    assert scene.q == read.joints.absolute_angles((0.4, -0.9))
    assert scene.u == read.joints.absolute_speeds((1.0, 2.0)) == (-1.0, 1.0)
    assert with_start(tmp_path, "theta = [0.4, -0.9]\nu = [1.0, 2.0]").u == (1.0, 2.0)
    assert with_start(tmp_path, "q = [0.4, -0.9]\nomega = [1.0, 2.0]").u == (-1.0, 1.0)
    assert with_start(tmp_path, "theta = [0.4, -0.9]").u == (0.0, 0.0)


def test_joint_angles_of_a_chain_of_numbers():
    numbers = "length = [1.0, 0.5]\njoint_sign = [-1, 1]\njoint_offset = [0.5, -0.25]"
    text = TEXT.replace("length = [1.0, 0.5]", numbers).replace("q =", "theta =")
    scene = Scene.parse(text)
    assert scene.joints == JointConvention((-1, 1), (0.5, -0.25))
    assert scene.q == scene.joints.absolute_angles((0.1, 0.2))
    assert_it_reads_back(scene)


@pytest.mark.parametrize(
    ("start", "words"),
    [
        ("q = [0, 0]\ntheta = [0, 0]", "start must have one of q and theta; got both"),
        ("q = [0, 0]\nu = [0, 0]\nomega = [0, 0]", "start must have one of u and omega; got both"),
        ("u = [0, 0]", "key 'start.q' is missing"),
        ("theta = [0]", "start.theta"),
        ("theta = ['a', 0]", "start.theta.0"),
    ],
)
def test_wrong_starts_are_refused(tmp_path, start, words):
    with pytest.raises(SceneError, match=re.escape(words)):
        with_start(tmp_path, start)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("q =", "theta =", "start.theta needs chain.urdf"),
        ("[start]", "[start]\nomega = [0, 0]", "start.omega needs chain.urdf"),
        ("[start]", "joint_sign = [1, 1]\n[start]", "joint_sign and joint_offset, or neither"),
        ("[start]", "joint_sign = [1, 2]\njoint_offset = [0, 0]\n[start]", "chain.joint_sign"),
    ],
)
def test_joint_angles_that_are_refused(old, new, words):
    with pytest.raises(SceneError, match=re.escape(words)):
        Scene.parse(TEXT.replace(old, new))


def test_a_urdf_and_joint_angles_of_numbers_are_refused(tmp_path):
    with pytest.raises(SceneError, match="urdf or joint_offset, joint_sign, not both"):
        with_start(tmp_path, "", more="joint_sign = [1, 1]\njoint_offset = [0, 0]")


def test_gravity_along_the_axes_does_not_act(tmp_path):
    scene = with_start(tmp_path, "theta = [0.4, -0.9]", HORIZONTAL)
    assert scene.effects == (JointDamping((0.1, 0.0)),)
    assert any("the joints bear it" in note for note in scene.notes)
    without = with_urdf(tmp_path, urdf=HORIZONTAL)
    without.write_text(without.read_text().replace("[effects.gravity]\ng = 9.81", ""))
    assert not any("ravity" in note for note in Scene.load(without).notes)


def test_oblique_gravity_acts_by_its_component(tmp_path):
    scene = with_start(tmp_path, "theta = [0, 0]", OBLIQUE)
    assert isinstance(scene.effects[0], Gravity)
    assert scene.effects[0].g == pytest.approx(9.81 * math.cos(0.3), rel=1e-15)
    assert any("the joints bear the rest" in note for note in scene.notes)
    assert any(f"plane, {9.81 * math.cos(0.3):.5g} m/s²" in note for note in scene.notes)
    file = tmp_path / "scene.toml"
    text = file.read_text()
    file.write_text(text.replace("g = 9.81", "g = 1.62"))
    moon = Scene.load(file)
    assert moon.effects[0].g == pytest.approx(1.62 * math.cos(0.3), rel=1e-15)
    assert any(f"plane, {1.62 * math.cos(0.3):.5g} m/s²" in note for note in moon.notes)
    # The length of the direction has no meaning.
    file.write_text(text.replace("g = 9.81", "g = 9.81\ndirection = [0.0, 2.0]"))
    assert Scene.load(file).effects == scene.effects
    # A direction of its own is one in the plane.
    file.write_text(text.replace("g = 9.81", "g = 9.81\ndirection = [1.0, 0.0]"))
    assert Scene.load(file).effects[0] == Gravity(9.81, (1.0, 0.0))


def test_a_horizontal_arm_turns_without_gravity(tmp_path):
    """Angular momentum about A, and energy, are constant; joint angles are stored and read."""
    file = with_urdf(tmp_path, urdf=HORIZONTAL)
    text = file.read_text().replace("[effects.joint_damping]\ncoefficient = [0.1, 0.0]", "")
    file.write_text(text.replace("q = [0.1, 0.2]", "theta = [0.1, 0.2]\nomega = [1.0, -2.0]"))
    trajectory = simulate(Scene.load(file), samples=11)
    assert np.ptp(trajectory.energy) < 1e-9
    assert trajectory.notes == trajectory.scene.notes
    assert "bear it" in "".join(trajectory.notes)
    np.testing.assert_allclose(trajectory.theta[:, 0], (0.1, 0.2), rtol=1e-15)
    for kind in (".npz", ".csv", ".parquet"):
        trajectory.save(tmp_path / f"run{kind}")
        back = Trajectory.load(tmp_path / f"run{kind}")
        assert np.array_equal(back.theta, trajectory.theta)
        assert np.array_equal(back.omega, trajectory.omega)
        assert back.notes == trajectory.notes
        assert np.array_equal(back.u, trajectory.u)
    with np.load(tmp_path / "run.npz") as archive:
        assert np.array_equal(archive["theta"], trajectory.theta)
        assert np.array_equal(archive["omega"], trajectory.omega)
    header = [x for x in (tmp_path / "run.csv").read_text().splitlines() if x.startswith("t_s")]
    assert header[0].endswith(",theta1_rad,theta2_rad,omega1_rad_per_s,omega2_rad_per_s")


def test_a_scene_without_joints_has_no_joint_angles():
    trajectory = simulate(Scene.parse(TEXT), samples=3)
    assert trajectory.theta is None
    assert trajectory.omega is None


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("", "damping and limits are not simulated; effects = ["),
        ('effects = ["damping"]', 'limits are not simulated; effects = ["damping", "limits"] in'),
        ('effects = ["limits"]', 'damping is not simulated; effects = ["limits", "damping"] in'),
        ('effects = ["limits", "damping"]', ""),
    ],
)
def test_properties_that_are_not_simulated_are_noted(tmp_path, more, words):
    notes = "".join(Scene.load(with_urdf(tmp_path, more)).notes)
    assert words in notes
    assert ("not simulated" in notes) == bool(words)


def test_simulate_prints_joint_angles_and_notes(tmp_path):
    result = CliRunner().invoke(app, ["simulate", str(with_urdf(tmp_path))])
    assert result.exit_code == 0
    for words in ("θ at the end", "ω at the end", "damping and limits are not simulated"):
        assert words in result.stdout
