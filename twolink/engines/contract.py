"""The contract of an engine: its package, its capabilities, and its answers.

    class MyEngine(Engine):
        name, version, reads = "mine", "1.0", ("parameters",)

        def load(self, model):
            self.chain = model.parameters

        def mass_matrix(self, angles):
            ...

An engine has a method for each quantity that it answers, with the name and the inputs that
`twolink.engines.quantities.QUANTITIES` has for it, and overrides `move` if it simulates.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from twolink.engines.faults import CannotError
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
from twolink.engines.scenes import parameters_of
from twolink.errors import EngineError

if TYPE_CHECKING:
    from twolink.scene import Scene

Array = NDArray[np.float64]


class Engine(ABC):
    """A dynamics engine.

    `packages` are its requirements, pairs of a distribution's name and a module's name, the
    engine's own first; `extra` is the extra of this project that installs them, or None if they are
    dependencies. `reads` are the kinds of model, the preferred one first; `effects` those that
    forward and inverse dynamics and motions include beside rigid bodies and gravity.

    Arrays have a row for each state: angles (rad), speeds (rad/s), accelerations (rad/s²) and
    torques (N m) have shape (n, 2), and results (n, …) with the shape of the quantity.
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
        """The quantities that the engine answers: those of its methods."""
        return tuple(name for name in QUANTITIES if hasattr(type(self), name))

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
        """Load a model, and return its parameters as the engine has read them.

        Raises `ModelRefusedError` for a model that the engine rejects.
        """

    def unsupported(self, scene: Scene) -> str | None:
        """Return why the engine cannot simulate a scene, or None if it can, by its capabilities."""
        if "scene" in self.reads:
            return None
        if not self.methods or "parameters" not in self.reads:
            return "the engine has no motions of parameters"
        try:
            _, needs = parameters_of(scene)
        except EngineError as error:
            return str(error)
        missing = [effect for effect in needs if effect not in self.effects]
        return f"the engine does not have {' and '.join(missing)}" if missing else None

    def evaluate(self, quantity: str, states: Mapping[str, Array]) -> Array:
        """Return a quantity in states, which have its inputs. Raises `CannotError`."""
        if quantity not in self.answers:
            raise CannotError(f"{self.name} does not answer {quantity}")
        return self._evaluated(quantity, [states[name] for name in QUANTITIES[quantity].inputs])

    def _evaluated(self, quantity: str, inputs: Sequence[Array]) -> Array:
        return _real(quantity, getattr(self, quantity)(*inputs))

    def move(self, request: Move) -> Moved:
        """Return a motion of the model."""
        raise CannotError(f"{self.name} does not simulate")


# What NumPy would convert to a number without a word, in an array of Python's objects.
_NO_NUMBERS = (str, bytes, bool, complex, NoneType)


def _real(quantity: str, values: Any) -> Array:
    """Return an engine's values as an array. Raises `EngineError` for other than real numbers."""
    found = np.asanyarray(values)
    if np.ma.is_masked(found):
        got = "masked ones"
    elif found.dtype.kind == "O":
        wrong = (type(x).__name__ for x in found.flat if isinstance(x, _NO_NUMBERS))
        got = next(wrong, "")
    else:
        got = "" if found.dtype.kind in "fiu" else found.dtype.name
    if got:
        raise EngineError(f"values of {quantity} must be real numbers; got {got}")
    return np.asarray(found, dtype=float)
