"""A scene's motion in multiple precision: heyoka's integrator at the initial state."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from twolink.chain import Chain
from twolink.integration.outcomes import check_outcome
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS, Equations, expressions_of
from twolink.simulation.smooth.longest_step import default_longest_step


@dataclass(frozen=True)
class PreciseMotion:
    """An integrator with `bits` of precision, at a scene's initial state, for one formulation.

    `number` creates numbers of its precision; `chain` is the scene's in such numbers; steps must
    not exceed `longest_step` (s).
    """

    integrator: Any
    equations: Equations
    chain: Chain
    bits: int
    number: Callable[[Any], Any]
    longest_step: Any

    def speeds(self) -> tuple[Any, Any, Any, Any]:
        """Return the integrator's present q1, q2 (rad), u1, u2 (rad/s)."""
        now = tuple(self.integrator.state)
        u1, u2 = self.equations.to_speeds(self.chain, now[:2], now[2:])
        return now[0], now[1], u1, u2

    def restart(self, time: str, state: Sequence[str]) -> None:
        """Continue at a time (s) with q1, q2 (rad), u1, u2 (rad/s), all as decimal numbers."""
        q1, q2, u1, u2 = map(self.number, state)
        momenta = self.equations.from_speeds(self.chain, (q1, q2), (u1, u2))
        self.integrator.time = self.number(time)
        self.integrator.state[:] = [q1, q2, *momenta]

    def step(self, longest: Any) -> Any:
        """Take a step that is no longer than the given time (s), and return its length (s).

        Other threads run meanwhile, as they do not in heyoka's own `step`. The Taylor coefficients
        of the step are in the integrator.
        """
        before = self.integrator.time
        outcome, _, own_length, *_ = self.integrator.propagate_until(
            before + 2 * longest, max_delta_t=longest, max_steps=1, write_tc=True
        )
        check_outcome(outcome, before)
        # heyoka counts no step that was cut.
        return own_length if own_length > 0 else longest


def precise_motion(scene: Scene, equations: EquationsName, digits: int) -> PreciseMotion:
    """Return an integrator at a scene's initial state with steps accurate to `digits` digits."""
    hy = heyoka()
    # Additional bits for the rounding of a step's sums.
    bits = math.ceil(digits * math.log2(10)) + 16

    def number(value: Any) -> Any:
        return hy.real(value, bits)

    form = EQUATIONS[equations]
    chain = scene.moving_chain.convert(number)
    q, u = tuple(map(number, scene.q)), tuple(map(number, scene.u))
    integrator = hy.taylor_adaptive(
        expressions_of(equations, chain, scene.effects, number),
        [*q, *form.from_speeds(chain, q, u)],
        fp_type=hy.real,
        prec=bits,
        tol=number(10) ** number(-_tolerance(digits)),
        opt_level=0,
    )
    return PreciseMotion(integrator, form, chain, bits, number, number(default_longest_step(scene)))


def _tolerance(digits: int) -> float:
    """Return the digits of a step's tolerance for which heyoka uses an odd order.

    It is the lowest odd order with the given digits per step; `twolink.simulation.smooth.taylor`
    explains heyoka's choice and the reason for odd orders.
    """
    order = math.ceil(digits * math.log(10) / 2 + 1) | 1
    return (2 * (order - 1) - 0.4) / math.log(10)
