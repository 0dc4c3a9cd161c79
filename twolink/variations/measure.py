"""A motion and its derivatives with measured errors.

Each run is judged by one that shares neither its precision nor its equations: momenta in double,
Lagrange's equations in long double, momenta in 113 bits. The finer run is kept, and its difference
from the coarser one, which is the error of the coarser one, bounds its own. Both runs share the
slopes of the scene's numbers: their measured error and their rounding to float64 are added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from twolink.integration.precisions import PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.smooth.judging import MARGIN_OF_LIKE_PRECISIONS, apart
from twolink.variations.directions import Direction, Roundings
from twolink.variations.system import VariedMotion, varied_motion

Array = NDArray[np.float64]

CONFIGURATIONS: tuple[tuple[PrecisionName, EquationsName], ...] = (
    ("double", "momenta"),
    ("long double", "lagrange"),
    ("quadruple", "momenta"),
)
"""The precision and the equations of each run: none has either in common with its judge."""


@dataclass(frozen=True)
class MeasuredVariation:
    """The kept run in float64: q, u (2, n) and dq, du (k, 2, n), with their errors so far.

    `error`, shape (n,), is that of q (rad) and u (rad/s), and `errors`, shape (k, n), that of the
    derivatives by each parameter, in rad and rad/s for a unit of it.
    """

    q: Array
    u: Array
    dq: Array
    du: Array
    error: Array
    errors: Array
    precision: PrecisionName
    runs: int

    def within(self, accuracy: float) -> NDArray[np.bool_]:
        """Return at which samples the motion and the derivatives are as accurate as allowed.

        The accuracy is absolute for q (rad) and u (rad/s), and relative to the largest derivative
        by the same parameter over the run.
        """
        allowed = accuracy * largest(self.dq, self.du)[:, None]
        return np.asarray((self.error <= accuracy) & (self.errors <= allowed).all(axis=0))


def measured_variation(
    scene: Scene,
    directions: Sequence[Direction],
    times: Array,
    accuracy: float,
    progress: Callable[[str], Callable[[float], None]],
) -> MeasuredVariation:
    """Return the first pair of runs that meets an accuracy, or the finest one."""

    def run(configuration: tuple[PrecisionName, EquationsName]) -> VariedMotion:
        precision, formulation = configuration
        report = progress(f"{formulation}, {precision}")
        every = (*directions, *roundings.units)
        return varied_motion(scene, every, times, formulation, precision, report)

    roundings = Roundings.of(directions)
    doubts = np.array([each.doubt for each in directions])
    coarse = run(CONFIGURATIONS[0])
    for runs, (_, configuration) in enumerate(pairwise(CONFIGURATIONS), start=2):
        fine = run(configuration)
        found = _measured(coarse, fine, doubts, roundings, runs)
        if found.within(accuracy).all():
            break
        coarse = fine
    return found


def largest(dq: Array, du: Array) -> Array:
    """Return the largest size over the run of the derivatives by each parameter, shape (k,)."""
    return np.asarray(np.abs(np.concatenate([dq, du], axis=1)).max(axis=(1, 2)))


def _measured(
    coarse: VariedMotion, fine: VariedMotion, doubts: Array, roundings: Roundings, runs: int
) -> MeasuredVariation:
    """Return the finer of two runs, with its error; `doubts`, (k,), are those of the slopes.

    The derivatives by the units of `roundings` follow those by the parameters. They add to the
    errors: derivatives by several numbers may nearly cancel, but not the roundings of their slopes.
    """
    count = len(doubts)
    by_units = np.concatenate([fine.dq[count:], fine.du[count:]], axis=1).astype(float)
    of_units = np.maximum.accumulate(np.abs(by_units).max(axis=1, initial=0.0), axis=1)
    coarse, fine = (replace(run, dq=run.dq[:count], du=run.du[:count]) for run in (coarse, fine))
    q, u, dq, du = (np.array(x, dtype=float) for x in (fine.q, fine.u, fine.dq, fine.du))
    of_state = np.concatenate([apart(coarse.q, fine.q), apart(coarse.u, fine.u)])
    slopes = np.concatenate([apart(coarse.dq, fine.dq), apart(coarse.du, fine.du)], axis=1)
    margin = MARGIN_OF_LIKE_PRECISIONS
    error = margin * np.maximum.accumulate(of_state.max(axis=0))
    errors = margin * np.maximum.accumulate(slopes.max(axis=1), axis=1)
    sizes = np.maximum.accumulate(np.abs(np.concatenate([dq, du], axis=1)).max(axis=1), axis=1)
    return MeasuredVariation(
        q=q,
        u=u,
        dq=dq,
        du=du,
        # The results are rounded to float64.
        error=error + np.spacing(np.abs(np.concatenate([q, u])).max()) / 2,
        errors=errors
        + doubts[:, None] * sizes
        + roundings.sizes @ of_units
        + np.spacing(sizes) / 2,
        precision=fine.precision,
        runs=runs,
    )
