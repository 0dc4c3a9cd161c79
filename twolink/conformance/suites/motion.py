"""The suites of motions: references of 60 digits, or of 28 with events, from models/.

`twolink reference SCENE --times … --out FILE` writes these files. Motions with events are computed
with 113 bits.
"""

from __future__ import annotations

import json
from decimal import Decimal
from typing import Any

from twolink.conformance.vectors import DIGITS, Group, Level, Motion
from twolink.data import data_path
from twolink.engines.scenes import joint_state, parameters_of
from twolink.hardcases import exact
from twolink.scene import Scene

# File, subject, flags, and the last time (s), before motions become sensitive.
_Row = tuple[str, str, tuple[str, ...], float]

_SMOOTH: tuple[_Row, ...] = (
    ("references/general", "two bars under gravity, from a general state", (), 2.0),
    ("references/chrono_double_pendulum", "links of large inertia, from the horizontal", (), 1.0),
    (
        "references/modelica_double_pendulum",
        "two boxes with a damped shoulder",
        ("DampingDropped",),
        2.0,
    ),
    ("motions/springs", "springs in both joints, beside gravity", ("SpringDropped",), 2.0),
    ("motions/dampers", "damping in both joints, beside gravity", ("DampingDropped",), 2.0),
)
_FRICTION: tuple[_Row, ...] = (
    (
        "motions/stick_slip",
        "dry friction in both joints, with a higher static limit",
        ("StickSlip",),
        1.1,
    ),
    ("motions/slide", "the end slides on a rough floor, turns, and sticks", ("StickSlip",), 2.5),
    ("motions/stops", "an arm bounces between the stops of its joints", ("Restitution",), 1.08),
)
_IMPACTS: tuple[_Row, ...] = (
    ("motions/floor", "the end bounces on a floor without friction", ("Restitution",), 1.0),
    (
        "motions/rough_floor",
        "the end bounces on a rough floor; with friction Stronge's law of restitution is assumed",
        ("Restitution", "ImpactLaw"),
        0.7,
    ),
)


def motion_suite() -> tuple[Group, ...]:
    """Return a group for each smooth scene."""
    return tuple(_group("motion", *row) for row in _SMOOTH)


def friction_suite() -> tuple[Group, ...]:
    """Return a group for each scene with dry friction or stops."""
    return tuple(_group("friction", *row) for row in _FRICTION)


def impact_suite() -> tuple[Group, ...]:
    """Return a group for each scene with impacts on a surface."""
    return tuple(_group("impact", *row) for row in _IMPACTS)


def _group(suite: str, file: str, comment: str, flags: tuple[str, ...], last: float) -> Group:
    document = json.loads(data_path(f"{file}.json").read_text(encoding="utf-8"))
    scene = Scene.parse(document["scene"], source=file)
    parameters, needs = parameters_of(scene)
    identity = f"{suite}/{file.partition('/')[2].replace('_', '-')}"
    states = [state for state in document["states"] if float(state["t"]) <= last]
    # A joint angle is the difference of two rounded numbers.
    digits = min(DIGITS, *(state["digits"] - 1 for state in states))
    angles, speeds = joint_state(scene)
    level: Level = "average" if digits == DIGITS else "higher"
    motion = Motion(
        id=f"{identity}/motion",
        level=level,
        needs=needs,
        angles=angles,
        speeds=speeds,
        times=(0.0, *(float(state["t"]) for state in states)),
        digits=digits,
        values=[_words(state, digits) for state in states],
    )
    return Group(
        id=identity,
        comment=comment,
        flags=flags,
        level=level,
        parameters=parameters,
        motions=(motion,),
    )


def _words(state: Any, digits: int) -> list[str]:
    """Return θ1, θ2 and their speeds as strings, with digits that are right."""
    form = f".{DIGITS - 1}e" if digits == DIGITS else f".{digits}f"
    with exact.digits():
        q1, q2, u1, u2 = (Decimal(state[key]) for key in ("q1", "q2", "u1", "u2"))
        return [format(value, form) for value in (q1, q2 - q1, u1, u2 - u1)]
