"""One run by itself: scenes with modes, and runs that lanes do not decide.

The run and its error are those of `simulate`: of a smooth scene in the precision that its accuracy
needs, of one with events judged by an independent run. The quantities are the same accumulators as
in lanes, in one lane.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.contact.impact_laws import Regime
from twolink.ensembles.blocks import Block, Ends, Impacts, Lanes
from twolink.ensembles.compiled import FORMULATION
from twolink.ensembles.quantity import Accumulator, Quantity
from twolink.ensembles.speeds import Speeds, derivatives, truncation_within
from twolink.integration.precisions import PRECISIONS
from twolink.limits import Budget, Limits
from twolink.scene import Scene
from twolink.simulation.hybrid.differences import impacts_beside
from twolink.simulation.hybrid.measure import STOPS_SHORT, Measured
from twolink.simulation.hybrid.measure import measured_run as through_events
from twolink.simulation.hybrid.run import HybridRun
from twolink.simulation.motion import has_events
from twolink.simulation.series import powers
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import intervals_to_check, pace_of
from twolink.simulation.smooth.measure import measured_run
from twolink.simulation.smooth.steps import Steps
from twolink.simulation.smooth.taylor import TaylorRun, taylor_run

Array = NDArray[np.float64]

# Places at which a run is compared with the one that measures it, at least.
_PLACES = 4001

# Units in the last place between the time of an impact and the end of its step.
_SLACK = 4

# Accuracies (rad, rad/s) that are tried in turn while a verdict is undecided: those of double, long
# double and quadruple precision.
_FINER = (1e-10, 1e-13, 1e-17, 1e-22)


class Outcome(NamedTuple):
    """How a run ended beside its numbers: a `failure`, why it ended early, or empty, and `notes`.

    It is `limited` if a limit of work ended it, or kept it from the accuracy.
    """

    failure: str = ""
    notes: tuple[str, ...] = ()
    limited: bool = False


class Single(NamedTuple):
    """The values of a run, by the names of variables; its error; and how it ended."""

    values: dict[str, Any]
    error: float
    precision: str
    undecided: bool
    outcome: Outcome


class _Run(NamedTuple):
    """A measured run: its steps, its ends, and how it ended."""

    blocks: Callable[[], Iterator[Block]]
    ends: Ends
    precision: str
    outcome: Outcome = Outcome()


def single(
    scene: Scene, kept: Sequence[Quantity], accuracy: float, refine: bool, limits: Limits
) -> Single:
    """Return the kept quantities of a run. Raises `SimulationError` if it cannot be integrated.

    With `refine` an undecided run is repeated at finer accuracies, as far as precisions go.
    """
    finer = [value for value in _FINER if value < accuracy] if refine else []
    found = _once(scene, kept, accuracy, limits)
    for wanted in finer:
        if not found.undecided:
            break
        again = _once(scene, kept, wanted, limits)
        if not again.error <= found.error:
            break
        found = again
    return found


def _once(scene: Scene, kept: Sequence[Quantity], accuracy: float, limits: Limits) -> Single:
    """Return the kept quantities of a run at one accuracy."""
    run = (_with_events if has_events(scene) else _smooth)(scene, accuracy, limits)
    q, u = (np.array(pair, dtype=float)[:, None] for pair in (scene.q, scene.u))
    chain = scene.moving_chain.convert(float)
    lanes = Lanes(chain, scene.effects, q, u, scene.duration)
    accumulators: list[Accumulator] = [quantity.accumulator(lanes) for quantity in kept]
    for block in run.blocks():
        for each in accumulators:
            each.add(block)
    values: dict[str, Any] = {}
    for each in accumulators:
        values |= {name: rows[0] for name, rows in each.values(run.ends).items()}
    undecided = any(bool(np.any(each.undecided())) for each in accumulators)
    rounding = max((float(np.max(each.rounding())) for each in accumulators), default=0.0)
    error = float(run.ends.errors[0]) + rounding
    return Single(values, error, run.precision, undecided, run.outcome)


def _smooth(scene: Scene, accuracy: float, limits: Limits) -> _Run:
    """Return a measured run of a scene without events."""
    pace = pace_of(scene)
    places = max(_PLACES, intervals_to_check(scene.duration, pace.longest_step) + 1)
    times = np.linspace(0.0, scene.duration, places)
    progress = _progress(scene, limits)
    # Quantities are those of the polynomials of the steps, which a correction would leave.
    found = measured_run(scene, times, accuracy, FORMULATION, progress, correct=False, pace=pace)
    kept = found.kept
    assert isinstance(kept, TaylorRun)
    return _Run(
        lambda: _steps(kept, times, found.errors),
        _ends(kept, found.errors),
        kept.precision,
    )


def _steps(run: TaylorRun, times: Array, errors: Array) -> Iterator[Block]:
    """Yield the steps of a run, which is repeated for them."""
    taken: list[Steps] = []
    taylor_run(
        run.scene,
        np.array([0.0, run.scene.duration]),
        formulation=run.formulation,
        precision=run.precision,
        order=run.order,
        longest_step=run.longest_step,
        code=run.code,
        observe=taken.append,
    )
    # A run that restarted with optimized code begins anew.
    first = max(k for k, steps in enumerate(taken) if steps.starts[0] == 0)
    equations, number = EQUATIONS[run.formulation], PRECISIONS[run.precision].number
    chain = run.scene.moving_chain.convert(number)
    for steps in taken[first:]:
        clocks = np.zeros_like(steps.coefficients[:, 0])
        clocks[:, 1] = clocks[:, 1] + 1
        angles = steps.coefficients[:, :2]
        block = _block(steps.starts, steps.lengths, angles, clocks, times, errors)
        q, x = np.split(np.concatenate([steps.coefficients[1:, :, 0], steps.end[None]]).T, 2)
        ends = np.array(equations.to_speeds(chain, tuple(q), tuple(x))).T
        speeds = derivatives(angles, steps.lengths, ends)
        yield block._replace(speeds=partial(_smooth_speeds, block, speeds))


def _smooth_speeds(block: Block, speeds: Any) -> Speeds:
    """Return the speeds on the steps of a block in one lane, from polynomials on [0, 1]."""
    assert block.clocks is not None
    floats, still = speeds.astype(float)[..., None], np.zeros_like(block.starts)
    cuts, moves = truncation_within(floats), block.lengths > 0
    return Speeds(block.starts, block.clocks, floats, cuts, block.errors, still, moves)


def _with_events(scene: Scene, accuracy: float, limits: Limits) -> _Run:
    """Return a measured run of a scene with events, as far as it goes."""
    times = np.linspace(0.0, scene.duration, _PLACES)
    progress = _progress(scene, limits)
    found = through_events(scene, times, accuracy, FORMULATION, progress, limits)
    kept, reached = found.kept, times[: len(found.errors)]
    ends = _ends(kept, found.errors)._replace(impacts=_impacts(kept, found.judge))
    return _Run(
        lambda: _arcs(found, reached, accuracy),
        ends,
        kept.precision,
        _outcome(found, accuracy),
    )


def _outcome(found: Measured, accuracy: float) -> Outcome:
    """Return how a run with events ended."""
    kept, notes = found.kept, found.kept.notes
    limited = found.stops_short(met=bool(found.errors.max() <= accuracy))
    if limited:
        notes += (STOPS_SHORT,)
    return Outcome(kept.failure, notes, limited or bool(kept.failure and kept.exhausted))


def _impacts(kept: HybridRun, judge: HybridRun) -> Impacts:
    """Return the numbers of impacts of a run and of the one that measures it, in one lane."""
    endless = any(
        s.impulse.regime is Regime.BOUNCES_DIE_AWAY for r in (kept, judge) for s in r.strikes
    )
    own, other = (np.array([len(run.strikes)]) for run in (kept, judge))
    return Impacts(own, other, np.array([endless]))


def _arcs(measured: Measured, times: Array, accuracy: float) -> Iterator[Block]:
    """Yield the steps of a run with events as one block."""
    polynomials, errors = measured.kept.polynomials, measured.errors
    clocks = polynomials.clocks.copy()
    by_time = ~polynomials.by_clock
    clocks[by_time, 1] = clocks[by_time, 1] + 1
    block = _block(
        polynomials.starts,
        polynomials.ends,
        polynomials.coefficients[:, :2],
        clocks,
        times,
        errors,
    )
    yield block._replace(speeds=lambda: _speeds_of_arcs(measured, block, times, accuracy))


def _speeds_of_arcs(measured: Measured, block: Block, times: Array, accuracy: float) -> Speeds:
    """Return the speeds on the steps of a run with events, and before and after each impact.

    An impact may be early or late by the error up to it. Its speeds are compared with those of the
    run that measures this one, at its own time.
    """
    assert block.clocks is not None
    kept, polynomials = measured.kept, measured.kept.polynomials
    scale = powers(polynomials.ends, polynomials.coefficients.shape[2])
    on_steps = (polynomials.coefficients[:, 2:4] * scale[:, None]).astype(float)[..., None]
    moments, at_impacts, apart = impacts_beside(kept, measured.judge, accuracy)
    instants = np.repeat(moments, 2)[:, None]
    coefficients = np.zeros((len(instants), *on_steps.shape[1:]))
    coefficients[:, :, 0, 0] = at_impacts.reshape(-1, 2)
    starts = np.concatenate([block.starts, instants])
    clocks = np.concatenate([block.clocks, np.zeros((len(instants), *block.clocks.shape[1:]))])
    ends = starts + clocks.sum(axis=1)
    shifts = _until(ends, times, measured.errors)
    struck = np.maximum(*(_at_impacts(x, moments, apart) for x in (starts, ends)))
    moves = np.concatenate([block.lengths > 0, np.ones(instants.shape, bool)])
    whole = np.concatenate([on_steps, coefficients])
    # Within steps as well both runs are compared by their polynomials, with their truncation.
    none, errors = np.zeros(whole.shape[:2] + whole.shape[3:]), np.maximum(shifts, struck)
    return Speeds(starts, clocks, whole, none, errors, shifts, moves)


def _at_impacts(times: Array, moments: Array, apart: Array) -> Array:
    """Return the largest of the errors of impacts at some times (s), which rise; 0 without any."""
    slack = _SLACK * np.spacing(times)
    first = np.searchsorted(moments, times - slack, "left")
    last = np.searchsorted(moments, times + slack, "right")
    largest = np.zeros(times.shape)
    for offset in range(int((last - first).max(initial=0))):
        place = first + offset
        here = place < last
        largest[here] = np.maximum(largest[here], apart[place[here]])
    return largest


def _block(
    starts: Any, lengths: Any, angles: Any, clocks: Any, times: Array, errors: Array
) -> Block:
    """Return steps in one lane, whose variable is the share of the step.

    In powers of the time coefficients of short steps may exceed float64.
    """
    scale = powers(lengths, angles.shape[2])
    scaled = (angles * scale[:, None]).astype(float)[..., None]
    own_clocks = (clocks * scale).astype(float)[..., None]
    begins, moves = np.asarray(starts, dtype=float)[:, None], (lengths > 0)[:, None]
    ends = begins + own_clocks.sum(axis=1)
    return Block(begins, moves.astype(float), scaled, _until(ends, times, errors), own_clocks)


def _until(ends: Array, times: Array, errors: Array) -> Array:
    """Return the bound on the error up to the ends of steps, from that up to times (s)."""
    place = np.searchsorted(times, ends[:, 0])
    found: Array = np.append(errors, errors[-1])[np.minimum(place, len(errors))][:, None]
    return found


def _ends(run: Any, errors: Array) -> Ends:
    """Return the end of a run in one lane, rounded to float64."""
    q, u = (np.array(rows, dtype=float)[:, -1:] for rows in (run.q, run.u))
    rounded = np.spacing(max(np.abs(q).max(), np.abs(u).max())) / 2
    return Ends(q, u, np.array([errors.max() + rounded]))


def _progress(scene: Scene, limits: Limits) -> Callable[[str], Callable[[float], None]]:
    """Return a function from the name of a run to one that takes its share, and enforces limits."""
    budget = Budget(limits, f"the motion over {scene.duration:g} s")
    return lambda name: budget.timed()
