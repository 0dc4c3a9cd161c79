"""Motions of an engine by each of its methods, from coarse to fine, and their convergence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twolink.conformance.bounds import EPSILONS
from twolink.conformance.convergence import Convergence, Limit, convergence
from twolink.conformance.results import TestResult, faulty
from twolink.conformance.transport import EngineFault, FaultKind
from twolink.conformance.vectors import Group, Motion
from twolink.engines.messages import About, Answer, Errored, Method, Move, Moved, Skipped
from twolink.hardcases import Mark

Array = NDArray[np.float64]
Ask = Callable[[Move], Answer]

# The coarsest step (s) or tolerance, the divisor, and how many settings.
_SETTINGS = {"step": (0.01, 2.0, 6), "tolerance": (1e-3, 100.0, 5)}

_MARKS = {Limit.TRUTH: Mark.PASS, Limit.ANOTHER: Mark.SILENT, Limit.NONE: Mark.MISSED}


class _NotMovedError(Exception):
    """An engine gave no motion; the message says why."""


def motion_results(
    suite: str, group: Group, motion: Motion, engine: About, ask: Ask
) -> Iterator[TestResult]:
    """Yield the result of each method of an engine, or one of an engine without methods."""
    flags = (*group.flags, *motion.flags)
    result = TestResult(motion.id, suite, group.id, "motion", flags, Mark.CANNOT)
    missing = [effect for effect in motion.needs if effect not in engine.effects]
    if not engine.methods:
        yield replace(result, said="the engine has no methods")
    elif missing:
        yield replace(result, said=f"the engine does not have {' and '.join(missing)}")
    else:
        for method in engine.methods:
            named = replace(
                result, id=f"{motion.id}/{method.name}", quantity=f"motion: {method.name}"
            )
            yield _of_method(named, motion, method, engine, ask)


def _of_method(
    result: TestResult, motion: Motion, method: Method, engine: About, ask: Ask
) -> TestResult:
    epsilon = EPSILONS[engine.precision]
    try:
        found = _verdict(motion, method, epsilon, ask)
    except EngineFault as fault:
        return faulty(result, fault)
    except _NotMovedError as error:
        return replace(result, mark=Mark.REFUSED, said=str(error))
    return replace(result, mark=_MARKS[found.limit], said=found.sentence)


def _verdict(motion: Motion, method: Method, epsilon: float, ask: Ask) -> Convergence:
    """Return the verdict on motions from coarse to fine, up to half of all digits."""
    truth = np.array(motion.values, dtype=float)
    value, ratio, count = _SETTINGS[method.parameter]
    motions: list[Array] = []
    for _ in range(count):
        motions.append(_moved(motion, method, value, ask))
        value /= ratio
        if len(motions) > 2:
            found = convergence(motions, truth, epsilon, ratio)
            if found.error <= np.sqrt(epsilon):
                return found
    return found


def _moved(motion: Motion, method: Method, parameter: float, ask: Ask) -> Array:
    """Return angles and speeds at all times but the first, shape (n, 4)."""
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
        raise _NotMovedError(answer.message or "no motion")
    assert isinstance(answer, Moved)
    count = len(motion.times)
    for name in ("angles", "speeds"):
        rows = getattr(answer, name)
        if len(rows) != count:
            raise EngineFault(
                FaultKind.WRONG_LENGTH, f"{name} must be {count} rows; got {len(rows)}"
            )
    return np.hstack([np.array(answer.angles), np.array(answer.speeds)])[1:]
