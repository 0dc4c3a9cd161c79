"""Motions of an engine by each of its methods, from coarse to fine, and their convergence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.convergence import Curve, Limit, convergence
from twolink.conformance.results import MOTION, TestResult, faulty
from twolink.conformance.transport import EngineFault, FaultKind
from twolink.conformance.vectors import Group, Motion
from twolink.engines.messages import About, Answer, Errored, Method, Move, Moved, Skipped
from twolink.hardcases import Mark

Array = NDArray[np.float64]
Ask = Callable[[Move], Answer]

# The coarsest step (s) or tolerance, the divisor, and how many settings; with events more steps.
_SETTINGS = {"step": (0.01, 2.0, 6), "tolerance": (1e-3, 100.0, 5)}
_MORE_STEPS = 3

_MARKS = {Limit.TRUTH: Mark.PASS, Limit.ANOTHER: Mark.SILENT, Limit.NONE: Mark.MISSED}


class _NotMovedError(Exception):
    """An engine skipped a motion, or ended it in an error: the answer that says so."""

    def __init__(self, answer: Skipped | Errored) -> None:
        super().__init__(answer.message)
        self.answer = answer


def unmoved(motion: Motion, engine: About) -> str:
    """Return why a motion is not for an engine, or nothing."""
    if not engine.methods:
        return "the engine has no methods"
    missing = [effect for effect in motion.needs if effect not in engine.effects]
    return f"the engine does not have {' and '.join(missing)}" if missing else ""


def motion_results(
    suite: str,
    group: Group,
    motion: Motion,
    engine: About,
    ask: Ask,
    warnings: tuple[str, ...] = (),
) -> Iterator[TestResult]:
    """Yield the result of each method of an engine, or one of an engine without methods.

    `warnings` are those of the engine on the model.
    """
    flags = (*group.flags, *motion.flags)
    result = TestResult(motion.id, suite, group.id, "motion", flags, Mark.CANNOT)
    reason = unmoved(motion, engine)
    if reason:
        yield replace(result, said=reason)
        return
    for method in engine.methods:
        named = replace(result, id=f"{motion.id}/{method.name}", quantity=f"{MOTION}{method.name}")
        yield _of_method(named, motion, method, engine, ask, warnings)


def _of_method(
    result: TestResult,
    motion: Motion,
    method: Method,
    engine: About,
    ask: Ask,
    of_model: tuple[str, ...],
) -> TestResult:
    epsilon = EPSILONS[engine.precision]
    try:
        curve, warnings = _curve(motion, method, epsilon, ask)
    except EngineFault as fault:
        return faulty(result, fault)
    except _NotMovedError as error:
        return _not_moved(result, error.answer)
    found = curve.verdict
    mark = _MARKS[found.limit]
    if mark is not Mark.PASS:
        warnings = (*of_model, *warnings)
    if mark is Mark.SILENT and warnings:
        mark = Mark.MISSED
    return replace(result, mark=mark, said=found.sentence, warnings=warnings, curve=curve)


def _not_moved(result: TestResult, answer: Skipped | Errored) -> TestResult:
    """Return the result of a motion that an engine skipped, or ended in an error."""
    if isinstance(answer, Skipped):
        return replace(result, mark=Mark.CANNOT, said=answer.message, issue=answer.issue_url)
    return replace(result, mark=Mark.REFUSED, said=answer.message or "no motion")


def _curve(
    motion: Motion, method: Method, epsilon: float, ask: Ask
) -> tuple[Curve, tuple[str, ...]]:
    """Return the errors from coarse to fine, up to half of all digits, and warnings."""
    truth = np.array(motion.values, dtype=float)
    value, ratio, count = _SETTINGS[method.parameter]
    even = method.parameter == "step" and motion.smooth
    if method.parameter == "step" and not even:
        count += _MORE_STEPS
    motions: list[Array] = []
    settings: list[float] = []
    warnings: dict[str, None] = {}
    for _ in range(count):
        rows, said = _moved(motion, method, value, ask)
        motions.append(rows)
        settings.append(value)
        warnings |= dict.fromkeys(said)
        value /= ratio
        if len(motions) > 2:
            found = convergence(motions, truth, epsilon, ratio, even=even)
            if found.limit is Limit.TRUTH and found.error <= np.sqrt(epsilon):
                break
    return Curve(method.parameter, tuple(settings), found), tuple(warnings)


def _moved(
    motion: Motion, method: Method, parameter: float, ask: Ask
) -> tuple[Array, tuple[str, ...]]:
    """Return angles and speeds at all times but the first, shape (n, 4), and warnings."""
    answer = ask(
        Move(
            seq=0,
            test=motion.id,
            angles=motion.angles,
            speeds=motion.speeds,
            method=method.name,
            parameter=parameter,
            times=motion.times,
        )
    )
    if isinstance(answer, Skipped | Errored):
        raise _NotMovedError(answer)
    assert isinstance(answer, Moved)
    count = len(motion.times)
    for name in ("angles", "speeds"):
        rows = getattr(answer, name)
        if len(rows) != count:
            raise EngineFault(
                FaultKind.WRONG_LENGTH, f"{name} must be {count} rows; got {len(rows)}"
            )
    rows = np.hstack([np.array(answer.angles), np.array(answer.speeds)])[1:]
    return rows, answer.warnings
