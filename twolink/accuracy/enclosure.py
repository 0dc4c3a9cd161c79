"""Rigorous enclosures: intervals that provably contain the exact motion of a scene.

heyoka computes an approximate motion, and ball arithmetic proves a bound on its error. The
approximate motion has about a hundred digits, uses the equations in momenta, and gives a polynomial
for each angle and step. The proof makes no assumption about these polynomials:
`twolink.accuracy.defect_bound` bounds the defect of each by evaluating the formulas of
`twolink.lagrange` on balls. The initial errors of a step are the final errors of the step before
plus the jump between both polynomials, computed in balls. They are kept in frames that turn with
the motion (`twolink.accuracy.frames`), so that bounds grow as errors do. The approximate motion is
computed with as many additional digits as they lose.

Impacts on rigid contacts are enclosed as well (`twolink.accuracy.enclosed_run`): each is proven to
be the only one in a short bracket of time, and its law takes the same branch for all motions there.

The proof relies on the inclusion property of python-flint's balls (Arb's outward rounding) and on
Python's integers. The equations are the Lagrange formulation with the exact values of the scene's
numbers. What follows from them is computed in balls: unit vectors of gravity and of surfaces, and
the bounds of contacts. The tests show symbolically that inverse and forward dynamics are the same
equations. The proof does not rely on heyoka or its rounding.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twolink.accuracy.defect_bound import COARSE_BITS, jacobian
from twolink.accuracy.enclosed_impact import EnclosedImpact
from twolink.accuracy.enclosed_run import (
    ONE_AT_A_TIME,
    TUBE,
    Ended,
    ProvenRun,
    State,
    proven_run,
)
from twolink.accuracy.frames import Frame
from twolink.accuracy.interval import as_exact
from twolink.accuracy.reference import asked_times, exact_inputs
from twolink.effects import contact_elements, discontinuities
from twolink.environment import package_versions
from twolink.errors import SimulationError
from twolink.inputs import as_count, as_tuple, refuse
from twolink.interruptible import side_by_side
from twolink.limits import DEFAULT_LIMITS, UNLIMITED, Limits
from twolink.optional import flint
from twolink.scene import Scene
from twolink.simulation.motion import check_run, has_modes, motion_run

# A larger loss of digits would take hours.
MOST_LOST = 400

# The bounds lose somewhat more than the estimate, which is that of one error at the start.
_MORE_LOST = 1.2

# Digits beyond the requested and the lost ones, at first.
_GUARD = 8

# Digits without which errors leave the tube, however few are asked for.
_OF_THE_TUBE = math.ceil(-math.log10(TUBE))

# Number of proofs with more and more digits: impacts lose digits that no estimate knows.
_MOST_TRIES, _MOST_TRIES_WITH_IMPACTS = 3, 6


@dataclass(frozen=True)
class Enclosure:
    """Intervals that contain the exact q1, q2 (rad), u1, u2 (rad/s) of a scene, at times (s).

    `impacts` has intervals of all impacts until the last of the times. A proof that ends before
    has the states until then, and `ended` with its reason. The approximate motion has precision
    `bits` and consists of `steps` of order `order`.
    """

    scene: Scene
    times: tuple[float, ...]
    states: tuple[State, ...]
    bits: int
    order: int
    steps: int
    impacts: tuple[EnclosedImpact, ...] = ()
    ended: Ended | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what is not simulated of a URDF."""
        return self.scene.notes

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
            "impacts": [impact.document() for impact in self.impacts],
            "ended": self.ended and {"t": self.ended.time, "reason": self.ended.reason},
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
        """The largest radius of any interval (rad, rad/s, and the units of an impact)."""
        states = [float(interval.radius) for state in self.states for interval in state]
        return max([*states, *(impact.radius for impact in self.impacts)], default=0.0)

    def contains(self, index: int, state: Any) -> bool:
        """Return whether the intervals at a time contain q1, q2, u1, u2.

        Numbers may be floats (taken exactly), decimal numbers or Fractions. Raises `ParameterError`
        for anything but four of them.
        """
        wanted = "four numbers: q1, q2, u1 and u2"
        entries = as_tuple("state", state, wanted)
        if len(entries) != 4:
            refuse("state", entries, wanted)
        numbers = [as_exact(f"state[{k}]", entry) for k, entry in enumerate(entries)]
        return all(x in interval for x, interval in zip(numbers, self.states[index], strict=True))


def enclosure(
    scene: Scene,
    digits: int = 30,
    times: tuple[float, ...] | None = None,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Enclosure:
    """Return intervals that contain a scene's states at times (s), with radii below 10^−digits.

    Times must increase, within the run; the default is its end. The scene may have rigid surfaces
    and joint stops: then the result has the impacts as well, and ends early where bounces
    accumulate within 10^−digits s, where a contact persists, and where no number of digits that was
    tried decides about an impact. Proofs in several threads take turns. Raises `ParameterError` for
    an invalid number of digits, `SimulationError` if python-flint or heyoka is missing, for scenes
    with other events or with a contact at the start, and if the motion loses more digits than can
    be computed in reasonable time, and `TooMuchError` if the proof exceeds the `limits`.
    """
    check_run(scene, progress, limits)
    asked = asked_times(scene, times)
    digits = as_count("digits", digits, 1, MOST_LOST)
    check_enclosed(scene)
    report = progress or (lambda stage, share: None)
    loss = 0.0 if has_modes(scene) else _expected_loss(scene, asked[-1])
    if loss > MOST_LOST:
        raise SimulationError(
            f"the enclosure must lose at most {MOST_LOST} digits; it loses more until "
            f"{asked[-1]:g} s, so use shorter times"
        )
    found = _proven(scene, asked, digits, loss, report, limits)
    if found.radius <= 10.0**-digits and (found.impacts or found.states):
        return found
    raise SimulationError(
        f"found no enclosure to {digits} digits; {found.bits} bits in each step do not suffice for "
        "this motion"
    )


def _proven(
    scene: Scene,
    asked: tuple[float, ...],
    digits: int,
    loss: float,
    report: Callable[[str, float], None],
    limits: Limits,
) -> Enclosure:
    """Return the first proof to a number of digits, or that with the most digits in each step."""
    least = max(digits, _OF_THE_TUBE)
    # Digits after the decimal point are asked for, and the motion has those of its largest number.
    of_size = math.ceil(math.log10(max(1.0, *map(abs, (*scene.q, *scene.u)))))
    own = least + of_size + math.ceil(_MORE_LOST * loss) + _GUARD
    for _ in range(_MOST_TRIES_WITH_IMPACTS if has_modes(scene) else _MOST_TRIES):
        run = _in_a_thread(scene, asked, own, digits, report, limits)
        reached = asked[: len(run.states)]
        found = Enclosure(
            scene, reached, run.states, run.bits, run.order, run.steps, run.impacts, run.ended
        )
        undecided = run.ended is not None and run.ended.undecided
        if undecided:
            more = least + math.ceil(loss / 4) + len(run.impacts) // 4
            left = 0 if has_modes(scene) else _lost_beyond(run, own - least, asked[-1])
            own += max(more, left)
        elif found.radius <= 10.0**-digits:
            break
        else:
            own += math.ceil(math.log10(found.radius) + digits) + _GUARD
    return found


def _lost_beyond(run: ProvenRun, lost: int, until: float) -> int:
    """Return the digits that a smooth motion loses from the end of a proof until a time (s).

    The proof has `lost` its digits at a rate that is taken as constant. The result is at most twice
    that number, as each attempt with more digits takes longer.
    """
    if run.ended is None or not run.ended.time > 0:
        return 0
    return math.ceil(lost * min(until / run.ended.time - 1, 2.0))


def check_enclosed(scene: Scene) -> None:
    """Raise `SimulationError` for scenes for which there is no proof."""
    contacts = contact_elements(scene.effects, scene.moving_chain)
    if discontinuities(scene.effects) or not all(contact.rigid for contact in contacts):
        raise SimulationError(
            "the scene of a rigorous enclosure must have no events but impacts: no dry friction in "
            "joints, compliant surfaces or piecewise torques"
        )


def _in_a_thread(
    scene: Scene,
    asked: tuple[float, ...],
    own: int,
    digits: int,
    report: Callable[[str, float], None],
    limits: Limits,
) -> ProvenRun:
    """Return a proven run around a motion of own digits; an interrupt ends it at once."""

    def proven(go_on: Callable[[], None]) -> ProvenRun:
        def advance(share: float) -> None:
            go_on()
            report("proving", share)

        timed = limits.timed(f"a proof in {own} digits", advance)
        return proven_run(scene, asked, own, 10.0**-digits, timed)

    (found,) = side_by_side(proven)
    return found


def _expected_loss(scene: Scene, until: float) -> float:
    """Estimate the digits that the bounds lose until a time (s), by a run in float64."""
    library = flint()
    arb = library.arb
    if until == 0:
        return 0.0
    # The least numbers have not so many others below them.
    times = np.unique(np.linspace(0.0, until, max(50, math.ceil(50 * until))))
    run = motion_run(scene, times, formulation="momenta", limits=UNLIMITED)
    chain, loss = scene.moving_chain.convert(float), 0.0
    with ONE_AT_A_TIME, library.ctx.workprec(COARSE_BITS):
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
