"""Differences between formulations and engines at every state, not only at the worst one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twolink.engines.chain_engine import ChainEngine
from twolink.formulations import FORMULATIONS, Formulation
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import FormulationName
from twolink.urdf import PlanarUrdf
from twolink.verification.states import Array
from twolink.verification.verify import Progress, motion_plan


@dataclass(frozen=True)
class Differences:
    """Difference of one quantity from two sources at each state, in units of the tolerance.

    `shares` has shape (states,). A value above 1 is a disagreement.
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
    formulations: Mapping[FormulationName, Formulation] = FORMULATIONS,
    engine: ChainEngine | None = None,
    progress: Progress = lambda share: None,
    limits: Limits = DEFAULT_LIMITS,
) -> tuple[Differences, ...]:
    """Return the differences of all quantities of `verify`, at the same states in the same order.

    A quantity with several components is represented by its largest one. Raises as `verify` does.
    """
    plan = motion_plan(urdf, formulations, engine)
    found: dict[tuple[str, str, str], list[Array]] = {}
    for quantity, met, _ in plan.batches(states, seed, progress, limits):
        for each in met:
            key = quantity.name, each.source, each.against
            found.setdefault(key, []).append(each.shares)
    return tuple(Differences(*key, np.concatenate(parts)) for key, parts in found.items())
