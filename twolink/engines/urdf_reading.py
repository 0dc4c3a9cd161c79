"""Simulators with a URDF reader of their own."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection
from typing import Any, Protocol

import numpy as np

from twolink.engines.contract import Array
from twolink.engines.faults import ModelRefusedError
from twolink.engines.messages import Model
from twolink.engines.simulation_engine import SimulationEngine


class ReadChain(Protocol):
    """A chain as an engine has read it; arrays as in `twolink.engines.contract.Engine`."""

    def mass_matrix(self, angles: Array) -> Array:
        """Return M over the joint angles (kg m²)."""

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the joint accelerations (rad/s²), with the resistance that the file has."""


class UrdfReadingEngine(SimulationEngine):
    """A simulator that answers for the chain of a URDF; parameters are written as one."""

    reads = (*SimulationEngine.reads, "urdf")

    def load(self, model: Model) -> None:
        """Read a URDF by the engine's own reader; keep the chain of another model."""
        self._given, self._file = None, None
        if model.urdf is None:
            super().load(model)
        else:
            self._file = self._read(model)

    def mass_matrix(self, angles: Array) -> Array:
        """Return the engine's M; the chain of parameters is written as a URDF."""
        return self._chain_read().mass_matrix(angles)

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the engine's accelerations, those of parameters without resistance."""
        self._check_rigid()
        return self._chain_read().forward_dynamics(angles, speeds, torques)

    def _chain_read(self) -> ReadChain:
        if self._file is None:
            gravity, joints = (0.0, 0.0, -self._gravity()), ("joint1", "joint2")
            written = self._chain.to_urdf()
            self._file = self._read(Model(id="", urdf=written, gravity=gravity, joints=joints))
        return self._file

    @abstractmethod
    def _read(self, model: Model) -> ReadChain:
        """Return the chain of a URDF. Raises `ModelRefusedError`."""


def check_joints(model: Model, count: int, names: Collection[str]) -> tuple[str, str]:
    """Return the names of both joints.

    Raises `ModelRefusedError` unless an engine that read the model has two degrees of freedom
    (`count`), those of the joints.
    """
    wanted = model.joints
    assert wanted is not None
    if count != 2:
        raise ModelRefusedError(f"{count} degrees of freedom")
    if not set(wanted) <= set(names):
        raise ModelRefusedError(f"the joints that move are {', '.join(sorted(names))}")
    return wanted


def each(function: Any, *rows: Array) -> Array:
    """Return the values of a function of states, state by state."""
    return np.array([function(*state) for state in zip(*rows, strict=True)])
