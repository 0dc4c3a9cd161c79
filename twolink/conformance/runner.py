"""Run the suites on an engine: load each model, ask each question, judge and diagnose."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from twolink.conformance.diagnosis import causes, explanation
from twolink.conformance.hard_cases import hard_case
from twolink.conformance.judge import judged
from twolink.conformance.motions import motion_results, unmoved
from twolink.conformance.results import READ, Report, TestResult, faulty
from twolink.conformance.session import Session
from twolink.conformance.transport import EngineFault, FaultKind, Transport
from twolink.conformance.understanding import misunderstood
from twolink.conformance.vectors import Group, Vector
from twolink.engines.messages import (
    About,
    Answer,
    Errored,
    Loaded,
    Refused,
    Skipped,
    Values,
)
from twolink.hardcases import Case, Mark, Result

Progress = Callable[[float], None]

SECONDS = 60.0
"""Time limit (s) of an answer, the start of the engine included."""

MEMORY = 4 * 2**30
"""Memory limit (bytes) of an engine in a child process."""

# An engine that fails so often on one model is not asked further questions on it.
_PATIENCE = 3


@dataclass(frozen=True)
class _Outcome:
    """A result, and the possible causes of a wrong answer."""

    result: TestResult
    causes: tuple[str, ...] = ()


def conform(
    attachment: str,
    start: Callable[[], Transport],
    suites: Mapping[str, tuple[Group | Case, ...]],
    *,
    seconds: float = SECONDS,
    memory: int = MEMORY,
    progress: Progress = lambda share: None,
) -> Report:
    """Return the report on an engine.

    `attachment` is how the engine is named on the command line, `start` starts it (see
    `twolink.conformance.attach`). Raises `EngineError` if it does not start.
    """
    count = sum(len(groups) for groups in suites.values())
    outcomes: list[_Outcome] = []
    with Session(start, seconds) as session:
        done = 0
        for name, groups in suites.items():
            for group in groups:
                if isinstance(group, Case):
                    outcomes.append(_Outcome(hard_case(session, name, group)))
                else:
                    outcomes += _group(session, name, group)
                done += 1
                progress(done / count)
        engine = session.engine
    chosen = explanation({each.result.id: each.causes for each in outcomes})
    results = tuple(replace(each.result, cause=chosen.get(each.result.id, "")) for each in outcomes)
    return Report(engine, attachment, tuple(suites), seconds, memory, results)


def _group(session: Session, suite: str, group: Group) -> Iterator[_Outcome]:
    """Load a model and ask its questions."""
    engine = session.engine
    request = group.request(engine.reads)
    read = TestResult(f"{group.id}/read", suite, group.id, READ, group.flags, Mark.PASS)
    if request is None:
        reads = " and ".join(engine.reads)
        yield _Outcome(replace(read, mark=Mark.CANNOT, said=f"the engine reads {reads} only"))
        return
    reasons = [unmoved(motion, engine) for motion in group.motions]
    if not group.tests and reasons and all(reasons):
        # The parameters of effects are sent only to engines that have them.
        yield _Outcome(replace(read, mark=Mark.CANNOT, said=reasons[0]))
        yield from _motions(session, suite, group)
        return
    try:
        answer = session.load(request)
    except EngineFault as fault:
        yield _Outcome(faulty(read, fault))
        return
    yield _Outcome(_reading(read, group, answer, engine))
    if isinstance(answer, Loaded):
        warnings = answer.warnings
        yield from _questions(session, suite, group, warnings, from_urdf=request.urdf is not None)
        yield from _motions(session, suite, group, warnings)


def _motions(
    session: Session, suite: str, group: Group, warnings: tuple[str, ...] = ()
) -> Iterator[_Outcome]:
    for motion in group.motions:
        for result in motion_results(suite, group, motion, session.engine, session.move, warnings):
            yield _Outcome(result)


def _reading(read: TestResult, group: Group, answer: Answer, engine: About) -> TestResult:
    """Return the result of loading a model."""
    if isinstance(answer, Refused):
        mark = Mark.REFUSED if group.expect == "value" else Mark.PASS
        return replace(read, mark=mark, said=answer.refused)
    assert isinstance(answer, Loaded)
    if group.expect == "refuse":
        wrong = f"it must be refused: {group.comment}"
    else:
        wrong = "; ".join(misunderstood(answer.understood, group.understood, engine.precision))
    mark = Result(math.inf if wrong else 0.0, warned=bool(answer.warnings)).mark
    return replace(read, mark=mark, said=wrong, warnings=answer.warnings)


def _questions(
    session: Session, suite: str, group: Group, warnings: tuple[str, ...], *, from_urdf: bool
) -> Iterator[_Outcome]:
    """Ask the questions on a model; `warnings` are those of the engine on the model."""
    faults: list[EngineFault] = []
    for vector in group.tests:
        flags = (*group.flags, *vector.flags)
        result = TestResult(vector.id, suite, group.id, vector.quantity, flags, Mark.CANNOT)
        reason = _unasked(vector, session.engine)
        if reason:
            yield _Outcome(replace(result, said=reason))
        elif len(faults) >= _PATIENCE:
            failed = faulty(result, faults[-1])
            yield _Outcome(replace(failed, said=f"not asked after {_PATIENCE} faults on the model"))
        else:
            try:
                yield _question(session, group, vector, result, warnings, from_urdf=from_urdf)
            except EngineFault as fault:
                # The engine is started anew after all faults but this one.
                faults += [fault] if fault.kind is not FaultKind.WRONG_LENGTH else []
                yield _Outcome(faulty(result, fault))


def _unasked(vector: Vector, engine: About) -> str:
    """Return why a question is not for an engine, or nothing."""
    if vector.quantity not in engine.answers:
        return "the engine does not answer this quantity"
    missing = [effect for effect in vector.needs if effect not in engine.effects]
    if missing:
        return f"the engine does not have {' and '.join(missing)}"
    return ""


def _question(
    session: Session,
    group: Group,
    vector: Vector,
    result: TestResult,
    of_model: tuple[str, ...],
    *,
    from_urdf: bool,
) -> _Outcome:
    """Return the outcome of one question. Raises `EngineFault`."""
    answer = session.ask(vector)
    if isinstance(answer, Skipped):
        return _Outcome(replace(result, said=answer.message, issue=answer.issue_url))
    if isinstance(answer, Errored):
        return _Outcome(replace(result, mark=Mark.REFUSED, said=answer.message or "an error"))
    assert isinstance(answer, Values)
    precision = session.engine.precision
    warnings = (*of_model, *answer.warnings)
    found = judged(
        vector,
        group,
        answer.values,
        from_urdf=from_urdf,
        precision=precision,
        warned=bool(warnings),
    )
    result = replace(result, mark=found.mark, factor=found.factor, digits=found.digits)
    if found.mark is Mark.PASS:
        return _Outcome(replace(result, warnings=answer.warnings))
    result = replace(result, warnings=warnings)
    names = causes(
        vector,
        group,
        found.answer,
        from_urdf=from_urdf,
        precision=precision,
        single=found.single,
    )
    return _Outcome(replace(result, said=_wrong(found.factor, found.digits)), names)


def _wrong(factor: float, digits: float) -> str:
    if math.isnan(factor):
        return "values are not finite"
    return f"the error is {factor:.2g} times its bound; {digits:.1f} digits are right"
