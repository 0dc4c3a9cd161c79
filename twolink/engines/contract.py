"""The contract of an engine: its package, its capabilities, and its answers.

    class MyEngine(Engine):
        name, version, reads = "mine", "1.0", ("parameters",)

        def load(self, model):
            self.chain = model.parameters

        def mass_matrix(self, angles):
            ...

An engine overrides the quantities that it answers, and `move` if it simulates.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from twolink.engines.messages import (
    Effect,
    Method,
    Model,
    Move,
    Moved,
    Precision,
    Reads,
    Understood,
)
from twolink.engines.quantities import QUANTITIES
from twolink.errors import EngineError

Array = NDArray[np.float64]


class ModelRefusedError(EngineError):
    """The engine rejects a model."""


class CannotError(EngineError):
    """The engine cannot answer a question; its message says why."""


class Engine(ABC):
    """A dynamics engine.

    `packages` are its requirements, pairs of a distribution's name and a module's name, the
    engine's own first; `extra` is the extra of this project that installs them, or None if they are
    dependencies. `reads` are the kinds of model, the preferred one first; `effects` those that
    forward and inverse dynamics and motions include beside rigid bodies and gravity.

    Arrays have a row for each state: angles (rad), speeds (rad/s), accelerations (rad/s²) and
    torques (N m) have shape (n, 2), and results (n, …) with the shape of the quantity, see
    `twolink.engines.quantities.QUANTITIES`. A quantity that is not overridden raises `CannotError`.
    """

    name: str
    packages: tuple[tuple[str, str], ...] = ()
    extra: str | None = None
    issues: str = ""
    precision: Precision = "binary64"
    reads: tuple[Reads, ...] = ("urdf",)
    effects: tuple[Effect, ...] = ()
    methods: tuple[Method, ...] = ()

    @property
    def version(self) -> str:
        """The versions of all packages, the engine's first."""
        return ", ".join(importlib.metadata.version(package) for package, _ in self.packages)

    @property
    def answers(self) -> tuple[str, ...]:
        """The quantities that the engine answers: those it overrides."""
        own = type(self)
        return tuple(name for name in QUANTITIES if getattr(own, name) is not getattr(Engine, name))

    def missing(self) -> str | None:
        """Return a sentence with the missing package and its installation, or None."""
        for package, module in self.packages:
            if importlib.util.find_spec(module) is None:
                wanted = f"'twolink[{self.extra}]'" if self.extra else package
                return (
                    f"{self.name} needs {package}, which is not installed; install it with "
                    f"pip install {wanted}"
                )
        return None

    def check_installed(self) -> None:
        """Raise `EngineError` for a missing package."""
        sentence = self.missing()
        if sentence:
            raise EngineError(sentence)

    def start(self) -> None:  # noqa: B027 - most engines have nothing to do
        """Get ready to answer, in the process that answers. Raises `EngineError`."""

    @abstractmethod
    def load(self, model: Model) -> Understood | None:
        """Load a model, and return what was understood of it.

        Raises `ModelRefusedError` for a model that the engine rejects.
        """

    def mass_matrix(self, angles: Array) -> Array:
        """Return M over the joint angles (kg m²)."""
        raise self._cannot("mass_matrix")

    def velocity_terms(self, angles: Array, speeds: Array) -> Array:
        """Return C θ̇ (N m), without gravity."""
        raise self._cannot("velocity_terms")

    def gravity_terms(self, angles: Array) -> Array:
        """Return ∂V/∂θ (N m)."""
        raise self._cannot("gravity_terms")

    def inverse_dynamics(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return the joint torques (N m) under gravity."""
        raise self._cannot("inverse_dynamics")

    def forward_dynamics(self, angles: Array, speeds: Array, torques: Array) -> Array:
        """Return the joint accelerations (rad/s²) under gravity."""
        raise self._cannot("forward_dynamics")

    def kinetic_energy(self, angles: Array, speeds: Array) -> Array:
        """Return T (J)."""
        raise self._cannot("kinetic_energy")

    def potential_energy(self, angles: Array) -> Array:
        """Return V (J), up to a constant."""
        raise self._cannot("potential_energy")

    def position(self, angles: Array) -> Array:
        """Return the position of D (m)."""
        raise self._cannot("position")

    def velocity(self, angles: Array, speeds: Array) -> Array:
        """Return the velocity of D (m/s)."""
        raise self._cannot("velocity")

    def acceleration(self, angles: Array, speeds: Array, accelerations: Array) -> Array:
        """Return the acceleration of D (m/s²)."""
        raise self._cannot("acceleration")

    def jacobian(self, angles: Array) -> Array:
        """Return ∂D/∂θ (m): rows are components, columns joint angles."""
        raise self._cannot("jacobian")

    def move(self, request: Move) -> Moved:
        """Return a motion of the model."""
        raise CannotError(f"{self.name} does not simulate")

    def _cannot(self, quantity: str) -> CannotError:
        return CannotError(f"{self.name} does not answer {quantity}")
