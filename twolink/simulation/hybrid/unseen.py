"""Steps of an arc that passed a change of the loads, from the residuals of their polynomials.

The loads of an effect of a user may change within a step, unseen at its start: in a narrow range of
an angle, or at a place where they are not smooth. The polynomials of the step then do not satisfy
the equations of motion.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.effects import contact_elements
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, constraint_count, mode_solution
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import CHANGED_STATE, LEAST_RESIDUAL
from twolink.simulation.run import Array
from twolink.simulation.smooth.linear import scaled, shortened
from twolink.simulation.smooth.residuals import NODES, ROUNDINGS, SIGNS, at_places, of_converged


class Unseen(NamedTuple):
    """A step that passed a change of the loads: its start and its length (s)."""

    time: float
    length: float


class _States(NamedTuple):
    """States at the places of steps, shape (n, 64), and the roots of depths by element."""

    q: tuple[Array, Array]
    u: tuple[Array, Array]
    t: Array
    roots: dict[int, Any]

    def changed(self) -> _States:
        """Return the states changed by some roundings."""
        (q1, q2), (u1, u2), t = self.q, self.u, (1 + CHANGED_STATE) * self.t
        a1, a2, b1, b2 = 1 + CHANGED_STATE * SIGNS
        return _States((a1 * q1, a2 * q2), (b1 * u1, b2 * u2), t, self.roots)


def passed_change(system: HybridSystem, arc: Arc) -> Unseen | None:
    """Return the first step of an arc that passed a change of the loads, or None.

    Where two constraints hold the chain at rest, no load moves it.
    """
    if constraint_count(system.elements, arc.mode.states) >= MOST_CONSTRAINTS:
        return None
    for block in arc.blocks:
        steps = _Steps.of(arc, block)
        with np.errstate(all="ignore"):
            passed = _passed(system, arc.mode.in_floats, steps)
        if passed.any():
            start, end = steps.ends[:, passed.argmax()].tolist()
            return Unseen(start, end - start)
    return None


class _Steps(NamedTuple):
    """The states of n steps at their places, shape (n, 64), and their derivatives.

    `ends` (s) has the starts and the ends of the steps, shape (2, n), `pace` the derivatives of the
    time and `changes` those of u, shape (2, n, 64), by the share of the step. The variables have
    the `sizes`, shape (n,).
    """

    states: _States
    ends: Array
    pace: Array
    changes: Array
    sizes: Array
    order: int

    @classmethod
    def of(cls, arc: Arc, block: Block) -> _Steps:
        """Return steps of an arc, whose variable may not be time."""
        polynomials = scaled(block.coefficients, block.lengths)
        starts, lengths = (shortened(each, np.float64) for each in (block.starts, block.lengths))
        values, slopes = at_places(polynomials)
        times, pace = starts[:, None] + lengths[:, None] * NODES, lengths[:, None]
        ends = np.array([starts, starts + lengths])
        compiled, begins = arc.compiled, float(arc.start.t)
        if compiled.clock is not None:
            clock = polynomials[:, compiled.clock]
            times, pace = begins + values[compiled.clock], slopes[compiled.clock]
            ends = begins + np.array([clock[:, 0], clock.sum(axis=1)])
        first = 4 + len(compiled.gaps) + len(compiled.recovering)
        roots = {index: values[place] for place, index in enumerate(compiled.roots, first)}
        sizes = np.maximum(1.0, np.abs(polynomials[:, :4]).max(axis=(1, 2)))
        states = _States((values[0], values[1]), (values[2], values[3]), times, roots)
        return cls(states, ends, pace, slopes[2:4], sizes, polynomials.shape[2] - 1)


def _passed(system: HybridSystem, mode: Mode, steps: _Steps) -> Array:
    """Return which steps passed a change, shape (n,)."""
    du = _accelerations(system, mode, steps.states)
    noise = np.abs(_accelerations(system, mode, steps.states.changed()) - du)
    rounded = np.abs(steps.pace) * (ROUNDINGS * noise + LEAST_RESIDUAL * np.abs(du))
    allowed = of_converged(steps.order) * steps.sizes[:, None] + rounded
    residuals = np.abs(steps.pace * du - steps.changes)
    # A residual that is not a number says that the loads are not finite.
    return np.asarray(~(residuals <= allowed.max(axis=2, keepdims=True)).all(axis=(0, 2)))


def _accelerations(system: HybridSystem, mode: Mode, states: _States) -> Array:
    """Return du/dt (rad/s²) of a mode at states, in float64: shape (2, n, 64)."""
    chain = system.scene_chain
    elements = contact_elements(system.effects, chain)
    dents = [mode.dent(index) for index in range(len(mode.states))]
    solution = mode_solution(
        Pose(chain, system.formulation, states.q), system.effects, elements, mode.states, dents,
        states.u, states.t, states.roots, system.scales.stabilisation,
    )  # fmt: skip
    return np.array([np.broadcast_to(own, states.t.shape) for own in solution.du], dtype=float)
