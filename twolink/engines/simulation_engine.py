"""Base classes of external engines that simulate a chain with their own integrators.

States are passed and returned in absolute angles. Coordinates and equations inside the engine are
its own.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Literal

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.engines.approximation import changed, smooth_part
from twolink.engines.joint_model import JointModel, at_state, why_not
from twolink.engines.protocol import Array
from twolink.errors import EngineError
from twolink.scene import Scene


@dataclass(frozen=True)
class EngineRun:
    """A motion at the requested times, and its cost.

    `q` (rad) and `u` (rad/s) are absolute, shape (2, n). `seconds` is the time of the run without
    set-up; `setup_seconds` that of building models, tracing and compiling. `evaluations` of the
    rates and `steps` are None if the engine does not report them. `warnings` are the engine's.
    """

    q: Array
    u: Array
    seconds: float
    setup_seconds: float
    evaluations: int | None = None
    steps: int | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class EngineMethod:
    """An integrator of an engine: its declared order (None if it varies) and its parameter.

    With "step" the parameter is the longest step (s), which is shortened to divide the time between
    two samples; with "tolerance" it is the engine's tolerance or accuracy.
    """

    name: str
    order: int | None
    parameter: Literal["step", "tolerance"]


Prepared = Callable[[float, Array], EngineRun]
"""Runs a scene, given the parameter's value and increasing times (s) that start with 0."""


class SimulationEngine(ABC):
    """An external engine with its own integrators.

    `name` is the engine's, such as "MuJoCo", and `methods` are its integrators. `packages` are its
    requirements, pairs of a distribution's name and a module's name, the engine's own first;
    `extra` is the extra of this project that installs them, or None if they are dependencies.
    `expresses` are the fields of a `JointModel` that it supports; `reasons` explain the missing
    ones, by the name of an effect or a field.
    """

    name: str
    methods: tuple[EngineMethod, ...]
    packages: tuple[tuple[str, str], ...]
    extra: str | None = "engines"
    expresses: frozenset[str] = frozenset()
    reasons: Mapping[str, str] = MappingProxyType({})

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

    def version(self) -> str:
        """Return the versions of all packages, the engine's first."""
        return ", ".join(importlib.metadata.version(package) for package, _ in self.packages)

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot express a scene, or None if it can."""
        return why_not(scene, self.name, self.expresses, self.reasons)

    def prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a scene by a method, with the set-up done.

        Raises `EngineError` for a scene that the engine cannot express or rejects; the returned
        function raises it if the engine fails.
        """
        self._check(scene, method)
        return self._prepared(scene, method)

    def accelerations(
        self,
        chain: Chain,
        q: Pair,
        u: Pair,
        *,
        gravity: Pair = (0.0, 9.81),
        torque: Pair = (0.0, 0.0),
    ) -> Pair:
        """Return du (rad/s²) at a state, by the engine's own forward dynamics.

        `gravity` (m/s²) is along x and y, `torque` (N m) that of the motors at A and B. Raises
        `EngineError` if the engine rejects the chain.
        """
        self._check_installed()
        return self._accelerations(at_state(chain, q, u, gravity, torque))

    def _check(self, scene: Scene, method: str) -> None:
        """Raise `EngineError` for a missing package, an unknown method or an unsupported scene."""
        self._check_installed()
        if method not in {each.name for each in self.methods}:
            allowed = ", ".join(each.name for each in self.methods)
            raise EngineError(f"{self.name}: method must be one of {allowed}; got '{method}'")
        sentence = self.unsupported(scene)
        if sentence:
            raise EngineError(sentence)

    def _check_installed(self) -> None:
        sentence = self.missing()
        if sentence:
            raise EngineError(sentence)

    @abstractmethod
    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return a function that runs a supported scene."""

    @abstractmethod
    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model."""


class ApproximatingEngine(SimulationEngine):
    """An engine that approximates friction, stops and surfaces by its own laws.

    `changes` are these laws, by the name of the effect.
    """

    changes: Mapping[str, str]

    def changed(self, scene: Scene) -> tuple[str, ...]:
        """Return descriptions of the changes that the approximation makes to a scene."""
        return changed(scene, self.changes)

    def prepared(self, scene: Scene, method: str, *, approximate: bool = False) -> Prepared:
        """Return a function that runs a scene; with `approximate`, also an approximated one."""
        self._check(smooth_part(scene) if approximate else scene, method)
        return self._prepared(scene, method)


def stretches(times: Array, longest: float) -> Iterator[tuple[int, float]]:
    """Yield the number of equal steps between successive times (s) and their size (s)."""
    for earlier, later in pairwise(times.tolist()):
        count = max(1, int(np.ceil((later - earlier) / longest * (1 - 1e-12))))
        yield count, (later - earlier) / count


@contextmanager
def captured_warnings() -> Iterator[list[str]]:
    """Collect the Python warnings issued in the block, without duplicates."""
    found: list[str] = []
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        try:
            yield found
        finally:
            found += dict.fromkeys(str(warning.message) for warning in given)
