"""URDF texts of arms whose planar parameters are known before a reader sees them.

A file is built from the plane outward: parameters of both links, the plane's axes in the world,
signs and offsets of the joint angles, and any orientation of the link frames. No code of the
library takes part.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Bar:
    """A link in its plane: mass (kg), length (m), centre (m), inertia about the centre (kg m²)."""

    mass: float = 1.0
    length: float = 1.0
    centre: tuple[float, float] = (0.5, 0.0)
    inertia: float = 1 / 12


def rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Return the rotation by roll, pitch and yaw about the fixed axes x, y, z in turn."""
    (a, b, c), (s, t, u) = np.cos((roll, pitch, yaw)), np.sin((roll, pitch, yaw))
    x = np.array([[1, 0, 0], [0, a, -s], [0, s, a]])
    y = np.array([[b, 0, t], [0, 1, 0], [-t, 0, b]])
    z = np.array([[c, -u, 0], [u, c, 0], [0, 0, 1]])
    return np.asarray(z @ y @ x)


def angles(rotation: Array) -> tuple[float, float, float]:
    """Return roll, pitch and yaw of a rotation."""
    pitch = -np.arcsin(np.clip(rotation[2, 0], -1, 1))
    roll = np.arctan2(rotation[2, 1], rotation[2, 2])
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    return float(roll) + 0.0, float(pitch) + 0.0, float(yaw) + 0.0


VERTICAL = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
HORIZONTAL = np.eye(3)


@dataclass(frozen=True)
class Arm:
    """An arm: its links, its plane (rows x, y, z in the world), and how its file is drawn.

    `frames` are the orientations of the link frames in the world at joint angles zero, `aside` how
    far the elbow lies along the axis (m), `turned` the orientation of the inertial frames in the
    link frames. `inside` is more text inside of a joint or link, by its name.
    """

    bars: tuple[Bar, Bar] = (Bar(), Bar())
    plane: Array = field(default_factory=lambda: VERTICAL)
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sign: tuple[int, int] = (1, 1)
    offset: tuple[float, float] = (0.0, 0.0)
    frames: tuple[Array, Array] = field(default_factory=lambda: (np.eye(3), np.eye(3)))
    aside: float = 0.0
    turned: Array = field(default_factory=lambda: np.eye(3))
    axis_length: float = 1.0
    kinds: tuple[str, str] = ("continuous", "continuous")
    inside: dict[str, str] = field(default_factory=dict)
    slender: bool = False

    def parts(self) -> dict[str, str]:
        """Return the elements of the file by name, in an order that readers expect."""
        elbow = self._place(0, self.bars[0].length, 0.0) + self.aside * self.plane[2]
        end = self._place(1, self.bars[1].length, 0.0)
        first, second = self.frames
        return {
            "base": f'<link name="base">{self.inside.get("base", "")}</link>',
            "upper": self._link("upper", 0),
            "lower": self._link("lower", 1),
            "D": f'<link name="D">{self.inside.get("D", "")}</link>',
            "shoulder": self._joint(
                "shoulder", 0, ("base", "upper"), np.array(self.origin), np.eye(3), first
            ),
            "elbow": self._joint("elbow", 1, ("upper", "lower"), first.T @ elbow, first, second),
            "end": joint("end", "fixed", ("lower", "D"), second.T @ end),
        }

    def _place(self, link: int, along: float, across: float) -> Array:
        """Return a point of a link, from its joint, in the world's axes."""
        q = sum(self.offset[: link + 1])
        c, s = np.cos(q), np.sin(q)
        x, y = along * c - across * s, along * s + across * c
        return np.asarray(x * self.plane[0] + y * self.plane[1])

    def _joint(
        self, name: str, link: int, ends: tuple[str, str], place: Array, outer: Array, inner: Array
    ) -> str:
        axis = self.axis_length * self.sign[link] * (inner.T @ self.plane[2])
        more = f'<axis xyz="{words(axis)}"/>{self.inside.get(name, "")}'
        if self.kinds[link] == "revolute" and "<limit" not in more:
            more += '<limit lower="-3" upper="3" effort="10" velocity="10"/>'
        return joint(name, self.kinds[link], ends, place, outer.T @ inner, more)

    def _link(self, name: str, link: int) -> str:
        bar = self.bars[link]
        frame = self.frames[link]
        centre = frame.T @ self._place(link, *bar.centre)
        q = sum(self.offset[: link + 1])
        along = np.cos(q) * self.plane[0] + np.sin(q) * self.plane[1]
        axes = np.array([along, np.cross(self.plane[2], along), self.plane[2]])
        share = (0.0, 1.0) if self.slender else (0.3, 0.8)
        moments = np.diag([*(part * bar.inertia for part in share), bar.inertia])
        # From the plane's axes to the world's, to the link's, to the inertial frame's.
        into = self.turned.T @ frame.T @ axes.T
        tensor = into @ moments @ into.T
        return (
            f'<link name="{name}">'
            + inertial(bar.mass, centre, self.turned, tensor)
            + f"{self.inside.get(name, '')}</link>"
        )

    def expected(self, gravity: float = 9.81, **changes: Any) -> dict[str, Any]:
        """Return the parameters, as the index has them."""
        return {
            "links": [
                {
                    "mass": bar.mass,
                    "length": bar.length,
                    "centre": list(bar.centre),
                    "inertia": bar.inertia,
                }
                for bar in self.bars
            ],
            "sign": list(self.sign),
            "offset": list(self.offset),
            "origin": list(self.origin),
            "plane": self.plane.tolist(),
            "gravity": gravity,
            "damping": [0.0, 0.0],
            "friction": [0.0, 0.0],
            "limits": [[-3.0, 3.0] if kind == "revolute" else None for kind in self.kinds],
        } | changes


def words(numbers: Any) -> str:
    """Return numbers as a URDF has them, the shortest text that reads back to the same bits."""
    return " ".join(f"{float(number) + 0.0!r}".removesuffix(".0") for number in numbers)


def origin(place: Any, rotation: Array | None = None) -> str:
    turned = "" if rotation is None else f' rpy="{words(angles(rotation))}"'
    return f'<origin xyz="{words(place)}"{turned}/>'


def inertial(mass: float, place: Any, rotation: Array | None, tensor: Array) -> str:
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = zip(names, tensor[np.triu_indices(3)], strict=True)
    inertia = " ".join(f'{name}="{words([value])}"' for name, value in entries)
    return (
        f'<inertial>{origin(place, rotation)}<mass value="{words([mass])}"/>'
        f"<inertia {inertia}/></inertial>"
    )


def ball(mass: float, place: Any, moment: float) -> str:
    """Return an isotropic inertial."""
    return inertial(mass, place, None, moment * np.eye(3))


def joint(
    name: str,
    kind: str,
    ends: tuple[str, str],
    place: Any,
    rotation: Array | None = None,
    more: str = "",
) -> str:
    between = f'<parent link="{ends[0]}"/><child link="{ends[1]}"/>'
    placed = origin(place, rotation)
    return f'<joint name="{name}" type="{kind}">{between}{placed}{more}</joint>'


def robot(*parts: str, head: str = "", attributes: str = "") -> str:
    """Return the text of a file, an element a line."""
    lines = "\n".join(f"  {part}" for part in parts if part)
    return f'{head}<robot name="arm"{attributes}>\n{lines}\n</robot>\n'
