"""The parameters that an engine reports for a model, compared with those of the model."""

from __future__ import annotations

from typing import Any

from twolink.conformance.bounds import EPSILONS, ROUNDINGS
from twolink.engines.messages import Precision, Understood

_UNITS = {
    "mass": "kg",
    "reach": "m",
    "inertia": "kg m²",
    "damping": "N m s/rad",
    "friction": "N m",
    "armature": "kg m²",
}


def misunderstood(
    received: Understood | None, expected: Understood | None, precision: Precision
) -> tuple[str, ...]:
    """Return a sentence for each parameter that an engine understood wrongly, by its own account.

    Parameters that the engine does not report are not judged.
    """
    if received is None or expected is None:
        return ()
    found = []
    for name, unit in _UNITS.items():
        ours, theirs = getattr(expected, name), getattr(received, name)
        for index, sentence in _differences(name, unit, ours, theirs, precision):
            found.append(f"{name} of {_owner(name)} {index + 1} {sentence}")
    return (*found, *_limits(received, expected, precision))


def _differences(
    name: str, unit: str, ours: Any, theirs: Any, precision: Precision
) -> list[tuple[int, str]]:
    if ours is None or theirs is None:
        return []
    allowed = ROUNDINGS * EPSILONS[precision] * max(abs(number) for number in ours)
    return [
        (index, f"must be {one:.6g} {unit}; it understood {other:.6g}")
        for index, (one, other) in enumerate(zip(ours, theirs, strict=True))
        if not abs(one - other) <= allowed
    ]


def _limits(received: Understood, expected: Understood, precision: Precision) -> list[str]:
    if received.limits is None or expected.limits is None:
        return []
    allowed = ROUNDINGS * EPSILONS[precision]
    found = []
    for index, (ours, theirs) in enumerate(zip(expected.limits, received.limits, strict=True)):
        if ours is None and theirs is None:
            continue
        if ours is not None and theirs is not None:
            pairs = zip(ours, theirs, strict=True)
            if all(abs(one - other) <= allowed * abs(one) for one, other in pairs):
                continue
        found.append(f"limits of joint {index + 1} must be {ours} rad; it understood {theirs}")
    return found


def _owner(name: str) -> str:
    return "link" if name in ("mass", "reach", "inertia") else "joint"
