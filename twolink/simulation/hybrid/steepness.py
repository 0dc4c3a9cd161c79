"""By how much event functions change with the angles and speeds of a state, in float64.

The derivatives decide which errors of a run would move an event to another side of zero. A few of
their digits are enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from twolink.arithmetic import Pair, Scalar
from twolink.compilation import Compiled
from twolink.contact.states import EventKind
from twolink.errors import ParameterError
from twolink.simulation.hybrid.dynamics import mode_solution
from twolink.simulation.hybrid.event_functions import EDGES, OF_FORCE, Surfaces, value
from twolink.simulation.hybrid.mode import Mode, Trigger
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import DIFFERENCE, FLAT

# Evaluations after which the formula of an event function is compiled, which takes as long as some
# twenty of them. A compiled one takes a fiftieth of the time.
_WORTH_COMPILING = 32


def steepness(
    system: HybridSystem, mode: Mode, state: Sequence[Any], time: float, trigger: Trigger
) -> float:
    """Return the change of an event function by one of every angle and speed (1/rad).

    The state has q (rad) and u (rad/s), in the system's numbers, and the time is in s. It is the
    sum of the sizes of the derivatives by q and u, by central differences in float64, and infinite
    where there is none. A point that is hardly pressed in leaves its surface on one side, so that
    the difference on that side alone would be too small.
    """
    if trigger.kind in EDGES:
        return _of_place(system, mode, state, trigger)
    function = _function(system.in_double, mode.in_floats, trigger)
    given = [float(each) for each in state]
    found = 0.0
    for k in range(4):
        ends = []
        for change in (DIFFERENCE, -DIFFERENCE):
            moved = [*given]
            moved[k] += change
            ends.append(function((moved[0], moved[1]), (moved[2], moved[3]), time))
        found += abs(ends[0] - ends[1]) / (2 * DIFFERENCE)
    if not math.isfinite(found):
        return math.inf
    return found * (system.scales.force(trigger.index) if trigger.kind is EventKind.BREAKS else 1.0)


def _of_place(system: HybridSystem, mode: Mode, state: Sequence[Any], trigger: Trigger) -> float:
    """Return the sum of the sizes of the derivatives by q of a gap, or of √depth."""
    element = system.elements[trigger.index]
    assert element.normal is not None
    pose = Pose(system.chain, system.formulation, (state[0], state[1]))
    found = sum(abs(float(each)) for each in pose.row(element.normal))
    if trigger.kind is EventKind.CLEARS:
        return found
    # √δ has the derivative 1 / (2 √δ) by the depth.
    reach: Any = element.branch(mode.dent(trigger.index)).reach
    return found / max(2 * float(reach), FLAT)


class EventFunction:
    """An event function of a mode, in its unit, as a function of q, u and time (s), in floats.

    It is infinite where the constraints of the mode have no solution. Its formula is compiled, with
    the same results, if it is evaluated often.
    """

    def __init__(self, system: HybridSystem, mode: Mode, trigger: Trigger) -> None:
        """Store a system and a mode, both of floats, and the event."""
        self._system, self._mode, self._trigger = system, mode, trigger
        self._evaluate: Callable[[Pair, Pair, Pair], Scalar] = self._plain
        self._left = _WORTH_COMPILING

    def __call__(self, q: Pair, u: Pair, time: float) -> float:
        """Return its value."""
        self._left -= 1
        if self._left == 0:
            self._evaluate = self._compiled()
        try:
            return float(self._evaluate(q, u, (time, 0.0)))
        except (ZeroDivisionError, OverflowError):
            return math.inf

    @property
    def is_compiled(self) -> bool:
        """Whether its formula is compiled."""
        return self._left <= 0 and self._evaluate != self._plain

    def _plain(self, q: Pair, u: Pair, time: Pair) -> Scalar:
        """Return its value by the formulas of poses that are compiled."""
        return self._in_pose(self._system.pose(q), u, time[0])

    def _compiled(self) -> Callable[[Pair, Pair, Pair], Scalar]:
        """Return the compiled formula, or the plain one if an effect is no formula of numbers."""

        def formula(q: Pair, u: Pair, time: Pair) -> Scalar:
            pose = Pose(self._system.chain, self._system.formulation, q)
            return self._in_pose(pose, u, time[0])

        try:
            return Compiled(formula).of_floats
        except (ArithmeticError, AttributeError, TypeError, ValueError, ParameterError):
            return self._plain

    def _in_pose(self, pose: Pose, u: Pair, time: Scalar) -> Scalar:
        system, mode, trigger = self._system, self._mode, self._trigger
        solution = None
        if trigger.kind in OF_FORCE:
            dents = [mode.dent(i) for i in range(len(mode.states))]
            solution = mode_solution(
                pose, system.effects, system.elements, mode.states, dents, u, time
            )
        return value(trigger, system, mode, pose, u, solution, Surfaces({}, {}))


def _function(system: HybridSystem, mode: Mode, trigger: Trigger) -> EventFunction:
    """Return the event function of a mode of a system, made once."""
    key = mode, trigger
    found: EventFunction | None = system.event_functions.get(key)
    if found is None:
        found = system.event_functions[key] = EventFunction(system, mode, trigger)
    return found
