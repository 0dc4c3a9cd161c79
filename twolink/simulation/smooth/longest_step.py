"""The longest step of a Taylor series: no step may pass the time in which a motion changes."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect, discontinuities
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation.smooth.balance import rates_of_balance
from twolink.simulation.smooth.changes import MOST_STEPS, longest_for_loads
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.times import merged

# Intervals in each time in which a motion changes.
_IN_A_CHANGE = 4

# Shares of the duration at which loads are evaluated.
_LOOKS = np.linspace(0.0, 1.0, 33)


class Pace(NamedTuple):
    """The longest step (s) of motions, and the rate (1/s) at which they leave a balance, or 0.

    Both are numbers, or arrays for motions side by side.
    """

    longest_step: Any
    leaving: Any


def default_longest_step(scene: Scene) -> float:
    """Return the cap of the step (s) of a scene, as `pace_of` does."""
    return float(pace_of(scene).longest_step)


def pace_of(scene: Scene) -> Pace:
    """Return the longest step of a scene and the rate at which it leaves a balance, in floats.

    Raises `SimulationError` if the accelerations at its start are not finite.
    """
    chain, effects, duration = scene.moving_chain.convert(float), scene.effects, scene.duration
    got = "non-finite ones"
    try:
        found = Pace(*map(float, paces(chain, effects, scene.q, scene.u, duration)))
    except (ArithmeticError, ValueError) as error:
        # Functions of floats raise errors where those of arrays return NaN.
        found, got = Pace(math.nan, 0.0), f"{type(error).__name__} ({error}) from their formula"
    if not found.longest_step > 0:
        raise SimulationError(
            "accelerations at the start must be finite in float64, under the loads at all times"
            f" until {duration:.6g} s; got {got} at q = {scene.q!r}, u = {scene.u!r}"
        )
    return found


def intervals_to_check(duration: float, longest_step: float) -> int:
    """Return the least number of intervals at whose ends two runs of a duration (s) are compared.

    There are some for each time in which the motion changes, the `longest_step` (s): errors may
    decay within a few steps.
    """
    return math.ceil(min(_IN_A_CHANGE * duration / longest_step, MOST_STEPS))


def paces(chain: Chain, effects: tuple[Effect, ...], q: Any, u: Any, duration: float) -> Pace:
    """Return the longest steps (s), from the speeds and accelerations, and the rates of leaving.

    The series of a chain that turns through a radian in a time τ does not converge much beyond τ.
    A longer step results from last coefficients that vanish by symmetry: a torque that begins as
    t³, for example, moves a chain at rest by t⁵ and then by t¹⁵. A chain in balance does not turn,
    and its deviation grows by e in a time τ. Nor is a step longer than the shortest time in which
    loads change.

    q (rad), u (rad/s) and the numbers of chain and effects may be those of runs side by side,
    shape (lanes,). The cap is NaN where accelerations at the start are not finite.
    """
    times = duration * _LOOKS
    if jumps := [t for t in discontinuities(effects) if 0 < t < duration]:
        times = merged(times, jumps)
    if np.ndim(q[0]):
        times = times[:, None]
    # At the initial pose, under the loads at each of these times.
    with np.errstate(all="ignore"):
        _, rates = EQUATIONS["lagrange"].rates(chain, effects, q, u, times)
        size = np.maximum(*map(np.abs, rates))
        # Where no load depends on time, rates have none.
        strongest = size.max(axis=0) if np.ndim(size) > np.ndim(q[0]) else size
        fastest = np.maximum(np.maximum(*map(np.abs, u)), np.sqrt(strongest))
        cap = np.minimum(duration, 1 / fastest)
    growth = rates_of_balance(chain, effects, q, u, duration)
    cap = np.minimum(cap, 1 / np.maximum(growth, 1 / duration))
    cap = np.minimum(cap, longest_for_loads(chain, effects, q, u, duration))
    return Pace(np.where(np.isfinite(strongest), cap, np.nan), growth)
