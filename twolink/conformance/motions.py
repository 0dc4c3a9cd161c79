"""Motions of an engine by each of its methods, from coarse to fine, and their convergence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.convergence import Curve, Limit, convergence
from twolink.conformance.motion_diagnosis import MotionDiagnosis
from twolink.conformance.results import MOTION, TestResult, without_answer
from twolink.conformance.vectors import Group, Motion
from twolink.engines.faults import EngineFault
from twolink.engines.marks import Mark
from twolink.engines.messages import Method, Move
from twolink.engines.remote_engine import RemoteEngine
from twolink.errors import EngineError

Array = NDArray[np.float64]

# The coarsest step (s) or tolerance, the divisor, and how many settings. There are more steps for
# motions with events, and for a method of first order that has not converged by then.
_SETTINGS = {"step": (0.01, 2.0, 6), "tolerance": (1e-3, 100.0, 5)}
_MORE_STEPS = 3

_MARKS = {Limit.TRUTH: Mark.PASS, Limit.ANOTHER: Mark.SILENT, Limit.NONE: Mark.MISSED}


def unmoved(motion: Motion, engine: RemoteEngine) -> str:
    """Return the reason for which an engine skips a motion, or an empty string."""
    if not engine.methods:
        return "the engine has no methods"
    missing = [effect for effect in motion.needs if effect not in engine.effects]
    return f"the engine does not have {' and '.join(missing)}" if missing else ""


def motion_results(
    suite: str,
    group: Group,
    motion: Motion,
    engine: RemoteEngine,
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
    diagnosis = MotionDiagnosis(motion, group)
    for method in engine.methods:
        named = replace(result, id=f"{motion.id}/{method.name}", quantity=f"{MOTION}{method.name}")
        yield _of_method(named, motion, method, engine, warnings, diagnosis)


def _of_method(
    result: TestResult,
    motion: Motion,
    method: Method,
    engine: RemoteEngine,
    of_model: tuple[str, ...],
    diagnosis: MotionDiagnosis,
) -> TestResult:
    try:
        curve, motions, warnings = _curve(motion, method, engine)
    except (EngineError, EngineFault) as error:
        return without_answer(result, error)
    found = curve.verdict
    mark, said = _MARKS[found.limit], found.sentence
    if mark is Mark.PASS and _is_of_lower_order(curve, motion, method, engine):
        mark, said = Mark.MISSED, f"{said}; the engine names order {method.order:g}"
    if mark is not Mark.PASS:
        warnings = (*of_model, *warnings)
    if mark is Mark.SILENT and warnings:
        mark = Mark.MISSED
    result = replace(result, mark=mark, said=said, warnings=warnings, curve=curve)
    if found.limit is not Limit.ANOTHER:
        return result
    before, finest = motions[-2:]
    unsure = float(np.abs(finest - before).max())
    return replace(result, causes=diagnosis.causes(finest, unsure, engine.precision))


def _is_of_lower_order(curve: Curve, motion: Motion, method: Method, engine: RemoteEngine) -> bool:
    """Return whether a motion converges with less than half of the order that the engine names.

    A step too many is such a mistake: its motions converge to the truth with order 1. Where half of
    all digits are right, rounding may hide the order.
    """
    found = curve.verdict
    if method.order is None or not _is_even(motion, method):
        return False
    size = float(np.abs(np.array(motion.values, dtype=float)).max())
    hidden = found.error <= np.sqrt(EPSILONS[engine.precision]) * size
    return not hidden and found.order < method.order / 2


def _is_even(motion: Motion, method: Method) -> bool:
    """Return whether errors fall evenly: those of a smooth motion with fixed steps."""
    return method.parameter == "step" and motion.smooth


def _curve(
    motion: Motion, method: Method, engine: RemoteEngine
) -> tuple[Curve, list[Array], tuple[str, ...]]:
    """Return the errors up to half of all digits, the motions from coarse to fine, and warnings."""
    truth, epsilon = np.array(motion.values, dtype=float), EPSILONS[engine.precision]
    value, ratio, count = _SETTINGS[method.parameter]
    even = _is_even(motion, method)
    is_slow = even and method.order is not None and method.order <= 1
    if method.parameter == "step" and not even:
        count += _MORE_STEPS
    most = count + _MORE_STEPS if is_slow else count
    motions: list[Array] = []
    settings: list[float] = []
    warnings: dict[str, None] = {}
    for number in range(1, most + 1):
        rows, said = _moved(motion, method, value, engine)
        motions.append(rows)
        settings.append(value)
        warnings |= dict.fromkeys(said)
        value /= ratio
        if len(motions) > 2:
            found = convergence(motions, truth, epsilon, ratio, even=even)
            is_enough = is_slow and number >= count
            if found.limit is Limit.TRUTH and (is_enough or found.error <= np.sqrt(epsilon)):
                break
    return Curve(method.parameter, tuple(settings), found), motions, tuple(warnings)


def _moved(
    motion: Motion, method: Method, parameter: float, engine: RemoteEngine
) -> tuple[Array, tuple[str, ...]]:
    """Return angles and speeds at all times but the first, shape (n, 4), and warnings."""
    answer = engine.move(
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
    rows = np.hstack([np.array(answer.angles), np.array(answer.speeds)])[1:]
    return rows, answer.warnings
