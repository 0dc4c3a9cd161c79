"""A Python engine's answers to the messages of the protocol, in process or in a child.

Authors of engines import the contract from here: `Engine`, its errors, and its arrays.
"""

from __future__ import annotations

import traceback
import warnings
from typing import Any

import numpy as np

from twolink.engines.contract import Array, CannotError, Engine, ModelRefusedError
from twolink.engines.messages import (
    PROTOCOL,
    About,
    Answer,
    Ask,
    Errored,
    Loaded,
    Model,
    Move,
    Refused,
    Request,
    Skipped,
    Start,
    Started,
    Values,
)
from twolink.engines.quantities import QUANTITIES
from twolink.engines.sandbox import each_once
from twolink.errors import TwolinkError

__all__ = ["Array", "CannotError", "Engine", "ModelRefusedError", "about", "answer"]


def about(engine: Engine) -> About:
    """Return an engine's capabilities."""
    return About(
        name=engine.name,
        version=engine.version,
        language="python",
        issues=engine.issues,
        precision=engine.precision,
        reads=engine.reads,
        answers=engine.answers,
        effects=engine.effects,
        methods=engine.methods,
    )


def answer(engine: Engine, request: Request) -> Answer:
    """Return an engine's answer to a request; exceptions of the engine become answers.

    Raises `EngineError` for an engine that does not start.
    """
    if isinstance(request, Start):
        engine.start()
        return Started(version=PROTOCOL, engine=about(engine))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if isinstance(request, Model):
                return Loaded(understood=engine.load(request), warnings=each_once(caught))
            if isinstance(request, Move):
                return engine.move(request)
            return Values(
                seq=request.seq, values=_values(engine, request), warnings=each_once(caught)
            )
        except Exception as error:
            return _failure(request, error)


def _values(engine: Engine, request: Ask) -> list[Any]:
    if request.quantity not in engine.answers:
        raise CannotError(f"{engine.name} does not answer {request.quantity}")
    inputs = [
        np.array(getattr(request.states, name), dtype=float)
        for name in QUANTITIES[request.quantity].inputs
    ]
    found = getattr(engine, request.quantity)(*inputs)
    return _worded(np.asarray(found, dtype=float).tolist())


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


def _worded(value: Any) -> Any:
    """Return nested lists with NaN and infinities as the strings of the protocol."""
    if isinstance(value, list):
        return [_worded(entry) for entry in value]
    return value if np.isfinite(value) else str(value)
