"""Check of an engine's adapter, message by message, before its numbers are judged."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.conformance.capabilities import mistake_in
from twolink.conformance.judge import judged
from twolink.conformance.suites import suite
from twolink.conformance.vectors import Group, Vector
from twolink.engines.contract import Array
from twolink.engines.faults import EngineFault, ModelRefusedError
from twolink.engines.messages import Errored, Model, Refused, Skipped, States
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.engines.transport import Transport
from twolink.errors import EngineError

# States of the large question.
_MANY = 1000

# Relative difference of equal answers; an engine may compute a batch in another order.
_ROUNDING = 1e-5


@dataclass(frozen=True)
class Check:
    """One check of the protocol: whether it passed, and the finding."""

    name: str
    passed: bool
    said: str


class _FailedError(Exception):
    """A check failed; the message says why."""


def check_harness(start: Callable[[], Transport], seconds: float) -> tuple[Check, ...]:
    """Return the checks of an engine's adapter; those after a failed start are left out."""
    try:
        session = Session(start, seconds)
    except EngineError as error:
        return (Check("start", False, str(error)),)
    with session:
        return tuple(_checks(session))


def _checks(session: Session) -> Iterator[Check]:
    """Run the checks in turn; the engine is started anew after a fault."""
    about = session.engine
    yield Check("start", True, f"{about.name} {about.version}, {about.precision}")
    yield _checked("capabilities", lambda: _capabilities(session))
    first, second = (_group(name) for name in ("bars", "general"))
    loaded = _checked("model", lambda: _loaded(session, first))
    yield loaded
    if not loaded.passed:
        return
    tests = [test for test in first.tests if test.quantity in about.answers and not test.needs]
    for test in tests:
        yield _checked(f"ask {test.quantity}", lambda test=test: _asked(session, first, test))
    if tests:
        yield _checked("the same question twice", lambda: _twice(session, first, tests[0]))
        yield _checked("one state", lambda: _alone(session, first, tests[0]))
        yield _checked("many states", lambda: _many(session, first, tests[0]))
        yield _checked("another model", lambda: _other(session, first, second, tests[0].quantity))
    yield _checked("a quantity that no engine has", lambda: _unknown(session, first))
    yield _checked("a broken model", lambda: _broken(session, first))
    yield _checked("stop", lambda: _stopped(session))


def _checked(name: str, run: Callable[..., str]) -> Check:
    try:
        return Check(name, True, run())
    except (EngineFault, _FailedError) as error:
        return Check(name, False, str(error))


def _capabilities(session: Session) -> str:
    about = session.engine
    if said := mistake_in(about):
        raise _FailedError(said)
    if not about.answers:
        raise _FailedError("answers must name a quantity; got none")
    effects = f", with {', '.join(about.effects)}" if about.effects else ""
    return f"reads {' and '.join(about.reads)}, answers {len(about.answers)} quantities{effects}"


def _loaded(session: Session, group: Group) -> str:
    request = group.request(session.engine.reads)
    assert request is not None
    try:
        understood = RemoteEngine(session, group.id).load(request)
    except ModelRefusedError as error:
        raise _FailedError(f"{group.id} must be loaded; it is refused: {error}") from error
    fields = [] if understood is None else list(understood.model_dump(exclude_none=True))
    return f"loaded; understood: {', '.join(fields) or 'not stated'}"


def _asked(session: Session, group: Group, test: Vector) -> str:
    values = _values(session, test)
    found = judged(test, group, values, from_urdf=session.engine.reads[0] == "urdf")
    if math.isnan(found.factor):
        raise _FailedError("values must be finite in these states; got others")
    return f"{len(values)} states, {found.digits:.1f} digits"


def _twice(session: Session, group: Group, test: Vector) -> str:
    first, second = (_values(session, test) for _ in range(2))
    if not _same(first, second):
        raise _FailedError(f"answers must be equal; got {first[0]} and {second[0]}")
    return "equal answers"


def _alone(session: Session, group: Group, test: Vector) -> str:
    whole, alone = _values(session, test), _values(session, _in_states(test, [1]))
    if not _same(alone, whole[1:2]):
        raise _FailedError(f"a state alone must have the value {whole[1]}; got {alone[:1]}")
    return "the value of a state does not depend on the others"


def _many(session: Session, group: Group, test: Vector) -> str:
    count = len(test.states.angles)
    _values(session, _in_states(test, [k % count for k in range(_MANY)]))
    return f"{_MANY} states in one message"


def _other(session: Session, first: Group, second: Group, quantity: str) -> str:
    (test,) = (test for test in second.tests if test.quantity == quantity)
    before = _values(session, test)
    _loaded(session, second)
    after = _values(session, test)
    _loaded(session, first)
    if _same(before, after):
        raise _FailedError("values must be those of the model loaded last; they did not change")
    return "values of the model loaded last"


def _unknown(session: Session, group: Group) -> str:
    test = group.tests[0].model_copy(update={"quantity": "phase_of_the_moon"})
    answer = session.ask(test.id, test.quantity, test.states)
    if not isinstance(answer, Skipped | Errored):
        raise _FailedError("it must be skipped; got values")
    return "skipped" if isinstance(answer, Skipped) else "an error, which skipped would say better"


def _broken(session: Session, group: Group) -> str:
    sound = group.request(session.engine.reads)
    assert sound is not None
    answer = session.load(_with_fault(sound))
    if not isinstance(answer, Refused):
        raise _FailedError("it must be refused; it was loaded")
    _loaded(session, group)
    return f"refused ({answer.refused}), and a sound one is loaded again"


def _with_fault(model: Model) -> Model:
    """Return a model that is cut off, or has a negative mass."""
    if model.urdf is not None:
        return model.model_copy(update={"urdf": model.urdf[: len(model.urdf) // 2]})
    assert model.parameters is not None
    wrong = model.parameters.model_copy(update={"mass": (1.0, -1.0)})
    return model.model_copy(update={"parameters": wrong})


def _stopped(session: Session) -> str:
    if not session.stop(5.0):
        raise _FailedError("it must end with exit code 0 within 5 s; it did not")
    return "ended by itself"


def _group(name: str) -> Group:
    (found,) = (group for group in suite("evaluation") if group.id == f"evaluation/{name}")
    return found


def _in_states(test: Vector, which: list[int]) -> Vector:
    """Return a test in some of its states."""
    rows: dict[str, Any] = test.states.model_dump(exclude_none=True)
    states = States(**{name: tuple(row[k] for k in which) for name, row in rows.items()})
    return test.model_copy(update={"states": states})


def _same(first: Array, second: Array) -> bool:
    """Return whether values are equal within rounding of any precision."""
    return bool(np.abs(first - second).max() <= _ROUNDING * np.abs(first).max())


def _values(session: Session, test: Vector) -> Array:
    try:
        return RemoteEngine(session, test.id).evaluate(test.quantity, test.states.arrays())
    except EngineError as error:
        raise _FailedError(f"a declared quantity must have values; got {error}") from error
