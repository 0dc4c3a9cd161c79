"""Names of the numbers of a scene that sweeps vary, and by which motions are differentiated."""

from __future__ import annotations

JOINT = "."
"""The sign between the keys that lead to a number in a scene file."""

SYMBOLS = {
    "q1": "start.q.0",
    "q2": "start.q.1",
    "u1": "start.u.0",
    "u2": "start.u.1",
    "m1": "chain.mass.0",
    "m2": "chain.mass.1",
    "L1": "chain.length.0",
    "L2": "chain.length.1",
    "g": "effects.gravity.g",
}
"""The symbols of the derivation that stand for the keys of a number."""


_UNITS = {
    ("start", "q"): "rad",
    ("start", "u"): "rad s-1",
    ("chain", "mass"): "kg",
    ("chain", "length"): "m",
    ("chain", "centre"): "m",
    ("chain", "inertia"): "kg m2",
    ("chain", "joint_offset"): "rad",
    ("effects", "gravity", "g"): "m s-2",
}


def unit_of(parameter: str) -> str:
    """Return the unit of a parameter of the start, the chain or gravity, "" for all others.

    Units are written as in the CF conventions, such as rad s-1.
    """
    keys = keys_of(parameter)
    return next((unit for first, unit in _UNITS.items() if keys[: len(first)] == first), "")


def keys_of(parameter: str) -> tuple[str, ...]:
    """Return the keys that lead to a parameter in a scene file: (start, q, 0) for start.q.0 or q1.

    They need not lead to a number of a certain scene.
    """
    return tuple(SYMBOLS.get(parameter, parameter).split(JOINT))
