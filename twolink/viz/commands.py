"""The commands of meshcat's viewer, encoded as MessagePack.

The motion is in meshcat's x-z plane: the chain's (x, y), y downward, is at (x, 0, −y), so that
gravity points down on the screen and the chain's z into it. All flat shapes are in this plane, and
`order` determines which covers which. Commands are deterministic: equal pictures have equal bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import umsgpack

from twolink.viz.shapes import Array, Place, Shape

# meshcat's codes of MessagePack for typed arrays.
_UINT32, _FLOAT32 = 0x16, 0x17
_BOTH_SIDES = 2

ROOT = "/twolink"
CAMERA = "/Cameras/default/rotated"


def flat_mesh(
    path: str,
    shape: Shape,
    colour: str,
    *,
    order: int,
    opacity: float = 1.0,
    opacities: Array | None = None,
) -> bytes:
    """Return the command that adds a flat shape at a path, in one unlit colour "#rrggbb".

    `opacities`, of shape (n,), belong to the corners.
    """
    attributes = {"position": _numbers(_in_space(shape.corners), 3)}
    if opacities is not None:
        # The viewer multiplies vertex colours and the material's colour.
        white = np.ones((len(opacities), 3))
        attributes["color"] = _numbers(np.column_stack([white, opacities]), 4)
    material = {
        "type": "MeshBasicMaterial",
        "color": int(colour[1:], 16),
        "vertexColors": 0 if opacities is None else 2,
        "side": _BOTH_SIDES,
        # Flat shapes are "transparent", so that they are drawn by `order` instead of depth.
        "transparent": True,
        "opacity": float(opacity),
        "depthTest": False,
        "depthWrite": False,
    }
    faces = {"itemSize": 3, "type": "Uint32Array", "array": _packed(shape.faces, _UINT32)}
    geometry = {
        "type": "BufferGeometry",
        "data": {"attributes": attributes, "index": {**faces, "normalized": False}},
    }
    return _set_object(path, "Mesh", geometry, material, order)


def line_segments(path: str, ends: Array, colour: str, *, order: int) -> bytes:
    """Return the command for straight lines, one pixel wide, between pairs of points (2 n, 2).

    They are behind everything else, including solid bodies.
    """
    geometry = {
        "type": "BufferGeometry",
        "data": {"attributes": {"position": _numbers(_in_space(ends), 3)}},
    }
    material = {
        "type": "LineBasicMaterial",
        "color": int(colour[1:], 16),
        # Opaque objects are drawn first, by order and then by depth.
        "transparent": False,
        "depthTest": False,
        "depthWrite": False,
    }
    return _set_object(path, "LineSegments", geometry, material, order)


def solid_mesh(path: str, corners: Array, faces: Any, rgba: Sequence[float]) -> bytes:
    """Return the command for a lit body in space: corners (n, 3) in meshcat's frame, m."""
    indices = {"itemSize": 3, "type": "Uint32Array", "array": _packed(faces, _UINT32)}
    geometry = {
        "type": "BufferGeometry",
        "data": {
            "attributes": {"position": _numbers(corners, 3)},
            "index": {**indices, "normalized": False},
        },
    }
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in rgba[:3])
    material = {
        "type": "MeshLambertMaterial",
        "color": red << 16 | green << 8 | blue,
        "side": _BOTH_SIDES,
        "transparent": rgba[3] < 1,
        "opacity": float(rgba[3]),
    }
    return _set_object(path, "Mesh", geometry, material, 0)


def transform(path: str, matrix: Array) -> bytes:
    """Return the command that sets the 4 × 4 transform of a path."""
    columns = np.asarray(matrix, dtype=float).T.ravel().tolist()
    return _pack({"type": "set_transform", "path": path, "matrix": columns})


def in_the_plane(origin: Place, angle: float) -> Array:
    """Return the 4 × 4 matrix of a frame at (x, y) (m), rotated by an angle (rad) from x to y."""
    c, s = math.cos(angle), math.sin(angle)
    x, y = float(origin[0]), float(origin[1])
    return np.array([[c, 0, s, x], [0, 1, 0, 0], [-s, 0, c, -y], [0, 0, 0, 1]], dtype=float)


def visible(path: str, shown: bool) -> bytes:
    """Return the command that shows or hides a path."""
    return set_property(path, "visible", shown)


def set_property(path: str, name: str, value: Any) -> bytes:
    """Return the command that sets a property of the object at a path."""
    return _pack({"type": "set_property", "path": path, "property": name, "value": value})


def background(colour: str) -> list[bytes]:
    """Return the commands for a background of one colour."""
    parts = background_parts(colour)
    return [set_property("/Background", name, parts) for name in ("top_color", "bottom_color")]


def background_parts(colour: str) -> list[float]:
    """Return red, green and blue (0 to 1) of a background for the viewer."""
    # The viewer truncates to bytes; adding a quarter makes the result exact.
    return [(int(colour[k : k + 2], 16) + 0.25) / 255 for k in (1, 3, 5)]


def frontal_camera(distance: float) -> list[bytes]:
    """Return the commands for an orthographic camera that looks along the chain's z (m).

    Its field of view depends on the size of the window and is set by the player, with the rule of
    `twolink.viz.framing.Framing`.
    """
    camera = {
        "uuid": CAMERA,
        "type": "OrthographicCamera",
        "left": -1.0,
        "right": 1.0,
        "top": 1.0,
        "bottom": -1.0,
        "near": 0.01 * distance,
        "far": 2.0 * distance,
        "zoom": 1.0,
    }
    place = set_property(f"{CAMERA}/<object>", "position", [0.0, 0.0, float(distance)])
    return [_pack({"type": "set_object", "path": CAMERA, "object": {"object": camera}}), place]


def decoded(command: bytes) -> dict[str, Any]:
    """Return a command as a dictionary, with arrays of numbers as NumPy's."""
    kinds = {_UINT32: np.uint32, _FLOAT32: np.float32}
    found: dict[str, Any] = umsgpack.unpackb(
        command,
        ext_handlers={
            code: lambda ext, kind=kind: np.frombuffer(ext.data, dtype=kind)
            for code, kind in kinds.items()
        },
    )
    return found


def _set_object(path: str, kind: str, geometry: Any, material: Any, order: int) -> bytes:
    """Return the command that adds an object at a path; its parts are named after the path."""
    names = {part: f"{path}#{part}" for part in ("object", "geometry", "material")}
    lowered = {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [{"uuid": names["geometry"], **geometry}],
        "materials": [{"uuid": names["material"], **material}],
        "object": {
            "uuid": names["object"],
            "type": kind,
            "geometry": names["geometry"],
            "material": names["material"],
            "renderOrder": order,
            # A flat shape may leave its initial bounds.
            "frustumCulled": False,
        },
    }
    return _pack({"type": "set_object", "path": path, "object": lowered})


def _in_space(corners: Array) -> Array:
    """Return points (x, y) of the chain's plane in meshcat's frame, shape (n, 3)."""
    return np.column_stack([corners[:, 0], np.zeros(len(corners)), -corners[:, 1]])


def _numbers(array: Array, size: int) -> dict[str, Any]:
    return {
        "itemSize": size,
        "type": "Float32Array",
        "array": _packed(np.asarray(array, dtype=np.float32), _FLOAT32),
        "normalized": False,
    }


def _packed(array: Any, code: int) -> Any:
    kind = np.uint32 if code == _UINT32 else np.float32
    return umsgpack.Ext(code, np.ascontiguousarray(array, dtype=kind).tobytes())


def _pack(command: dict[str, Any]) -> bytes:
    packed: bytes = umsgpack.packb(command)
    return packed
