"""A trajectory: the result of a simulation, with its measured error."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np

from twolink import kinematics, lagrange
from twolink.chain import Chain, Point
from twolink.effects import (
    potential_energy,
)
from twolink.errors import SimulationError
from twolink.inputs import as_floats, as_path, as_times, refuse
from twolink.integration.precisions import PRECISIONS
from twolink.limits import UNLIMITED
from twolink.points import as_point
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.run import Array, MotionRun, Recipe, Statistics
from twolink.simulation.views import Views
from twolink.text import distinct, one_line

if TYPE_CHECKING:
    from twolink.integration.precisions import PrecisionName
    from twolink.names import EquationsName
    from twolink.simulation.forces import ContactForce, ModeForces, States
    from twolink.simulation.hybrid.mode import Event, Impact

Dense = Callable[[Array, str], tuple[Any, Any]]


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
    the run ends before the scene, or empty; some of its events may be after the last sample.
    `recipe` has the settings that repeat a run by Taylor series. Arrays are read-only. Two
    trajectories are equal if all data except `statistics` and dense output are equal.
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
        """The chain that moved, in float64."""
        return self.scene.moving_chain.convert(float)

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
        event, rounded to float64, they are those at the event itself: after an impact, or with
        `side="left"` before it. Raises `SimulationError` for times outside, and for methods without
        polynomials.
        """
        if not isinstance(side, str) or side not in ("left", "right"):
            refuse("side", side, "'left' or 'right'")
        moments = _within(self.t, times)
        q, u = self._function()(moments, side)
        return np.asarray(q, dtype=float), np.asarray(u, dtype=float)

    def _function(self) -> Dense:
        """Return q and u as functions of time (s), in the numbers of the run."""
        if self._dense is None:
            raise SimulationError(
                "values between samples must be those of a trajectory just simulated with method"
                f" taylor; got one by {self.method} that is known only at its samples"
            )
        return self._dense()

    def position(self, point: Point) -> Array:
        """Return the x and y of a point (m), shape (2, n)."""
        own = as_point("point", point)
        return np.array(kinematics.position(self.chain, tuple(self.q), own))

    def velocity(self, point: Point) -> Array:
        """Return the velocity of a point (m/s), shape (2, n)."""
        own = as_point("point", point)
        return np.array(kinematics.velocity(self.chain, tuple(self.q), tuple(self.u), own))

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

    @property
    def samples(self) -> States:
        """The times, angles and speeds of all samples."""
        from twolink.simulation.forces import States

        return States(self.t, self.q, self.u)

    @property
    def mode_forces(self) -> ModeForces:
        """The forces in each mode of the motion."""
        from twolink.simulation.forces import ModeForces

        return ModeForces(self.scene, self.events, until=float(self.t[-1]))

    def reactions(self) -> tuple[Array, Array]:
        """Return the forces of the ground on link 1 at A, and of link 1 on link 2 at B (N).

        Each has the x and y components at the samples, shape (2, n).
        """
        return self.mode_forces.reactions(self.samples)

    def contact_forces(self, times: Any = None) -> tuple[ContactForce, ...]:
        """Return the force of each dry friction and contact, in the order of the elements.

        Forces are those at the samples, or at times (s) within the run; at the time of an event,
        those of the mode that begins. Impulses are in `impacts`. Raises `SimulationError` for
        times that `at` refuses.
        """
        states = self.samples
        if times is not None:
            moments = as_times(times)
            q, u = self.at(moments)
            states = states._replace(t=moments, q=q, u=u)
        return self.mode_forces.contact_forces(states)

    def work(self) -> dict[str, Array]:
        """Return the work of each effect since the start (J), shape (n,), by its name.

        The power is integrated by Gauss's rule on the polynomials of the run, step by step and
        between events, independent of the samples; the work of impacts is added. The sum of all is
        the change of T since before any impact at the start, within round-off and the error of
        the run. Where a slide jams (Painlevé), the power grows without bound as the angle α (rad)
        that is left to the jam vanishes: the round-off of the angles, 1e-16 rad in runs in double
        precision and 1e-19 rad in others, over α is then the relative round-off of the power.
        Raises `SimulationError` for methods without polynomials, and `TooMuchError` for runs whose
        number of steps would exceed memory.
        """
        from twolink.simulation.work import Work

        function = self._function()
        knots = np.empty(0) if self._knots is None else self._knots()
        number = float if knots.dtype == np.float64 else np.longdouble
        mixable = PRECISIONS[cast("PrecisionName", self.precision)].mixable

        def at(times: Any) -> tuple[Any, Any]:
            q, u = function(times, "right")
            return mixable(q).astype(number), mixable(u).astype(number)

        forces = replace(self.mode_forces, number=number)
        return Work(forces, self.impacts, at, knots).until(self.t)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the samples and their metadata to a .npz, .csv or .parquet file.

        The file is written atomically, and `load` reads it back bit for bit. A scene that no scene
        file can hold, such as one with fractions or an effect of one's own, is left out with a
        warning, and `load` refuses the file. Raises `SimulationError` for other kinds of file, and
        if it cannot be written.
        """
        from twolink.simulation import storage

        target = as_path("path", path)
        # Accuracies may be numbers of any type; files have floats.
        facts = {name: getattr(self, name) for name in storage.FACTS}
        facts["accuracy"] = float(self.accuracy)
        reason = storage.save(storage.Stored(self.scene, self.t, self.q, self.u, facts), target)
        if reason is not None:
            warnings.warn(
                f"{one_line(target, 300)} has no scene, so that `Trajectory.load` refuses it, for"
                f" `Scene.to_toml` cannot write it ({reason})",
                stacklevel=2,
            )

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
            precision=cast("PrecisionName", stored.precision),
            order=self.recipe.order,
            longest_step=self.recipe.longest_step,
            evaluated_in=self.recipe.evaluated_in,
            lane=self.recipe.lane,
            limits=UNLIMITED,
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


def _within(t: Array, times: Any) -> Array:
    """Return times (s) as an array. Raises `SimulationError` for times outside of a run."""
    moments = as_times(times)
    if not (np.all(moments >= t[0]) and np.all(moments <= t[-1])):
        raise SimulationError(
            f"times must be {distinct(t[0])} to {distinct(t[-1])} s; got times from"
            f" {distinct(moments.min())} to {distinct(moments.max())} s"
        )
    return moments
