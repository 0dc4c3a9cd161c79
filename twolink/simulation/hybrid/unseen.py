"""Steps of an arc that passed a change of the loads, from the residuals of their polynomials.

The loads of an effect of a user may change within a step, unseen at its start: in a narrow range of
an angle, or at a place where they are not smooth. The polynomials of the step then do not satisfy
the equations of motion.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from twolink.effects import contact_elements
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.dynamics import MOST_CONSTRAINTS, constraint_count, mode_solution
from twolink.simulation.hybrid.mode import Mode
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import BAUMGARTE_RATE, CHANGED_STATE, LEAST_RESIDUAL
from twolink.simulation.run import Array
from twolink.simulation.series import powers
from twolink.simulation.smooth.linear import shortened

# The places on a step.
_NODES = (np.arange(64) + 0.5) / 64

# Factors on the residual of a series that has converged, and on the round-off of its evaluation.
_TERMS, _ROUNDINGS = 100.0, 64.0

# The part of a step that passed a change for which the run is repeated.
_SHORTER = 1 / 4


class Unseen(NamedTuple):
    """A step that passed a change of the loads: its start and its length (s)."""

    time: float
    length: float

    @property
    def shorter(self) -> float:
        """The longest step (s) of a further run."""
        return _SHORTER * self.length


class _States(NamedTuple):
    """States at the places of steps, shape (n, 64), and the roots of depths by element."""

    q: tuple[Array, Array]
    u: tuple[Array, Array]
    t: Array
    roots: dict[int, Any]

    def changed(self) -> _States:
        """Return the states changed by some roundings."""
        (q1, q2), (u1, u2), c = self.q, self.u, 1 + CHANGED_STATE
        return _States((c * q1, c * q2), (c * u1, c * u2), c * self.t, self.roots)


def passed_change(system: HybridSystem, arc: Arc) -> Unseen | None:
    """Return the first step of an arc that passed a change of the loads, or None.

    Where two constraints hold the chain at rest, no load moves it.
    """
    if constraint_count(system.elements, arc.mode.states) >= MOST_CONSTRAINTS:
        return None
    mode = arc.mode.in_floats
    for block in arc.blocks:
        with np.errstate(all="ignore"):
            times, passed = _passed(system, arc, mode, block)
        if passed.any():
            first = int(passed.argmax())
            start = float(times[first, 0])
            return Unseen(start, float(times[first, -1]) - start)
    return None


def _passed(system: HybridSystem, arc: Arc, mode: Mode, block: Block) -> tuple[Array, Array]:
    """Return the times (s) of the places of steps, (n, 64), and which steps passed a change."""
    coefficients = shortened(block.coefficients, np.float64)
    starts, lengths = (shortened(each, np.float64) for each in (block.starts, block.lengths))
    scaled = coefficients * powers(lengths, coefficients.shape[2])[:, None]
    k = np.arange(scaled.shape[2])[:, None]
    values = np.moveaxis(scaled @ _NODES**k, 1, 0)
    slopes = np.moveaxis(scaled @ (k * _NODES ** np.maximum(k - 1, 0)), 1, 0)
    compiled = arc.compiled
    times, pace = starts[:, None] + lengths[:, None] * _NODES, lengths[:, None]
    if compiled.clock is not None:
        times, pace = float(arc.start.t) + values[compiled.clock], slopes[compiled.clock]
    first = 4 + len(compiled.gaps) + len(compiled.recovering)
    roots = {index: values[place] for place, index in enumerate(compiled.roots, first)}
    states = _States((values[0], values[1]), (values[2], values[3]), times, roots)
    du = _accelerations(system, mode, states)
    noise = np.abs(_accelerations(system, mode, states.changed()) - du)
    order = scaled.shape[2] - 1
    omitted = _TERMS * (order + 1) * math.exp(-2 * (order + 1))
    size = np.maximum(1.0, np.abs(scaled[:, :4]).max(axis=(1, 2)))
    rounded = _ROUNDINGS * noise + LEAST_RESIDUAL * np.abs(du)
    allowed = omitted * size[:, None] + np.abs(pace) * rounded
    found = np.abs(pace * du - slopes[2:4])
    return times, ~(found <= allowed.max(axis=2, keepdims=True)).all(axis=(0, 2))


def _accelerations(system: HybridSystem, mode: Mode, states: _States) -> Array:
    """Return du/dt (rad/s²) of a mode at states, in float64: shape (2, n, 64)."""
    chain = system.scene_chain
    elements = contact_elements(system.effects, chain)
    dents = [mode.dent(index) for index in range(len(mode.states))]
    solution = mode_solution(
        Pose(chain, system.formulation, states.q), system.effects, elements, mode.states, dents,
        states.u, states.t, states.roots, BAUMGARTE_RATE,
    )  # fmt: skip
    return np.array([np.broadcast_to(own, states.t.shape) for own in solution.du], dtype=float)
