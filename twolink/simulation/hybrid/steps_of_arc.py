"""The steps of an arc, taken by the integrator of its mode."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from twolink.integration.outcomes import failure_of
from twolink.optional import heyoka
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.course import Course
from twolink.simulation.hybrid.pace import factors_of_pace, product
from twolink.simulation.hybrid.tolerances import SHORTEST_STEP

_TOO_SHORT = "its steps become too short"

# Largest binary exponent of the powers of a step: numbers have exponents up to 1023 in float64, and
# up to 16383 in long doubles and in 113 bits.
_MOST_EXPONENT = {"double": 900, "long double": 15000, "quadruple": 15000}


# The starts, lengths and coefficients of steps, the last in bytes, which are joined several times
# faster than small arrays. The loops of steps append to the lists themselves, as a call for each
# step would take a tenth of their own time.
_Taken = tuple[list[Any], list[Any], list[bytes]]


def take_steps(course: Course, ahead: int, longest: Any) -> tuple[Block, bool, str]:
    """Return the next steps, whether they reach the end of the arc, and the failure if any.

    In time they are at most as long as the `longest` (s).
    """
    starts: list[Any] = []
    lengths: list[Any] = []
    coefficients: list[bytes] = []
    taken = starts, lengths, coefficients
    if course.compiled.clock is None:
        over, failure = _in_time(course, ahead, longest, taken)
    else:
        over, failure = False, _by_clock(course, ahead, course.compiled.clock, taken)
    tc = course.stepper.tc
    kind = tc.dtype
    joined: Any = np.ndarray((len(lengths), *tc.shape), kind, b"".join(coefficients))
    return Block(np.array(starts, kind), np.array(lengths, kind), joined), over, failure


def _in_time(course: Course, ahead: int, longest: Any, taken: _Taken) -> tuple[bool, str]:
    """Take steps in time; return whether they reach the end of the arc, and the failure if any."""
    _, compiled, (integrator, step, variables, tc, _, values), _, _, until, _ = course
    integrals, falling, complete = compiled.integrals, compiled.falling, _complete()
    starts, lengths, coefficients = taken
    watches_integrals = integrals.stop > integrals.start
    for _ in range(ahead):
        start = integrator.time
        left = until - start
        if not left > 0:
            return True, ""
        outcome, length = step(left if left < longest else longest, True)
        if outcome.value not in complete:
            return False, failure_of(outcome)
        starts.append(start)
        lengths.append(length)
        coefficients.append(tc.tobytes())
        if watches_integrals:
            variables[integrals] = 0
        if length == left:
            return True, ""
        if not length > SHORTEST_STEP * start:
            return False, _TOO_SHORT
        for variable in falling:
            if values[variable] < 0:
                return False, ""
    return False, ""


def _by_clock(course: Course, ahead: int, clock: int, taken: _Taken) -> str:
    """Take steps of s, up to one that passes the end of the arc; return the failure if any."""
    _, compiled, (integrator, step, variables, tc, _, values), _, state, until, _ = course
    integrals, span, complete = compiled.integrals, until - state.t, _complete()
    starts, lengths, coefficients = taken
    for _ in range(ahead):
        start = integrator.time
        outcome, length = step(_longest_press(course, span), True)
        if outcome.value not in complete:
            return failure_of(outcome)
        starts.append(start)
        lengths.append(length)
        coefficients.append(tc.tobytes())
        variables[integrals] = 0
        if values[clock] >= span:
            break
        if not length > 0:
            return _TOO_SHORT
        if any(values[own] < 0 for own in compiled.falling):
            break
    return ""


def _longest_press(course: Course, span: Any) -> Any:
    """Return a step of s that, if no depth changes, takes more than the time left to an arc.

    It takes no more than the longest step of the system. The series of a chain that rests on a
    surface converges everywhere. A press begins with a root of zero, and its clock is slow until
    the root has grown, as it is where roots fall to zero together. Where the point leaves the
    surface at the instant at which the arc begins, the root is below zero by round-off.
    """
    system, compiled, values = course.system, course.compiled, course.stepper.values
    first = 4 + len(compiled.gaps) + len(compiled.recovering)
    roots = []
    for place, index in enumerate(compiled.roots, first):
        if index in compiled.moving:
            root = values[place]
            roots.append(root if root > 0 else system.scales.least_root(index))
    longest = min(2 * span, system.cap) / product(factors_of_pace(roots))
    # The powers of a longer step leave the range of the numbers.
    exponent = _MOST_EXPONENT[system.precision] / (course.stepper.integrator.order + 1)
    most = system.number(2.0 ** min(exponent, 1000.0))
    return longest if longest < most else most


@functools.cache
def _complete() -> frozenset[int]:
    """Return heyoka's result codes for a full and for a capped step.

    Integers are compared faster than the codes themselves.
    """
    outcomes = heyoka().taylor_outcome
    return frozenset((outcomes.success.value, outcomes.time_limit.value))
