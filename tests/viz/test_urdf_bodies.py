"""The geometry of a URDF against Pinocchio's placements in every pose."""

from __future__ import annotations

import math
import os
import struct

import numpy as np
import pinocchio as pin
import pytest

from tests.viz.test_film import commands, matrix
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects.gravity import Gravity
from twolink.errors import PictureError, UrdfError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import read_planar_urdf
from twolink.viz.film import Film
from twolink.viz.run import Run
from twolink.viz.urdf_bodies import urdf_bodies

# A robot that stands away from the origin, moves in the y-z plane about axes of both signs, has
# meshes on links and on a part that is fixed to one, and one on its base.
ROBOT = """<robot name="meshes">
  <link name="base"><visual><geometry><box size="0.3 0.4 0.1"/></geometry></visual></link>
  <link name="upper">
    <inertial><origin xyz="0 0.5 0"/><mass value="1"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><origin xyz="0.02 0.4 0.1" rpy="0.3 0.2 0.1"/>
      <geometry><mesh filename="{mesh}" scale="0.5 1 2"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material></visual>
  </link>
  <link name="lower">
    <inertial><origin xyz="0 0 0.3"/><mass value="1"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <visual><origin xyz="0 0 0.3"/>
      <geometry><cylinder radius="0.05" length="0.6"/></geometry></visual>
  </link>
  <link name="tool"><visual><origin xyz="0 0.1 0"/>
    <geometry><sphere radius="0.1"/></geometry></visual></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/>
    <origin xyz="0.5 0.6 0.7"/><axis xyz="1 0 0"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.1 1.0 0" rpy="0.5 0 0"/><axis xyz="-1 0 0"/></joint>
  <joint name="mount" type="fixed"><parent link="lower"/><child link="tool"/>
    <origin xyz="0 0 0.6"/></joint>
</robot>
"""


def tetrahedron(file):
    """Write a tetrahedron as a binary STL, from the origin to (0.2, 0.3, 0.4)."""
    corners = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]], dtype="<f4")
    with file.open("wb") as stream:
        stream.write(bytes(80) + struct.pack("<I", 4))
        for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
            stream.write(bytes(12) + corners[list(face)].tobytes() + bytes(2))


@pytest.fixture
def robot(tmp_path):
    (tmp_path / "meshes").mkdir()
    tetrahedron(tmp_path / "meshes" / "part.stl")
    file = tmp_path / "robot.urdf"
    file.write_text(ROBOT.format(mesh="package://meshes/part.stl"))
    return file


def film_with(file):
    read = read_planar_urdf(file)
    chain = Chain.from_links(read.links)
    scene = Scene(chain=chain, q=(0.3, -0.4), u=(0.1, 0.2), duration=0.5, effects=(Gravity(9.81),))
    return Film((Run("it", simulate(scene)),), bodies=urdf_bodies(file, chain)), read


def drawn(film, frame):
    """All corners of a URDF's bodies in a frame, in meshcat's frame, body by body."""
    found = commands([*film.setup, *film.frame(frame).commands])
    bodies = []
    for path, kind, _ in found:
        if kind == "set_object" and "/body" in path:
            geometry = found[path, kind, ""]["object"]["geometries"][0]["data"]["attributes"]
            points = geometry["position"]["array"].reshape(-1, 3)
            pose = matrix(found, path)
            link = path.rsplit("/", 1)[0]
            if link.endswith(("link1", "link2")):
                pose = matrix(found, link) @ pose
            bodies.append(points @ pose[:3, :3].T + pose[:3, 3])
    return bodies


def by_pinocchio(file, read, q):
    """The same corners by Pinocchio: geometry in the world, turned into meshcat's frame."""
    model = pin.buildModelFromUrdf(str(file))
    shapes = pin.buildGeomFromUrdf(
        model, str(file), pin.GeometryType.VISUAL, package_dirs=[str(file.parent)]
    )
    # Continuous joints are pairs of cosine and sine.
    theta = read.joints.joint_angles(q)
    pose = np.array([f(angle) for angle in theta for f in (math.cos, math.sin)])
    data, placed = model.createData(), shapes.createData()
    pin.forwardKinematics(model, data, pose)
    pin.updateGeometryPlacements(model, data, shapes, placed)
    x, y, z = (np.array(axis) for axis in read.axes)
    bodies = []
    for shape, place in zip(shapes.geometryObjects, placed.oMg, strict=True):
        bodies.append((shape, place, lambda p: np.array([x, z, -y]) @ (p - np.array(read.origin))))
    return bodies


@pytest.mark.parametrize("frame", [0, 7, 15])
def test_bodies_are_where_pinocchio_has_them(robot, frame):
    film, read = film_with(robot)
    q, _ = film.runs[0].trajectory.at([film.times[frame]])
    bodies = drawn(film, frame)
    expected = by_pinocchio(robot, read, (float(q[0, 0]), float(q[1, 0])))
    assert len(bodies) == len(expected) == 4
    for shape, place, turned in expected:
        if shape.meshPath.endswith(".stl"):
            corners = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.3, 0], [0, 0, 0.4]]) * shape.meshScale
        else:
            # The middle of a box, a cylinder or a sphere.
            corners = np.zeros((1, 3))
        wanted = np.array([turned(place.act(corner)) for corner in corners])
        near = [
            np.abs(body.mean(axis=0) - wanted[0]).max() < 1e-5
            if len(wanted) == 1
            else all(np.abs(body - point).max(axis=1).min() < 1e-6 for point in wanted)
            for body in bodies
        ]
        assert sum(near) == 1


def test_colours_are_the_file_s(robot):
    film, _ = film_with(robot)
    found = commands(film.setup)
    colours = {
        c["object"]["materials"][0]["color"]
        for (path, kind, _), c in found.items()
        if "/body" in path and kind == "set_object"
    }
    assert 0xFF0000 in colours


def test_the_shipped_urdf_is_drawn_along_its_bars():
    film, _ = film_with(data_path("twolink.urdf"))
    for body in drawn(film, 5):
        assert np.abs(body[:, 1]).max() < 0.021


def test_packages_around_the_file_are_searched(tmp_path):
    package = tmp_path / "my_robot"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    tetrahedron(package / "meshes" / "part.stl")
    file = package / "urdf" / "robot.urdf"
    for name in ("package://my_robot/meshes/part.stl", "../meshes/part.stl"):
        file.write_text(ROBOT.format(mesh=name))
        assert len(drawn(film_with(file)[0], 0)) == 4


def test_a_missing_mesh_is_rejected(robot):
    (robot.parent / "meshes" / "part.stl").unlink()
    with pytest.raises(
        UrdfError, match=r"mesh must be an existing file; got package://meshes/part\.stl"
    ):
        film_with(robot)


@pytest.mark.parametrize(
    "name",
    ["/dev/zero", "file:///dev/zero", "http://localhost/part.stl", "package://", "fifo.stl", "."],
)
def test_a_mesh_that_is_no_regular_file_is_not_opened(name, robot):
    """A device would be read without an end, a pipe waited for, and an address fetched."""
    os.mkfifo(robot.parent / "fifo.stl")
    robot.write_text(ROBOT.format(mesh=name))
    with pytest.raises(UrdfError, match="mesh must be an existing file; got"):
        film_with(robot)


def test_an_empty_mesh_is_rejected(robot):
    (robot.parent / "meshes" / "part.stl").write_bytes(b"no mesh")
    with pytest.raises(UrdfError, match="link 'upper' has an empty or unreadable mesh"):
        film_with(robot)


def test_another_chain_s_urdf_is_refused(robot):
    with pytest.raises(
        PictureError, match="must be a URDF of the simulated chain, with links of 1 and 1"
    ):
        urdf_bodies(robot, Chain.uniform_bars(), own=False)
    urdf_bodies(data_path("twolink.urdf"), Chain.uniform_bars(), own=False)
