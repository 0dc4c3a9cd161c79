"""The spatial model of a URDF text or of planar parameters, with numbers of any type.

The reader is independent of `twolink.urdf`: it accepts the valid files of the import suite and
checks nothing. Numbers are the float64 numbers that the text parses to, kept exactly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

from twolink.conformance.spatial import HOME, Arithmetic, Body, Joint, SpatialModel
from twolink.urdf.spatial import Matrix3, Pose, Vector3, scale


def model_of_parameters(parameters: Mapping[str, Any], arithmetic: Arithmetic) -> SpatialModel:
    """Return the model of planar parameters: x to the right, y down, the joints along z."""
    number = arithmetic.number
    vertical = (number(0.0), number(0.0), number(1.0))
    bodies = []
    for link in (0, 1):
        a, b = parameters["centre"][link]
        inertia = number(parameters["inertia"][link])
        nothing = (number(0.0),) * 3
        bodies.append(
            Body(
                link + 1,
                number(parameters["mass"][link]),
                Pose((number(a), number(b), number(0.0)), HOME.rotation),
                (nothing, nothing, (number(0.0), number(0.0), inertia)),
                path=math.hypot(a, b),
            )
        )
    first, second = parameters["length"]
    elbow = Pose((number(first), number(0.0), number(0.0)), HOME.rotation)
    return SpatialModel(
        joints=(Joint(HOME, vertical), Joint(elbow, vertical, first)),
        bodies=tuple(bodies),
        tip=(number(second), number(0.0), number(0.0)),
        gravity=(number(0.0), number(parameters["gravity"]), number(0.0)),
        plane=HOME.rotation[:2],
        origin=HOME.position,
        damping=_numbers(parameters.get("damping", (0.0, 0.0)), arithmetic),
        friction=_numbers(parameters.get("friction", (0.0, 0.0)), arithmetic),
        armature=_numbers(parameters.get("armature", (0.0, 0.0)), arithmetic),
        tip_path=second,
    )


def model_of_urdf(
    text: str, arithmetic: Arithmetic, *, plane: Any, origin: Any, gravity: Any
) -> SpatialModel:
    """Return the model of a URDF text with two moving joints and an end link named D.

    `plane` has the rows x and y (and z) of the chain's frame, `origin` is A (m) and `gravity` the
    vector of gravity (m/s²), all in the frame of the root link.
    """
    return _Reader(text, arithmetic).model(plane, origin, gravity)


class _Reader:
    """The links and joints of a URDF text."""

    def __init__(self, text: str, arithmetic: Arithmetic) -> None:
        self._arithmetic = arithmetic
        robot = ElementTree.fromstring(text)
        for element in robot.iter():
            element.tag = element.tag.rpartition("}")[2]
        self._links = {link.attrib["name"]: link for link in robot.findall("link")}
        self._joints: dict[str, list[ElementTree.Element]] = {name: [] for name in self._links}
        children = set()
        for joint in robot.findall("joint"):
            self._joints[_named(joint, "parent")].append(joint)
            children.add(_named(joint, "child"))
        (self._root,) = set(self._links) - children

    def model(self, plane: Any, origin: Any, gravity: Any) -> SpatialModel:
        """Walk from the root to all leaves."""
        joints: list[tuple[Joint, ElementTree.Element]] = []
        bodies: list[Body] = []
        tip = (HOME.position, 0.0)
        stack = [(self._root, 0, HOME, 0.0, True)]
        while stack:
            name, link, placement, path, own = stack.pop()
            if name == "D":
                tip = placement.position, path
            if link:
                bodies.append(self._body(name, link, placement, path, own))
            for joint in self._joints[name]:
                there = placement @ self._origin(joint)
                length = path + _length(joint)
                child = _named(joint, "child")
                if joint.attrib["type"] == "fixed":
                    stack.append((child, link, there, length, False))
                else:
                    joints.append((Joint(there, self._axis(joint), length), joint))
                    stack.append((child, link + 1, HOME, 0.0, True))
        (first, of_first), (second, of_second) = joints
        damping, friction = (
            self._dynamics(of_first, of_second, name) for name in ("damping", "friction")
        )
        x, y = (self._vector(row) for row in plane[:2])
        return SpatialModel(
            joints=(first, second),
            bodies=tuple(bodies),
            tip=tip[0],
            gravity=self._vector(gravity),
            plane=(x, y),
            origin=self._vector(origin),
            damping=damping,
            friction=friction,
            tip_path=tip[1],
        )

    def _body(self, name: str, link: int, placement: Pose, path: float, own: bool) -> Body:
        inertial = self._links[name].find("inertial")
        if inertial is None:
            nothing = self._vector((0, 0, 0))
            tensor = (nothing, nothing, nothing)
            return Body(link, nothing[0], HOME, tensor, placement, own, declared=False, path=path)
        moments = _child(inertial, "inertia").attrib
        xx, xy, xz, yy, yz, zz = (
            self._number(moments[key]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        )
        box = self._links[name].find("collision/geometry/box")
        return Body(
            link,
            self._number(_child(inertial, "mass").attrib["value"]),
            self._origin(inertial),
            ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)),
            placement,
            own,
            box=None if box is None else self._vector(box.attrib["size"].split()),
            path=path + _length(inertial),
        )

    def _origin(self, element: ElementTree.Element) -> Pose:
        origin = element.find("origin")
        if origin is None:
            return HOME
        position = self._vector(origin.get("xyz", "0 0 0").split())
        rpy = self._vector(origin.get("rpy", "0 0 0").split())
        return Pose(position, self._rotation(rpy))

    def _rotation(self, rpy: Vector3) -> Matrix3:
        """Return the rotation by roll, pitch and yaw about the fixed axes x, y, z in turn."""
        (cr, sr), (cp, sp), (cy, sy) = (self._arithmetic.cosine_and_sine(x) for x in rpy)
        return (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )

    def _axis(self, joint: ElementTree.Element) -> Vector3:
        axis = joint.find("axis")
        x, y, z = self._vector(("1 0 0" if axis is None else axis.attrib["xyz"]).split())
        return scale(1 / self._arithmetic.sqrt(x * x + y * y + z * z), (x, y, z))

    def _dynamics(
        self, first: ElementTree.Element, second: ElementTree.Element, name: str
    ) -> tuple[Any, Any]:
        found = [joint.find("dynamics") for joint in (first, second)]
        words = ["0" if each is None else each.get(name, "0") for each in found]
        return self._number(words[0]), self._number(words[1])

    def _number(self, word: Any) -> Any:
        return self._arithmetic.number(float(word))

    def _vector(self, words: Any) -> Vector3:
        x, y, z = (self._number(word) for word in words)
        return x, y, z


def _numbers(pair: Any, arithmetic: Arithmetic) -> tuple[Any, Any]:
    return arithmetic.number(pair[0]), arithmetic.number(pair[1])


def _named(joint: ElementTree.Element, end: str) -> str:
    return _child(joint, end).attrib["link"]


def _child(element: ElementTree.Element, name: str) -> ElementTree.Element:
    found = element.find(name)
    assert found is not None, name
    return found


def _length(element: ElementTree.Element) -> float:
    """Return the distance (m) by which an element's origin is moved."""
    origin = element.find("origin")
    return 0.0 if origin is None else math.hypot(*map(float, origin.get("xyz", "0 0 0").split()))
