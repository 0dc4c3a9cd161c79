"""A Python engine's answers to the messages of the protocol, in process or in a child."""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Iterable

from pydantic import ValidationError

from twolink.engines.contract import Engine
from twolink.engines.faults import CannotError
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
    sentence_of,
)
from twolink.errors import EngineError, TwolinkError


def about(engine: Engine) -> About:
    """Return an engine's capabilities. Raises `EngineError` for those of a wrong type."""
    try:
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
    except ValidationError as error:
        raise EngineError(f"{type(engine).__name__}: {sentence_of(error)}") from error


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
                return Loaded(understood=engine.load(request), warnings=_each_once(caught))
            if isinstance(request, Move):
                moved = engine.move(request)
                warned = (*moved.warnings, *_each_once(caught))
                return moved.model_copy(update={"warnings": warned})
            values = engine.evaluate(request.quantity, request.states.arrays()).tolist()
            return Values(seq=request.seq, values=values, warnings=_each_once(caught))
        except MemoryError:
            # The process ends, and its parent reports the fault.
            raise
        except (Exception, SystemExit) as error:
            # Some bindings exit where an assertion fails.
            return _failure(request, error)


def _each_once(captured: Iterable[warnings.WarningMessage]) -> tuple[str, ...]:
    """Return captured Python warnings as sentences, without duplicates."""
    return tuple(dict.fromkeys(f"{each.category.__name__}: {each.message}" for each in captured))


def _failure(request: Model | Ask | Move, error: BaseException) -> Answer:
    """Return an exception as an answer."""
    if isinstance(request, Model):
        return Refused(refused=_sentence(error))
    if isinstance(error, CannotError):
        return Skipped(seq=request.seq, message=str(error), issue_url=error.link)
    context = {"traceback": "".join(traceback.format_exception(error))}
    return Errored(seq=request.seq, message=_sentence(error), context=context)


def _sentence(error: BaseException) -> str:
    """Return an exception's message, with its type unless it is written for users."""
    if isinstance(error, ValidationError):
        return sentence_of(error)
    said, kind = str(error), type(error).__name__
    if said and isinstance(error, TwolinkError):
        return said
    return f"{kind}: {said}" if said else kind
