"""Reference integrator: heyoka's Taylor series in multiple precision with independent equations.

The library's kinematics, formulations and simulation are not used: the two equations of motion are
written out here and solved by the textbook determinant, whose cancellation is harmless in 113 bits.
A test compares them with heyoka's `lagrangian()` of the energies. Numbers have 113 bits by default.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.errors import SimulationError
from twolink.optional import heyoka
from twolink.simulation.pool import IntegratorPool
from twolink.verification.states import Array

Numbers = tuple[float, float]


@dataclass(frozen=True)
class ReferenceStates:
    """The reference q (rad) and u (rad/s) at some times (s), shape (2, n), rounded to float64."""

    t: Array
    q: Array
    u: Array


@dataclass(frozen=True)
class ReferenceMotion:
    """A smooth motion of a chain from q (rad) and u (rad/s) for a duration (s).

    `gravity` is along x and y (m/s²). The joints have springs (N m/rad) with rest angles `rest`
    (rad), dampers (N m s/rad), and torques: each row of `torques` has a time (s) and the torques at
    A and B (N m) and their rates (N m/s) until the next row's time. Steps do not exceed `cap` (s).
    `presses` is a stiffness (N/m) that pushes D upwards (along −y) below y = `floor` (m). `cubic`
    are coefficients (N m/s³) of torques at A and B proportional to t³.
    """

    chain: Chain
    q: Numbers
    u: Numbers
    duration: float
    gravity: Numbers = (0.0, 9.81)
    stiffness: Numbers = (0.0, 0.0)
    rest: Numbers = (0.0, 0.0)
    damping: Numbers = (0.0, 0.0)
    torques: tuple[tuple[float, Numbers, Numbers], ...] = ()
    cap: float = 0.1
    bits: int = 113
    presses: float = 0.0
    floor: float = 0.0
    cubic: Numbers = (0.0, 0.0)
    _made: dict[tuple[Any, ...], IntegratorPool] = field(
        default_factory=dict, repr=False, compare=False
    )

    def states(self, times: Sequence[float] | Array) -> ReferenceStates:
        """Return the motion at increasing times (s), the first of them 0."""
        plain = np.array([[float(x) for x in row] for row in self._followed(times, 0.0)])
        return ReferenceStates(np.asarray(times, dtype=float), plain[:2], plain[2:])

    def growth(self, times: Sequence[float] | Array, nudge: float = 1e-20) -> Array:
        """Return the growth factor of a small initial error at each of the times."""
        apart = np.abs(self._followed(times, nudge) - self._followed(times, 0.0)).max(axis=0)
        return np.array([float(x / self._number(nudge)) for x in apart])

    def _number(self, value: Any) -> Any:
        if self.bits == 113:
            return heyoka().real128(value)
        return heyoka().real(value, self.bits)

    def _followed(self, times: Sequence[float] | Array, nudge: float) -> Any:
        """Return q and u at the times, shape (4, n), from a perturbed initial state."""
        number = self._number
        start = number(nudge)
        state = [number(x) + start for x in (*self.q, *self.u)]
        rows = [np.array(state)]
        wanted = [number(float(t)) for t in times]
        last = float(times[-1])
        edges = [t for t, *_ in self.torques if 0 < t < last]
        ends = [number(0), *(number(t) for t in edges), number(last)]
        now = number(0)
        for _, end in pairwise(ends):
            pressing = False
            while now < end:
                inside = [t for t in wanted if now < t < end]
                grid = [now, *inside, end]
                state, now, found = self._stretch(state, now, grid, pressing)
                rows += found[: len([t for t in inside if t <= now])]
                pressing = pressing != (now < end)
            if any(t == end for t in wanted):
                rows.append(np.array(state))
        return np.array(rows).T

    def _stretch(
        self, state: list[Any], now: Any, grid: list[Any], pressing: bool
    ) -> tuple[list[Any], Any, list[Any]]:
        """Integrate along a grid of times, to its end or until contact with the floor changes."""
        with self._pool(pressing).lend() as integrator:
            return self._integrated(integrator, state, now, grid)

    def _integrated(
        self, integrator: Any, state: list[Any], now: Any, grid: list[Any]
    ) -> tuple[list[Any], Any, list[Any]]:
        """Return the state and the time at the end, and the states on the grid."""
        integrator.state[:] = state
        integrator.time = now
        if self.presses:
            integrator.reset_cooldowns()
        if self.torques:
            integrator.pars[:] = [self._number(x) for x in self._torque_at(float(now))]
        outcome, _, _, _, _, values = integrator.propagate_grid(
            np.array(grid), max_delta_t=self._number(self.cap)
        )
        hy = heyoka()
        if outcome != hy.taylor_outcome.time_limit and int(outcome.value) != -1:
            raise SimulationError(f"the integration of the reference failed ({outcome.name})")
        return [*integrator.state], self._number(integrator.time), list(values[1:])

    def _torque_at(self, t: float) -> tuple[float, ...]:
        """Return the start (s), values and rates of the torque piece that begins at a time."""
        begun = [row for row in self.torques if row[0] <= t]
        start, values, rates = begun[-1] if begun else (0.0, (0.0, 0.0), (0.0, 0.0))
        return (start, *values, *rates)

    def _pool(self, pressing: bool) -> IntegratorPool:
        key = (pressing,)
        if key not in self._made:
            hy = heyoka()
            kind = hy.real128 if self.bits == 113 else hy.real
            more: dict[str, Any] = {} if self.bits == 113 else {"prec": self.bits}
            variables = hy.make_vars("q1", "q2", "v1", "v2")
            system = self._equations(hy, variables, pressing)
            if self.presses:
                gap = self._number(self.floor) - self._height(hy, variables[:2])
                event = hy.t_event(
                    -gap if pressing else gap,
                    direction=hy.event_direction.negative,
                    fp_type=kind,
                )
                more["t_events"] = [event]
            if self.torques:
                more["pars"] = np.array([self._number(0)] * 5)
            zeros = np.array([self._number(0)] * 4)
            # Loops of library calls compile fifty times as fast as unrolled code.
            self._made[key] = IntegratorPool(
                hy.taylor_adaptive(
                    system, zeros, fp_type=kind, opt_level=0, compact_mode=True, **more
                )
            )
        return self._made[key]

    def _height(self, hy: Any, q: Any) -> Any:
        """Return y of D."""
        L1, L2 = (self._number(x) for x in self.chain.length)
        return L1 * hy.sin(q[0]) + L2 * hy.sin(q[1])

    def _equations(self, hy: Any, variables: list[Any], pressing: bool) -> Any:
        """Return du/dt and dq/dt, with M du = r solved by the textbook determinant."""
        number = self._number
        (q1, q2), (v1, v2) = variables[:2], variables[2:]
        chain = self.chain.convert(number)
        (a1, b1), (a2, b2) = chain.centre
        M11 = chain.I_C1 + chain.m1 * (a1 * a1 + b1 * b1) + chain.m2 * chain.L1 * chain.L1
        M22 = chain.I_C2 + chain.m2 * (a2 * a2 + b2 * b2)
        cos, sin, first = hy.cos(q2 - q1), hy.sin(q2 - q1), chain.m2 * chain.L1
        M12 = first * (a2 * cos - b2 * sin)
        slope = first * (a2 * sin + b2 * cos)
        r1, r2 = slope * v2 * v2, -slope * v1 * v1
        moments = (
            (chain.m1 * a1 + first, chain.m1 * b1),
            (chain.m2 * a2, chain.m2 * b2),
        )
        gx, gy = (number(x) for x in self.gravity)
        weight = []
        for angle, (along, across) in zip((q1, q2), moments, strict=True):
            c, s = hy.cos(angle), hy.sin(angle)
            weight.append((gy * along - gx * across) * c - (gx * along + gy * across) * s)
        tau = [self._joint_torque(hy, 0, q1, v1), self._joint_torque(hy, 1, q2 - q1, v2 - v1)]
        r1, r2 = r1 + weight[0] + tau[0] - tau[1], r2 + weight[1] + tau[1]
        if pressing:
            # The floor's force acts upwards, along −y.
            force = number(self.presses) * (self._height(hy, (q1, q2)) - number(self.floor))
            r1 = r1 - force * chain.L1 * hy.cos(q1)
            r2 = r2 - force * chain.L2 * hy.cos(q2)
        det = M11 * M22 - M12 * M12
        rates = [v1, v2, (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det]
        return list(zip(variables, rates, strict=True))

    def _joint_torque(self, hy: Any, joint: int, angle: Any, speed: Any) -> Any:
        """Return the torque of a joint's spring, damper and motor (N m)."""
        number = self._number
        start, *rows = (hy.par[place] for place in range(5))
        total = hy.expression(number(0))
        if self.torques:
            total = total + rows[joint] + rows[joint + 2] * (hy.time - start)
        if self.cubic[joint]:
            total = total + number(self.cubic[joint]) * (hy.time * hy.time * hy.time)
        if self.stiffness[joint]:
            total = total - number(self.stiffness[joint]) * (angle - number(self.rest[joint]))
        if self.damping[joint]:
            total = total - number(self.damping[joint]) * speed
        return total
