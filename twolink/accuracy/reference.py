"""References: the state of a scene at given times, with a requested number of correct digits.

Two runs verify a reference. They differ in precision, in the order of their Taylor series and in
the formulation, so that they share only the scene. The second is more accurate by several digits:
their difference is the error of the first, and the second is the result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from twolink.accuracy.multiprecision import precise_motion
from twolink.accuracy.precise_steps import PreciseSteps
from twolink.effects import discontinuities
from twolink.environment import package_versions
from twolink.errors import IntegrationError, SimulationError
from twolink.inputs import as_count, as_times
from twolink.integration.outcomes import check_outcome
from twolink.interruptible import side_by_side
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.motion import check_run, has_modes
from twolink.simulation.resolved import resolved_run
from twolink.simulation.shortened import MOST_STEPS_TO_RESOLVE, CheckedRun, shortened_run
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.text import distinct

# Motions with events use 113 bits, which have 34 digits; some are lost during the run.
MOST_DIGITS_WITH_EVENTS = 28
MOST_DIGITS = 1000

# Initial number of digits of each run beyond the requested ones, for the error growth of a motion
# of about ten seconds. The second has more, so that their difference is the error of the first.
_FIRST_GUARD, _SECOND_GUARD = 8, 14

# Number of repetitions with more digits; motions with larger error growth have fewer digits.
_MOST_TRIES = 4

# Digits of agreement that are discarded. If one of two runs is better by six digits, the difference
# is the error of the other, whose leading digit may be near 10. With events both errors are the
# rounding of 113 bits, which grows in the same direction: two such runs may agree by chance, by
# three digits in one case of a thousand.
_MARGIN, _MARGIN_WITH_EVENTS = 1, 3

State = tuple[str, str, str, str]


@dataclass(frozen=True)
class ReferenceRun:
    """One of the two runs: its formulation, bits, the order of its series, and its steps."""

    equations: EquationsName
    bits: int
    order: int
    steps: int


class _Run(NamedTuple):
    """A run, its states q1, q2, u1, u2 at the requested times, and its notes."""

    about: ReferenceRun
    states: list[tuple[Decimal, ...]]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reference:
    """The states of a scene at times (s), as decimal numbers.

    Each state is q1, q2 (rad), u1, u2 (rad/s), rounded to the number of decimal places in `digits`
    for its time; all digits are correct, except for rounding of the last. `notes` are sentences on
    what is not simulated, and on choices that the laws of contact leave: others are as correct.
    """

    scene: Scene
    times: tuple[float, ...]
    states: tuple[State, ...]
    digits: tuple[int, ...]
    runs: tuple[ReferenceRun, ReferenceRun]
    notes: tuple[str, ...] = ()

    @property
    def how(self) -> str:
        """A one-line description of the two runs."""
        one, other = (f"{run.equations} (order {run.order}, {run.bits} bits)" for run in self.runs)
        return f"verified by {one} and {other}"

    def worth(self, index: int) -> str:
        """Return a description of the accuracy of the state at a time."""
        return f"{self.digits[index]} digits"

    def document(self) -> dict[str, Any]:
        """Return it as JSON-compatible data, with scene and initial state as exact numbers."""
        return {
            **exact_inputs(self.scene),
            "verified_by": [
                {"equations": run.equations, "bits": run.bits, "order": run.order}
                for run in self.runs
            ],
            "versions": package_versions("heyoka"),
            **({"notes": list(self.notes)} if self.notes else {}),
            "states": [
                dict(zip(("t", "digits", "q1", "q2", "u1", "u2"), row, strict=True))
                for row in self._rows()
            ],
        }

    def csv(self) -> str:
        """Return the states as comma-separated values, one line per time."""
        rows = (",".join(map(str, row)) for row in self._rows())
        return "\n".join(["t,digits,q1,q2,u1,u2", *rows]) + "\n"

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for time, digits, state in zip(self.times, self.digits, self.states, strict=True):
            yield (repr(time), digits, *state)


def exact_inputs(scene: Scene) -> dict[str, Any]:
    """Return a scene and its initial state as exact numbers with units, JSON-compatible."""
    start = zip(("q1", "q2", "u1", "u2"), (*scene.q, *scene.u), strict=True)
    return {
        "title": scene.title,
        "inputs": "the float64 numbers that the scene's decimals parse to, exactly",
        "start": {
            name: {"decimal": str(Decimal(float(value))), "hex": float(value).hex()}
            for name, value in start
        },
        "scene": scene.to_toml(),
        "units": {"t": "s", "q1": "rad", "q2": "rad", "u1": "rad/s", "u2": "rad/s"},
    }


def reference(
    scene: Scene,
    digits: int = 60,
    times: tuple[float, ...] | None = None,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Reference:
    """Return the states of a scene at times (s) with `digits` correct decimal places.

    Times must increase, within the run; the default is its end. If a motion amplifies errors more
    than expected, both runs are repeated with more digits, a few times. A motion with events is
    limited to the digits of 113 bits. The result states its number of digits. Raises
    `ParameterError` for an invalid number of digits, `SimulationError` for invalid times and for a
    failed run, `IntegrationError` if both runs agree in no digit at a time, and `TooMuchError` for
    a run that would exceed the `limits`.
    """
    check_run(scene, progress, limits)
    digits = _as_digits(scene, digits)
    asked = asked_times(scene, times)
    grid = asked if asked[0] == 0 else (0.0, *asked)
    report = progress or (lambda stage, share: None)
    if has_events(scene):
        first, second = _by_events(scene, grid, report, limits)
        return _with_digits(_verified(scene, asked, grid, first, second, digits))
    extra = 0
    for _ in range(_MOST_TRIES):
        first, second = _side_by_side(scene, grid, digits + extra, report, limits)
        found = _verified(scene, asked, grid, first, second, digits)
        short = digits - min(found.digits)
        if short <= 0:
            break
        extra += short + 2
    return _with_digits(found)


def _with_digits(found: Reference) -> Reference:
    """Return a reference, or raise `IntegrationError` if two runs agree in no digit at a time."""
    for time, digits in zip(found.times, found.digits, strict=True):
        if digits < 0:
            raise IntegrationError(
                f"the two runs of the reference agree in no digit at {time:.6g} s, since errors"
                " grow too much until then; earlier times may have digits"
            )
    return found


def _side_by_side(
    scene: Scene,
    grid: tuple[float, ...],
    digits: int,
    report: Callable[[str, float], None],
    limits: Limits,
) -> tuple[_Run, _Run]:
    """Return two runs with additional digits, in parallel threads."""
    done = {"lagrange": 0.0, "momenta": 0.0}

    def run(equations: EquationsName, guard: int) -> Callable[[Callable[[], None]], _Run]:
        def followed(go_on: Callable[[], None]) -> _Run:
            def advance(share: float) -> None:
                go_on()
                done[equations] = share
                report(f"two runs in more than {digits} digits", sum(done.values()) / 2)

            timed = limits.timed(f"a reference of {digits} digits", advance)
            return _precise(scene, grid, equations, digits + guard, timed)

        return followed

    first, second = side_by_side(run("lagrange", _FIRST_GUARD), run("momenta", _SECOND_GUARD))
    return first, second


def has_events(scene: Scene) -> bool:
    """Return whether a scene has events: changes of mode or discontinuities of a torque."""
    return has_modes(scene) or bool(discontinuities(scene.effects))


def most_digits(scene: Scene) -> int:
    """Return the largest number of digits for a scene."""
    return MOST_DIGITS_WITH_EVENTS if has_events(scene) else MOST_DIGITS


def asked_times(scene: Scene, times: tuple[float, ...] | None) -> tuple[float, ...]:
    """Return the requested times (s), by default the end of the run.

    Raises `SimulationError` unless they increase within the run.
    """
    if times is None:
        return (scene.duration,)
    times = tuple(as_times(times).tolist())
    rising = all(a < b for a, b in pairwise(times))
    if not times or not rising or not all(0 <= t <= scene.duration for t in times):
        raise SimulationError(
            f"times must increase from 0 to {distinct(scene.duration)} s; got "
            f"{', '.join(map(distinct, times)) or 'an empty list'}"
        )
    return tuple(float(t) for t in times)


def _as_digits(scene: Scene, value: int) -> int:
    """Return a number of digits that a motion can have."""
    most = most_digits(scene)
    why = ", since its motion has events" if most == MOST_DIGITS_WITH_EVENTS else ""
    return as_count("digits", value, 1, most, why)


def _precise(
    scene: Scene,
    grid: tuple[float, ...],
    equations: EquationsName,
    digits: int,
    report: Callable[[float], None],
) -> _Run:
    """Return a run by Taylor series in multiple precision, with `digits` digits in each step.

    None of its steps passes a change of the loads.
    """

    def made(longest: float) -> CheckedRun:
        looked = PreciseSteps(scene, equations)
        run = _precise_once(scene, grid, equations, digits, longest, looked, report)
        return CheckedRun(run, looked.longest_resolving_step())

    longest, shortest = default_longest_step(scene), scene.duration / MOST_STEPS_TO_RESOLVE
    found: _Run = shortened_run(longest, shortest, made)
    return found


def _precise_once(
    scene: Scene,
    grid: tuple[float, ...],
    equations: EquationsName,
    digits: int,
    longest: float,
    looked: PreciseSteps,
    report: Callable[[float], None],
) -> _Run:
    """Return a run whose steps are no longer than a time (s), and look at all of them."""
    motion = precise_motion(scene, equations, digits)
    integrator, steps = motion.integrator, 0
    reached, states = integrator.time, []

    def each_step(stepped: Any) -> bool:
        nonlocal reached
        reached = stepped.time
        looked.add(stepped)
        report(float(stepped.time) / (grid[-1] or 1.0))
        return True

    for time in grid:
        outcome, _, _, taken, *_ = integrator.propagate_until(
            motion.number(time), max_delta_t=motion.number(longest), callback=each_step,
            write_tc=looked.are_checked,
        )  # fmt: skip
        check_outcome(outcome, reached)
        steps += taken
        states.append(_decimals(motion.speeds()))
    return _Run(ReferenceRun(equations, motion.bits, integrator.order, steps), states)


def _by_events(
    scene: Scene,
    grid: tuple[float, ...],
    report: Callable[[str, float], None],
    limits: Limits,
) -> tuple[_Run, _Run]:
    """Return two runs in 113 bits with different orders and formulations."""

    def followed(equations: EquationsName, order: int, advance: Callable[[float], None]) -> _Run:
        run = resolved_run(
            scene,
            np.array(grid),
            formulation=equations,
            precision="quadruple",
            order=order,
            progress=advance,
            limits=limits,
        )
        states = [_decimals(state) for state in zip(*run.q, *run.u, strict=True)]
        # Two runs that agree have decided the events that round-off might.
        notes = run.decided(np.array(grid), np.zeros(len(grid))).notes
        return _Run(ReferenceRun(equations, 113, run.order, run.steps), states, notes)

    return (
        followed("lagrange", 37, lambda share: report("113 bits, order 37", share / 2)),
        followed("kane", 41, lambda share: report("113 bits, order 41", (1 + share) / 2)),
    )


def _decimals(values: Any) -> tuple[Decimal, ...]:
    return tuple(Decimal(str(value)) for value in values)


def _verified(
    scene: Scene,
    asked: tuple[float, ...],
    grid: tuple[float, ...],
    first: _Run,
    second: _Run,
    digits: int,
) -> Reference:
    """Return the second run's states, each rounded to the digits that agree with the first."""
    margin = _MARGIN_WITH_EVENTS if has_events(scene) else _MARGIN
    states, right = [], []
    for time, coarse, fine in zip(grid, first.states, second.states, strict=True):
        if time not in asked:
            continue
        agreed = min(digits, _agreement(coarse, fine) - margin)
        right.append(agreed)
        states.append(tuple(_rounded(value, agreed) for value in fine))
    found: Any = tuple(states)
    notes = tuple(dict.fromkeys((*scene.notes, *second.notes, *first.notes)))
    return Reference(scene, asked, found, tuple(right), (first.about, second.about), notes)


def _agreement(coarse: tuple[Decimal, ...], fine: tuple[Decimal, ...]) -> int:
    """Return the number of decimal places in which two states agree."""
    with localcontext() as context:
        context.prec = 2 * MOST_DIGITS
        apart = max(abs(a - b) for a, b in zip(coarse, fine, strict=True))
    return 2 * MOST_DIGITS if apart == 0 else -apart.adjusted() - 1


def _rounded(value: Decimal, digits: int) -> str:
    with localcontext() as context:
        context.prec = 2 * MOST_DIGITS
        return f"{value.quantize(Decimal(1).scaleb(-digits)):f}"
