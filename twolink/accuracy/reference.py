"""References: the state of a scene at chosen times, with as many right digits as are asked for.

Two runs vouch for a reference. They differ in precision, in the order of their Taylor series and in
the equations they are written with, so what they have in common beyond chance is the scene. The
second is the better one by several digits: their difference is the error of the first, and the
second is the one that is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from decimal import Decimal, localcontext
from itertools import pairwise
from typing import Any

import numpy as np

from twolink.accuracy.multiprecision import precise_motion
from twolink.effects import breaks
from twolink.errors import SimulationError
from twolink.provenance import package_versions
from twolink.scene import Scene
from twolink.simulation.motion import has_modes, motion_run

# Motions with events are followed in 113 bits, which have 34 digits; some are lost on the way.
MOST_DIGITS_WITH_EVENTS = 28
MOST_DIGITS = 1000

# Digits that each run carries beyond those asked for, at first: what a motion of some ten seconds
# amplifies. The second carries more, so that it can judge the first.
_FIRST_GUARD, _SECOND_GUARD = 8, 14

# Motions that amplify more than this many repetitions make up for are left with fewer digits.
_MOST_TRIES = 4

# Digits of their agreement that are not vouched for. Of two runs of which one is better by six
# digits, the difference is the error of the other, of which the first digit may be near to 10. With
# events both err by the rounding of 113 bits, which grows in the same direction: so two that err
# alike may agree too well, by three digits in one case of a thousand.
_MARGIN, _MARGIN_WITH_EVENTS = 1, 3

State = tuple[str, str, str, str]


@dataclass(frozen=True)
class ReferenceRun:
    """One of the runs that vouch: its equations, bits, the order of its series, and its steps."""

    equations: str
    bits: int
    order: int
    steps: int


# A run, and its states at the times asked for: q1, q2, u1, u2 in each.
_Run = tuple[ReferenceRun, list[tuple[Decimal, ...]]]


@dataclass(frozen=True)
class Reference:
    """The states of a scene at times (s), as decimal numbers.

    Each state is q1, q2 (rad), u1, u2 (rad/s), rounded to as many digits after the decimal point as
    `digits` says for its time; all of them are right, but for the rounding of the last.
    """

    scene: Scene
    times: tuple[float, ...]
    states: tuple[State, ...]
    digits: tuple[int, ...]
    runs: tuple[ReferenceRun, ReferenceRun]

    @property
    def how(self) -> str:
        """One line on who vouches."""
        one, other = (f"{run.equations} (order {run.order}, {run.bits} bits)" for run in self.runs)
        return f"vouched for by {one} and {other}"

    def worth(self, index: int) -> str:
        """Return in words how good the state at a time is."""
        return f"{self.digits[index]} digits"

    def document(self) -> dict[str, Any]:
        """Return it as plain data, with the scene and its start as exact numbers."""
        return {
            **exact_inputs(self.scene),
            "vouched_for_by": [
                {"equations": run.equations, "bits": run.bits, "order": run.order}
                for run in self.runs
            ],
            "versions": package_versions("heyoka"),
            "states": [
                dict(zip(("t", "digits", "q1", "q2", "u1", "u2"), row, strict=True))
                for row in self._rows()
            ],
        }

    def csv(self) -> str:
        """Return the states as comma-separated values, a line for each time."""
        rows = (",".join(map(str, row)) for row in self._rows())
        return "\n".join(["t,digits,q1,q2,u1,u2", *rows]) + "\n"

    def _rows(self) -> Iterator[tuple[Any, ...]]:
        for time, digits, state in zip(self.times, self.digits, self.states, strict=True):
            yield (repr(time), digits, *state)


def exact_inputs(scene: Scene) -> dict[str, Any]:
    """Return a scene and its start as exact numbers, with units, as plain data."""
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
) -> Reference:
    """Return the states of a scene at times (s) with so many right digits after the decimal point.

    Times are increasing, within the run; its end alone, if none are given. Where a motion amplifies
    more than was expected, both runs are repeated with more digits, a few times. A motion with
    events is known to as many digits as 113 bits allow. The result says how many digits it has.
    Raises `SimulationError` for what cannot be had.
    """
    asked = asked_times(scene, times)
    _check(scene, digits)
    grid = asked if asked[0] == 0 else (0.0, *asked)
    tell = progress or (lambda what, share: None)
    if has_events(scene):
        first, second = _by_events(scene, grid, tell)
        return _vouched(scene, asked, grid, first, second, digits)
    extra = 0
    for _ in range(_MOST_TRIES):
        first, second = _side_by_side(scene, grid, digits + extra, tell)
        found = _vouched(scene, asked, grid, first, second, digits)
        short = digits - min(found.digits)
        if short <= 0:
            break
        extra += short + 2
    return found


def _side_by_side(
    scene: Scene, grid: tuple[float, ...], digits: int, tell: Callable[[str, float], None]
) -> tuple[_Run, _Run]:
    """Return two runs with digits to spare, each in a thread: heyoka computes in both at once."""
    done = {"lagrange": 0.0, "momenta": 0.0}

    def run(equations: str, guard: int) -> _Run:
        def told(share: float) -> None:
            done[equations] = share
            tell(f"{digits} digits and some to spare, twice", sum(done.values()) / 2)

        return _precise(scene, grid, equations, digits + guard, told)

    with ThreadPoolExecutor(2) as threads:
        first = threads.submit(run, "lagrange", _FIRST_GUARD)
        second = threads.submit(run, "momenta", _SECOND_GUARD)
        return first.result(), second.result()


def has_events(scene: Scene) -> bool:
    """Return whether anything in a scene begins or ends: a mode, or a piece of a torque."""
    return has_modes(scene) or bool(breaks(scene.effects))


def most_digits(scene: Scene) -> int:
    """Return how many digits may be asked for."""
    return MOST_DIGITS_WITH_EVENTS if has_events(scene) else MOST_DIGITS


def asked_times(scene: Scene, times: tuple[float, ...] | None) -> tuple[float, ...]:
    """Return the times (s) that are asked for: the end of the run, if none are given.

    Raises `SimulationError` unless they increase, within the run.
    """
    if times is None:
        return (scene.duration,)
    rising = all(a < b for a, b in pairwise(times))
    if not times or not rising or not all(0 <= t <= scene.duration for t in times):
        raise SimulationError(
            f"times are {', '.join(f'{t:g}' for t in times) or 'none'}; allowed are increasing "
            f"times from 0 to {scene.duration:g} s"
        )
    return tuple(float(t) for t in times)


def _check(scene: Scene, digits: int) -> None:
    most = most_digits(scene)
    if not 1 <= digits <= most:
        why = ", since its motion has events" if most == MOST_DIGITS_WITH_EVENTS else ""
        raise SimulationError(
            f"digits is {digits}; allowed for this scene is a whole number from 1 to {most}{why}"
        )


def _precise(
    scene: Scene,
    grid: tuple[float, ...],
    equations: str,
    digits: int,
    tell: Callable[[float], None],
) -> _Run:
    """Return a run by Taylor series in multiple precision, each of its steps to so many digits."""
    motion = precise_motion(scene, equations, digits)
    integrator, steps = motion.integrator, 0
    states = []
    for time in grid:
        outcome, _, _, taken, *_ = integrator.propagate_until(
            motion.number(time), max_delta_t=motion.longest_step
        )
        motion.check(outcome)
        steps += taken
        states.append(_decimals(motion.speeds()))
        tell(time / grid[-1])
    return ReferenceRun(equations, motion.bits, integrator.order, steps), states


def _by_events(
    scene: Scene, grid: tuple[float, ...], tell: Callable[[str, float], None]
) -> tuple[_Run, _Run]:
    """Return two runs in 113 bits, at different orders and by different equations."""

    def followed(equations: str, order: int, told: Callable[[float], None]) -> _Run:
        run = motion_run(
            scene,
            np.array(grid),
            formulation=equations,
            precision="quadruple",
            order=order,
            progress=told,
        )
        states = [_decimals(state) for state in zip(*run.q, *run.u, strict=True)]
        return ReferenceRun(equations, 113, run.order, run.steps), states

    # One after the other: they share the integrators of the modes.
    return (
        followed("lagrange", 37, lambda share: tell("113 bits, order 37", share / 2)),
        followed("kane", 41, lambda share: tell("113 bits, order 41", (1 + share) / 2)),
    )


def _decimals(values: Any) -> tuple[Decimal, ...]:
    return tuple(Decimal(str(value)) for value in values)


def _vouched(
    scene: Scene,
    asked: tuple[float, ...],
    grid: tuple[float, ...],
    first: _Run,
    second: _Run,
    digits: int,
) -> Reference:
    """Return the second run's states, each to the digits in which the first agrees."""
    margin = _MARGIN_WITH_EVENTS if has_events(scene) else _MARGIN
    states, right = [], []
    for time, coarse, fine in zip(grid, first[1], second[1], strict=True):
        if time not in asked:
            continue
        agreed = min(digits, _agreement(coarse, fine) - margin)
        right.append(agreed)
        states.append(tuple(_rounded(value, agreed) for value in fine))
    found: Any = tuple(states)
    return Reference(scene, asked, found, tuple(right), (first[0], second[0]))


def _agreement(coarse: tuple[Decimal, ...], fine: tuple[Decimal, ...]) -> int:
    """Return to how many digits after the decimal point two states agree."""
    with localcontext() as context:
        context.prec = 2 * MOST_DIGITS
        apart = max(abs(a - b) for a, b in zip(coarse, fine, strict=True))
    return 2 * MOST_DIGITS if apart == 0 else -apart.adjusted() - 1


def _rounded(value: Decimal, digits: int) -> str:
    with localcontext() as context:
        context.prec = 2 * MOST_DIGITS
        return f"{value.quantize(Decimal(1).scaleb(-digits)):f}"
