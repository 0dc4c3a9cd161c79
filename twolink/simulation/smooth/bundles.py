"""One motion in several lanes side by side, with steps of different lengths: a bundle.

An integrator takes a step of all lanes at once, in vector instructions: four lanes take little
longer than one. They have one order p, and differ in the lengths of their steps. A step of heyoka
is proportional to (s / |x_p|)^{1/p}, with the last coefficients x_p and the size s of the state,
its largest variable or 1 (Jorba and Zou, A software package for the numerical integration of ODEs
by means of high-order Taylor methods, 2005, section 3.2). A constant variable that is larger than
all others is that size: it selects the truncation error of a step, s exp(−2 (p + 1)), continuously
and for each lane by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.errors import IntegrationError
from twolink.integration.precisions import PRECISIONS
from twolink.names import EquationsName
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation.memo import Memo
from twolink.simulation.pool import IntegratorPool
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS, expressions_of
from twolink.values import Content

RATIOS = np.array([1.0, 300.0, 900.0, 1.0])
"""The truncation errors of the steps of all lanes, in those of the first."""

FIRST, SECOND, LONGEST, MOVED = range(4)
"""The lanes: the first, the second, that of the longest steps, and that of another start.

The third may start elsewhere too.
"""

Starts = tuple[tuple[Pair, Pair], tuple[Pair, Pair]]
"""The angles (rad) and speeds (rad/s) from which the third and the last lane start."""

_LANES = len(RATIOS)

# The start of each lane: the first two have one.
_STARTS = [0, 0, 1, 2]

# The least number of steps of a lane: within the first one, all lanes have the same polynomial.
_LEAST_STEPS = 8

# The part of a motion between two checks of signals and progress, in longest steps, and the most
# steps in it: they take at most a tenth of a second. Lanes end a step at the ends of each part.
_AT_ONCE, _MOST_AT_ONCE = 500, 100_000


class Followed(NamedTuple):
    """q and u of all lanes at the times of a grid, shape (lanes, 4, n), and their steps.

    `largest` is the largest variable of all lanes at all times. `steps` has the number of steps of
    each lane, and `ends` the times (s) at which these end, shape (lanes, m): a lane that arrives
    early waits there for the others.
    """

    motions: Array
    largest: float
    steps: tuple[int, ...]
    ends: Array


@dataclass(frozen=True)
class Bundle:
    """Compiled code for bundles of any start of a scene, in double precision.

    A term of the series takes a number of `operations`.
    """

    pool: IntegratorPool
    chain: Chain
    formulation: EquationsName
    order: int
    operations: int

    def follow(
        self,
        scene: Scene,
        grid: Array,
        size: float,
        cap: float,
        progress: Callable[[float], None] | None = None,
        moved: Starts | None = None,
    ) -> Followed:
        """Return the motions at rising times of a grid (s), within the duration of a scene.

        The first lane has the `size` of its state, and no step is longer than `cap` (s). The third
        and the last lane start from angles and speeds that are `moved`. Raises `IntegrationError`
        if a lane does not reach the end.
        """
        caps = self._caps(scene.duration, cap)
        parts = list(_parts(grid, scene.duration, cap))
        rows: list[Array] = []
        ends: list[bytes] = []
        steps = np.zeros(_LANES, int)
        with self.pool.lend() as integrator:
            usual = scene.q, scene.u
            self._start(integrator, size, (usual, *(moved or (usual, usual))))
            note = _noting(integrator, ends)
            for part in parts:
                known, taken = _followed(integrator, part, caps, note)
                rows.append(known)
                steps += taken
                if progress is not None:
                    progress(float(part[-1]) / scene.duration)
        # The last time of a part is the first one of the next.
        times = np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
        # Arrays of consecutive times are the fastest.
        rows[1:] = [row[1:] for row in rows[1:]]
        variables = np.ascontiguousarray(np.concatenate(rows).T)
        largest = float(np.abs(variables).max())
        if not math.isfinite(largest):
            raise _not_finite(0.0)
        if len(times) > len(grid):
            variables = variables[..., np.searchsorted(times, grid)]
        noted: Any = np.ndarray((len(ends), _LANES), float, b"".join(ends))
        return Followed(self._motions(variables), largest, tuple(steps.tolist()), noted.T)

    def _motions(self, variables: Array) -> Array:
        """Return q and u of variables, both of shape (lanes, 4, n)."""
        q, x = (variables[:, pair].transpose(1, 0, 2) for pair in (slice(2), slice(2, 4)))
        u = EQUATIONS[self.formulation].to_speeds(self.chain, tuple(q), tuple(x))
        return np.stack([*q, *u], axis=1)

    def _start(self, integrator: Any, size: float, starts: Any) -> None:
        """Set the lanes of an integrator to the starts of the first, the third and the last one."""
        from_speeds = EQUATIONS[self.formulation].from_speeds
        states = np.array([[*q, *from_speeds(self.chain, q, u)] for q, u in starts])
        integrator.state[:4] = states[_STARTS].T
        integrator.state[4] = size * RATIOS
        integrator.set_time(0.0)

    def _caps(self, duration: float, cap: float) -> Array:
        """Return the longest step (s) of each lane, in the ratios that other steps have."""
        lengths = RATIOS ** (1 / self.order)
        found = min(cap, duration / _LEAST_STEPS) * lengths / lengths[LONGEST]
        # heyoka takes no step of zero as the longest one of the shortest motions.
        return np.maximum(found, np.finfo(float).tiny)


def _noting(integrator: Any, ends: list[bytes]) -> Callable[[Any], bool]:
    """Return a callback that notes the times of all lanes after each step."""
    note_end, copied = ends.append, integrator.time.tobytes

    def note(integrator: Any) -> bool:
        note_end(copied())
        return True

    return note


def _followed(
    integrator: Any, times: Array, caps: Array, note: Callable[[Any], bool]
) -> tuple[Array, tuple[int, ...]]:
    """Return the variables of all lanes at times (s), shape (n, 4, lanes), and their steps."""
    _, found = integrator.propagate_grid(
        np.repeat(times[:, None], _LANES, axis=1),
        max_delta_t=caps,
        max_steps=_MOST_AT_ONCE,
        callback=note,
    )
    outcomes, _, _, steps = zip(*integrator.propagate_res, strict=True)
    reached = float(integrator.time.min())
    if heyoka().taylor_outcome.step_limit in outcomes:
        raise IntegrationError(
            f"lanes side by side take more than {_MOST_AT_ONCE} steps after {reached:.6g} s"
        )
    if set(outcomes) != {heyoka().taylor_outcome.time_limit}:
        raise _not_finite(reached)
    return found[:, :4], steps


def _not_finite(reached: float) -> IntegrationError:
    """Return the error of lanes whose values become too large."""
    return IntegrationError(
        f"lanes side by side could not be integrated beyond {reached:.6g} s: values must be finite"
    )


def _parts(grid: Array, duration: float, cap: float) -> Iterator[Array]:
    """Yield the times of a grid (s) in parts, each with its first and last time.

    The parts depend on the duration and the longest step (s) alone, so that steps do.
    """
    ends = np.linspace(0.0, duration, math.ceil(duration / (_AT_ONCE * cap)) + 1)
    for begin, end in pairwise(ends.tolist()):
        inside = grid[np.searchsorted(grid, begin, "right") : np.searchsorted(grid, end)]
        yield np.concatenate([[begin], inside, [end]])


def _compile(chain: Content, effects: Content, formulation: EquationsName, order: int) -> Bundle:
    """Return compiled code, for scenes that differ only in their start."""
    hy, double = heyoka(), PRECISIONS["double"]
    (given,) = chain.objects
    own = given.convert(float)
    size = hy.make_vars("size")
    integrator = hy.taylor_adaptive_batch(
        [*expressions_of(formulation, own, effects.objects, float), (size, hy.expression(0.0))],
        np.zeros((5, _LANES)),
        tol=double.step_tolerance(order),
        opt_level=double.codes[0].level,
    )
    operations = len(integrator.decomposition) - 2 * integrator.dim
    return Bundle(IntegratorPool(integrator), own, formulation, order, operations)


BUNDLES = Memo(_compile, 128)
"""The code of the last bundles, by chain, effects, formulation and order."""
