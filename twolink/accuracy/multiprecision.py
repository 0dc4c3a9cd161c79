"""A scene's motion in as many digits as are asked for: heyoka's integrator, ready to start."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from twolink.chain import Chain
from twolink.errors import SimulationError
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS, Equations
from twolink.simulation.smooth.taylor import default_longest_step


@dataclass(frozen=True)
class PreciseMotion:
    """An integrator in `bits`, at a scene's start, by one set of equations.

    `number` makes numbers of its precision; `chain` is the scene's, in them; no step is to be
    longer than `longest_step` (s).
    """

    integrator: Any
    equations: Equations
    chain: Chain
    bits: int
    number: Callable[[Any], Any]
    longest_step: Any

    def speeds(self) -> tuple[Any, Any, Any, Any]:
        """Return q1, q2 (rad), u1, u2 (rad/s) where the integrator is now."""
        now = tuple(self.integrator.state)
        u1, u2 = self.equations.to_speeds(self.chain, now[:2], now[2:])
        return now[0], now[1], u1, u2

    def check(self, outcome: Any) -> None:
        """Raise `SimulationError` unless a step, or a run of steps, went well."""
        fine = (heyoka().taylor_outcome.success, heyoka().taylor_outcome.time_limit)
        if outcome not in fine:
            raise SimulationError(
                f"the motion could not be followed beyond {float(self.integrator.time):.6g} s "
                f"({outcome.name}); allowed are scenes whose motion stays finite"
            )


def precise_motion(scene: Scene, equations: str, digits: int) -> PreciseMotion:
    """Return a scene's start in multiple precision, each step to be taken to so many digits."""
    hy = heyoka()
    # Some bits more, for the rounding of a step's sums.
    bits = math.ceil(digits * math.log2(10)) + 16

    def number(value: Any) -> Any:
        return hy.real(value, bits)

    form = EQUATIONS[equations]
    chain = scene.equipped.convert(number)
    variables = hy.make_vars("q1", "q2", "x1", "x2")
    first, second = form.rates(chain, scene.effects, variables[:2], variables[2:], hy.time)
    q, u = tuple(map(number, scene.q)), tuple(map(number, scene.u))
    integrator = hy.taylor_adaptive(
        list(zip(variables, (*first, *second), strict=True)),
        [*q, *form.from_speeds(chain, q, u)],
        fp_type=hy.real,
        prec=bits,
        tol=number(10) ** number(-_tolerance(digits)),
        opt_level=0,
    )
    return PreciseMotion(integrator, form, chain, bits, number, number(default_longest_step(scene)))


def _tolerance(digits: int) -> float:
    """Return the digits of a step's tolerance for which heyoka takes an odd order.

    It is the lowest odd order that brings a step to so many digits; why odd, and how heyoka
    chooses, `twolink.simulation.smooth.taylor` says.
    """
    order = math.ceil(digits * math.log(10) / 2 + 1) | 1
    return (2 * (order - 1) - 0.4) / math.log(10)
