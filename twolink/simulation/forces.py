"""The forces of a motion, mode by mode: accelerations, reactions of the joints, contact forces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink import kinematics, lagrange
from twolink.chain import Chain
from twolink.contact.coordinates import JointCoordinate
from twolink.effects import contact_elements, discontinuities, smooth_loads
from twolink.loads import Force, Loads
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Mode
from twolink.simulation.run import Array

if TYPE_CHECKING:
    from twolink.contact.elements import ContactElement
    from twolink.simulation.hybrid.dynamics import Solution


@dataclass(frozen=True)
class ContactForce:
    """The force of one dry friction or contact over time, in its `unit`.

    `normal` is the force along its direction (the friction torque of a joint), and `tangential` the
    one along its tangent, or None; each of shape (n,).
    """

    name: str
    unit: str
    normal: Array
    tangential: Array | None


class States(NamedTuple):
    """Times t (s), shape (n,), with angles q (rad) and speeds u (rad/s), shape (2, n)."""

    t: Array
    q: Array
    u: Array


@dataclass(frozen=True)
class ModeForces:
    """The forces of a scene in the modes that begin with its events; none for a smooth motion.

    `number` is the type of numbers in which they are evaluated: float or `numpy.longdouble`. The
    last sample is at the time `until` (s), which may be before the end of the scene.
    """

    scene: Scene
    events: tuple[Event, ...]
    number: Any = float
    until: float = math.inf

    @cached_property
    def chain(self) -> Chain:
        """The chain that moved, in the numbers of the forces."""
        return self.scene.moving_chain.convert(self.number)

    def accelerations(self, states: States) -> Array:
        """Return du/dt (rad/s²) in states, shape (2, n), by the equations of each mode."""
        found = np.empty_like(states.q)
        for now, _, du in self.by_mode(states):
            found[:, now] = du
        return found

    def by_mode(self, states: States) -> Iterator[tuple[NDArray[np.intp], Loads, Array]]:
        """Return, for each mode, the places of its times, all loads, and du/dt."""
        states = self._before_the_end(states)
        times, q, u = states
        if not self.events:
            loads = smooth_loads(self.scene.effects, self.chain, tuple(q), tuple(u), times)
            du = lagrange.forward_dynamics(self.chain, tuple(q), tuple(u), loads)
            yield np.ones(len(times), dtype=bool), loads, np.array(np.broadcast_arrays(*du))
            return
        from twolink.simulation.hybrid.dynamics import loads_of
        from twolink.simulation.hybrid.pose import Pose

        elements = contact_elements(self.scene.effects, self.chain)
        for now, solution in self.solutions(states):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            loads = loads_of(pose, self.scene.effects, elements, solution, speeds, t)
            yield now, loads, np.array(np.broadcast_arrays(*solution.du, t)[:2])

    def solutions(self, states: States) -> Iterator[tuple[NDArray[np.intp], Solution]]:
        """Return, for each mode, the places of its times, and its solution there."""
        times, q, u = self._before_the_end(states)
        if not self.events:
            return
        from twolink.simulation.hybrid.dynamics import mode_solution
        from twolink.simulation.hybrid.pose import Pose

        effects = self.scene.effects
        elements = contact_elements(effects, self.chain)
        for now, mode in self.modes_at(times):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            dents = [mode.dent(index) for index in range(len(elements))]
            with np.errstate(divide="ignore", invalid="ignore"):
                # The force of a slide that jams may be infinite within round-off.
                found = mode_solution(pose, effects, elements, mode.states, dents, speeds, t)
            yield now, found

    def _before_the_end(self, states: States) -> States:
        """Return states whose loads are those of the modes: none begins where the motion ends."""
        end = min(self.until, self.scene.duration)
        begins = any(event.entered == end for event in self.events)
        if begins or end not in discontinuities(self.scene.effects):
            return states
        return states._replace(t=np.minimum(states.t, np.nextafter(end, 0.0)))

    def modes_at(self, times: Array) -> Iterator[tuple[NDArray[np.intp], Mode]]:
        """Return the mode of each event, and the indices of the times (s) in it."""
        entered = [event.entered for event in self.events]
        index = np.searchsorted(entered, times, side="right") - 1
        order = np.argsort(index, kind="stable")
        bounds = np.searchsorted(index[order], np.arange(len(self.events) + 1))
        for event, start, stop in zip(self.events, bounds[:-1], bounds[1:], strict=True):
            if stop > start:
                yield order[start:stop], event.mode

    def reactions(self, states: States) -> tuple[Array, Array]:
        """Return the forces of the ground on link 1 at A, and of link 1 on link 2 at B (N).

        Each has the x and y components, shape (2, n), from Newton's law: m a_C minus the other
        forces on the link.
        """
        chain, q, u = self.chain, tuple(states.q), tuple(states.u)
        total = np.zeros((2, *states.q.shape))
        du = self.accelerations(states)
        links = ((1, chain.m1, chain.C1), (2, chain.m2, chain.C2))
        for link, mass, centre in links:
            inertia = mass * np.array(kinematics.acceleration(chain, q, u, tuple(du), centre))
            total[link - 1] = inertia
        for now, loads, _ in self.by_mode(states):
            for load in loads:
                if isinstance(load, Force):
                    force = np.array(np.broadcast_arrays(*load.components, states.t[now])[:2])
                    total[load.point.link - 1][:, now] -= force
        return total[0] + total[1], total[1]

    def contact_forces(self, states: States) -> tuple[ContactForce, ...]:
        """Return the force of each dry friction and contact, in the order of the elements."""
        elements = contact_elements(self.scene.effects, self.chain) if self.events else ()
        given = np.zeros((len(elements), 2, len(states.t)))
        for now, solution in self.solutions(states):
            for index, forces in enumerate(solution.forces):
                given[index][:, now] = np.array(np.broadcast_arrays(*forces, states.t[now])[:2])
        return tuple(
            _contact_force(element, *forces)
            for element, forces in zip(elements, given, strict=True)
        )


def _contact_force(element: ContactElement, normal: Array, tangential: Array) -> ContactForce:
    """Return the contact force of an element; that of dry friction is along its direction."""
    unit = "N m" if isinstance(element.principal, JointCoordinate) else "N"
    if element.normal is None:
        return ContactForce(element.name, unit, tangential, None)
    return ContactForce(element.name, unit, normal, tangential if element.rough else None)
