"""Lyapunov exponents: the mean rates at which neighbouring motions separate or approach.

Four derivatives of the motion by its start are integrated with it, in canonical variables (q, p),
and made orthonormal again before their lengths differ by many powers of ten; the logarithms of
their stretches are summed (Benettin, Galgani, Giorgilli and Strelcyn, Lyapunov characteristic
exponents for smooth dynamical systems, 1980). In canonical variables the exponents of a
conservative motion sum to zero over any time, by Liouville's theorem.

Exponents are limits for infinite time. A finite run gives a mean, whose error is estimated from
the scatter of its blocks, and separation by a power of time looks like an exponent of ln(T)/T. A
motion that stays long in one part of phase space and long in another has a larger error than this
estimate. In a chaotic motion round-off replaces the motion by another of
nearly the same energy, which has the same exponents unless it lies in another part of phase space.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twolink import lagrange
from twolink.errors import ParameterError
from twolink.inputs import as_count, as_duration, check_callback, check_instance
from twolink.integration.outcomes import check_arrival, last_time
from twolink.integration.precisions import Code
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.scene import Scene
from twolink.simulation.smooth.longest_step import default_longest_step
from twolink.tables import Column, Table, table
from twolink.variations.directions import Direction
from twolink.variations.smooth import check_smooth
from twolink.variations.system import VariedSystem, VariedSystems

Array = NDArray[np.float64]

# The ratio of the largest stretch and the least one between two orthonormalisations, of which the
# latter loses as many digits.
_MOST_STRETCH = 1e5

# A step at full order is the radius of convergence over e² (Jorba and Zou, 2005, section 3.2).
_RADIUS_IN_STEPS = math.e**2

# The longest time between two orthonormalisations, in time scales of the motion. Small oscillations
# of a rate ω have a scale of about 10/ω, so that each period has two or three of these.
_LONGEST_INTERVAL = 0.25

# Standard errors beyond which a sign is decided.
_SIGMAS = 3

# Merged blocks below this number have no scatter worth the name.
_FEWEST = 5

# Long runs are worth the half second of optimization.
_CODE = Code(compact=True, level=3)

# Change of an angle (rad), or of its momentum in these units, of a chain that does not move.
_STILL = 1e-9

_UNVARIED = tuple(Direction((), (0.0, 0.0), (0.0, 0.0)) for _ in range(4))


@dataclass(frozen=True)
class Spectrum:
    """The Lyapunov exponents (1/s) of a motion over `seconds`, in decreasing order, shape (4,).

    `blocks`, shape (blocks, 4), are the exponents over successive parts of the run, of which
    `exponents` is the mean. `resolution` (1/s) is the apparent exponent of a separation that grows
    linearly with time: smaller exponents cannot be distinguished from zero. If the chain does not
    move, the exponents are those of an equilibrium, `at_rest`, which is not chaotic. `departures`,
    shape (4,), are the largest ranges in a block of the logarithms of stretches about their steady
    growth.
    """

    scene: Scene
    seconds: float
    blocks: Array
    resolution: float
    at_rest: bool = False
    departures: Array = field(default_factory=lambda: np.zeros(4))

    @property
    def exponents(self) -> Array:
        """The exponents (1/s)."""
        return np.asarray(self.blocks.mean(axis=0))

    @property
    def spread(self) -> Array:
        """The standard errors (1/s) of the exponents, from the scatter of the blocks.

        Blocks are merged by two and by four, too, where five or more remain, and the largest error
        counts: successive blocks are not independent (Flyvbjerg and Petersen, Error estimates on
        averages of correlated data, 1989). Blocks in step with an oscillation of the stretches do
        not show it: an error is at least the share of their departures in the time.
        """
        errors = [_standard_error(self.blocks), self.departures / self.seconds]
        for size in (2, 4):
            count = len(self.blocks) // size
            if count >= _FEWEST:
                merged = self.blocks[-count * size :].reshape(count, size, 4).mean(axis=1)
                errors.append(_standard_error(merged))
        return np.asarray(np.max(errors, axis=0))

    @property
    def total(self) -> float:
        """The sum of the exponents (1/s): zero for a conservative motion."""
        return float(self.exponents.sum())

    @property
    def chaotic(self) -> bool | None:
        """Whether the largest exponent is positive; None if the run is too short to tell."""
        largest, known = float(self.exponents[0]), _SIGMAS * float(self.spread[0])
        zero = 2 * self.resolution
        if self.at_rest:
            return False
        if largest > known + zero:
            return True
        return False if largest < zero and known < zero else None

    @property
    def verdict(self) -> str:
        """A sentence on the sign of the largest exponent, and on how far it is known."""
        largest, spread = self.exponents[0], self.spread[0]
        known = f"the largest exponent is {largest:.4g} ± {spread:.1g} 1/s, over {self.seconds:g} s"
        if self.at_rest:
            return f"The chain is at rest; of small deviations from it {known}."
        if self.chaotic:
            return f"The motion is chaotic: {known}."
        apart = f"a separation linear in time gives {self.resolution:.2g} 1/s"
        if self.chaotic is None:
            return f"The run is too short to tell whether the motion is chaotic: {known}; {apart}."
        return f"No chaos is seen: {known}; {apart}."

    def summary(self) -> Table:
        """Return a table of the exponents and their standard errors."""
        columns = [Column("exponent"), Column("1/s", number=True), Column("±", number=True)]
        rows = (
            (f"λ{k}", f"{value:.4g}", f"{spread:.1g}")
            for k, (value, spread) in enumerate(
                zip(self.exponents, self.spread, strict=True), start=1
            )
        )
        return table("Lyapunov exponents", columns, [*rows, ("sum", f"{self.total:.2g}", "")])

    def document(self) -> dict[str, Any]:
        """Return the result as plain data."""
        return {
            "scene": self.scene.title,
            "seconds": self.seconds,
            "exponents": self.exponents.tolist(),
            "spread": self.spread.tolist(),
            "sum": self.total,
            "resolution": self.resolution,
            "blocks": self.blocks.tolist(),
            "verdict": self.verdict,
        }

    def csv(self) -> str:
        """Return the exponents over each block as comma-separated values."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(["block", "lambda1", "lambda2", "lambda3", "lambda4"])
        writer.writerows([number, *row] for number, row in enumerate(self.blocks.tolist(), start=1))
        return text.getvalue()


def _standard_error(blocks: Array) -> Array:
    """Return the standard error of the mean of independent blocks, shape (4,)."""
    return np.asarray(blocks.std(axis=0, ddof=1) / math.sqrt(len(blocks)))


def lyapunov(
    scene: Scene,
    seconds: float,
    *,
    blocks: int = 20,
    progress: Callable[[str, float], None] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Spectrum:
    """Return the Lyapunov exponents of a smooth motion over a time (s).

    The time, which does not depend on the scene's duration, is divided into `blocks`, from whose
    scatter the standard errors follow; one more block before them, from the scene's start, turns
    the derivatives into the directions of the exponents. Raises `SimulationError` for a scene with
    contact, friction or other events, and `ParameterError` for invalid arguments.
    """
    check_instance("scene", scene, Scene)
    check_callback("progress", progress, ("name", "share"))
    check_instance("limits", limits, Limits)
    seconds, blocks = as_duration("seconds", seconds), as_count("blocks", blocks, 2)
    check_smooth(scene)
    named = None if progress is None else lambda share: progress("separating", share)
    report = limits.timed(f"the exponents over {seconds:g} s", named)
    ends = np.linspace(0.0, seconds * (1 + 1 / blocks), blocks + 2)[1:]
    systems = VariedSystems.of(scene, _UNVARIED, "momenta", "double", _CODE)
    system = systems.at(0.0, scene.effects)
    with system.pool.lend() as integrator:
        following = _Following(system, integrator, replace(scene, duration=seconds), report)
        following.advance(ends[0], ends[-1])
        scale = following.settle()
        if seconds < blocks * scale:
            raise ParameterError(
                f"seconds must be {blocks * scale:.3g} or more for {blocks} blocks of this motion;"
                f" got {seconds:g}"
            )
        found = [following.block(end, ends[-1]) for end in ends[1:]]
    sums, departures = (np.array(every) for every in zip(*found, strict=True))
    # The directions of nearly equal exponents may not have found their order.
    order = np.argsort(-sums.mean(axis=0))
    return Spectrum(
        scene=scene,
        seconds=seconds,
        blocks=sums[:, order] / (seconds / blocks),
        resolution=math.log1p(seconds / scale) / seconds,
        at_rest=following.at_rest,
        departures=departures.max(axis=0)[order],
    )


class _Following:
    """A motion that is followed with four orthogonal directions, and the stretches of these."""

    def __init__(
        self, system: VariedSystem, integrator: Any, scene: Scene, report: Callable[[float], None]
    ) -> None:
        self._system, self._integrator, self._report = system, integrator, report
        self._cap = default_longest_step(scene)
        (self._inertia, _), _ = lagrange.mass_matrix(scene.moving_chain.convert(float), scene.q)
        self._steps = 0
        self._interval, self._longest = self._cap, math.inf
        self._course: list[Array] = []
        integrator.state[:] = system.start(scene, _UNVARIED)
        self._start, self.at_rest = integrator.state[:4].copy(), True
        integrator.time = 0.0
        self._measure_in(self._cap)
        integrator.state[system.places] = self._units * np.eye(4)

    def block(self, end: float, last: float) -> tuple[Array, Array]:
        """Follow the motion to a time (s); return the logarithms of the stretches until then.

        The second array, shape (4,), has their ranges about a steady growth.
        """
        self._course.clear()
        found = self.advance(end, last)
        times, *logarithms = np.cumsum([np.zeros(5), *self._course], axis=0).T
        steady = np.outer(found, times / times[-1])
        return found, np.asarray(np.ptp(np.array(logarithms) - steady, axis=1))

    def advance(self, end: float, last: float) -> Array:
        """Follow the motion to a time (s); return the logarithms of the stretches until then."""
        integrator, places = self._integrator, self._system.places
        found = np.zeros(4)
        while integrator.time < end:
            state, time = integrator.state.copy(), integrator.time
            reached = min(end, time + self._interval)
            outcome, _, _, steps, *_ = integrator.propagate_until(reached, max_delta_t=self._cap)
            if not math.isfinite(integrator.time):
                integrator.time = last_time(integrator, time, state, reached, self._cap)
            check_arrival(outcome, float(integrator.time), last)
            directions, stretch = np.linalg.qr(integrator.state[places] / self._units)
            sizes = np.abs(np.diag(stretch))
            if not sizes.max() <= _MOST_STRETCH * sizes.min():
                integrator.state[:], integrator.time = state, time
                self._interval = (reached - time) / 2
                continue
            integrator.state[places] = self._units * directions
            stretches = np.log(sizes)
            found += stretches
            self._course.append(np.array([reached - time, *stretches]))
            self._steps += steps
            self._look()
            if sizes.max() < math.sqrt(_MOST_STRETCH) * sizes.min():
                self._interval = min(2 * self._interval, self._longest)
            self._report(integrator.time / last)
        return found

    def _look(self) -> None:
        """Note whether the chain has moved."""
        changes = np.abs(self._integrator.state[:4] - self._start)
        self.at_rest = self.at_rest and bool((changes < _STILL * self._units[:, 0]).all())

    def settle(self) -> float:
        """Return the time scale (s) of the motion so far, and measure stretches in it from now.

        It is the mean radius of convergence of the Taylor series.
        """
        scale = _RADIUS_IN_STEPS * float(self._integrator.time) / self._steps
        self._longest = _LONGEST_INTERVAL * scale
        self._interval = min(self._interval, self._longest)
        self._measure_in(scale)
        places = self._system.places
        directions, _ = np.linalg.qr(self._integrator.state[places] / self._units)
        self._integrator.state[places] = self._units * directions
        return scale

    def _measure_in(self, scale: float) -> None:
        """Use units in which all variables are of one size: 1 rad, and its momentum in a scale."""
        momentum = self._inertia / scale
        self._units = np.array([1.0, 1.0, momentum, momentum])[:, None]
