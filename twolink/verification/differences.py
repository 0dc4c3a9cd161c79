"""How far formulations and engines are apart at each of many states, not in the worst alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twolink.engines.protocol import Engine
from twolink.urdf import PlanarUrdf
from twolink.verification.jointspace import FORMULATIONS, Formulation
from twolink.verification.states import Array
from twolink.verification.verify import Progress, comparing_motion


@dataclass(frozen=True)
class Differences:
    """One quantity from two sources: at each state the difference, in units of the tolerance.

    `shares` has shape (states,). More than 1 is a disagreement.
    """

    quantity: str
    source: str
    against: str
    shares: Array


def differences(
    urdf: PlanarUrdf,
    *,
    states: int = 10_000,
    seed: int = 1,
    formulations: Mapping[str, Formulation] = FORMULATIONS,
    engine: Engine | None = None,
    progress: Progress = lambda share: None,
) -> tuple[Differences, ...]:
    """Return the differences of all that `verify` compares, at the same states in the same order.

    Of a quantity with several components the largest counts. Raises as `verify` does.
    """
    comparing = comparing_motion(urdf, formulations, engine)
    found: dict[tuple[str, str, str], list[Array]] = {}
    for quantity, met, _ in comparing.met(states, seed, progress):
        for each in met:
            key = quantity.name, each.source, each.against
            found.setdefault(key, []).append(each.shares)
    return tuple(Differences(*key, np.concatenate(parts)) for key, parts in found.items())
