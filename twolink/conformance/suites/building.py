"""Building of vectors: states, certified values and bounds of a model."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.chain import Chain
from twolink.conformance.bounds import bound
from twolink.conformance.quantities import QUANTITIES, in_numbers
from twolink.conformance.spatial import DECIMALS, FLOATS, SpatialModel, SpatialState
from twolink.conformance.vectors import DIGITS, Level, Vector
from twolink.coordinates import JointConvention
from twolink.engines.messages import Effect, States
from twolink.errors import TwolinkError
from twolink.hardcases import exact

Array = NDArray[np.float64]
Rows = Mapping[str, Array]

_GENERAL = ((0.0, 0.0), (0.3, -0.8), (-1.7, 2.2))


class UncertifiedError(TwolinkError):
    """A value differs between two precisions in one of its 30 digits."""


def states_of(chain: Chain, name: str, *, drawn: int = 3, turns: float = 1.0) -> dict[str, Array]:
    """Return states with numbers of at most four digits: three poses, and drawn ones.

    The same name has the same states. Each field has shape (n, 2). Torques are as large as those of
    accelerations of 10 rad/s².
    """
    # By the name: the states of a group stay as they are when others are added.
    random = np.random.default_rng(zlib.crc32(name.encode()))
    count = len(_GENERAL) + drawn

    def rows(limit: float) -> Array:
        return _short(random.uniform(-limit, limit, (count, 2)))

    angles = rows(2 * np.pi * turns)
    if turns == 1.0:
        angles[: len(_GENERAL)] = _GENERAL
    reach = chain.L1 + float(np.hypot(*chain.centre[1]))
    inertia = chain.I_C1 + chain.I_C2 + sum(chain.mass) * reach**2
    return {
        "angles": angles,
        "speeds": rows(10.0),
        "accelerations": rows(100.0),
        "torques": rows(10 * inertia),
    }


def vectors_of(
    group: str,
    models: Any,
    chain: Chain,
    convention: JointConvention,
    gravity: float,
    states: Rows,
    *,
    flags: Mapping[str, tuple[str, ...]] | None = None,
    level: Level = "average",
    needs: tuple[Effect, ...] = (),
) -> tuple[Vector, ...]:
    """Return the tests of all quantities of a model.

    `models` returns the spatial model in a number type. A model with joint damping or friction is
    tested without inverse dynamics, and its forward dynamics needs both effects; with armature,
    all that depends on it needs it.
    """
    flat = models(FLOATS)
    resisting = _resisting(flat)
    certain = certified(models, states)
    found = []
    for quantity in QUANTITIES.values():
        if quantity.name == "inverse_dynamics" and resisting:
            continue
        rows = {name: states[name] for name in quantity.inputs}
        values = certain[quantity.name]
        truth = np.array(values, dtype=float)
        allowed = bound(quantity, flat, chain, convention, gravity, rows, truth)
        forward = resisting if quantity.name == "forward_dynamics" else ()
        rotors = needs if quantity.name in _WITH_ARMATURE else ()
        found.append(
            Vector(
                id=f"{group}/{quantity.name.replace('_', '-')}",
                flags=(flags or {}).get(quantity.name, ()),
                level=level,
                quantity=quantity.name,
                unit=quantity.unit,
                needs=(*forward, *rotors),
                states=States(**{name: _pairs(row) for name, row in rows.items()}),
                values=values,
                bound=_rounded_up(allowed).tolist(),
            )
        )
    return tuple(found)


def _resisting(model: SpatialModel) -> tuple[Effect, ...]:
    """Return the effects that resist in the joints of a model."""
    pairs: dict[Effect, Any] = {
        "joint_damping": model.damping,
        "joint_friction": model.friction,
    }
    return tuple(effect for effect, pair in pairs.items() if any(pair))


_WITH_ARMATURE = ("mass_matrix", "inverse_dynamics", "forward_dynamics", "kinetic_energy")


def certified(models: Any, states: Rows) -> dict[str, list[Any]]:
    """Return the values of all quantities to 30 digits, as strings, by the quantities' names.

    They are computed with 120 digits and with 60. Raises `UncertifiedError` if one differs in the
    digits that are kept.
    """
    with exact.digits():
        high = _all_values(models(DECIMALS), states)
    with exact.digits(), localcontext() as context:
        context.prec = 2 * DIGITS
        low = _all_values(models(DECIMALS), states)
    return {
        name: _compared(values, low[name], max(map(abs, _flat(values))), name)
        for name, values in high.items()
    }


def _all_values(model: SpatialModel, states: Rows) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {name: [] for name in QUANTITIES}
    for state in in_numbers(states, DECIMALS):
        # One placement of the links for all quantities: most of the work is in the sines.
        placed = SpatialState(model, DECIMALS, state["angles"], state["speeds"])
        for quantity in QUANTITIES.values():
            found[quantity.name].append(quantity.of(placed, state))
    for quantity in QUANTITIES.values():
        if quantity.up_to_constant:
            values = found[quantity.name]
            found[quantity.name] = [value - values[0] for value in values]
    return found


def _compared(high: Any, low: Any, size: Decimal, name: str) -> Any:
    """Return values as strings, if they agree; `size` is that of the largest."""
    if isinstance(high, list):
        return [_compared(h, w, size, name) for h, w in zip(high, low, strict=True)]
    # Terms that cancel, as in a coupling of zero, leave fewer digits than they have.
    if abs(high - low) > Decimal(10) ** -DIGITS * max(abs(high), size * Decimal(10) ** -5):
        raise UncertifiedError(f"{name}: {high} and {low} must agree to {DIGITS} digits")
    if abs(high) <= size * Decimal(10) ** -40:
        return "0"
    return f"{high:.{DIGITS - 1}e}"


def _flat(value: Any) -> list[Decimal]:
    if isinstance(value, list):
        return [number for entry in value for number in _flat(entry)]
    return [value]


def _pairs(rows: Array) -> tuple[tuple[float, float], ...]:
    return tuple((float(first), float(second)) for first, second in rows)


def _short(values: Array) -> Array:
    """Return numbers of four digits."""
    return np.vectorize(lambda x: float(f"{x:.4g}"))(values)


def _rounded_up(values: Array) -> Array:
    """Return bounds of three digits, rounded up."""
    return np.vectorize(lambda x: float(f"{x * 1.005:.2e}"))(values)
