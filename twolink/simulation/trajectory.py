"""A trajectory: the result of a simulation, with its measured error."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
from numpy.typing import NDArray

from twolink import kinematics, lagrange
from twolink.chain import Chain, Point
from twolink.contact.coordinates import JointCoordinate
from twolink.contact.elements import ContactElement
from twolink.effects import (
    Effect,
    contact_elements,
    discontinuities,
    names_of,
    potential_energy,
    smooth_loads,
)
from twolink.errors import SimulationError
from twolink.inputs import as_floats, as_path, as_times, check_instance, refuse
from twolink.limits import DEFAULT_LIMITS
from twolink.loads import Force, Loads
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact, Mode
from twolink.simulation.motion import motion_run
from twolink.simulation.run import Array, MotionRun, Recipe, Statistics
from twolink.simulation.views import Views

if TYPE_CHECKING:
    from twolink.formulations import EquationsName
    from twolink.simulation.hybrid.dynamics import Solution

# Between two samples the motion is one or two polynomials of about the twentieth degree, in time,
# or in its square root at the start or end of a contact.
_NODES = 24

# Memory (bytes) for each of these places: the state, the powers, and intermediate values.
_BYTES_OF_A_NODE = 200

Dense = Callable[[Array, str], tuple[Any, Any]]


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


_ARRAYS = ("t", "q", "u")


def _read_only(array: Array) -> Array:
    array.setflags(write=False)
    return array


@dataclass(frozen=True, repr=False)
class Trajectory(Views):
    """Times t (s), angles q (rad) and speeds u (rad/s), each q and u of shape (2, n).

    `error` is the measured global error (rad, rad/s), and `accuracy` the requested one;
    `holds_until` is the time (s) up to which it is met. `effects` are the effects that were
    simulated. `notes` has the scene's notes, and a sentence for each departure from the request.
    `theta` and `omega` are joint angles and speeds, if the chain has them. `events` are the
    starts of modes (empty for a smooth motion), `impacts` the impacts. `failure` is the reason why
    the run ends before the scene, or empty. `recipe` has the settings that repeat a run by Taylor
    series. Arrays are read-only. Two trajectories are equal if all
    data except `statistics` and dense output are equal.
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
    statistics: Statistics = field(compare=False)
    notes: tuple[str, ...] = ()
    events: tuple[Event, ...] = ()
    impacts: tuple[Impact, ...] = ()
    failure: str = ""
    recipe: Recipe | None = field(default=None, compare=False)
    _knots: Callable[[], Array] | None = field(default=None, repr=False, compare=False)
    _dense: Callable[[], Dense] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Store read-only copies of the arrays."""
        for name in _ARRAYS:
            array = as_floats(name, getattr(self, name))
            object.__setattr__(self, name, _read_only(array))

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the arrays of a copied or unpickled trajectory read-only."""
        self.__dict__.update(state)
        for name in _ARRAYS:
            _read_only(getattr(self, name))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trajectory):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name))
            if f.name in _ARRAYS
            else getattr(self, f.name) == getattr(other, f.name)
            for f in fields(self)
            if f.compare
        )

    def __hash__(self) -> int:
        return hash((self.accuracy, self.error, self.method, self.formulation, len(self.t)))

    @property
    def met(self) -> bool:
        """Whether the requested accuracy is met over the whole run."""
        return self.error <= self.accuracy and not self.failure

    @property
    def chain(self) -> Chain:
        """The chain that moved."""
        return self.scene.moving_chain

    @property
    def theta(self) -> Array | None:
        """The joint angles θ (rad), shape (2, n); None for a chain without joint angles."""
        joints = self.scene.joints
        return None if joints is None else np.array(joints.joint_angles((self.q[0], self.q[1])))

    @property
    def omega(self) -> Array | None:
        """The joint speeds dθ/dt (rad/s), shape (2, n); None for a chain without joint angles."""
        joints = self.scene.joints
        return None if joints is None else np.array(joints.joint_speeds((self.u[0], self.u[1])))

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of the simulated effects."""
        return tuple(type(effect).__name__ for effect in self.scene.effects)

    def at(self, times: Any, side: Literal["left", "right"] = "right") -> tuple[Array, Array]:
        """Return q (rad) and u (rad/s), each of shape (2, n), at times (s) within the run.

        They are values of the Taylor polynomials, as accurate as at the samples. At the time of an
        impact they are those after it, or with `side="left"` those before it. Raises
        `SimulationError` for times outside, and for methods without polynomials.
        """
        if not isinstance(side, str) or side not in ("left", "right"):
            refuse("side", side, "'left' or 'right'")
        moments = as_times(times)
        if not (np.all(moments >= self.t[0]) and np.all(moments <= self.t[-1])):
            raise SimulationError(
                f"times must be {self.t[0]:.6g} to {self.t[-1]:.6g} s; got times from"
                f" {moments.min():.6g} to {moments.max():.6g} s"
            )
        if self._dense is None:
            raise SimulationError(
                "values between samples must be those of a trajectory just simulated with method"
                f" taylor; got one by {self.method} that is known only at its samples"
            )
        q, u = self._dense()(moments, side)
        return np.asarray(q, dtype=float), np.asarray(u, dtype=float)

    def position(self, point: Point) -> Array:
        """Return the x and y of a point (m), shape (2, n)."""
        check_instance("point", point, Point)
        return np.array(kinematics.position(self.chain, tuple(self.q), point))

    def velocity(self, point: Point) -> Array:
        """Return the velocity of a point (m/s), shape (2, n)."""
        check_instance("point", point, Point)
        return np.array(kinematics.velocity(self.chain, tuple(self.q), tuple(self.u), point))

    @property
    def kinetic_energy(self) -> Array:
        """T (J), shape (n,)."""
        return np.asarray(lagrange.kinetic_energy(self.chain, tuple(self.q), tuple(self.u)))

    @property
    def potential_energy(self) -> Array:
        """V (J) of the effects that have one, shape (n,)."""
        V = potential_energy(self.scene.effects, self.chain, tuple(self.q))
        return np.asarray(V + np.zeros_like(self.t))

    @property
    def energy(self) -> Array:
        """T + V (J), shape (n,)."""
        return self.kinetic_energy + self.potential_energy

    def reactions(self) -> tuple[Array, Array]:
        """Return the forces of the ground on link 1 at A, and of link 1 on link 2 at B (N).

        Each has the x and y components, shape (2, n), from Newton's law: m a_C minus the other
        forces on the link.
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
        """Return the force of each dry friction and contact, in the order of the elements.

        Forces are those at the samples, or at times (s) within the run; at the time of an event,
        those of the mode that begins. Impulses are in `impacts`. Raises `SimulationError` for
        times that `at` refuses.
        """
        if times is None:
            moments, q, u = self.t, self.q, self.u
        else:
            moments = as_times(times)
            q, u = self.at(moments)
        elements = contact_elements(self.scene.effects, self.chain) if self.events else ()
        given = np.zeros((len(elements), 2, len(moments)))
        for now, solution in self._solutions(moments, q, u):
            for index, forces in enumerate(solution.forces):
                given[index][:, now] = np.array(np.broadcast_arrays(*forces, moments[now])[:2])
        return tuple(
            _contact_force(element, *forces)
            for element, forces in zip(elements, given, strict=True)
        )

    def _accelerations(self) -> Array:
        """Return du/dt (rad/s²) at the samples, shape (2, n), by the equations of each mode."""
        found = np.empty_like(self.q)
        for now, _, du in self._by_mode(self.t, self.q, self.u):
            found[:, now] = du
        return found

    def _by_mode(
        self, times: Array, q: Array, u: Array
    ) -> Iterator[tuple[NDArray[np.intp], Loads, Array]]:
        """Return, for each mode, the mask of its times, all loads, and du/dt."""
        if not self.events:
            loads = smooth_loads(self.scene.effects, self.chain, tuple(q), tuple(u), times)
            du = lagrange.forward_dynamics(self.chain, tuple(q), tuple(u), loads)
            yield np.ones(len(times), dtype=bool), loads, np.array(np.broadcast_arrays(*du))
            return
        from twolink.simulation.hybrid.dynamics import Pose, loads_of

        elements = contact_elements(self.scene.effects, self.chain)
        for now, solution in self._solutions(times, q, u):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            loads = loads_of(pose, self.scene.effects, elements, solution, speeds, t)
            yield now, loads, np.array(np.broadcast_arrays(*solution.du, t)[:2])

    def _solutions(
        self, times: Array, q: Array, u: Array
    ) -> Iterator[tuple[NDArray[np.intp], Solution]]:
        """Return, for each mode, the indices of its times, and its solution there."""
        if not self.events:
            return
        from twolink.simulation.hybrid.dynamics import Pose, mode_solution

        effects = self.scene.effects
        elements = contact_elements(effects, self.chain)
        for now, mode in self._modes_at(times):
            t, pair, speeds = times[now], tuple(q[:, now]), tuple(u[:, now])
            pose = Pose(self.chain, lagrange, pair)
            dents = [mode.dent(index) for index in range(len(elements))]
            yield now, mode_solution(pose, effects, elements, mode.states, dents, speeds, t)

    def _modes_at(self, times: Array) -> Iterator[tuple[NDArray[np.intp], Mode]]:
        """Return the mode of each event, and the indices of the times (s) in it."""
        entered = [event.entered for event in self.events]
        index = np.searchsorted(entered, times, side="right") - 1
        order = np.argsort(index, kind="stable")
        bounds = np.searchsorted(index[order], np.arange(len(self.events) + 1))
        for event, start, stop in zip(self.events, bounds[:-1], bounds[1:], strict=True):
            if stop > start:
                yield order[start:stop], event.mode

    def work(self) -> dict[str, Array]:
        """Return the work of each effect since the start (J), shape (n,), by its name.

        The power is integrated by Gauss's rule on the polynomials of the run, step by step and
        between events, independent of the samples; the work of impacts is added. The sum of all is
        the change of T since before any impact at the start, within round-off and the error of
        the run.
        Raises `SimulationError` for methods without polynomials, and `TooMuchError` for runs whose
        number of steps would exceed memory.
        """
        nodes, weights = _nodes_and_weights()
        # The power may have kinks at the start of a mode, which bounds the pieces.
        jumps = [t for t in discontinuities(self.scene.effects) if self.t[0] < t < self.t[-1]]
        kinks = [*(e.entered for e in self.events), *(i.time for i in self.impacts), *jumps]
        # Between the ends of a step the motion is one polynomial.
        kinks += [] if self._knots is None else self._knots().tolist()
        edges = np.union1d(self.t, [t for t in kinks if self.t[0] < t < self.t[-1]])
        DEFAULT_LIMITS.check_memory("the work", len(edges) * _NODES * _BYTES_OF_A_NODE)
        widths = np.diff(edges)[:, None]
        moments = edges[:-1, None] + widths * nodes
        q, u = self.at(moments.ravel())
        found: dict[str, Array] = {}
        names = names_of(self.scene.effects)
        for number, (_, power) in enumerate(self._powers(moments.ravel(), q, u)):
            pieces = (widths * weights * power.reshape(moments.shape)).sum(axis=1)
            total = np.concatenate([[0.0], np.cumsum(pieces)])[np.searchsorted(edges, self.t)]
            found[names[number]] = total + self._given_by_impacts(number)
        return found

    def _powers(self, times: Array, q: Array, u: Array) -> Iterator[tuple[Effect, Array]]:
        """Return the power of each effect (W), without impacts."""
        pair, speeds = tuple(q), tuple(u)
        given = self._given_by_modes(times, q, u)
        for number, effect in enumerate(self.scene.effects):
            loads = smooth_loads((effect,), self.chain, pair, speeds, times)
            Q1, Q2 = lagrange.generalized_active_force(self.chain, pair, loads)
            yield effect, Q1 * u[0] + Q2 * u[1] + given[number]

    def _given_by_modes(self, times: Array, q: Array, u: Array) -> Array:
        """Return the power of the friction and contact of each effect (W), shape (effects, n)."""
        power = np.zeros((len(self.scene.effects), len(times)))
        owners = self._owners()
        elements = contact_elements(self.scene.effects, self.chain)
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
        """Return the cumulative energy change in impacts on the contacts of an effect (J)."""
        given = np.zeros_like(self.t)
        owners = self._owners()
        for impact in self.impacts:
            if owners[impact.index] == number:
                given[self.t >= impact.time] += impact.energy_change
        return given

    def _owners(self) -> list[int]:
        """Return the index of the effect that owns each friction and contact."""
        return [
            number
            for number, effect in enumerate(self.scene.effects)
            for _ in contact_elements((effect,), self.chain)
        ]

    def save(self, path: str | PathLike[str]) -> None:
        """Write the samples and their metadata to a .npz, .csv or .parquet file.

        The file is written atomically, and `load` reads it back bit for bit. Raises
        `SimulationError` for other kinds of file, and if it cannot be written.
        """
        from twolink.simulation import storage

        target = as_path("path", path)
        # Accuracies may be numbers of any type; files have floats.
        facts = {name: getattr(self, name) for name in storage.FACTS}
        facts["accuracy"] = float(self.accuracy)
        storage.save(storage.Stored(self.scene, self.t, self.q, self.u, facts), target)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Trajectory:
        """Return the trajectory in a file that `save` wrote.

        Dense output is that of the same run, which is repeated when it is first asked for. Raises
        `SimulationError` for files that are missing, damaged or of another kind, and for those
        whose scene a scene file cannot represent.
        """
        from twolink.simulation import storage

        stored = storage.load(as_path("path", path))
        found = cls(scene=stored.scene, t=stored.t, q=stored.q, u=stored.u, **stored.facts)
        if found.recipe is None or found.failure:
            return found
        repeated = _Repeated(found, found.recipe)
        return replace(found, _knots=repeated.step_times, _dense=repeated.dense)


@dataclass(frozen=True)
class _Repeated:
    """A stored run by Taylor series, repeated with the same settings when it is needed."""

    stored: Trajectory
    recipe: Recipe

    def step_times(self) -> Array:
        """Return the boundaries (s) of the steps."""
        return np.asarray(self._run.step_times())

    def dense(self) -> Dense:
        """Return q and u as functions of time (s)."""
        return self._run.dense()

    @cached_property
    def _run(self) -> MotionRun:
        """The run; raises `SimulationError` if it does not have the stored samples."""
        stored = self.stored
        run = motion_run(
            stored.scene,
            stored.t,
            formulation=cast("EquationsName", stored.formulation),
            precision=stored.precision,
            order=self.recipe.order,
            longest_step=self.recipe.longest_step,
        )
        off = max(
            float(np.abs(np.asarray(found, dtype=float) - kept).max(initial=0.0))
            for found, kept in ((run.q, stored.q), (run.u, stored.u))
        )
        if not off <= 2 * stored.error:
            raise SimulationError(
                f"the repeated run must have the stored samples within {2 * stored.error:.1e}; got "
                f"a difference of {off:.1e}: values between samples are unknown"
            )
        return run


def _contact_force(element: ContactElement, normal: Array, tangential: Array) -> ContactForce:
    """Return the contact force of an element; that of dry friction is along its direction."""
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
