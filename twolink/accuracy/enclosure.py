"""Rigorous enclosures: intervals that provably contain the exact motion of a smooth scene.

heyoka computes an approximate motion, and ball arithmetic proves a bound on its error. The
approximate motion has about a hundred digits, uses the equations in momenta, and gives a polynomial
for each angle and step. The proof makes no assumption about these polynomials:
`twolink.accuracy.defect_bound` bounds the defect of each by evaluating the formulas of
`twolink.lagrange` on balls. The initial errors of a step are the final errors of the step before
plus the jump between both polynomials, computed in balls. They are kept in frames that turn with
the motion (`twolink.accuracy.frames`), so that bounds grow as errors do. The approximate motion is
computed with as many additional digits as they lose.

The proof relies on the inclusion property of python-flint's balls (Arb's outward rounding) and on
Python's integers. The equations are the Lagrange formulation with the exact float64 parameters of
the scene, as effects provide them (for example, the float64 unit vector of gravity). The tests
show symbolically that inverse and forward dynamics are the same equations. The proof does not
rely on heyoka or its rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from threading import RLock
from typing import Any, NamedTuple

import numpy as np

from twolink.accuracy.defect_bound import (
    COARSE_BITS,
    DISC,
    Step,
    TubeLeftError,
    jacobian,
)
from twolink.accuracy.frames import Frame
from twolink.accuracy.multiprecision import PreciseMotion, precise_motion
from twolink.accuracy.reference import asked_times, exact_inputs, has_events
from twolink.environment import package_versions
from twolink.errors import SimulationError
from twolink.inputs import as_count
from twolink.interruptible import side_by_side
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.optional import flint
from twolink.scene import Scene
from twolink.simulation.motion import check_run, motion_run

# Largest width for which a bound is proven (rad, rad/s).
_TUBE = 2.0**-24

# A larger loss of digits would take hours.
MOST_LOST = 400

# The bounds lose somewhat more than the estimate, which is that of one error at the start.
_MORE_LOST = 1.2

# Digits beyond the requested and the lost ones, at first and for each retry.
_GUARD, _MOST_TRIES = 8, 3

# python-flint has one precision of balls and one length of series for all threads, so proofs in
# several threads take turns.
_ONE_AT_A_TIME = RLock()

# Bits of balls beyond those of the approximate motion, so that the proof adds little error.
_MORE_BITS = 64


class Interval(NamedTuple):
    """All numbers within `radius` of `centre`, both exact decimal numbers."""

    centre: str
    radius: str

    def __contains__(self, number: object) -> bool:
        """Return whether it contains a float, integer, Fraction, Decimal or decimal string."""
        exact: Any = number
        distance = abs(Fraction(exact) - Fraction(self.centre))
        return distance <= Fraction(self.radius)

    def __str__(self) -> str:
        return f"{self.centre} ± {self.radius}"


State = tuple[Interval, Interval, Interval, Interval]


@dataclass(frozen=True)
class Enclosure:
    """Intervals that contain the exact q1, q2 (rad), u1, u2 (rad/s) of a scene, at times (s).

    The approximate motion has precision `bits` and consists of `steps` of order `order`.
    """

    scene: Scene
    times: tuple[float, ...]
    states: tuple[State, ...]
    bits: int
    order: int
    steps: int

    @property
    def how(self) -> str:
        """A one-line description of the proof."""
        return (
            f"proven by ball arithmetic, around a motion in {self.bits} bits (momenta, order "
            f"{self.order}, {self.steps} steps)"
        )

    def worth(self, index: int) -> str:
        """Return a description of the accuracy of the state at a time."""
        radius = max(float(interval.radius) for interval in self.states[index])
        return f"within {radius:.3g}"

    def document(self) -> dict[str, Any]:
        """Return it as JSON-compatible data, with scene and initial state as exact numbers."""
        names = ("q1", "q2", "u1", "u2")
        return {
            **exact_inputs(self.scene),
            "approximate_motion": {"equations": "momenta", "bits": self.bits, "order": self.order},
            "proof": "defect of the approximate motion in balls; comparison theorem for the error",
            "versions": package_versions("python-flint", "heyoka"),
            "states": [
                {"t": repr(time)}
                | {name: interval._asdict() for name, interval in zip(names, state, strict=True)}
                for time, state in zip(self.times, self.states, strict=True)
            ],
        }

    def csv(self) -> str:
        """Return centres and radii as comma-separated values, one line per time."""
        names = [f"{name}{kind}" for name in ("q1", "q2", "u1", "u2") for kind in ("", "_radius")]
        rows = [
            [repr(time), *(number for interval in state for number in interval)]
            for time, state in zip(self.times, self.states, strict=True)
        ]
        return "\n".join(",".join(row) for row in [["t", *names], *rows]) + "\n"

    @property
    def radius(self) -> float:
        """The largest radius of any interval (rad, rad/s)."""
        return max(float(interval.radius) for state in self.states for interval in state)

    def contains(self, index: int, state: Any) -> bool:
        """Return whether the intervals at a time contain q1, q2, u1, u2.

        Numbers may be floats (taken exactly), decimal numbers or Fractions.
        """
        return all(x in interval for x, interval in zip(state, self.states[index], strict=True))


def enclosure(
    scene: Scene,
    digits: int = 30,
    times: tuple[float, ...] | None = None,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Enclosure:
    """Return intervals that contain a scene's states at times (s), with radii below 10^−digits.

    Times must increase, within the run; the default is its end. Proofs in several threads take
    turns. Raises `SimulationError` if python-flint or heyoka is missing, for scenes with events,
    and if the motion loses more digits than can be computed in reasonable time, and `TooMuchError`
    if the proof exceeds the `limits`.
    """
    check_run(scene, progress, limits)
    asked = asked_times(scene, times)
    digits = as_count("digits", digits)
    if has_events(scene):
        raise SimulationError(
            "the scene of a rigorous enclosure must have no events: no dry friction, obstacles or "
            "piecewise torques"
        )
    if not 1 <= digits <= MOST_LOST:
        raise SimulationError(
            f"digits of an enclosure must be a whole number from 1 to {MOST_LOST}; got {digits}"
        )
    report = progress or (lambda stage, share: None)
    loss = _expected_loss(scene, asked[-1])
    if loss > MOST_LOST:
        raise SimulationError(
            f"the enclosure must lose at most {MOST_LOST} digits; it loses more until "
            f"{asked[-1]:g} s, so use shorter times"
        )
    own = digits + math.ceil(_MORE_LOST * loss) + _GUARD
    for _ in range(_MOST_TRIES):
        try:
            found = _in_a_thread(scene, asked, own, report, limits)
        except TubeLeftError:
            own += digits + math.ceil(loss / 4)
            continue
        if found.radius <= 10.0**-digits:
            return found
        own += math.ceil(math.log10(found.radius) + digits) + _GUARD
    raise SimulationError(
        f"found no enclosure to {digits} digits; {own} digits in each step do not suffice for this "
        "motion"
    )


def _in_a_thread(
    scene: Scene,
    asked: tuple[float, ...],
    digits: int,
    report: Callable[[str, float], None],
    limits: Limits,
) -> Enclosure:
    """Return the enclosure around an approximate motion; an interrupt ends it at once."""

    def proven(go_on: Callable[[], None]) -> Enclosure:
        def advance(share: float) -> None:
            go_on()
            report("proving", share)

        return _proven(scene, asked, digits, limits.timed(f"a proof in {digits} digits", advance))

    (found,) = side_by_side(proven)
    return found


def _proven(
    scene: Scene, asked: tuple[float, ...], digits: int, report: Callable[[float], None]
) -> Enclosure:
    """Return the enclosure around an approximate motion of the given number of digits."""
    library = flint()
    arb = library.arb
    motion = precise_motion(scene, "momenta", digits)
    terms = max(math.ceil((digits + _GUARD) / math.log10(DISC)), motion.integrator.order + 2)
    steps, states = 0, []
    with _balls(library, motion.bits + _MORE_BITS, terms):
        chain = scene.moving_chain.convert(arb)
        tube, now = arb(_TUBE), arb(0)
        frame = Frame.around(library, [arb(0)] * 4)
        end = [arb(x) for x in (*scene.q, *scene.u)]
        for target in asked:
            arrived = target == 0
            while not arrived:
                q, length, arrived = _approximation(library, motion, target, now)
                step = Step(library, chain, scene.effects, q, now, length, library.ctx.prec, terms)
                jump = [abs(x - y).upper() for x, y in zip(step.state(0), end, strict=True)]
                frame = step.after(frame.moved(jump), tube)
                end = step.state(length)
                now = arb(target) if arrived else now + length
                steps += 1
                report(float(now.mid()) / asked[-1])
            states.append(tuple(map(_interval, end, frame.bounds())))
    found: Any = tuple(states)
    return Enclosure(scene, asked, found, motion.bits, motion.integrator.order, steps)


def _approximation(
    library: Any, motion: PreciseMotion, target: float, now: Any
) -> tuple[tuple[list[Any], list[Any]], Any, bool]:
    """Take a step towards a time (s); return q̂1, q̂2, its length, and whether it ends there."""
    integrator, arb = motion.integrator, library.arb
    left = motion.number(target) - integrator.time
    last = left <= motion.longest_step
    longest = left if last else motion.longest_step
    length = motion.step(longest)
    arrived = bool(last and length == left)
    # Rounding of decimals is harmless: the polynomial is defined by the rounded numbers.
    q1, q2 = ([arb(str(c)).mid() for c in row] for row in integrator.tc[:2])
    return (q1, q2), (arb(target) - now if arrived else arb(str(length)).mid()), arrived


def _expected_loss(scene: Scene, until: float) -> float:
    """Estimate the digits that the bounds lose until a time (s), by a run in float64."""
    library = flint()
    arb = library.arb
    if until == 0:
        return 0.0
    times = np.linspace(0.0, until, max(50, math.ceil(50 * until)))
    run = motion_run(scene, times, formulation="momenta")
    chain, loss = scene.moving_chain, 0.0
    with _ONE_AT_A_TIME, library.ctx.workprec(COARSE_BITS):
        frame = Frame.around(library, [arb(1)] * 4)
        for time, *state in zip(times[:-1], *run.q, *run.u, strict=False):
            point = [float(x) for x in state]
            A = library.arb_mat(4, 4)
            A[0, 2] = A[1, 3] = 1
            for by, column in enumerate(jacobian(chain, scene.effects, point, float(time))):
                A[2, by], A[3, by] = column
            frame = frame.after(library, (A * arb(times[1])).exp())
            loss = max(float(bound.log().mid()) / math.log(10) for bound in frame.bounds())
            if loss > MOST_LOST:
                break
    return loss


@contextmanager
def _balls(library: Any, bits: int, terms: int) -> Iterator[None]:
    """Set the bits of balls and the terms of series within the block, then restore them."""
    with _ONE_AT_A_TIME, library.ctx.workprec(bits):
        cap = library.ctx.cap
        library.ctx.cap = terms
        try:
            yield
        finally:
            library.ctx.cap = cap


def _interval(ball: Any, bound: Any) -> Interval:
    """Return a decimal interval that contains all numbers within a bound of a ball."""
    middle, width = _exact(ball.mid()), _exact(ball.rad()) + _exact(bound.upper())
    if width == 0:
        return Interval(_decimal(middle), "0")
    # One digit beyond the first of the radius; the radius absorbs this rounding.
    places = max(0, 1 - math.floor(_log10(width)))
    centre = Fraction(round(middle * 10**places), 10**places)
    width += abs(middle - centre)
    unit = Fraction(10) ** (math.floor(_log10(width)) - 2)
    radius = math.ceil(width / unit) * unit
    return Interval(_decimal(centre), f"{Decimal(radius.numerator) / Decimal(radius.denominator)}")


def _exact(ball: Any) -> Fraction:
    """Return an exact ball as a rational."""
    mantissa, exponent = (int(part) for part in ball.man_exp())
    return Fraction(mantissa) * Fraction(2) ** exponent


def _log10(x: Fraction) -> float:
    return math.log10(x.numerator) - math.log10(x.denominator)


def _decimal(x: Fraction) -> str:
    """Return a rational whose denominator has no factors but 2 and 5, as a decimal number."""
    with localcontext() as context:
        context.prec = 5000
        return f"{Decimal(x.numerator) / Decimal(x.denominator):f}"
