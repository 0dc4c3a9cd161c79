"""The steps of an arc, taken by the integrator of its mode."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from twolink.integration.outcomes import failure_of
from twolink.optional import heyoka
from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.course import Course
from twolink.simulation.hybrid.pace import factors_of_pace, product
from twolink.simulation.hybrid.tolerances import SHORTEST_STEP

# Largest binary exponent of the powers of a step: numbers have exponents up to 1023 in float64, and
# up to 16383 in long doubles and in 113 bits.
_MOST_EXPONENT = {"double": 900, "long double": 15000, "quadruple": 15000}


def take_steps(course: Course, ahead: int, longest: Any) -> tuple[Block, bool, str]:
    """Return the next steps, whether they reach the end of the arc, and the failure if any.

    In time they are at most as long as the `longest` (s).
    """
    _, compiled, (integrator, step, variables, tc, _, values), _, state, until, _ = course
    clock, integrals = compiled.clock, compiled.integrals
    by_time, watches_integrals = clock is None, integrals.stop > integrals.start
    complete, falling = _complete(), compiled.falling
    span, shortest = until - state.t, SHORTEST_STEP if by_time else 0
    taken = _Taken([], [], [])
    over, failure = False, ""
    for _ in range(ahead):
        start = integrator.time
        if by_time:
            left = until - start
            if not left > 0:
                over = True
                break
            outcome, length = step(left if left < longest else longest, True)
        else:
            outcome, length = step(_longest_press(course, span), True)
        if outcome.value not in complete:
            failure = failure_of(outcome)
            break
        taken.add(start, length, tc)
        if watches_integrals:
            variables[integrals] = 0
        over = by_time and length == left
        if over or (not by_time and values[clock] >= span):
            break
        if not length > shortest * start:
            failure = "its steps become too short"
            break
        if _has_fallen(values, falling):
            break
    return taken.block(tc), over, failure


def _longest_press(course: Course, span: Any) -> Any:
    """Return a step of s that takes more than the time left to an arc if no depth changes.

    The series of a chain that rests on a surface converges everywhere. A press begins with a root
    of zero, and its clock is slow until the root has grown, as it is where roots fall to zero
    together. Where the point leaves the surface at the instant at which the arc begins, the root is
    below zero by round-off.
    """
    system, compiled, values = course.system, course.compiled, course.stepper.values
    first = 4 + len(compiled.gaps) + len(compiled.recovering)
    roots = []
    for place, index in enumerate(compiled.roots, first):
        if index in compiled.moving:
            root = values[place]
            roots.append(root if root > 0 else system.scales.least_root(index))
    longest = 2 * span / product(factors_of_pace(roots))
    # The powers of a longer step leave the range of the numbers.
    exponent = _MOST_EXPONENT[system.precision] / (course.stepper.integrator.order + 1)
    most = system.number(2.0 ** min(exponent, 1000.0))
    return longest if longest < most else most


class _Taken(NamedTuple):
    """The starts, lengths and coefficients of steps, the last in bytes.

    Bytes are joined several times faster than small arrays.
    """

    starts: list[Any]
    lengths: list[Any]
    coefficients: list[bytes]

    def add(self, start: Any, length: Any, tc: Any) -> None:
        """Add a step of the coefficients `tc`."""
        self.starts.append(start)
        self.lengths.append(length)
        self.coefficients.append(tc.tobytes())

    def block(self, tc: Any) -> Block:
        """Return the steps, whose coefficients have the shape and the type of `tc`."""
        kind, shape = tc.dtype, (len(self.lengths), *tc.shape)
        joined: Any = np.ndarray(shape, kind, b"".join(self.coefficients))
        return Block(np.array(self.starts, kind), np.array(self.lengths, kind), joined)


def _has_fallen(values: Any, falling: Sequence[int]) -> bool:
    """Return whether an event has occurred: a variable that may fall is below zero."""
    for variable in falling:  # noqa: SIM110
        if values[variable] < 0:
            return True
    return False


@functools.cache
def _complete() -> frozenset[int]:
    """Return heyoka's result codes for a full and for a capped step.

    Integers are compared faster than the codes themselves.
    """
    outcomes = heyoka().taylor_outcome
    return frozenset((outcomes.success.value, outcomes.time_limit.value))
