"""The work of each effect of a motion, and of its impacts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink import lagrange
from twolink.effects import contact_elements, discontinuities, names_of, smooth_loads
from twolink.limits import DEFAULT_LIMITS
from twolink.scene import Scene
from twolink.simulation.forces import ModeForces, States
from twolink.simulation.hybrid.mode import Impact
from twolink.simulation.run import Array
from twolink.times import merged

# Between two samples the motion is one or two polynomials of about the twentieth degree, in time,
# or in its square root at the start or end of a contact.
_NODES = 24

# Numbers in memory for each of these places: the state, the powers, and intermediate values.
_FLOATS_OF_A_NODE = 25


@dataclass(frozen=True)
class Work:
    """The work of the effects of a scene, in the modes and the impacts of a motion.

    Forces are evaluated in the numbers of the knots, long double for runs in longer precisions.
    Where a slide jams (Painlevé), the normal force is a quotient whose divisor falls to zero in
    proportion to the angle that is left. The last steps of the run turn the chain by a few
    roundings of float64, so that float64 angles would not determine the force.

    `at` gives q and u, each of shape (2, n), at times (s); `knots` are the ends of its steps (s),
    in the numbers of the forces.
    """

    forces: ModeForces
    impacts: tuple[Impact, ...]
    at: Callable[..., tuple[Any, Any]]
    knots: Any

    @property
    def scene(self) -> Scene:
        """The scene that was simulated."""
        return self.forces.scene

    def until(self, times: Array) -> dict[str, Array]:
        """Return the work of each effect from the first time (s) to each one (J), by its name.

        Raises `TooMuchError` for motions whose number of steps would exceed memory.
        """
        nodes, weights = _nodes_and_weights()
        edges = self._edges(times)
        size = len(edges) * _NODES * _FLOATS_OF_A_NODE * self.knots.itemsize
        DEFAULT_LIMITS.check_memory("the work", size)
        begins, ends = (side[:, None] for side in self._pieces(edges))
        widths = ends - begins
        moments = np.clip(begins + widths * nodes, begins, np.nextafter(ends, begins))
        # In float64 a time next to an edge may round to it, where the next mode begins.
        left, right = edges[:-1, None], edges[1:, None]
        rounded = np.clip(moments.astype(float), left, np.nextafter(right, left))
        powers = self._powers(States(rounded.ravel(), *self.at(moments.ravel())))
        found: dict[str, Array] = {}
        for number, name in enumerate(names_of(self.scene.effects)):
            pieces = (widths * weights * powers[number].reshape(-1, _NODES)).sum(axis=1)
            total = np.concatenate([[0.0], np.cumsum(pieces)])[np.searchsorted(edges, times)]
            found[name] = total.astype(float) + self._by_impacts(number, times)
        return found

    def _edges(self, times: Array) -> Array:
        """Return the times (s) between which the power of each effect is smooth, in float64."""
        first, last = times[0], times[-1]
        kinks = [
            *(event.entered for event in self.forces.events),
            *(impact.time for impact in self.impacts),
            *discontinuities(self.scene.effects),
            *self.knots.astype(float).tolist(),
        ]
        return merged(times, [t for t in kinks if first < t < last])

    def _pieces(self, edges: Array) -> tuple[Any, Any]:
        """Return where the motion between two edges begins and ends (s), in the knots' numbers.

        Edges that are knots rounded to float64 stand for these: where a slide jams, the rounding of
        a time is a part of the last step. Steps shorter than that are between two pieces.
        """
        rounded = self.knots.astype(float)
        inside = (rounded >= edges[0]) & (rounded <= edges[-1])
        place, knots = np.searchsorted(edges, rounded[inside]), self.knots[inside]
        begins = edges.astype(self.knots.dtype)
        ends = begins.copy()
        begins[place] = knots
        ends[place[::-1]] = knots[::-1]
        return begins[:-1], ends[1:]

    def _powers(self, states: States) -> Array:
        """Return the power of each effect (W), without impacts, shape (effects, n)."""
        chain, (t, q, u) = self.forces.chain, states
        power = self._by_modes(states)
        for number, effect in enumerate(self.scene.effects):
            loads = smooth_loads((effect,), chain, tuple(q), tuple(u), t)
            Q1, Q2 = lagrange.generalized_active_force(chain, tuple(q), loads)
            power[number] += Q1 * u[0] + Q2 * u[1]
        return power

    def _by_modes(self, states: States) -> Array:
        """Return the power of the friction and contact of each effect (W), shape (effects, n).

        A rigid contact that pulls, or whose force is not finite, is one that leaves or jams within
        round-off, so that its force is unknown. The work it does there is at most the round-off of
        T, or the T that the impact of a jam takes.
        """
        power = np.zeros((len(self.scene.effects), len(states.t)), states.q.dtype)
        owners = self._owners()
        elements = contact_elements(self.scene.effects, self.forces.chain)
        for now, solution in self.forces.solutions(states):
            pair, speeds = tuple(states.q[:, now]), tuple(states.u[:, now])
            for owner, element, forces in zip(owners, elements, solution.forces, strict=True):
                along = (element.normal, element.tangent)
                known: Any = True
                if element.rigid:
                    known = np.isfinite(forces.normal) & (forces.normal >= 0)
                for coordinate, force in zip(along, forces, strict=True):
                    if coordinate is not None:
                        speed = coordinate.speed(self.forces.chain, pair, speeds)
                        power[owner, now] += np.where(known, force, 0) * speed
        return power

    def _by_impacts(self, number: int, times: Array) -> Array:
        """Return the cumulative energy change in impacts on the contacts of an effect (J)."""
        given = np.zeros_like(times)
        owners = self._owners()
        for impact in self.impacts:
            if owners[impact.index] == number:
                given[times >= impact.time] += impact.energy_change
        return given

    def _owners(self) -> list[int]:
        """Return the index of the effect that owns each friction and contact."""
        return [
            number
            for number, effect in enumerate(self.scene.effects)
            for _ in contact_elements((effect,), self.forces.chain)
        ]


def _nodes_and_weights() -> tuple[Array, Array]:
    """Return nodes in (0, 1) and weights that sum up to 1, for functions with roots at both ends.

    They are Gauss's in x, with the place 3x² − 2x³: then (place)^{3/2} is a polynomial in x.
    """
    x, weights = np.polynomial.legendre.leggauss(_NODES)
    x, weights = (1 + x) / 2, weights / 2
    return x * x * (3 - 2 * x), weights * 6 * x * (1 - x)
