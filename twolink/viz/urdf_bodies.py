"""The visual geometry of a URDF, including meshes, attached to the links."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twolink import kinematics
from twolink.chain import Chain
from twolink.errors import PictureError, UrdfError
from twolink.urdf import PlanarUrdf, read_planar_urdf
from twolink.viz.commands import ROOT, in_the_plane, solid_mesh, transform
from twolink.viz.shapes import Array

# Relative difference of lengths below which chains are equal for a picture.
_SAME = 1e-6


def urdf_bodies(file: Path, chain: Chain, *, own: bool = True) -> tuple[bytes, ...]:
    """Return the commands that attach the visual geometry of a URDF to the first run's links.

    `own` states that the chain was read from this file. Raises `UrdfError` for files without a
    planar two-link chain or with unreadable meshes, and `PictureError` for another chain's file.
    """
    read = read_planar_urdf(file)
    lengths = np.array([[link.length for link in read.links], [float(x) for x in chain.length]])
    if not own and np.abs(lengths[0] - lengths[1]).max() > _SAME * lengths[1].max():
        raise PictureError(
            f"{file} must be a URDF of the simulated chain, with links of {lengths[1][0]:g} and "
            f"{lengths[1][1]:g} m; got {lengths[0][0]:g} and {lengths[0][1]:g} m"
        )
    robot = _loaded(file)
    _check_whole(robot, file)
    moved_by = _moved_by(robot, read)
    links = _links_at_zero(read, chain)
    found: list[bytes] = []
    graph = robot.scene.graph
    for number, node in enumerate(sorted(graph.nodes_geometry)):
        pose, name = graph.get(node)
        mesh = robot.scene.geometry[name]
        body = moved_by[graph.transforms.parents[node]]
        path = f"{ROOT}/{'base' if body == 0 else f'run0/link{body}'}/body{number}"
        placed = np.linalg.inv(links[body]) @ _in_meshcat(read) @ pose
        rgba = _colour(mesh)
        found.append(solid_mesh(path, np.asarray(mesh.vertices), np.asarray(mesh.faces), rgba))
        found.append(transform(path, placed))
    return tuple(found)


def _loaded(file: Path) -> Any:
    """Return the robot with its meshes, by yourdfpy. Raises `UrdfError` for a missing mesh."""
    import logging

    import yourdfpy

    # The parameter's name is set by yourdfpy.
    def found(fname: str) -> str:
        path = _resolved(file, fname)
        if not path.is_file():
            raise UrdfError(f"{file}: mesh must be an existing file; got {fname}")
        return str(path)

    # yourdfpy logs the problems that are raised as errors here.
    logger = logging.getLogger("yourdfpy")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        return yourdfpy.URDF.load(
            str(file), filename_handler=found, load_meshes=True, build_scene_graph=True
        )
    except UrdfError:
        raise
    # Mesh readers raise exceptions of many types.
    except Exception as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise UrdfError(
            f"{file}: its geometry cannot be read ({said[:200]}); use meshes that trimesh "
            "reads, such as .stl, .obj and .dae"
        ) from error
    finally:
        logger.setLevel(before)


def _check_whole(robot: Any, file: Path) -> None:
    """Raise `UrdfError` for an empty visual, which yourdfpy ignores."""
    graph = robot.scene.graph
    drawn = [
        graph.transforms.parents[node]
        for node in graph.nodes_geometry
        if len(getattr(robot.scene.geometry[graph.get(node)[1]], "faces", ()))
    ]
    for name, link in robot.link_map.items():
        wanted = sum(visual.geometry is not None for visual in link.visuals)
        if drawn.count(name) < wanted:
            raise UrdfError(
                f"{file}: link '{name}' has an empty or unreadable mesh; use triangles in a "
                "format of trimesh, such as .stl, .obj and .dae"
            )


def _resolved(file: Path, name: str) -> Path:
    """Return the path of a mesh: beside the URDF, or in a package around it."""
    if name.startswith("file://"):
        return Path(name.removeprefix("file://"))
    if not name.startswith("package://"):
        return file.parent / name
    inside = name.removeprefix("package://")
    _, _, within = inside.partition("/")
    folders = [file.resolve().parent, *file.resolve().parents]
    tried = [folder / part for folder in folders for part in (inside, within)]
    return next((path for path in tried if path.is_file()), file.parent / within)


def _moved_by(robot: Any, read: PlanarUrdf) -> dict[str, int]:
    """Return for each link the number of moving joints between it and the root."""
    parents = {joint.child: joint for joint in robot.robot.joints}
    found = {}
    for link in robot.link_map:
        count, here = 0, link
        while here in parents:
            count += parents[here].name in read.joint_names
            here = parents[here].parent
        found[link] = count
    return found


def _links_at_zero(read: PlanarUrdf, chain: Chain) -> list[Array]:
    """Return the poses of base and links in meshcat's frame, at joint angles zero."""
    q1, q2 = (float(q) for q in read.joints.absolute_angles((0.0, 0.0)))
    elbow = kinematics.position(chain, (q1, q2), chain.B)
    return [np.eye(4), in_the_plane((0.0, 0.0), q1), in_the_plane(elbow, q2)]


def _in_meshcat(read: PlanarUrdf) -> Array:
    """Return the pose of the URDF's root in meshcat's frame: A at the origin, gravity along −z."""
    x, y, z = (np.array(axis) for axis in read.axes)
    rotation = np.array([x, z, -y])
    pose = np.eye(4)
    pose[:3, :3] = rotation
    pose[:3, 3] = -rotation @ np.array(read.origin)
    return pose


def _colour(mesh: Any) -> tuple[float, float, float, float]:
    """Return the main colour of a mesh, each part from 0 to 1."""
    material = getattr(mesh.visual, "material", mesh.visual)
    rgba: Any = getattr(material, "main_color", (160, 160, 160, 255))
    red, green, blue, alpha = (float(part) / 255 for part in rgba)
    return red, green, blue, alpha
