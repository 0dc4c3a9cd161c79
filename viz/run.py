"""A run as a picture sees it: its name and colour, and its states on a grid of times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twolink import kinematics, lagrange
from twolink.chain import Chain
from twolink.simulation import Trajectory
from viz.motion import States, resolution, states_of
from viz.shapes import Array

# An impact of less than this part of the largest impulse bends no trail that can be seen.
_SEEN = 1e-3


@dataclass(frozen=True)
class Run:
    """A trajectory with the name that the picture gives it."""

    name: str
    trajectory: Trajectory

    @property
    def chain(self) -> Chain:
        """The chain that moves."""
        return self.trajectory.chain

    @property
    def reach(self) -> float:
        """How far D can be from A (m)."""
        return float(sum(self.chain.length))

    @property
    def duration(self) -> float:
        """How long it moves (s)."""
        return float(self.trajectory.t[-1] - self.trajectory.t[0])

    @cached_property
    def states(self) -> States:
        """What gives q and u at times (s)."""
        return states_of(self.trajectory)

    @cached_property
    def _resolution(self) -> float:
        return self.reach * resolution(self.trajectory)

    def resolution(self, time: float) -> float:
        """Return how far its points may be off at a time (s) that is between samples (m)."""
        near = np.abs(self.trajectory.t - time).min()
        return 0.0 if near <= 1e-12 * self.duration else self._resolution

    def at(self, times: Array) -> Moments:
        """Return the run at times (s)."""
        q, u = self.states(times)
        return Moments(self, times, q, u)

    def moments(self, frames: Array, finer: int) -> Moments:
        """Return the states at the times of frames (s), `finer` times as often, and at impacts."""
        parts = np.arange(finer) / finer
        between = frames[:-1, None] + np.diff(frames)[:, None] * parts
        impulses = np.array([impact.normal_impulse for impact in self.trajectory.impacts])
        felt = np.abs(impulses) >= _SEEN * np.abs(impulses).max(initial=0.0)
        struck = np.array([impact.time for impact in self.trajectory.impacts])[felt]
        return self.at(np.union1d([*between.ravel(), frames[-1]], struck[struck <= frames[-1]]))


@dataclass(frozen=True)
class Moments:
    """A run at times (s): angles q (rad) and speeds u (rad/s), each of shape (2, n)."""

    run: Run
    times: Array
    q: Array
    u: Array

    def point(self, name: str) -> Array:
        """Return where A, B or D is (m), shape (n, 2)."""
        if name == "A":
            return np.zeros((len(self.times), 2))
        chain = self.run.chain
        place = kinematics.position(chain, tuple(self.q), getattr(chain, name))
        return np.column_stack(np.broadcast_arrays(*place))

    @cached_property
    def end(self) -> Array:
        """Where D is (m), shape (n, 2)."""
        return self.point("D")

    @cached_property
    def kinetic_energy(self) -> Array:
        """T (J), shape (n,)."""
        chain = self.run.chain
        return np.asarray(lagrange.kinetic_energy(chain, tuple(self.q), tuple(self.u)))

    @cached_property
    def potential_energy(self) -> Array:
        """V (J) of the effects that have one, shape (n,)."""
        energies = [
            effect.potential_energy(self.run.chain, tuple(self.q))
            for effect in self.run.trajectory.scene.effects
            if hasattr(effect, "potential_energy")
        ]
        return np.asarray(sum(energies, np.zeros_like(self.times)))

    def at(self, time: float) -> Moments:
        """Return the run at one time (s); at one of those that are known, without computing it."""
        index = int(np.searchsorted(self.times, time))
        if index < len(self.times) and self.times[index] == time:
            return self.only(index)
        return self.run.at(np.array([time]))

    def only(self, index: int) -> Moments:
        """Return the run at the time of a number."""
        return self._part(slice(index, index + 1))

    def between(self, start: float, end: float) -> Moments:
        """Return the run at those of its times (s) that are after `start` and before `end`."""
        first, last = np.searchsorted(self.times, [start, end], side="left")
        return self._part(slice(int(first), int(last)))

    def _part(self, part: slice) -> Moments:
        return Moments(self.run, self.times[part], self.q[:, part], self.u[:, part])
