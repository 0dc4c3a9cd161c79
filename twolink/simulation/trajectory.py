"""A trajectory: what came out of a simulation, and how well it is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from twolink import kinematics, lagrange
from twolink.chain import Chain, Point
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import ContactElement
from twolink.effects import Effect, breaks, nonsmooth, smooth_loads
from twolink.errors import SimulationError
from twolink.loads import Force, Loads
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact, Mode

if TYPE_CHECKING:
    from twolink.simulation.hybrid.dynamics import Solution

# Between two samples the motion is a polynomial or two of some twentieth degree, in time or, where
# a contact begins or ends, in its square root.
_NODES = 24

Array = NDArray[np.float64]
Dense = Callable[[Array, str], tuple[Any, Any]]


@dataclass(frozen=True)
class Statistics:
    """What a simulation cost: the run whose result was kept, and all runs together.

    `steps` of that run; `evaluations` of the rates, or of a series' terms; times in s.
    """

    steps: int
    evaluations: int
    runs: int
    compile_seconds: float
    run_seconds: float


@dataclass(frozen=True)
class ContactForce:
    """What the dry friction or the obstacle of this name gives over time, in its `unit`.

    `normal` is that along its direction (for a joint's friction the torque of friction), and
    `tangential` that along its tangent, None where there is none; each of shape (n,).
    """

    name: str
    unit: str
    normal: Array
    tangential: Array | None


@dataclass(frozen=True)
class Trajectory:
    """Times t (s), angles q (rad) and speeds u (rad/s), each q and u of shape (2, n).

    `error` is the measured global error (rad, rad/s), and `accuracy` what was asked for;
    `holds_until` is the time (s) up to which it is met. `effects` are the effects that were
    simulated. `notes` has a sentence for whatever was done otherwise than asked. `events` are the
    beginnings of modes (none in a motion that is smooth), `impacts` the impacts. `failure` is the
    reason why the run ends before the scene does, or empty. Arrays cannot be written to.
    """

    scene: Scene
    t: Array
    q: Array
    u: Array
    accuracy: float
    error: float
    holds_until: float
    method: str
    formulation: str
    precision: str
    statistics: Statistics
    notes: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    impacts: tuple[Impact, ...] = ()
    failure: str = ""
    _knots: Array | None = field(default=None, repr=False, compare=False)
    _dense: Callable[[], Dense] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Keep the arrays from being written to."""
        for array in (self.t, self.q, self.u):
            array.setflags(write=False)

    @property
    def met(self) -> bool:
        """Whether the accuracy that was asked for holds over the whole run."""
        return self.error <= self.accuracy and not self.failure

    @property
    def chain(self) -> Chain:
        """The chain that moved."""
        return self.scene.equipped

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of the effects that were simulated."""
        return tuple(type(effect).__name__ for effect in self.scene.effects)

    def at(self, times: Any, side: Literal["left", "right"] = "right") -> tuple[Array, Array]:
        """Return q (rad) and u (rad/s), each of shape (2, n), at times (s) within the run.

        For a Taylor run they are the values of its polynomials, as accurate as at the samples. At
        the time of an impact they are those after it, or with `side="left"` those before it.
        Raises `SimulationError` for times outside, and for methods without polynomials.
        """
        moments = np.atleast_1d(np.asarray(times, dtype=float))
        if not (np.all(moments >= self.t[0]) and np.all(moments <= self.t[-1])):
            raise SimulationError(
                f"times reach from {moments.min():.6g} to {moments.max():.6g} s; allowed is "
                f"{self.t[0]:.6g} to {self.t[-1]:.6g} s"
            )
        if self._dense is None:
            raise SimulationError(
                f"a trajectory by {self.method} is known at its samples alone; allowed is a "
                "trajectory that was just simulated with method taylor"
            )
        q, u = self._dense()(moments, side)
        return np.asarray(q, dtype=float), np.asarray(u, dtype=float)

    def position(self, point: Point) -> Array:
        """Return the x and y of a point (m), shape (2, n)."""
        return np.array(kinematics.position(self.chain, tuple(self.q), point))

    def velocity(self, point: Point) -> Array:
        """Return the velocity of a point (m/s), shape (2, n)."""
        return np.array(kinematics.velocity(self.chain, tuple(self.q), tuple(self.u), point))

    @property
    def kinetic_energy(self) -> Array:
        """T (J), shape (n,)."""
        return np.asarray(lagrange.kinetic_energy(self.chain, tuple(self.q), tuple(self.u)))

    @property
    def potential_energy(self) -> Array:
        """V (J) of the effects that have one, shape (n,)."""
        energies = [
            effect.potential_energy(self.chain, tuple(self.q))
            for effect in self.scene.effects
            if hasattr(effect, "potential_energy")
        ]
        return np.asarray(sum(energies, np.zeros_like(self.t)))

    @property
    def energy(self) -> Array:
        """T + V (J), shape (n,)."""
        return self.kinetic_energy + self.potential_energy

    def reactions(self) -> tuple[Array, Array]:
        """Return the forces of the ground on link 1 at A, and of link 1 on link 2 at B (N).

        Each has the x and y components, shape (2, n): what Newton's law leaves for the joint,
        m a_C less the effects' forces on the link.
        """
        chain, q, u = self.chain, tuple(self.q), tuple(self.u)
        total = np.zeros((2, *self.q.shape))
        du = self._accelerations()
        links = ((1, chain.m1, chain.C1), (2, chain.m2, chain.C2))
        for link, mass, centre in links:
            inertia = mass * np.array(kinematics.acceleration(chain, q, u, tuple(du), centre))
            total[link - 1] = inertia
        for now, loads, _ in self._by_mode(self.t, self.q, self.u):
            for load in loads:
                if isinstance(load, Force):
                    force = np.array(np.broadcast_arrays(*load.components, self.t[now])[:2])
                    total[load.point.link - 1][:, now] -= force
        return total[0] + total[1], total[1]

    def contact_forces(self, times: Any = None) -> tuple[ContactForce, ...]:
        """Return what each dry friction and obstacle gives, in the order of the modes' names.

        It is that at the samples, or at times (s) within the run; at the time of an event, that of
        the mode that begins. Impacts are not in it: `impacts` has their impulses. Raises
        `SimulationError` for times that `at` refuses.
        """
        if times is None:
            moments, q, u = self.t, self.q, self.u
        else:
            moments = np.atleast_1d(np.asarray(times, dtype=float))
            q, u = self.at(moments)
        elements = nonsmooth(self.scene.effects, self.chain) if self.events else ()
        given = np.zeros((len(elements), 2, len(moments)))
        for now, solution in self._solutions(moments, q, u):
            for index, forces in enumerate(solution.forces):
                given[index][:, now] = np.array(np.broadcast_arrays(*forces, moments[now])[:2])
        return tuple(
            _contact_force(element, *forces)
            for element, forces in zip(elements, given, strict=True)
        )

    def _accelerations(self) -> Array:
        """Return du/dt (rad/s²) at the samples, shape (2, n): in each mode by its own equations."""
        found = np.empty_like(self.q)
        for now, _, du in self._by_mode(self.t, self.q, self.u):
            found[:, now] = du
        return found

    def _by_mode(
        self, times: Array, q: Array, u: Array
    ) -> Iterator[tuple[NDArray[np.intp], Loads, Array]]:
        """Return, for each mode, the times in it (as a mask), all that acts, and du/dt there."""
        if not self.events:
            loads = smooth_loads(self.scene.effects, self.chain, tuple(q), tuple(u), times)
            du = lagrange.forward_dynamics(self.chain, tuple(q), tuple(u), loads)
            yield np.ones(len(times), dtype=bool), loads, np.array(np.broadcast_arrays(*du))
            return
        from twolink.simulation.hybrid.dynamics import Pose, loads_of

        elements = nonsmooth(self.scene.effects, self.chain)
        for now, solution in self._solutions(times, q, u):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            loads = loads_of(pose, self.scene.effects, elements, solution, speeds, t)
            yield now, loads, np.array(np.broadcast_arrays(*solution.du, t)[:2])

    def _solutions(
        self, times: Array, q: Array, u: Array
    ) -> Iterator[tuple[NDArray[np.intp], Solution]]:
        """Return, for each mode, the numbers of the times in it, and what holds in it there."""
        if not self.events:
            return
        from twolink.simulation.hybrid.dynamics import Pose, mode_solution

        effects = self.scene.effects
        elements = nonsmooth(effects, self.chain)
        for now, mode in self._modes_at(times):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            dents = [mode.dent(index) for index in range(len(elements))]
            yield now, mode_solution(pose, effects, elements, mode.states, dents, speeds, t)

    def _modes_at(self, times: Array) -> Iterator[tuple[NDArray[np.intp], Mode]]:
        """Return each event's mode, and the numbers of the times (s) that are in it."""
        entered = [event.entered for event in self.events]
        index = np.searchsorted(entered, times, side="right") - 1
        order = np.argsort(index, kind="stable")
        bounds = np.searchsorted(index[order], np.arange(len(self.events) + 1))
        for event, start, stop in zip(self.events, bounds[:-1], bounds[1:], strict=True):
            if stop > start:
                yield order[start:stop], event.mode

    def work(self) -> dict[str, Array]:
        """Return the work of each effect since the start (J), shape (n,), by its name.

        The power is integrated by Gauss's rule between samples and events, on the run's own
        polynomials, and impacts take what they take: the sum of all is the change of T to rounding,
        from what T is before an impact at the very start.
        Raises `SimulationError` for methods without polynomials.
        """
        nodes, weights = _nodes_and_weights()
        # The power may have kinks where a mode begins: no piece reaches over one.
        jumps = [t for t in breaks(self.scene.effects) if self.t[0] < t < self.t[-1]]
        kinks = [*(e.entered for e in self.events), *(i.time for i in self.impacts), *jumps]
        # Steps are short where a force grows fast, as before friction locks a slide.
        kinks += [] if self._knots is None else self._knots.tolist()
        edges = np.union1d(self.t, [t for t in kinks if self.t[0] < t < self.t[-1]])
        widths = np.diff(edges)[:, None]
        moments = edges[:-1, None] + widths * nodes
        q, u = self.at(moments.ravel())
        found: dict[str, Array] = {}
        for number, (effect, power) in enumerate(self._powers(moments.ravel(), q, u)):
            pieces = (widths * weights * power.reshape(moments.shape)).sum(axis=1)
            name = type(effect).__name__
            key = name if name not in found else f"{name} {number + 1}"
            total = np.concatenate([[0.0], np.cumsum(pieces)])[np.searchsorted(edges, self.t)]
            found[key] = total + self._given_by_impacts(number)
        return found

    def _powers(self, times: Array, q: Array, u: Array) -> Iterator[tuple[Effect, Array]]:
        """Return the power of each effect (W), but for impacts."""
        pair, speeds = tuple(q), tuple(u)
        given = self._given_by_modes(times, q, u)
        for number, effect in enumerate(self.scene.effects):
            loads = smooth_loads((effect,), self.chain, pair, speeds, times)
            Q1, Q2 = lagrange.generalized_active_force(self.chain, pair, loads)
            yield effect, Q1 * u[0] + Q2 * u[1] + given[number]

    def _given_by_modes(self, times: Array, q: Array, u: Array) -> Array:
        """Return the power of each effect's frictions and obstacles (W), shape (effects, n)."""
        power = np.zeros((len(self.scene.effects), len(times)))
        owners = self._owners()
        elements = nonsmooth(self.scene.effects, self.chain)
        for now, solution in self._solutions(times, q, u):
            pair, speeds = tuple(q[:, now]), tuple(u[:, now])
            for owner, element, forces in zip(owners, elements, solution.forces, strict=True):
                along = (element.normal, element.tangent)
                for coordinate, force in zip(along, forces, strict=True):
                    if coordinate is not None:
                        speed = coordinate.speed(self.chain, pair, speeds)
                        power[owner, now] += force * speed
        return power

    def _given_by_impacts(self, number: int) -> Array:
        """Return the energy that impacts on an effect's obstacles have given so far (J)."""
        given = np.zeros_like(self.t)
        owners = self._owners()
        for impact in self.impacts:
            if owners[impact.index] == number:
                given[self.t >= impact.time] += impact.energy_change
        return given

    def _owners(self) -> list[int]:
        """Return the number of the effect that each friction and obstacle comes from."""
        return [
            number
            for number, effect in enumerate(self.scene.effects)
            for _ in nonsmooth((effect,), self.chain)
        ]

    def save(self, path: str | PathLike[str]) -> None:
        """Write t, q and u, and what is known of them, to a .npz, .csv or .parquet file.

        The file is written whole or not at all, and `load` reads it back to the last bit. Raises
        `SimulationError` for other kinds of file, and where it cannot be written.
        """
        from twolink.simulation.storage import save

        save(self, Path(path))

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Trajectory:
        """Return the trajectory in a file that `save` wrote: its samples, without dense output.

        Raises `SimulationError` for files that are missing, damaged or of another kind, and for
        those of a scene that no scene file can hold.
        """
        from twolink.simulation.storage import load

        return load(Path(path))


def _contact_force(element: ContactElement, normal: Array, tangential: Array) -> ContactForce:
    """Return the forces of an element as they are shown: of friction alone, along its direction."""
    unit = "N m" if isinstance(element.principal, JointCoordinate) else "N"
    if element.normal is None:
        return ContactForce(element.name, unit, tangential, None)
    return ContactForce(element.name, unit, normal, tangential if element.rough else None)


def _nodes_and_weights() -> tuple[Array, Array]:
    """Return nodes in (0, 1) and weights that sum up to 1, for functions with roots at both ends.

    They are Gauss's in x, with the place 3x² − 2x³: then (place)^{3/2} is a polynomial in x.
    """
    x, weights = np.polynomial.legendre.leggauss(_NODES)
    x, weights = (1 + x) / 2, weights / 2
    return x * x * (3 - 2 * x), weights * 6 * x * (1 - x)
