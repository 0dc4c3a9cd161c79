"""The import suite: the files of models/import, with certified values of the exact texts."""

from __future__ import annotations

import json
import math
from typing import Any

from twolink.chain import Chain
from twolink.conformance.spatial import Arithmetic, SpatialModel
from twolink.conformance.suites.building import states_of, vectors_of
from twolink.conformance.urdf_model import model_of_urdf
from twolink.conformance.vectors import Expect, Frame, Group, Level
from twolink.coordinates import JointConvention
from twolink.data import data_path
from twolink.engines.messages import Understood

_GRAVITY = (0.0, 0.0, -9.81)

# Files that are no planar two-link chain but sound otherwise, or on which readers of URDF differ.
_EITHER = frozenset(
    {
        "three-joints",
        "one-joint",
        "no-joint",
        "branches",
        "prismatic",
        "floating",
        "planar-joint",
        "mimic",
        "crossed-axes",
        "skewed-axes",
        "coincident-axes",
        "massless-first-link",
        "massless-second-link",
        "no-inertia",
        "quaternion",
        "missing-effort",
        "missing-velocity",
        "missing-product",
        "revolute-without-limit",
        "nameless-robot",
        "xacro-macro",
        "xacro-namespace",
        "sdf",
        "mjcf",
        "doctype",
    }
)

# The text of a message has no encoding, so files about encodings are left out.
_ABOUT_ENCODING = frozenset({"byte-order-mark", "latin-1", "utf-16", "undeclared-encoding"})

_LOWER = frozenset({"plain", "revolute", "general"})


def import_suite() -> tuple[Group, ...]:
    """Return a group for each file that is about its content."""
    folder = data_path("import")
    index = json.loads((folder / "index.json").read_text(encoding="utf-8"))
    groups = []
    for entry in index["tests"]:
        name = entry["id"].removeprefix("import/")
        if name in _ABOUT_ENCODING:
            continue
        text = (folder / entry["file"]).read_text(encoding="utf-8")
        if entry["expect"] == "value":
            groups.append(_valid(name, entry, text))
        else:
            groups.append(_invalid(name, entry, text))
    return tuple(groups)


def _invalid(name: str, entry: Any, text: str) -> Group:
    expect: Expect = "either" if name in _EITHER else "refuse"
    return Group(
        id=entry["id"],
        comment=entry["comment"],
        flags=tuple(entry["flags"]),
        expect=expect,
        reason=tuple(entry["reason"]),
        urdf=text,
        gravity=_GRAVITY,
    )


def _valid(name: str, entry: Any, text: str) -> Group:
    expected = entry["parameters"]
    chain = _chain(expected)
    plane, origin = expected["plane"], expected["origin"]

    def model(arithmetic: Arithmetic) -> SpatialModel:
        return model_of_urdf(text, arithmetic, plane=plane, origin=origin, gravity=_GRAVITY)

    convention = JointConvention(tuple(expected["sign"]), tuple(expected["offset"]))
    level: Level = "lower" if name in _LOWER else "average"
    return Group(
        id=entry["id"],
        comment=entry["comment"],
        flags=tuple(entry["flags"]),
        level=level,
        urdf=text,
        gravity=_GRAVITY,
        frame=Frame(origin=tuple(origin), x=tuple(plane[0]), y=tuple(plane[1])),
        understood=_understood(expected),
        tests=vectors_of(
            entry["id"],
            model,
            chain,
            convention,
            9.81,
            states_of(chain, entry["id"]),
            level=level,
        ),
    )


def _chain(expected: Any) -> Chain:
    first, second = expected["links"]
    return Chain(
        mass=(first["mass"], second["mass"]),
        length=(first["length"], second["length"]),
        centre=(tuple(first["centre"]), tuple(second["centre"])),
        inertia=(first["inertia"], second["inertia"]),
    )


def _understood(expected: Any) -> Understood:
    first, second = expected["links"]
    lower, upper = expected["limits"]
    return Understood(
        mass=(first["mass"], second["mass"]),
        reach=(math.hypot(*first["centre"]), math.hypot(*second["centre"])),
        inertia=(first["inertia"], second["inertia"]),
        damping=tuple(expected["damping"]),
        friction=tuple(expected["friction"]),
        armature=(0.0, 0.0),
        limits=(lower and tuple(lower), upper and tuple(upper)),
    )
