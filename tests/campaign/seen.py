"""A trajectory as the checks see it: at dense times, with modes, forces and geometry beside it.

Times are spread evenly, and clustered on both sides of every event and impact. Where the accuracy
is not met, they end where it stops to hold.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from tests.campaign.elements import CUSHION, FRICTION, OBSTACLE, Element, elements
from twolink import lagrange
from twolink.effects import discontinuities
from twolink.effects.end_force import EndForce
from twolink.loads import Torque

RESTING = ("STICKS", "PRESSED_FORWARD", "PRESSED_BACKWARD")
SLIDING = {"FORWARD": 1, "BACKWARD": -1}

# Numbers of evenly spaced times, of times on each side of an event, and of events at most.
_EVEN, _BESIDE, _MOST_MOMENTS = 2001, 20, 400

# Times nearer than this to an event (s, per s of the run) may belong to either side of it.
_EITHER_SIDE = 5e-13


class Seen:
    """A trajectory at times `t` (s), with q (rad) and u (rad/s) of shape (2, n) there.

    `mode` numbers the event whose mode holds, `normal` and `tangential` are each element's
    forces (N, N m), shape (elements, n), and `slack` is the error that is allowed (rad, rad/s).
    """

    def __init__(self, trajectory: Any) -> None:
        self.trajectory = trajectory
        self.scene, self.chain = trajectory.scene, trajectory.scene.moving_chain
        self.elements = elements(self.scene)
        self.slack = max(float(trajectory.accuracy), 1e-12)
        end = float(trajectory.t[-1])
        self.until = end if trajectory.met else float(trajectory.holds_until)
        self.shortest = _EITHER_SIDE * max(1.0, end)
        self.t = self._dense_times()
        self.q, self.u = trajectory.at(self.t)
        self.mode = self.modes_at(self.t)
        self.normal, self.tangential = self.forces_at(self.t)

    @cached_property
    def moments(self) -> Any:
        """The times (s) at which the motion is not smooth, rising."""
        run = self.trajectory
        found = [x for event in run.events for x in (event.time, event.entered)]
        found += [impact.time for impact in run.impacts]
        found += [t for t in discontinuities(self.scene.effects) if 0 < t < run.t[-1]]
        return np.unique(np.array([0.0, *found], dtype=float))

    def _dense_times(self) -> Any:
        end = float(self.trajectory.t[-1])
        offsets = np.geomspace(1e-12 * max(1.0, end), 1e-2 * max(1e-9, end), _BESIDE)
        chosen = self.moments
        if len(chosen) > _MOST_MOMENTS:
            chosen = chosen[np.linspace(0, len(chosen) - 1, _MOST_MOMENTS).astype(int)]
        beside = (chosen[:, None] + np.concatenate([-offsets, offsets])).ravel()
        times = np.unique(np.concatenate([np.linspace(0.0, end, _EVEN), beside]))
        times = times[(times >= 0) & (times <= self.until)]
        return times[self.distance(times) > self.shortest]

    def distance(self, times: Any) -> Any:
        """Return how far times are from the nearest moment that is not smooth (s)."""
        place = np.clip(np.searchsorted(self.moments, times), 1, len(self.moments) - 1)
        if len(self.moments) == 1:
            return np.abs(times - self.moments[0])
        near = np.minimum(
            np.abs(times - self.moments[place - 1]), np.abs(times - self.moments[place])
        )
        return near

    def modes_at(self, times: Any) -> Any:
        """Return the number of the event whose mode holds at times (s)."""
        entered = [event.entered for event in self.trajectory.events]
        return np.maximum(np.searchsorted(entered, times, side="right") - 1, 0)

    def forces_at(self, times: Any) -> tuple[Any, Any]:
        """Return the forces of each element at times (s), along its way and along its tangent."""
        given = self.trajectory.contact_forces(times)
        shape = (len(self.elements), len(times))
        normal, tangential = np.zeros(shape), np.zeros(shape)
        for place, force in enumerate(given[: len(self.elements)]):
            normal[place] = force.normal
            if force.tangential is not None:
                tangential[place] = force.tangential
        return normal, tangential

    def of_kind(self, *kinds: str) -> list[tuple[int, Element]]:
        """Return the elements of some kinds, with their numbers."""
        return [(i, element) for i, element in enumerate(self.elements) if element.kind in kinds]

    def states(self, number: int, mode: Any = None) -> Any:
        """Return the names of an element's state at all times, or in given modes."""
        names = [event.mode.states[number].name for event in self.trajectory.events]
        return np.array(names)[self.mode if mode is None else mode]

    def gap(self, element: Element) -> Any:
        """Return how far the chain is from an obstacle (rad or m), negative inside."""
        return element.way.coordinate(self.chain, self.q) - element.bound

    def generalized(self, q: Any, normal: Any, tangential: Any) -> Any:
        """Return the generalized forces (N m) of all elements, shape (elements, 2, n)."""
        found = np.zeros((len(self.elements), 2, np.shape(q)[1]))
        for i, element in enumerate(self.elements):
            found[i] = element.way.row(self.chain, q) * normal[i]
            if element.tangent is not None:
                found[i] += element.tangent.row(self.chain, q) * tangential[i]
        return found

    def smooth_force(self, q: Any, u: Any, t: Any) -> tuple[Any, Any]:
        """Return the generalized forces (N m) of all else, and the sum of their sizes."""
        total, sizes = np.zeros(np.shape(q)), np.zeros(np.shape(q))
        for load in self._smooth_loads(q, u, t):
            Q = lagrange.generalized_active_force(self.chain, (q[0], q[1]), (load,))
            part = np.array(np.broadcast_arrays(*Q, q[0])[:2])
            total, sizes = total + part, sizes + np.abs(part)
        return total, sizes

    def _smooth_loads(self, q: Any, u: Any, t: Any) -> Any:
        """Return the loads of all effects that make no modes."""
        parts = [part for effect in self.scene.effects if (part := _smooth(effect)) is not None]
        return [
            load for part in parts for load in part.loads(self.chain, (q[0], q[1]), (u[0], u[1]), t)
        ]

    @cached_property
    def size(self) -> Any:
        """The size of all generalized forces (N m) at each time, shape (n,)."""
        return self.size_at(self.q, self.u, self.t, self.normal, self.tangential)

    def size_at(self, q: Any, u: Any, t: Any, normal: Any, tangential: Any) -> Any:
        """Return the size of all generalized forces (N m) in some states, shape (n,).

        Inertial forces vanish in a stretched or folded pose, and the moment of a load along a link
        too, but not their change with the pose: loads count as in the pose where they turn most.
        """
        smooth = sum(_most_moment(self.chain, load) for load in self._smooth_loads(q, u, t))
        (M11, M12), (_, M22) = lagrange.mass_matrix(self.chain, (q[0], q[1]))
        inertial = (np.abs(M11) + 2 * np.abs(M12) + np.abs(M22)) * np.abs(u).max(axis=0) ** 2
        contact = np.abs(self.generalized(q, normal, tangential)).sum(axis=(0, 1))
        return smooth + inertial + contact

    @cached_property
    def stiffness(self) -> Any:
        """The change of the cushions' generalized forces per change of the state (N m/rad)."""
        found = np.zeros_like(self.t)
        for _, element in self.of_kind(CUSHION):
            reach = element.way.reach(self.chain)
            depth, rate = -self.gap(element), -element.way.speed(self.chain, self.q, self.u)
            assert element.law is not None
            off = 1e-6 * reach
            change = element.law(depth + off, rate + off) - element.law(depth, rate)
            found += reach * np.abs(change) / 1e-6
        return found

    @cached_property
    def force_slack(self) -> Any:
        """The error (N m) that forces of constraints may have at each time, shape (n,)."""
        return (1e-7 + 30 * self.slack) * self.size + 2 * self.slack * self.stiffness

    @cached_property
    def crossing(self) -> Any:
        """How much nearly parallel constraints enlarge errors of their forces, 1 or more."""
        found = np.ones_like(self.t)
        for number in np.unique(self.mode):
            now = self.mode == number
            rows = [way.row(self.chain, self.q[:, now]) for way in self._held(int(number))]
            for i, first in enumerate(rows):
                for second in rows[:i]:
                    area = np.abs(first[0] * second[1] - first[1] * second[0])
                    sides = np.hypot(*first) * np.hypot(*second)
                    found[now] = np.maximum(found[now], np.minimum(1e6, sides / (area + 1e-300)))
        return found

    def _held(self, number: int) -> list[Any]:
        """Return the ways along which a mode lets nothing move."""
        if not self.trajectory.events:
            return []
        found = []
        states = self.trajectory.events[number].mode.states
        for element, state in zip(self.elements, states, strict=False):
            if element.kind == OBSTACLE and state.name != "OPEN":
                found.append(element.way)
            if element.slides is not None and state.name in RESTING:
                found.append(element.slides)
        return found

    def sunk(self, number: int) -> Any:
        """Return how deep (m) a damped cushion that was left is still sunk in at each time."""
        element, found = self.elements[number], np.zeros_like(self.t)
        if element.relaxation is None:
            return found
        # A start may be inside already, and come out faster than the surface does.
        left, was_open = None, False
        for place, event in enumerate(self.trajectory.events):
            if event.entered > self.trajectory.t[-1]:
                # A run that fails may have events after its last sample.
                break
            is_open = event.mode.states[number].name == "OPEN"
            if is_open and not was_open:
                q, _ = self.trajectory.at(event.entered)
                gap = float(element.way.coordinate(self.chain, q)[0]) - element.bound
                left = event.entered, max(0.0, -gap)
            was_open = is_open
            now = self.mode == place
            if is_open and left is not None:
                found[now] = left[1] * np.exp(-element.relaxation * (self.t[now] - left[0]))
        return found


def _most_moment(chain: Any, load: Any) -> Any:
    """Return the sum of the generalized forces (N m) that a load has at most in any pose."""
    if isinstance(load, Torque):
        return np.abs(load.moment)
    reach = np.hypot(load.point.along, load.point.across)
    Fx, Fy = load.components
    return np.hypot(Fx, Fy) * (reach + (chain.L1 if load.point.link == 2 else 0.0))


def _smooth(effect: Any) -> Any:
    """Return the part of an effect that makes no modes, or None."""
    name = type(effect).__name__
    if name in ("JointFriction", "JointStop", "Surface", "CompliantSurface"):
        return None
    if name == "EndForce" and effect.sliding is None:
        return EndForce(effect.normal)
    return effect


__all__ = ["CUSHION", "FRICTION", "OBSTACLE", "RESTING", "SLIDING", "Seen"]
