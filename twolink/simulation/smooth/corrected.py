"""A run by Taylor series whose estimated error is subtracted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twolink.errors import SimulationError
from twolink.integration.operations import Operations
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array, MotionRun, Recipe
from twolink.simulation.smooth.correction import Correction
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.step_errors import MOST_KEPT, StepErrors
from twolink.simulation.smooth.taylor import TaylorRun, taylor_run


@dataclass(frozen=True, kw_only=True)
class CorrectedRun(MotionRun):
    """A `raw` run whose estimated error is subtracted, in numbers of at least long double.

    The defects of its steps were `evaluated_in` a precision.
    """

    raw: TaylorRun
    correction: Correction
    evaluated_in: PrecisionName

    @property
    def recipe(self) -> Recipe:
        """The settings that repeat the run."""
        return replace(super().recipe, evaluated_in=self.evaluated_in)

    @property
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps; without those of the correction."""
        return self.raw.arithmetic

    def step_times(self) -> Any:
        """Return the boundaries (s) of the steps, in float64."""
        return self.raw.step_times()

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s)."""
        function = self.raw.dense()

        def at(times: Any, side: str = "right") -> tuple[Any, Any]:
            return _corrected(self.raw, self.correction, times, function(times, side))

        return at


def corrected_taylor_run(
    scene: Scene,
    times: Array,
    *,
    formulation: EquationsName,
    precision: PrecisionName,
    order: int,
    evaluated_in: PrecisionName,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> CorrectedRun:
    """Return the corrected motion of a scene at increasing times (s), the first of them 0.

    Raises `SimulationError` if it cannot be integrated, or in too many steps for a correction.
    """
    errors = StepErrors(scene, formulation, precision, evaluated_in)
    raw = taylor_run(
        scene,
        times,
        formulation=formulation,
        precision=precision,
        order=order,
        longest_step=longest_step,
        progress=progress,
        observe=errors,
    )
    if not errors.is_kept:
        raise SimulationError(
            f"a corrected motion must take at most {MOST_KEPT} steps; got {raw.steps}"
        )
    return corrected_run(raw, times, errors.correction(), evaluated_in)


def corrected_run(
    raw: TaylorRun, times: Array, correction: Correction, evaluated_in: PrecisionName
) -> CorrectedRun:
    """Return a run with its correction at the times (s) of its values."""
    q, u = _corrected(raw, correction, times, (raw.q, raw.u))
    shared = {name: getattr(raw, name) for name in MotionRun.__dataclass_fields__}
    return CorrectedRun(
        **{**shared, "q": q, "u": u}, raw=raw, correction=correction, evaluated_in=evaluated_in
    )


def _corrected(
    run: TaylorRun, correction: Correction, times: Array, known: tuple[Any, Any]
) -> tuple[Any, Any]:
    """Return corrected q and u, in long doubles, from those of a run at times (s)."""
    equations, chain = EQUATIONS[run.formulation], run.scene.moving_chain.convert(np.longdouble)
    q, u = (np.asarray(PRECISIONS[run.precision].mixable(x), np.longdouble) for x in known)
    x = np.array(equations.from_speeds(chain, tuple(q), tuple(u)))
    errors = correction.at(times)
    # The difference of speeds has no round-off of the conversions of u.
    before, after = (
        np.array(equations.to_speeds(chain, tuple(angles), tuple(others)))
        for angles, others in ((q, x), (q + errors[:2], x + errors[2:]))
    )
    return q + errors[:2], u + (after - before)
