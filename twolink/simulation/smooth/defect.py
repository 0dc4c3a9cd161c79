"""The global error of a run by Taylor series, from the defect of its own steps.

On each step the polynomial y(t) leaves a defect, y(0) + ∫ f(y) dt − y(h) with y(h) the start of the
next step: truncation and round-off together. The errors of all steps add up as the linearized
motion carries them: e_{i+1} = Φ_i e_i + l_i (Hairer, Nørsett and Wanner, Solving Ordinary
Differential Equations I, 1993, section II.8). The integral is Gauss's rule, whose error is far
below that of the series. Φ is the exponential of Magnus's series of sixth order (Blanes, Casas,
Oteo and Ros, The Magnus expansion and some of its applications, 2009, section 5.4): over many steps
an error of Φ would grow like an instability.

The rates f have round-off too, of the size that a rounding of the state and of f itself gives.
Vectors of random signs times this size on each step, propagated like the defect, are samples of the
round-off of the estimate. Where Gauss's rule should not suffice, its error is seen on the slopes of
the polynomials themselves, whose integrals are known, and takes the place of the round-off.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.series import powers
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.taylor import Steps

# The ratio of a step to the radius of convergence (heyoka's choice of steps), and the part of a
# rounding that the error of Gauss's rule may reach. With m nodes it is (ratio / 4)^(2 m).
_RATIO, _OF_A_ROUNDING = math.exp(-2), 1 / 64

# Samples of the round-off of the estimate, and the factor on their root mean square. In 750 runs of
# random chains 1.9 sufficed, and 1.1 in 99 of 100.
_SAMPLES, _DEVIATIONS = 16, 3.5

# Allowance for the linearization and for the place on a step where its defect arises.
_MARGIN = 1.25

# The largest errors for which the motion is linearized: of angles (rad), and of speeds as a part of
# the largest speed, or of 1 rad/s.
_LINEAR = 1e-5

# The difference of arguments by which rates are differentiated: of angles in rad, of the other two
# variables relative to their size; and the least, in units in the last place.
_DIFFERENCE, _APART = 1e-7, 16

# The norm up to which the sixth power ends the series of an exponential at 1e-8.
_NORM = 0.25


class Defects(NamedTuple):
    """Defects of steps, shape (n, 4), their moments, (2, n, 4, 1), and the sizes of h f, (n, 4).

    The moments are those with the rest of the step, and with half its square. `quadrature`, shape
    (n, 4), is the error of Gauss's rule on the slopes of the polynomials, whose integral is known.
    """

    defects: Array
    moments: Array
    rates: Array
    quadrature: Array


class StepErrors:
    """The estimated error of a run at the ends of its steps, from the steps as they are taken."""

    def __init__(self, scene: Scene, formulation: EquationsName, precision: PrecisionName) -> None:
        """Store the run: a scene, its equations, and its precision."""
        self._equations = EQUATIONS[formulation]
        self._chain, self._effects = scene.moving_chain, scene.effects
        self._own_chain = self._chain.convert(PRECISIONS[precision].number)
        self._rounding = PRECISIONS[precision].rounding
        self._nodes = math.ceil(math.log(self._rounding * _OF_A_ROUNDING, _RATIO / 4) / 2)
        self._signs = np.random.default_rng(0)
        self._ends: list[Array] = []
        self._errors: list[Array] = []
        self._noise: list[Array] = []
        self._carried = np.zeros((4, 1 + _SAMPLES))

    def __call__(self, steps: Steps) -> None:
        """Add steps that continue those before; steps from 0 s begin anew."""
        if steps.starts[0] == 0:
            self._signs = np.random.default_rng(0)
            self._ends, self._errors, self._noise = [], [], []
            self._carried = self._start(steps)
        with np.errstate(all="ignore"):
            # A motion that diverges has no bound.
            flows, sources, jacobians, fastest = self._linearized(steps)
            errors = _accumulated(flows, sources, self._carried)
            self._carried = errors[-1]
            # The rates of q are u, whose error may have its peak within a step.
            speeds = jacobians[[0, 2], :, :2] @ np.stack([errors[:-1], errors[1:]])
            self._note(steps, np.concatenate([errors[1:, :2], *speeds], axis=1), fastest)

    def _linearized(self, steps: Steps) -> tuple[Array, Array, Array, float]:
        """Return Φ, the errors that steps add, the Jacobians at three nodes, and the largest speed.

        The errors have shape (n, 4, 1 + samples): the defect, and samples of its round-off.
        """
        scaled = steps.coefficients
        scaled = scaled * powers(steps.lengths, scaled.shape[2])[:, None]
        found = self._defects(steps, scaled)
        jacobians = self._jacobians(steps, scaled.astype(float))
        lengths = steps.lengths.astype(float)
        scaled_jacobians = jacobians * lengths[:, None, None]
        mean = scaled_jacobians[1]
        flows = _exponentials(_magnus(*scaled_jacobians))
        states = np.abs(scaled[:, :, 0].astype(float))
        roundings = (np.abs(mean) @ states[:, :, None])[:, :, 0] + found.rates
        sizes = np.maximum(self._rounding / math.sqrt(self._nodes) * roundings, found.quadrature)
        samples = sizes[:, :, None] * self._random_signs(len(sizes))
        # The defect of a step grows over the rest of the step.
        once, twice = found.moments
        defects = found.defects[:, :, None] + mean @ (once + mean @ twice)
        fastest = float((found.rates[:, :2] / lengths[:, None]).max())
        return flows, np.concatenate([defects, samples], axis=2), jacobians, fastest

    def at(self, times: Array) -> Array:
        """Return the bound on the error (rad, rad/s) up to each time (s)."""
        return self._largest(self._errors, times)

    def round_off_at(self, times: Array) -> Array:
        """Return the root mean square of round-off errors (rad, rad/s) up to each time (s)."""
        return self._largest(self._noise, times)

    def _largest(self, values: list[Array], times: Array) -> Array:
        """Return the largest value of the steps up to each time (s)."""
        ends, every = np.concatenate(self._ends), np.concatenate(values)
        place = np.minimum(np.searchsorted(ends, times), len(ends) - 1)
        found: Array = np.maximum.accumulate(every)[place]
        return found

    def _start(self, steps: Steps) -> Array:
        """Return the error of the start: momenta are rounded, in samples of either sign."""
        state = np.abs(steps.coefficients[0, :, 0].astype(float))
        rounded = np.where(np.arange(4) < 2, 0.0, self._rounding)[:, None]
        samples = rounded * state[:, None] * self._random_signs(1)[0]
        return np.concatenate([np.zeros((4, 1)), samples], axis=1)

    def _random_signs(self, count: int) -> Array:
        """Return signs of shape (count, 4, samples)."""
        return self._signs.integers(0, 2, (count, 4, _SAMPLES), np.int8) * 2.0 - 1.0

    def _note(self, steps: Steps, errors: Array, fastest: float) -> None:
        """Store the bounds of steps from errors of q and u, shape (n, 6, 1 + samples).

        `fastest` (rad/s) is the largest speed; those of u are at two places of each step.
        """
        estimated, samples = np.abs(errors[:, :, 0]), errors[:, :, 1:]
        noise = np.sqrt(np.einsum("ijk,ijk->ij", samples, samples) / _SAMPLES)
        every = _MARGIN * estimated + _DEVIATIONS * noise
        bounds, speeds = every.max(axis=1), every[:, 2:].max(axis=1)
        small = (every[:, :2].max(axis=1) <= _LINEAR) & (speeds <= _LINEAR * max(1.0, fastest))
        bounds[~small] = np.inf
        self._ends.append(steps.starts + steps.lengths.astype(float))
        self._errors.append(bounds)
        self._noise.append(noise.max(axis=1))

    def _defects(self, steps: Steps, scaled: Any) -> Defects:
        """Return the defects of steps from their polynomials, scaled to [0, 1]."""
        h = steps.lengths
        nodes, weights = _gauss(self._nodes, h.dtype.type)
        t = steps.starts[:, None] + h[:, None] * nodes
        rates = h[:, None] * self._rates(self._own_chain, _values(scaled, nodes), t)
        # The weights' round-off multiplies only the differences from the mean.
        mean = rates.mean(axis=2)
        integrals = mean + (rates - mean[..., None]) @ weights
        following = np.concatenate([scaled[1:, :, 0], steps.end[None]]).T
        slopes = _values(scaled[:, :, 1:] * np.arange(1.0, scaled.shape[2]), nodes)
        left = 1 - nodes
        moments = np.stack([weights * left, weights * left * left / 2], axis=1)
        within = ((rates - slopes).astype(float) @ moments).transpose(2, 1, 0)[..., None]
        return Defects(
            ((scaled[:, :, 0].T - following) + integrals).astype(float).T,
            within,
            np.abs(mean).astype(float).T,
            np.abs(slopes @ weights - scaled[:, :, 1:].sum(axis=2).T).astype(float).T,
        )

    def _jacobians(self, steps: Steps, scaled: Array) -> Array:
        """Return the derivatives of the rates at three nodes of each step, shape (3, n, 4, 4)."""
        nodes, _ = _gauss(3)
        states = _values(scaled, nodes)
        largest = np.abs(states).max(axis=(1, 2))
        sizes = np.where((largest > 0) & (np.arange(4) > 1), largest, 1.0)
        nudges = np.maximum(_DIFFERENCE * sizes, _APART * np.spacing(largest))
        every = np.repeat(states[:, None], 5, axis=1)
        taken = np.empty_like(states)
        for k in range(4):
            every[k, k + 1] += nudges[k]
            taken[k] = every[k, k + 1] - states[k]
        t = steps.starts[:, None] + steps.lengths[:, None].astype(float) * nodes
        rates = self._rates(self._chain, every, t)
        slopes = (rates[:, 1:] - rates[:, :1]) / taken
        return slopes.transpose(3, 2, 0, 1)

    def _rates(self, chain: Chain, states: Any, t: Array) -> Any:
        """Return the rates at states of shape (4, …)."""
        effects: tuple[Effect, ...] = self._effects
        q, x = (states[0], states[1]), (states[2], states[3])
        every = (rate for pair in self._equations.rates(chain, effects, q, x, t) for rate in pair)
        found = np.empty_like(states)
        for place, rate in enumerate(every):
            found[place] = rate
        return found


def _values(scaled: Any, nodes: Array) -> Any:
    """Return the polynomials' values at nodes in [0, 1]: shape (4, n, nodes)."""
    if scaled.dtype == np.float64:
        return np.ascontiguousarray(
            (scaled @ nodes ** np.arange(scaled.shape[2])[:, None]).transpose(1, 0, 2)
        )
    value = scaled[:, :, -1, None] + 0 * nodes
    for k in range(scaled.shape[2] - 2, -1, -1):
        value = value * nodes + scaled[:, :, k, None]
    return value.transpose(1, 0, 2)


@functools.cache
def _gauss(count: int, kind: Any = np.float64) -> tuple[Any, Any]:
    """Return the nodes and weights of Gauss's rule on [0, 1]."""
    # NumPy's rule is in float64, and its import takes 30 ms.
    from_highest = np.arange(count, 0, -1, dtype=np.longdouble)
    x: Any = np.cos(np.pi * (from_highest - 0.25) / (count + 0.5))
    for _ in range(6):
        # Newton's method on Legendre's polynomial; the last slope gives the weights.
        before, value = np.ones_like(x), x
        for k in range(2, count + 1):
            before, value = value, ((2 * k - 1) * x * value - (k - 1) * before) / k
        slope = count * (x * value - before) / (x * x - 1)
        x = x - value / slope
    weights = 1 / ((1 - x * x) * slope * slope)
    return ((x + 1) / 2).astype(kind), weights.astype(kind)


def _magnus(first: Array, second: Array, third: Array) -> Array:
    """Return Ω, whose exponential is the flow of steps, from h J at Gauss's three nodes."""
    slope = math.sqrt(15) / 3 * (third - first)
    bend = 10 / 3 * (third - 2 * second + first)
    inner = _commutator(second, slope)
    outer = _commutator(second, 2 * bend + inner) / 60
    return second + bend / 12 + _commutator(inner - 20 * second - bend, slope - outer) / 240


def _commutator(one: Array, other: Array) -> Array:
    return one @ other - other @ one


def _exponentials(matrices: Array) -> Array:
    """Return the exponentials of matrices of shape (n, 4, 4), by scaling and squaring."""
    largest = float(np.abs(matrices).sum(axis=2).max())
    halvings = max(0, math.ceil(math.log2(largest / _NORM))) if 0 < largest < math.inf else 0
    # The series to the sixth power, in three products.
    first, one = matrices / 2**halvings, np.eye(4)
    second = first @ first
    third = first @ second
    found = one + first + second / 2 + third @ (one / 6 + first / 24 + second / 120 + third / 720)
    for _ in range(halvings):
        found = found @ found
    return found


def _accumulated(flows: Array, sources: Array, start: Array) -> Array:
    """Return e of e_{i+1} = Φ_i e_i + l_i for several l at once, shape (n + 1, 4, m).

    Blocks of steps are followed side by side from zero and from unit vectors, and then joined.
    """
    n, _, m = sources.shape
    width = math.isqrt(n) + 1
    count = -(-n // width)
    missing = count * width - n
    flows = np.concatenate([flows, np.zeros((missing, 4, 4))]).reshape(count, width, 4, 4)
    sources = np.concatenate([sources, np.zeros((missing, 4, m))]).reshape(count, width, 4, m)
    both = np.zeros((width + 1, count, 4, 4 + m))
    both[0, :, :, :4] = np.eye(4)
    for k in range(width):
        both[k + 1] = flows[:, k] @ both[k]
        both[k + 1, :, :, 4:] += sources[:, k]
    starts = [start]
    for end in both[-1]:
        starts.append(end[:, :4] @ starts[-1] + end[:, 4:])
    every = both[1:, :, :, :4] @ np.array(starts[:-1]) + both[1:, :, :, 4:]
    ends: Array = every.transpose(1, 0, 2, 3).reshape(-1, 4, m)[:n]
    return np.concatenate([start[None], ends])
