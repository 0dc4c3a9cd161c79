"""What a peer is: somebody else's engine that moves a chain by its own integrator.

States go in and come out in the source's absolute angles. What the engine computes in between, in
what coordinates and with which equations, is its own.
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
from twolink.engines.joint_model import JointModel, at_state, why_not
from twolink.engines.nearest import changed, smooth_part
from twolink.engines.protocol import Array
from twolink.errors import EngineError
from twolink.scene import Scene


@dataclass(frozen=True)
class PeerRun:
    """A motion at the times that were asked for, and what it cost.

    `q` (rad) and `u` (rad/s) are absolute, shape (2, n). `seconds` is the run itself, without
    set-up; `setup_seconds` the building of models, tracing and compiling. `evaluations` of the
    rates and `steps` are None where the engine does not tell. `warnings` are what it said itself.
    """

    q: Array
    u: Array
    seconds: float
    setup_seconds: float
    evaluations: int | None = None
    steps: int | None = None
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class PeerMethod:
    """An integrator of a peer: its declared order (None if that varies), and what refines it.

    With a `step` the knob is the longest step (s), which is shortened to divide the time between
    two samples; with a `tolerance` it is whatever the engine calls its tolerance or accuracy.
    """

    name: str
    order: int | None
    knob: Literal["step", "tolerance"]


Prepared = Callable[[float, Array], PeerRun]
"""Runs a scene: knob value, and increasing times (s) of which the first is 0."""


class Peer(ABC):
    """Somebody else's engine, with integrators of its own.

    `name` is the engine's, such as "MuJoCo", and `methods` are its integrators. `packages` are what
    it needs, pairs of a distribution's name and the module to look for, the engine's own first;
    `extra` is the extra of this project that has them, or None where they come with it.
    `expresses` are the fields of a `JointModel` that it has a place for, and `reasons` say why not,
    by the name of an effect or of a field.
    """

    name: str
    methods: tuple[PeerMethod, ...]
    packages: tuple[tuple[str, str], ...]
    extra: str | None = "engines"
    expresses: frozenset[str] = frozenset()
    reasons: Mapping[str, str] = MappingProxyType({})

    def missing(self) -> str | None:
        """Return the sentence that it is not installed, and how to install it; None if it is."""
        for package, module in self.packages:
            if importlib.util.find_spec(module) is None:
                wanted = f"'twolink[{self.extra}]'" if self.extra else package
                return (
                    f"{self.name} needs {package}, which is not installed; allowed is to "
                    f"install it: pip install {wanted}"
                )
        return None

    def version(self) -> str:
        """Return the versions of all packages, the engine's first."""
        return ", ".join(importlib.metadata.version(package) for package, _ in self.packages)

    def cannot(self, scene: Scene) -> str | None:
        """Return the sentence that says why it cannot express a scene; None if it can."""
        return why_not(scene, self.name, self.expresses, self.reasons)

    def prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene by one of the methods, with all set-up done that can be.

        Raises `EngineError` for a scene that it cannot express or that the engine refuses; what is
        returned raises it where the engine gives up.
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
        `EngineError` where the engine refuses the chain.
        """
        self._check_installed()
        return self._accelerations(at_state(chain, q, u, gravity, torque))

    def _check(self, scene: Scene, method: str) -> None:
        """Raise `EngineError` for what is missing, no method, or cannot be expressed."""
        self._check_installed()
        if method not in {each.name for each in self.methods}:
            allowed = ", ".join(each.name for each in self.methods)
            raise EngineError(f"{self.name}: method is '{method}'; allowed are {allowed}")
        sentence = self.cannot(scene)
        if sentence:
            raise EngineError(sentence)

    def _check_installed(self) -> None:
        sentence = self.missing()
        if sentence:
            raise EngineError(sentence)

    @abstractmethod
    def _prepared(self, scene: Scene, method: str) -> Prepared:
        """Return what runs a scene that it can express."""

    @abstractmethod
    def _accelerations(self, model: JointModel) -> Pair:
        """Return du (rad/s²) at the start of a model."""


class NearestPeer(Peer):
    """A peer that can run friction, stops and surfaces by laws of its own that are near to them.

    `changes` are these laws, by the name of the effect.
    """

    changes: Mapping[str, str]

    def changed(self, scene: Scene) -> tuple[str, ...]:
        """Return what it changes of a scene when it takes the nearest that it has, in words."""
        return changed(scene, self.changes)

    def prepared(self, scene: Scene, method: str, *, nearest: bool = False) -> Prepared:
        """Return what runs a scene; with `nearest`, also one that it cannot express as it is."""
        self._check(smooth_part(scene) if nearest else scene, method)
        return self._prepared(scene, method)


def stretches(times: Array, longest: float) -> Iterator[tuple[int, float]]:
    """Yield, between each two times (s), the number of equal steps and their size (s)."""
    for earlier, later in pairwise(times.tolist()):
        count = max(1, int(np.ceil((later - earlier) / longest * (1 - 1e-12))))
        yield count, (later - earlier) / count


@contextmanager
def heard() -> Iterator[list[str]]:
    """Collect the warnings that Python code gives meanwhile, each once."""
    found: list[str] = []
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        try:
            yield found
        finally:
            found += dict.fromkeys(str(warning.message) for warning in given)
