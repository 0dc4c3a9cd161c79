"""The impact log of a run, computed for all impacts at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from twolink import lagrange
from twolink.chain import Chain
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.simulation.hybrid.impact import Strike
from twolink.simulation.hybrid.mode import Impact


def impact_log(
    chain: Chain, strikes: Sequence[Strike], precision: PrecisionName
) -> tuple[Impact, ...]:
    """Return the log of the impacts on a chain, in numbers of one precision."""
    if not strikes:
        return ()
    q = _columns([strike.q for strike in strikes], precision)
    states = [(q, _columns([strike.u[side] for strike in strikes], precision)) for side in (0, 1)]
    kinetic = [_floats([lagrange.kinetic_energy(chain, *state)]) for state in states]
    links = [_floats(lagrange.kinetic_energies(chain, *state)) for state in states]
    return tuple(
        Impact(
            time=strike.time,
            index=strike.number,
            name=strike.name,
            speeds=_pair(strike.speeds),
            sliding=_pair(strike.sliding),
            normal_impulse=float(strike.impulse.normal),
            tangential_impulse=float(strike.impulse.tangential),
            regime=strike.impulse.regime,
            u=(_pair(strike.u[0]), _pair(strike.u[1])),
            kinetic_energy=(kinetic[0][0][place], kinetic[1][0][place]),
            link_energies=(
                (links[0][0][place], links[0][1][place]),
                (links[1][0][place], links[1][1][place]),
            ),
        )
        for place, strike in enumerate(strikes)
    )


def _columns(pairs: Sequence[Any], precision: PrecisionName) -> Any:
    """Return pairs of numbers as a pair of arrays."""
    return tuple(PRECISIONS[precision].array(column) for column in zip(*pairs, strict=True))


def _floats(rows: Sequence[Any]) -> list[list[float]]:
    return [[float(value) for value in row] for row in rows]


def _pair(pair: Any) -> tuple[float, float]:
    return float(pair[0]), float(pair[1])
