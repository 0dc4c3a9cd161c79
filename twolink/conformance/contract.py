"""The contract of an engine under test in Python.

    class MyEngine(Engine):
        name, version, reads = "mine", "1.0", ("parameters",)

        def load(self, model):
            self.chain = model.parameters

        def mass_matrix(self, angles):
            ...

Quantities are methods with the names of `twolink.conformance.quantities.QUANTITIES`; an engine
answers those that it has. `answer` gives it the messages of the protocol, in process or in a child.
"""

from __future__ import annotations

import traceback
import warnings
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.messages import (
    PROTOCOL,
    About,
    Answer,
    Ask,
    Effect,
    Errored,
    Loaded,
    Method,
    Model,
    Move,
    Moved,
    Precision,
    Reads,
    Refused,
    Request,
    Skipped,
    Start,
    Started,
    Understood,
    Values,
)
from twolink.conformance.quantities import QUANTITIES
from twolink.errors import EngineError, TwolinkError

Array = NDArray[np.float64]


class ModelRefusedError(EngineError):
    """The engine rejects a model."""


class CannotError(EngineError):
    """The engine cannot answer a question; its message says why."""


class Engine(ABC):
    """An engine under test.

    Arrays have a row for each state: angles (rad), speeds (rad/s), accelerations (rad/s²) and
    torques (N m) have shape (n, 2), and results (n, …) with the shape of the quantity.
    """

    name: str
    version: str = ""
    precision: Precision = "binary64"
    reads: tuple[Reads, ...] = ("urdf",)
    effects: tuple[Effect, ...] = ()
    methods: tuple[Method, ...] = ()
    issues: str = ""

    @abstractmethod
    def load(self, model: Model) -> Understood | None:
        """Load a model, and return what was understood of it.

        Raises `ModelRefusedError` for a model that the engine rejects.
        """

    def move(self, request: Move) -> Moved:
        """Return a motion of the model. Raises `CannotError` unless overridden."""
        raise CannotError(f"{self.name} does not simulate")


def about(engine: Engine) -> About:
    """Return an engine's capabilities."""
    return About(
        name=engine.name,
        version=engine.version,
        language="python",
        issues=engine.issues,
        precision=engine.precision,
        reads=engine.reads,
        answers=tuple(name for name in QUANTITIES if hasattr(engine, name)),
        effects=engine.effects,
        methods=engine.methods,
    )


def answer(engine: Engine, request: Request) -> Answer:
    """Return an engine's answer to a request; exceptions of the engine become answers."""
    if isinstance(request, Start):
        return Started(version=PROTOCOL, engine=about(engine))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if isinstance(request, Model):
                return Loaded(understood=engine.load(request), warnings=_each_once(caught))
            if isinstance(request, Move):
                return engine.move(request)
            return Values(
                seq=request.seq, values=_values(engine, request), warnings=_each_once(caught)
            )
        except Exception as error:
            return _failure(request, error)


def _values(engine: Engine, request: Ask) -> list[Any]:
    function = getattr(engine, request.quantity, None)
    if function is None or request.quantity not in QUANTITIES:
        raise CannotError(f"{engine.name} does not answer {request.quantity}")
    inputs = [
        np.array(getattr(request.states, name), dtype=float)
        for name in QUANTITIES[request.quantity].inputs
    ]
    return _worded(np.asarray(function(*inputs), dtype=float).tolist())


def _failure(request: Model | Ask | Move, error: Exception) -> Answer:
    """Return an exception as an answer."""
    if isinstance(request, Model):
        if isinstance(error, TwolinkError):
            return Refused(refused=str(error))
        return Refused(refused=f"{type(error).__name__}: {error}")
    if isinstance(error, CannotError):
        return Skipped(seq=request.seq, message=str(error))
    last = traceback.format_exception_only(error)[-1].strip()
    context = {"traceback": "".join(traceback.format_exception(error))}
    return Errored(seq=request.seq, message=last, context=context)


def _each_once(caught: Iterable[Any]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(f"{each.category.__name__}: {each.message}" for each in caught))


def _worded(value: Any) -> Any:
    """Return nested lists with NaN and infinities as the strings of the protocol."""
    if isinstance(value, list):
        return [_worded(entry) for entry in value]
    return value if np.isfinite(value) else str(value)
