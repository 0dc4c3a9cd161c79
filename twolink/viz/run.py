"""A run for pictures: its name, and its states on a grid of times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twolink import kinematics, lagrange
from twolink.chain import Chain
from twolink.effects import potential_energy
from twolink.errors import SimulationError
from twolink.simulation import Trajectory
from twolink.viz.motion import States, resolution, states_of
from twolink.viz.shapes import Array

# Impacts below this part of the largest impulse have no visible effect on a trail.
_SEEN = 1e-3

# Between two points of a trail a link turns by this angle (rad) at most, unless there would be more
# points than this between two frames.
_TURN, _MOST_BETWEEN = 0.12, 24

TRAIL_RATE = 90
"""The least number of points of a trail in a second, of the film or of the motion."""


def points_of_a_frame(fps: float) -> tuple[int, int]:
    """Return the least and the largest number of points of a trail from one frame to the next."""
    least = max(1, round(TRAIL_RATE / fps))
    return least, max(least, _MOST_BETWEEN)


@dataclass(frozen=True)
class Run:
    """A trajectory with its name in the picture."""

    name: str
    trajectory: Trajectory

    @property
    def chain(self) -> Chain:
        """The moving chain."""
        return self.trajectory.chain

    @property
    def reach(self) -> float:
        """The largest possible distance of D from A (m)."""
        return float(sum(self.chain.length))

    @property
    def duration(self) -> float:
        """The duration of the motion (s)."""
        return float(self.trajectory.t[-1] - self.trajectory.t[0])

    @cached_property
    def states(self) -> States:
        """The function of times (s) for q and u."""
        return states_of(self.trajectory)

    @cached_property
    def _resolution(self) -> float:
        return self.reach * resolution(self.trajectory)

    @property
    def is_sampled(self) -> bool:
        """Whether its states between samples are interpolated."""
        return self._resolution > 0

    def resolution(self, time: float) -> float:
        """Return the error of its points at a time (s) between samples (m)."""
        near = np.abs(self.trajectory.t - time).min()
        return 0.0 if near <= 1e-12 * self.duration else self._resolution

    def at(self, times: Array) -> Moments:
        """Return the run at times (s)."""
        q, u = self.states(times)
        return Moments(self, times, q, u)

    def friction(self, number: int, time: float) -> float | None:
        """Return the friction force (N) at the contact of this number at a time (s).

        It is None for a trajectory that is known only at its samples.
        """
        try:
            force = self.trajectory.contact_forces([time])[number].tangential
        except SimulationError:
            return None
        return None if force is None else abs(float(force[0]))

    def moments(self, frames: Array, fps: float) -> Moments:
        """Return the states at the times of frames (s), between them, and at impacts.

        There are as many times between frames that no link turns visibly, within
        `points_of_a_frame`.
        """
        least, most = points_of_a_frame(fps)
        _, u = self.states(frames)
        fastest = np.abs(u).max(axis=0)
        turned = np.maximum(fastest[:-1], fastest[1:]) * np.diff(frames)
        counts = np.clip(np.ceil(turned / _TURN), least, most).astype(int)
        between = np.concatenate(
            [
                start + length * np.arange(count) / count
                for start, length, count in zip(frames, np.diff(frames), counts, strict=False)
            ]
            or [np.empty(0)]
        )
        impulses = np.array([impact.normal_impulse for impact in self.trajectory.impacts])
        felt = np.abs(impulses) >= _SEEN * np.abs(impulses).max(initial=0.0)
        struck = np.array([impact.time for impact in self.trajectory.impacts])[felt]
        return self.at(np.union1d([*between, frames[-1]], struck[struck <= frames[-1]]))


@dataclass(frozen=True)
class Moments:
    """A run at times (s): angles q (rad) and speeds u (rad/s), each of shape (2, n)."""

    run: Run
    times: Array
    q: Array
    u: Array

    def point(self, name: str) -> Array:
        """Return the positions of A, B or D (m), shape (n, 2)."""
        if name == "A":
            return np.zeros((len(self.times), 2))
        chain = self.run.chain
        place = kinematics.position(chain, tuple(self.q), getattr(chain, name))
        return np.column_stack(np.broadcast_arrays(*place))

    @cached_property
    def end(self) -> Array:
        """The positions of D (m), shape (n, 2)."""
        return self.point("D")

    @cached_property
    def kinetic_energy(self) -> Array:
        """T (J), shape (n,)."""
        chain = self.run.chain
        return np.asarray(lagrange.kinetic_energy(chain, tuple(self.q), tuple(self.u)))

    @cached_property
    def potential_energy(self) -> Array:
        """V (J) of all effects with a potential, shape (n,)."""
        V = potential_energy(self.run.trajectory.scene.effects, self.run.chain, tuple(self.q))
        return np.asarray(V + np.zeros_like(self.times))

    def at(self, time: float) -> Moments:
        """Return the run at one time (s), without evaluation if the time is on the grid."""
        index = int(np.searchsorted(self.times, time))
        if index < len(self.times) and self.times[index] == time:
            return self.only(index)
        return self.run.at(np.array([time]))

    def only(self, index: int) -> Moments:
        """Return the run at one index of its times."""
        return self._part(slice(index, index + 1))

    def between(self, start: float, end: float) -> Moments:
        """Return the run at its times (s) after `start` and before `end`."""
        first, last = np.searchsorted(self.times, [start, end], side="left")
        return self._part(slice(int(first), int(last)))

    def _part(self, part: slice) -> Moments:
        return Moments(self.run, self.times[part], self.q[:, part], self.u[:, part])
