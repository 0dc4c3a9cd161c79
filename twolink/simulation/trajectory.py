"""A trajectory: what came out of a simulation, and how well it is known."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink import kinematics, lagrange
from twolink.chain import Chain, Point
from twolink.errors import SimulationError
from twolink.files import written_whole
from twolink.loads import Force
from twolink.scene import Scene
from twolink.simulation.equations import loads_of
from twolink.simulation.mode import Event

# Between two samples the motion is a polynomial or two of some twentieth degree.
_NODES = 16

Array = NDArray[np.float64]
Dense = Callable[[Array], tuple[Any, Any]]


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
class Trajectory:
    """Times t (s), angles q (rad) and speeds u (rad/s), each q and u of shape (2, n).

    `error` is the measured global error (rad, rad/s), and `accuracy` what was asked for;
    `holds_until` is the time (s) up to which it is met. `effects` are the effects that were
    simulated. `notes` has a sentence for whatever was done otherwise than asked. `events` are the
    beginnings of modes of stick and slip. Arrays cannot be written to.
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
    _dense: Callable[[], Dense] | None = field(default=None, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Keep the arrays from being written to."""
        for array in (self.t, self.q, self.u):
            array.setflags(write=False)

    @property
    def met(self) -> bool:
        """Whether the accuracy that was asked for holds over the whole run."""
        return self.error <= self.accuracy

    @property
    def chain(self) -> Chain:
        """The chain that moved."""
        return self.scene.chain

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of the effects that were simulated."""
        return tuple(type(effect).__name__ for effect in self.scene.effects)

    def at(self, times: Any) -> tuple[Array, Array]:
        """Return q (rad) and u (rad/s), each of shape (2, n), at times (s) within the run.

        For a Taylor run they are the values of its polynomials, as accurate as at the samples.
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
        q, u = self._dense()(moments)
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
        loads = loads_of(self.scene.effects, chain, q, u, self.t)
        du = self._accelerations()
        missing = []
        for link, mass, centre in ((1, chain.m1, chain.C1), (2, chain.m2, chain.C2)):
            total = mass * np.array(kinematics.acceleration(chain, q, u, tuple(du), centre))
            for load in loads:
                if isinstance(load, Force) and load.point.link == link:
                    total = total - np.array(np.broadcast_arrays(*load.components, self.t)[:2])
            missing.append(total)
        at_B = missing[1]
        return missing[0] + at_B, at_B

    def _accelerations(self) -> Array:
        """Return du/dt (rad/s²) at the samples, shape (2, n): in each mode by its own equations."""
        q, u = tuple(self.q), tuple(self.u)
        if not self.events:
            loads = loads_of(self.scene.effects, self.chain, q, u, self.t)
            return np.array(lagrange.forward_dynamics(self.chain, q, u, loads))
        from twolink.simulation.modes import FrictionModes, split_friction

        smooth, friction = split_friction(self.scene.effects)
        assert friction is not None
        modes = FrictionModes(self.chain, smooth, friction)
        found = np.empty_like(self.q)
        index = np.searchsorted([event.time for event in self.events], self.t, side="right") - 1
        for number, event in enumerate(self.events):
            now = index == number
            q, u = tuple(self.q[:, now]), tuple(self.u[:, now])
            rates = modes.accelerations(event.mode, q, u, self.t[now])
            found[:, now] = np.array(np.broadcast_arrays(*rates))
        return found

    def work(self) -> dict[str, Array]:
        """Return the work of each effect since the start (J), shape (n,), by its name.

        The power is integrated by Gauss's rule between samples, on the run's own polynomials, so
        the sum of all is the change of T to rounding. Raises `SimulationError` for methods without
        polynomials.
        """
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        # The power may have kinks where a mode begins: no piece reaches over one.
        edges = np.union1d(self.t, [event.time for event in self.events])
        half = np.diff(edges)[:, None] / 2
        moments = edges[:-1, None] + half * (1 + nodes)
        q, u = (tuple(pair) for pair in self.at(moments.ravel()))
        found: dict[str, Array] = {}
        for number, effect in enumerate(self.scene.effects):
            loads = effect.loads(self.chain, q, u, moments.ravel())
            Q1, Q2 = lagrange.generalized_active_force(self.chain, q, loads)
            power = np.asarray(Q1 * u[0] + Q2 * u[1]).reshape(moments.shape)
            pieces = (half * weights * power).sum(axis=1)
            name = type(effect).__name__
            key = name if name not in found else f"{name} {number + 1}"
            total = np.concatenate([[0.0], np.cumsum(pieces)])
            found[key] = total[np.searchsorted(edges, self.t)]
        return found

    def save(self, path: str | PathLike[str]) -> None:
        """Write t, q and u to a .npz file (with what is known of them) or a .csv file."""
        file = Path(path)
        if file.suffix == ".npz":
            self._save_npz(file)
        elif file.suffix == ".csv":
            self._save_csv(file)
        else:
            raise SimulationError(f"{file}: the suffix is '{file.suffix}'; allowed are .npz, .csv")

    def _save_npz(self, file: Path) -> None:
        about = {
            "title": self.scene.title,
            "effects": self.effects,
            "accuracy": self.accuracy,
            "error": self.error,
            "holds_until": self.holds_until,
            "method": self.method,
            "formulation": self.formulation,
            "precision": self.precision,
            "statistics": asdict(self.statistics),
            "notes": self.notes,
            "events": [[event.time, event.what] for event in self.events],
        }
        with written_whole(file) as temporary, temporary.open("wb") as stream:
            np.savez(stream, t=self.t, q=self.q, u=self.u, about=json.dumps(about))

    def _save_csv(self, file: Path) -> None:
        with (
            written_whole(file) as temporary,
            temporary.open("w", newline="", encoding="utf-8") as stream,
        ):
            writer = csv.writer(stream)
            writer.writerow(["t_s", "q1_rad", "q2_rad", "u1_rad_per_s", "u2_rad_per_s"])
            writer.writerows(zip(self.t, *self.q, *self.u, strict=True))
