"""The motion suite: smooth motions with references of 60 digits, from models/references."""

from __future__ import annotations

import json
from decimal import Decimal
from typing import Any

from twolink.conformance.vectors import DIGITS, Group, Motion
from twolink.data import data_path
from twolink.effects import Gravity, JointDamping
from twolink.engines.messages import Effect, Parameters
from twolink.hardcases import exact
from twolink.scene import Scene
from twolink.scene.names import scene_file

# Scene, what it is about, and the last time (s), before motions become sensitive.
_SCENES = (
    ("general", "two bars under gravity, from a general state", 2.0),
    ("chrono_double_pendulum", "links of large inertia, from the horizontal", 1.0),
    ("modelica_double_pendulum", "two boxes with a damped shoulder", 2.0),
)


def motion_suite() -> tuple[Group, ...]:
    """Return a group for each scene."""
    return tuple(_group(*each) for each in _SCENES)


def _group(name: str, comment: str, last: float) -> Group:
    scene = Scene.load(scene_file(name))
    (gravity,) = (effect for effect in scene.effects if isinstance(effect, Gravity))
    dampers = [effect for effect in scene.effects if isinstance(effect, JointDamping)]
    needs: tuple[Effect, ...] = ("joint_damping",) if dampers else ()
    chain = scene.chain
    parameters = Parameters(
        mass=chain.mass,
        length=chain.length,
        centre=chain.centre,
        inertia=chain.inertia,
        gravity=gravity.g,
        damping=dampers[0].coefficient if dampers else (0.0, 0.0),
    )
    identity = f"motion/{name.replace('_', '-')}"
    document = json.loads((data_path("references") / f"{name}.json").read_text(encoding="utf-8"))
    states = [state for state in document["states"] if float(state["t"]) <= last]
    return Group(
        id=identity,
        comment=comment,
        flags=("DampingDropped",) if dampers else (),
        parameters=parameters,
        motions=(
            Motion(
                id=f"{identity}/motion",
                needs=needs,
                angles=_joint(scene.q),
                speeds=_joint(scene.u),
                times=(0.0, *(float(state["t"]) for state in states)),
                values=[_words(state) for state in states],
            ),
        ),
    )


def _joint(absolute: Any) -> tuple[float, float]:
    """Return joint angles or speeds of absolute ones."""
    first, second = absolute
    return float(first), float(second - first)


def _words(state: Any) -> list[str]:
    """Return θ1, θ2 and their speeds as strings of 30 digits."""
    with exact.digits():
        q1, q2, u1, u2 = (Decimal(state[key]) for key in ("q1", "q2", "u1", "u2"))
        return [f"{value:.{DIGITS - 1}e}" for value in (q1, q2 - q1, u1, u2 - u1)]
