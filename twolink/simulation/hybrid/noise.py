"""The round-off of the conditions of a mode selection, by the sizes of all forces."""

from __future__ import annotations

import math
from typing import NamedTuple

from twolink.arithmetic import Pair, Scalar
from twolink.integration.precisions import PRECISIONS
from twolink.loads import Force, Load, Loads, Torque
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.conditions import Condition, Law, along
from twolink.simulation.hybrid.constraint import cramer
from twolink.simulation.hybrid.dynamics import LocalEquations
from twolink.simulation.hybrid.impact import has_no_lever
from twolink.simulation.hybrid.system import HybridSystem

# A start is given in float64.
_OF_START = PRECISIONS["double"].rounding


class Zero(NamedTuple):
    """A value that is zero within its round-off of this `size`, with its derivatives.

    It is a force (N or N m), or the acceleration along a gap (rad/s² or m/s²). As it is computed it
    has a `value`, which contradicts its law if it is negative, with a `rounding` by the forces that
    act along it, and an `error` by that of the state as well. A violation `is_rounding` if it is no
    more than the round-off of the numbers in their precision or of a start.
    """

    size: float
    value: float = 0.0
    error: float = 0.0
    rounding: float = 0.0
    is_rounding: bool = True

    @property
    def excess(self) -> float:
        """The largest violation of its law, 0 if the value is certain to obey it."""
        return max(self.error - self.value, 0.0)

    @property
    def obeys(self) -> bool:
        """Whether the value is certain to obey its law, or is zero by all digits of its numbers."""
        return self.value > self.error or abs(self.value) <= self.rounding


class Noise:
    """The round-off of the conditions at a state, by the sizes of all forces there.

    The part of a condition that does not depend on the mode is computed once.
    """

    def __init__(self, system: HybridSystem, equations: LocalEquations, u: Pair, t: Scalar) -> None:
        """Compute the sizes of the forces (N m) and of M (kg m²) at speeds and a time (s)."""
        (M11, M12), (_, M22) = equations.M
        inertia = abs(float(M11)), abs(float(M12)), abs(float(M22))
        self._system, self._equations = system, equations
        given = tolerances.ROUNDED_PLACE * known_at(t, 0.0)
        self._unsure = max(tolerances.UNDECIDED * system.scales.resolution, given)
        self._rounding = max(tolerances.ROUNDED_VALUE * system.scales.resolution, given)
        self._forces = _size_of_forces(equations, inertia, system.scene_chain.L1, u)
        # A start is exact.
        self._of_state = system.scales.resolution if t else system.rounding
        self._inertia = inertia[0] + inertia[1], inertia[1] + inertia[2]
        self._turning = size_of(u) * size_of(u)
        self._gains: dict[Condition, float] = {}

    def of(self, condition: Condition, du: Pair) -> float:
        """Return the round-off of the value of a condition at du (rad/s²)."""
        gain = self._gains.get(condition)
        if gain is None:
            gain = self._gains[condition] = self._gain(condition)
        if condition.law in (Law.SEPARATES, Law.ACCELERATES):
            return self._of_acceleration(gain, du)
        return gain if math.isinf(gain) else self._unsure * self._forces_at(du) * gain

    def zero(self, condition: Condition, q: Pair, du: Pair, value: float) -> Zero:
        """Return a condition that is zero within its round-off at q (rad) and du (rad/s²).

        As it is computed it has a value, which contradicts the law if it is negative.
        """
        size = self.of(condition, du)
        is_rounding = -value * self._unsure <= size * self._rounding
        acting = tolerances.ROUNDED_VALUE * self._acting_along(condition, q, du)
        return Zero(
            size, value, self._of_state * acting, self._system.rounding * acting, is_rounding
        )

    def _acting_along(self, condition: Condition, q: Pair, du: Pair) -> float:
        """Return the sum of the sizes of all terms of the value of a condition, at q and du.

        It is zero where none acts along the condition.
        """
        gain = self._gain(condition)
        if math.isinf(gain):
            return 0.0
        found = self._acting(q, du) * gain
        is_force = condition.law not in (Law.SEPARATES, Law.ACCELERATES)
        return found if is_force else found + self._own_acceleration(du)

    def _acting(self, q: Pair, du: Pair) -> float:
        """Return the sum of the sizes (N m) of all forces at q (rad) and du (rad/s²)."""
        system, equations = self._system, self._equations
        active = system.formulation.generalized_active_force
        parts = (part for load in equations.loads for part in _parts(load))
        given = sum(size_of(active(system.chain, q, (part,))) for part in parts)
        one, two = self._inertia
        first, second = (abs(float(own)) + self._turning for own in du)
        return given + one * first + two * second + _size_of_pushes(equations)

    def along(self, row: Pair, du: Pair) -> float:
        """Return the round-off of the acceleration along a row at du (rad/s²)."""
        return self._of_acceleration(self._response(row), du)

    def _gain(self, condition: Condition) -> float:
        """Return the change of a condition by a generalized force (N m)."""
        row, _ = along(self._equations, condition)
        if condition.law in (Law.SEPARATES, Law.ACCELERATES):
            return self._response(row)
        return math.inf if vanishes(self._system, row) else 1 / size_of(row)

    def _response(self, row: Pair) -> float:
        return size_of(cramer(self._equations.M, row, self._equations.det))

    def _of_acceleration(self, response: float, du: Pair) -> float:
        return self._unsure * (self._forces_at(du) * response + self._own_acceleration(du))

    def _own_acceleration(self, du: Pair) -> float:
        """Return the size (m/s²) of accelerations of points at du (rad/s²)."""
        return self._system.scales.lever * (size_of(du) + self._turning)

    def _forces_at(self, du: Pair) -> float:
        """Return the size (N m) of all forces at du (rad/s²), those of inertia included."""
        one, two = self._inertia
        return self._forces + one * abs(float(du[0])) + two * abs(float(du[1]))


def _size_of_forces(
    equations: LocalEquations, inertia: tuple[float, float, float], length: Scalar, u: Pair
) -> float:
    """Return the sum of all generalized forces (N m), each as large as it is in some pose.

    In one pose they may vanish or cancel, and their round-off remains: that of the angles times
    their derivatives. `length` (m) is that of link 1.
    """
    M11, M12, M22 = inertia
    speed = size_of(u)
    size = (M11 + 2 * M12 + M22) * speed * speed
    for load in equations.loads:
        if isinstance(load, Torque):
            size += abs(float(load.moment))
        else:
            point, force = load.point, size_of(load.components)
            reach = abs(float(point.along)) + abs(float(point.across))
            size += force * (reach + (float(length) if point.link == 2 else 0.0))
    return size + _size_of_pushes(equations)


def _size_of_pushes(equations: LocalEquations) -> float:
    """Return the sum of the generalized forces (N m) of pressed surfaces."""
    return sum(
        abs(float(terms.push)) * size_of(terms.normal.row)
        for terms in equations.terms
        if terms is not None and terms.normal is not None
    )


def _parts(load: Load) -> Loads:
    """Return the loads along x and y whose sum is a load: their moments may cancel."""
    if isinstance(load, Torque):
        return (load,)
    x, y = load.components
    return Force(load.point, (x, 0 * y)), Force(load.point, (0 * x, y))


def known_at(t: Scalar, rounding: float) -> float:
    """Return the relative accuracy of a state at a time (s): `rounding`, and float64's at a start.

    A start is given in float64, so that every precision makes the same decisions there.
    """
    return rounding if t else max(rounding, _OF_START)


def vanishes(system: HybridSystem, row: Pair) -> bool:
    """Return whether a row is zero within round-off: no force acts along it in this pose."""
    return has_no_lever(row, system.scales.lever)


def size_of(row: Pair) -> float:
    """Return the largest entry of a row."""
    return max(abs(float(row[0])), abs(float(row[1])))
