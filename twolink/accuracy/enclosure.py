"""Rigorous enclosures: intervals that provably contain the true motion of a smooth scene.

heyoka proposes and ball arithmetic proves. A motion in some hundred digits, by the momenta's
equations, gives a polynomial for each step of each angle. These are the witnesses, and where they
come from is of no account: `twolink.accuracy.witness` says what is proven of each, by running the
text of `twolink.lagrange` on balls. At the end of a step its bounds on |x − y|, and the jump to the
next witness, which is computed in balls too, are where the next step's bounds begin. The bounds
grow by the sizes of the Jacobian's entries, without their signs, so much faster than errors do: 36
digits in ten seconds where errors lose five. Digits are cheap: so many more are computed.

The bound is a proof if python-flint's balls contain what they are said to contain (Arb's outward
rounding) and Python computes integers rightly. The problem it answers is Lagrange's text with the
scene's float64 numbers taken exactly, as effects hand them over (a unit vector that gravity makes
of its direction, say, is one of float64). That inverse and forward dynamics are the same equations
is shown in symbols by the tests. heyoka, and rounding in whatever it does, are not trusted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from twolink.accuracy.multiprecision import PreciseMotion, precise_motion
from twolink.accuracy.reference import asked_times, exact_inputs, has_events
from twolink.accuracy.witness import (
    COARSE_BITS,
    DISC,
    Step,
    TubeLeftError,
    comparison,
    grown,
)
from twolink.errors import SimulationError
from twolink.optional import flint
from twolink.provenance import package_versions
from twolink.scene import Scene
from twolink.simulation.motion import motion_run

# What is proven is proven while it is narrower than this (rad, rad/s).
_TUBE = 2.0**-24

# More digits than this to lose would take hours.
MOST_LOST = 400

# Digits beyond those asked for and those to be lost, at first and for each new try.
_GUARD, _MOST_TRIES = 8, 3

# Bits in balls beyond those of the witness, so that the proof adds little to its errors.
_MORE_BITS = 64


class Interval(NamedTuple):
    """All numbers within `radius` of `centre`, two decimal numbers that are meant exactly."""

    centre: str
    radius: str

    def __contains__(self, number: object) -> bool:
        """Return whether a float, an integer, a Fraction, a Decimal or a decimal lies in it."""
        exact: Any = number
        distance = abs(Fraction(exact) - Fraction(self.centre))
        return distance <= Fraction(self.radius)

    def __str__(self) -> str:
        return f"{self.centre} ± {self.radius}"


State = tuple[Interval, Interval, Interval, Interval]


@dataclass(frozen=True)
class Enclosure:
    """Intervals that contain the true q1, q2 (rad), u1, u2 (rad/s) of a scene, at times (s).

    The witness was computed in so many `bits`, by `steps` of an `order`.
    """

    scene: Scene
    times: tuple[float, ...]
    states: tuple[State, ...]
    bits: int
    order: int
    steps: int

    @property
    def how(self) -> str:
        """One line on the proof."""
        return (
            f"proven by ball arithmetic, beside a motion in {self.bits} bits (momenta, order "
            f"{self.order}, {self.steps} steps)"
        )

    def worth(self, index: int) -> str:
        """Return in words how good the state at a time is."""
        radius = max(float(interval.radius) for interval in self.states[index])
        return f"within {radius:.3g}"

    def document(self) -> dict[str, Any]:
        """Return it as plain data, with the scene and its start as exact numbers."""
        names = ("q1", "q2", "u1", "u2")
        return {
            **exact_inputs(self.scene),
            "witness": {"equations": "momenta", "bits": self.bits, "order": self.order},
            "proof": "inverse dynamics of the witness in balls; a comparison theorem for the rest",
            "versions": package_versions("python-flint", "heyoka"),
            "states": [
                {"t": repr(time)}
                | {name: interval._asdict() for name, interval in zip(names, state, strict=True)}
                for time, state in zip(self.times, self.states, strict=True)
            ],
        }

    def csv(self) -> str:
        """Return centres and radii as comma-separated values, a line for each time."""
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
        """Return whether q1, q2, u1, u2 may be the state at a time: whether all are inside.

        Numbers may be floats, which are taken exactly, decimal numbers, or Fractions.
        """
        return all(x in interval for x, interval in zip(state, self.states[index], strict=True))


def enclosure(
    scene: Scene,
    digits: int = 30,
    times: tuple[float, ...] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Enclosure:
    """Return intervals that contain a scene's states at times (s), of radii below 10^−digits.

    Times are increasing, within the run; its end alone, if none are given. Raises
    `SimulationError` where python-flint or heyoka is missing, for scenes with events, and where
    more digits would be lost on the way than can be computed in reasonable time.
    """
    asked = asked_times(scene, times)
    if has_events(scene):
        raise SimulationError(
            "a rigorous enclosure of a motion with events was asked for; allowed are scenes "
            "without dry friction, obstacles, and torques in pieces"
        )
    if not 1 <= digits <= MOST_LOST:
        raise SimulationError(
            f"digits is {digits}; allowed for an enclosure is a whole number from 1 to {MOST_LOST}"
        )
    tell = progress or (lambda what, share: None)
    loss = _expected_loss(scene, asked[-1])
    if loss > MOST_LOST:
        raise SimulationError(
            f"the enclosure would lose more than {MOST_LOST} digits until {asked[-1]:g} s; allowed "
            "are times until which it loses fewer"
        )
    own = digits + math.ceil(loss) + _GUARD
    for _ in range(_MOST_TRIES):
        try:
            found = _proven(scene, asked, own, lambda share: tell("proving", share))
        except TubeLeftError:
            own += digits + math.ceil(loss / 4)
            continue
        if found.radius <= 10.0**-digits:
            return found
        own += math.ceil(math.log10(found.radius) + digits) + _GUARD
    raise SimulationError(
        f"an enclosure to {digits} digits was not found; allowed are motions for which "
        f"{own} digits in each step suffice"
    )


def _proven(
    scene: Scene, asked: tuple[float, ...], digits: int, tell: Callable[[float], None]
) -> Enclosure:
    """Return the enclosure that a witness of so many digits leads to."""
    library = flint()
    arb = library.arb
    motion = precise_motion(scene, "momenta", digits)
    terms = max(math.ceil((digits + _GUARD) / math.log10(DISC)), motion.integrator.order + 2)
    steps, states = 0, []
    with _balls(library, motion.bits + _MORE_BITS, terms):
        chain = scene.equipped.convert(arb)
        tube, now = arb(_TUBE), arb(0)
        bounds = [arb(0)] * 4
        end = [arb(x) for x in (*scene.q, *scene.u)]
        for target in asked:
            arrived = target == 0
            while not arrived:
                q, length, arrived = _witness(library, motion, target, now)
                step = Step(library, chain, scene.effects, q, now, length, library.ctx.prec, terms)
                jump = [abs(x - y).upper() for x, y in zip(step.state(0), end, strict=True)]
                bounds = step.after([x + y for x, y in zip(bounds, jump, strict=True)], tube)
                end = step.state(length)
                now = arb(target) if arrived else now + length
                steps += 1
                tell(float(now.mid()) / asked[-1])
            states.append(tuple(map(_interval, end, bounds)))
    found: Any = tuple(states)
    return Enclosure(scene, asked, found, motion.bits, motion.integrator.order, steps)


def _witness(
    library: Any, motion: PreciseMotion, target: float, now: Any
) -> tuple[tuple[list[Any], list[Any]], Any, bool]:
    """Take a step towards a time (s); return q̂1 and q̂2, its length, and whether it is there."""
    integrator, arb = motion.integrator, library.arb
    left = motion.number(target) - integrator.time
    last = left <= motion.longest_step
    longest = left if last else motion.longest_step
    outcome, length = integrator.step(max_delta_t=longest, write_tc=True)
    motion.check(outcome)
    arrived = bool(last and length == left)
    # Whatever a decimal is rounded to, the witness is the number that comes of it.
    q1, q2 = ([arb(str(c)).mid() for c in row] for row in integrator.tc[:2])
    return (q1, q2), (arb(target) - now if arrived else arb(str(length)).mid()), arrived


def _expected_loss(scene: Scene, until: float) -> float:
    """Return how many digits the bounds will lose until a time (s), by a run in float64."""
    library = flint()
    arb = library.arb
    if until == 0:
        return 0.0
    times = np.linspace(0.0, until, max(50, math.ceil(20 * until)))
    run = motion_run(scene, times, formulation="momenta")
    chain = scene.equipped.convert(arb)
    bounds, zero, loss = [arb(1)] * 4, [arb(0)] * 4, 0.0
    with library.ctx.workprec(COARSE_BITS):
        for time, *state in zip(times[:-1], *run.q, *run.u, strict=False):
            box = [arb(float(x)) for x in state]
            B = comparison(library, chain, scene.effects, box, arb(float(time)))
            bounds = grown(library, B, zero, bounds, arb(times[1]))
            loss = max(float(bound.log().mid()) / math.log(10) for bound in bounds)
            if loss > MOST_LOST:
                break
    return loss


@contextmanager
def _balls(library: Any, bits: int, terms: int) -> Iterator[None]:
    """Compute in balls of so many bits, and in series of so many terms; leave all as it was."""
    cap = library.ctx.cap
    with library.ctx.workprec(bits):
        library.ctx.cap = terms
        try:
            yield
        finally:
            library.ctx.cap = cap


def _interval(ball: Any, bound: Any) -> Interval:
    """Return an interval of decimal numbers that contains all that is within a bound of a ball."""
    middle, width = _exact(ball.mid()), _exact(ball.rad()) + _exact(bound.upper())
    if width == 0:
        return Interval(_decimal(middle), "0")
    # A digit beyond the first of the radius; what that rounds away, the radius takes up.
    places = max(0, 1 - math.floor(_log10(width)))
    centre = Fraction(round(middle * 10**places), 10**places)
    width += abs(middle - centre)
    unit = Fraction(10) ** (math.floor(_log10(width)) - 2)
    radius = math.ceil(width / unit) * unit
    return Interval(_decimal(centre), f"{Decimal(radius.numerator) / Decimal(radius.denominator)}")


def _exact(ball: Any) -> Fraction:
    """Return a ball without width as the rational that it is."""
    mantissa, exponent = (int(part) for part in ball.man_exp())
    return Fraction(mantissa) * Fraction(2) ** exponent


def _log10(x: Fraction) -> float:
    return math.log10(x.numerator) - math.log10(x.denominator)


def _decimal(x: Fraction) -> str:
    """Return a rational whose denominator has no factors but 2 and 5, as a decimal number."""
    with localcontext() as context:
        context.prec = 5000
        return f"{Decimal(x.numerator) / Decimal(x.denominator):f}"
