"""Run the suites on an engine: load each model, ask each question, judge and diagnose."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace

from twolink.conformance.capabilities import mistake_in
from twolink.conformance.diagnosis import causes, explanation
from twolink.conformance.hard_cases import hard_case
from twolink.conformance.judge import judged
from twolink.conformance.motions import motion_results, unmoved
from twolink.conformance.random_states import at_random_states
from twolink.conformance.results import READ, Report, TestResult, without_answer
from twolink.conformance.suites import Item
from twolink.conformance.understanding import misunderstood
from twolink.conformance.vectors import Group, Vector
from twolink.engines.faults import EngineFault, FaultKind, ModelRefusedError
from twolink.engines.marks import Mark, Result
from twolink.engines.messages import About, Precision, Understood
from twolink.engines.remote_engine import RemoteEngine
from twolink.engines.session import Session
from twolink.engines.transport import Transport
from twolink.errors import EngineError
from twolink.hardcases import Case

Progress = Callable[[float], None]

SECONDS = 60.0
"""Time limit (s) of an answer, the start of the engine included."""

MEMORY = 4 * 2**30
"""Memory limit (bytes) of an engine in a child process."""

# An engine that fails so often on one model is not asked further questions on it.
_PATIENCE = 3


def conform(
    attachment: str,
    start: Callable[[], Transport],
    suites: Mapping[str, tuple[Item, ...]],
    *,
    seconds: float = SECONDS,
    memory: int = MEMORY,
    progress: Progress = lambda share: None,
) -> Report:
    """Return the report on an engine.

    `attachment` is how the engine is named on the command line, `start` starts it (see
    `twolink.engines.attach`). Raises `EngineError` if it does not start, or names wrong
    capabilities.
    """
    count = sum(len(groups) for groups in suites.values())
    found: list[TestResult] = []
    with Session(start, seconds) as session:
        if said := mistake_in(session.engine):
            raise EngineError(f"the engine's {said}")
        done = 0
        for name, groups in suites.items():
            for group in groups:
                found += _results(session, name, group)
                done += 1
                progress(done / count)
        engine = session.engine
    chosen = explanation({each.id: each.causes for each in found})
    results = tuple(replace(each, cause=chosen.get(each.id, "")) for each in found)
    printed = session.printed
    return Report(engine, attachment, tuple(suites), seconds, memory, results, printed=printed)


def _results(session: Session, suite: str, item: Item) -> Iterator[TestResult]:
    if isinstance(item, Group):
        yield from _group(session, suite, item)
    elif isinstance(item, Case):
        yield hard_case(session, suite, item)
    else:
        yield from at_random_states(session, suite, item)


def _group(session: Session, suite: str, group: Group) -> Iterator[TestResult]:
    """Load a model and ask its questions."""
    engine = RemoteEngine(session, group.id)
    request = group.request(engine.reads)
    read = TestResult(f"{group.id}/read", suite, group.id, READ, group.flags, Mark.PASS)
    if request is None:
        reads = " and ".join(engine.reads)
        yield replace(read, mark=Mark.CANNOT, said=f"the engine reads {reads} only")
        return
    reasons = [unmoved(motion, engine) for motion in group.motions]
    if not group.tests and reasons and all(reasons):
        # The parameters of effects are sent only to engines that have them.
        yield replace(read, mark=Mark.CANNOT, said=reasons[0])
        yield from _motions(session, suite, group)
        return
    try:
        understood = engine.load(request)
    except ModelRefusedError as refusal:
        mark = Mark.REFUSED if group.expect == "value" else Mark.PASS
        yield replace(read, mark=mark, said=str(refusal))
    except EngineFault as fault:
        yield without_answer(read, fault)
    else:
        warnings = tuple(engine.captured_warnings)
        yield _reading(read, group, understood, engine.precision, warnings)
        yield from _questions(session, suite, group, warnings)
        yield from _motions(session, suite, group, warnings)


def _motions(
    session: Session, suite: str, group: Group, warnings: tuple[str, ...] = ()
) -> Iterator[TestResult]:
    for motion in group.motions:
        engine = RemoteEngine(session, motion.id)
        yield from motion_results(suite, group, motion, engine, warnings)


def _reading(
    read: TestResult,
    group: Group,
    understood: Understood | None,
    precision: Precision,
    warnings: tuple[str, ...],
) -> TestResult:
    """Return the result of a model that was loaded."""
    if group.expect == "refuse":
        wrong = f"it must be refused: {group.comment}"
    else:
        wrong = "; ".join(misunderstood(understood, group.understood, precision))
    mark = Result(math.inf if wrong else 0.0, warned=bool(warnings)).mark
    return replace(read, mark=mark, said=wrong, warnings=warnings)


def _questions(
    session: Session, suite: str, group: Group, warnings: tuple[str, ...]
) -> Iterator[TestResult]:
    """Ask the questions on a model; `warnings` are those of the engine on the model."""
    faults: list[EngineFault] = []
    for vector in group.tests:
        flags = (*group.flags, *vector.flags)
        result = TestResult(vector.id, suite, group.id, vector.quantity, flags, Mark.CANNOT)
        reason = _unasked(vector, session.engine)
        if reason:
            yield replace(result, said=reason)
        elif len(faults) >= _PATIENCE:
            failed = without_answer(result, faults[-1])
            yield replace(failed, said=f"not asked after {_PATIENCE} faults on the model")
        else:
            try:
                yield _question(RemoteEngine(session, vector.id), group, vector, result, warnings)
            except (EngineError, EngineFault) as error:
                # The engine is started anew after all faults but this one.
                if isinstance(error, EngineFault) and error.kind is not FaultKind.WRONG_LENGTH:
                    faults.append(error)
                yield without_answer(result, error)


def _unasked(vector: Vector, engine: About) -> str:
    """Return the reason for which an engine skips a question, or an empty string."""
    if vector.quantity not in engine.answers:
        return "the engine does not answer this quantity"
    missing = [effect for effect in vector.needs if effect not in engine.effects]
    if missing:
        return f"the engine does not have {' and '.join(missing)}"
    return ""


def _question(
    engine: RemoteEngine,
    group: Group,
    vector: Vector,
    result: TestResult,
    of_model: tuple[str, ...],
) -> TestResult:
    """Return the outcome of one question. Raises `EngineError` and `EngineFault`."""
    answer = engine.evaluate(vector.quantity, vector.states.arrays())
    precision, from_urdf = engine.precision, engine.has_urdf
    warnings = (*of_model, *engine.captured_warnings)
    found = judged(
        vector,
        group,
        answer,
        from_urdf=from_urdf,
        precision=precision,
        warned=bool(warnings),
    )
    result = replace(result, mark=found.mark, factor=found.factor, digits=found.digits)
    if found.mark is Mark.PASS:
        return replace(result, warnings=tuple(engine.captured_warnings))
    result = replace(result, warnings=warnings)
    names = causes(
        vector,
        group,
        found.answer,
        from_urdf=from_urdf,
        precision=precision,
        single=found.single,
    )
    return replace(result, said=_wrong(found.factor, found.digits), causes=names)


def _wrong(factor: float, digits: float) -> str:
    if math.isnan(factor):
        return "values are not finite"
    return f"the error is {factor:.2g} times its bound; {digits:.1f} digits are right"
