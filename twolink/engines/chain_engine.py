"""An engine with a chain loaded, as `verify` compares it with the formulations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from twolink.engines.contract import Array, Engine
from twolink.engines.faults import ModelRefusedError
from twolink.engines.messages import Model
from twolink.engines.quantities import QUANTITIES
from twolink.urdf import PlanarUrdf


@dataclass(frozen=True)
class Sizes:
    """Spatial sizes in an engine's computation: levers (m) and inertias (kg m²)."""

    radius: tuple[float, float]
    length: float
    inertia: tuple[float, float]
    tip: float
    origin: float


class ChainEngine(ABC):
    """An engine that has loaded a chain's URDF, in the frame of the chain.

    States are arrays of shape (2, n) in the URDF's joint angles θ (rad), speeds (rad/s),
    accelerations (rad/s²) and torques (N m); results have the states along their last axis. Vectors
    are x and y components in the chain's frame, positions are relative to A, and the potential
    energy (J) is zero with both mass centres level with A.
    """

    roundings: int
    """The largest number of operations on any path from a state to a result."""

    contact_roundings = 0
    """The same, if constraint forces are solved for as well."""

    def __init__(self, urdf: PlanarUrdf, engine: Engine) -> None:
        """Load the same text as the URDF reader.

        Raises `EngineError` when the engine is missing or rejects the file.
        """
        self.engine = engine
        # x and y of the chain's frame as rows, for vectors in the root link's frame.
        self._plane, self._origin = np.array(urdf.axes[:2]), np.array(urdf.origin)
        x, y, z = (float(entry) for entry in urdf.gravity * np.array(urdf.axes[1]))
        first, second = urdf.joint_names
        try:
            engine.load(
                Model(
                    id=urdf.path,
                    urdf=urdf.xml,
                    gravity=(x, y, z),
                    joints=(first, second),
                    tip=urdf.tip,
                )
            )
        except ModelRefusedError as error:
            said = f"{urdf.path}: {engine.name} rejects the file: {error}"
            raise ModelRefusedError(said) from error

    @property
    def name(self) -> str:
        """The engine's name and version."""
        return f"{self.engine.name} {self.engine.version}"

    @property
    @abstractmethod
    def sizes(self) -> Sizes:
        """The sizes of the numbers that the engine computes with."""

    def evaluate(self, quantity: str, **states: Array) -> Array:
        """Return a quantity of the contract of engines, with the states along the last axis."""
        given = {name: rows.T for name, rows in states.items()}
        found = self.engine.evaluate(quantity, given)
        if QUANTITIES[quantity].up_to_constant:
            found = found - self._zero()
        if QUANTITIES[quantity].vector:
            found = in_plane(found, self._plane, self._origin if quantity == "position" else None)
        return columns(found)

    def _zero(self) -> float:
        """Return the engine's V (J) with both mass centres level with A."""
        # The mean of two poses that are half a turn apart.
        poses = np.array([[0.0, 0.0], [np.pi, 0.0]])
        return float(self.engine.evaluate("potential_energy", {"angles": poses}).mean())


def in_plane(vectors: Array, plane: Array, origin: Array | None = None) -> Array:
    """Return components along the rows of a plane of vectors (n, 3, …), or of places from a point.

    The result has shape (n, 2, …).
    """
    if origin is not None:
        vectors = vectors - origin
    return np.einsum("pw,nw...->np...", plane, vectors)


def columns(rows: Array) -> Array:
    """Return values with the states along the last axis."""
    return np.moveaxis(rows, 0, -1)
