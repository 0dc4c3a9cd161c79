"""The evaluation suite: chains of different proportions, by parameters and as a plain URDF."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from twolink.chain import Chain
from twolink.conformance.spatial import Arithmetic, SpatialModel
from twolink.conformance.suites.building import states_of, vectors_of
from twolink.conformance.urdf_model import model_of_parameters
from twolink.conformance.vectors import Frame, Group, Level
from twolink.coordinates import JointConvention
from twolink.engines.messages import Effect, Parameters, Understood
from twolink.urdf import JointProperties, write_planar_urdf

_FLAGS = {
    "mass_matrix": ("UpperTriangle", "RelativeVsAbsolute"),
    "gravity_terms": ("GravitySign",),
}


@dataclass(frozen=True)
class _Chain:
    """A chain of the suite; `in_urdf` states that a URDF can describe it."""

    name: str
    comment: str
    parameters: dict[str, Any]
    flags: tuple[str, ...] = ()
    level: Level = "average"
    needs: tuple[Effect, ...] = ()
    turns: float = 1.0
    in_urdf: bool = True


def _parameters(**changes: Any) -> dict[str, Any]:
    """Return parameters of two bars of 1 kg and 1 m, with changes."""
    return {
        "mass": (1.0, 1.0),
        "length": (1.0, 1.0),
        "centre": ((0.5, 0.0), (0.5, 0.0)),
        "inertia": (1 / 12, 1 / 12),
        "gravity": 9.81,
    } | changes


_GENERAL = _parameters(
    mass=(1.3, 0.7),
    length=(0.9, 0.6),
    centre=((0.4, 0.15), (0.35, -0.1)),
    inertia=(0.11, 0.05),
)

_CHAINS = (
    _Chain("bars", "two uniform bars", _parameters(), level="lower"),
    _Chain("general", "no symmetry, mass centres off the lines", _GENERAL),
    _Chain(
        "point-masses",
        "point masses at the ends of massless rods",
        _parameters(centre=((1.0, 0.0), (1.0, 0.0)), inertia=(0.0, 0.0)),
        flags=("PointMass",),
        in_urdf=False,
    ),
    _Chain(
        "heavy-second",
        "the second link a thousand times as heavy",
        _GENERAL | {"mass": (0.7, 700.0), "inertia": (0.05, 50.0)},
        flags=("MassRatio",),
        level="higher",
    ),
    _Chain(
        "light-second",
        "the second link a thousandth of the mass and a hundredth of the length",
        _GENERAL
        | {
            "mass": (1.3, 1.3e-3),
            "length": (0.9, 9e-3),
            "centre": ((0.4, 0.15), (4e-3, 1e-3)),
            "inertia": (0.11, 1.1e-8),
        },
        flags=("MassRatio",),
        level="higher",
    ),
    _Chain(
        "no-gravity", "without gravity", _GENERAL | {"gravity": 0.0}, ("NoGravity",), in_urdf=False
    ),
    _Chain(
        "upward-gravity",
        "gravity points upwards",
        _GENERAL | {"gravity": -3.7},
        ("GravitySign",),
        in_urdf=False,
    ),
    _Chain(
        "many-turns",
        "angles of a thousand turns",
        _GENERAL,
        flags=("BigAngle",),
        level="higher",
        turns=1000.0,
    ),
    _Chain(
        "damped",
        "joints with viscous damping",
        _GENERAL | {"damping": (0.3, 0.1)},
        flags=("DampingDropped",),
    ),
    _Chain(
        "rubbing",
        "joints with dry friction",
        _GENERAL | {"friction": (0.2, 0.05)},
        flags=("FrictionDropped",),
    ),
    _Chain(
        "armature",
        "joints with the reflected inertia of rotors",
        _GENERAL | {"armature": (0.02, 0.01)},
        flags=("ArmatureIgnored",),
        needs=("armature",),
        in_urdf=False,
    ),
)


_FRAME = Frame(origin=(0.0, 0.0, 0.0), x=(1.0, 0.0, 0.0), y=(0.0, 0.0, -1.0))


def evaluation_suite() -> tuple[Group, ...]:
    """Return a group for each chain."""
    return tuple(_group(each) for each in _CHAINS)


def _group(each: _Chain) -> Group:
    parameters = each.parameters
    chain = Chain(**{name: parameters[name] for name in ("mass", "length", "centre", "inertia")})

    def model(arithmetic: Arithmetic) -> SpatialModel:
        return model_of_parameters(parameters, arithmetic)

    identity = f"evaluation/{each.name}"
    return Group(
        id=identity,
        comment=each.comment,
        flags=each.flags,
        level=each.level,
        urdf=_urdf(chain, parameters) if each.in_urdf else None,
        gravity=(0.0, 0.0, -parameters["gravity"]) if each.in_urdf else None,
        frame=_FRAME if each.in_urdf else None,
        parameters=Parameters(**parameters),
        understood=_understood(parameters),
        tests=vectors_of(
            identity,
            model,
            chain,
            JointConvention(),
            parameters["gravity"],
            states_of(chain, identity, turns=each.turns),
            flags=_FLAGS,
            level=each.level,
            needs=each.needs,
        ),
    )


def _urdf(chain: Chain, parameters: dict[str, Any]) -> str:
    pairs = zip(
        parameters.get("damping", (0.0, 0.0)), parameters.get("friction", (0.0, 0.0)), strict=True
    )
    first, second = (JointProperties(damping, friction) for damping, friction in pairs)
    text = write_planar_urdf(chain.links, joints=(first, second))
    # The joints of all models have the same names.
    return text.replace('"joint1"', '"shoulder"').replace('"joint2"', '"elbow"')


def _understood(parameters: dict[str, Any]) -> Understood:
    first, second = parameters["centre"]
    return Understood(
        mass=parameters["mass"],
        reach=(math.hypot(*first), math.hypot(*second)),
        inertia=parameters["inertia"],
        damping=parameters.get("damping", (0.0, 0.0)),
        friction=parameters.get("friction", (0.0, 0.0)),
        armature=parameters.get("armature", (0.0, 0.0)),
    )
