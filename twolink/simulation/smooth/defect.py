"""The defect of the steps of a run by Taylor series, in the precision of the run or a longer one.

On each step the polynomial y(t) leaves a defect, y(0) + ∫ f(y) dt − y(h⁺), with y(h⁺) the start of
the next step: truncation and round-off together. It is the sum of y(h) − y(h⁺) and of the integral
of the residual f(y) − y′, which is small and has a known form, so that a few nodes serve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from twolink.integration.precisions import PRECISIONS, Precision, PrecisionName
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.series import powers
from twolink.simulation.smooth.linear import shortened
from twolink.simulation.smooth.quadrature import residual_rule
from twolink.simulation.smooth.rates import Rates, rates_of
from twolink.simulation.smooth.steps import Steps

# The least number of terms of a series that are computed in numbers of a precision; shorter numbers
# suffice for the others. By heyoka's choice of steps each is some exp(−2) times the one before. So
# the round-off of the others in float64 is a tenth of that of the first term in long doubles. In an
# evaluation in quadruple precision, that of the others in long doubles is 1e-7 of that of the run.
# Nearly linear motions have larger terms, up to far later ones.
_LEADING_TERMS: dict[PrecisionName, int] = {"double": 5, "long double": 5, "quadruple": 8}


class Defects(NamedTuple):
    """Defects of n steps, shape (n, 4), the part that is `truncated`, and `rates`, both (n, 4).

    Moment k is that of the residual h f − y′ with (1 − τ)^k/k!, where 1 − τ is the rest of the
    step: `moments`, shape (MOMENTS − 1, n, 4), k from 2. `firsts`, shape (3, n, 4), are the parts
    of the first moment at Gauss's nodes (`ResidualRule`). `rates` are h f: at the start, or the
    mean over the step where that is larger. `noise` is the standard deviation of an integral,
    divided by that of one value at a node.
    """

    defects: Array
    truncated: Array
    firsts: Array
    moments: Array
    rates: Array
    noise: float


@dataclass(frozen=True)
class Evaluation:
    """The evaluation of defects: the rates in a precision."""

    name: PrecisionName
    rates: Rates

    @property
    def precision(self) -> Precision:
        """The precision of the evaluation."""
        return PRECISIONS[self.name]

    def of(self, steps: Steps, scaled: Array) -> Defects:
        """Return the defects of the polynomials of steps.

        `scaled` are the polynomials for the share of the step, in float64: (n, 4, p + 1).
        """
        longer, rule = self.precision.lengthened, residual_rule(scaled.shape[2] - 1)
        polynomials = _polynomials(steps, scaled, self.name)
        h = longer(steps.lengths)
        starts = longer(steps.starts) + longer(steps.rests)
        nodes = longer(rule.nodes)
        states, slopes = polynomials.at(nodes)
        rates = self.rates(states, starts[:, None] + h[:, None] * nodes)
        residuals = (h[:, None] * rates - slopes).astype(float)
        weights = np.concatenate([rule.integral, rule.firsts, rule.moments], axis=1)
        integrals = (residuals @ weights).transpose(2, 1, 0)
        change = polynomials.change
        firsts = polynomials.leading[:, :, 0].astype(change.dtype)
        following = np.concatenate([firsts[1:], longer(steps.end)[None].astype(change.dtype)])
        return Defects(
            ((firsts - following) + change).astype(float) + integrals[0],
            integrals[1],
            integrals[2:5],
            integrals[5:],
            _larger(scaled[:, :, 1], change.astype(float)),
            rule.noise,
        )


def _larger(one: Array, other: Array) -> Array:
    """Return the numbers of larger size, with their signs."""
    return np.where(np.abs(one) > np.abs(other), one, other)


def evaluation_of(
    scene: Scene, formulation: EquationsName, evaluated_in: PrecisionName
) -> Evaluation:
    """Return the evaluation of the defects of runs in a precision, at least that of the runs."""
    return Evaluation(evaluated_in, rates_of(scene, formulation, evaluated_in))


@dataclass(frozen=True, eq=False)
class _Polynomials:
    """Polynomials on [0, 1] whose `leading` coefficients are in a precision, the `rest` in shorter.

    The coefficients have shape (n, 4, number of terms).
    """

    precision: Precision
    leading: Any
    rest: Any

    def at(self, nodes: Any) -> tuple[Any, Any]:
        """Return the values and the slopes at nodes in [0, 1], each of shape (4, n, nodes)."""
        count = self.leading.shape[2]
        rest = _sums(self.rest, shortened(nodes, self.rest.dtype), count)
        value, slope = (self.precision.lengthened(each) for each in rest)
        if self.leading.dtype in (np.float64, np.longdouble):
            first, second = _sums(self.leading, nodes, 0)
            return first + value, second + slope
        # NumPy has no products of matrices of quadruple numbers.
        leading, leading_slope = 0 * value, 0 * slope
        for coefficient in reversed(np.ascontiguousarray(self.leading.transpose(2, 1, 0))):
            leading_slope = leading_slope * nodes + leading
            leading = leading * nodes + coefficient[..., None]
        return leading + value, leading_slope + slope

    @property
    def change(self) -> Any:
        """The changes over the steps, shape (n, 4), in long doubles or in longer numbers.

        Their round-off would be as large as that of the run.
        """
        leading = self.leading[:, :, 1:]
        if leading.dtype == np.float64:
            leading = leading.astype(np.longdouble)
        rest = self.rest.sum(axis=2)
        return np.add.reduce(leading, -1) + self.precision.lengthened(rest).astype(leading.dtype)


def _polynomials(steps: Steps, scaled: Array, precision: PrecisionName) -> _Polynomials:
    """Return the polynomials of steps as functions of the share of the step.

    `scaled` are these polynomials in float64.
    """
    own, length = PRECISIONS[precision], scaled.shape[2]
    count = min(_LEADING_TERMS[precision], length)
    if precision == "double":
        return _Polynomials(own, scaled[:, :, :count], scaled[:, :, count:])
    count = _until_small(np.abs(scaled).max(axis=0), count)
    leading = own.lengthened(steps.coefficients[:, :, :count])
    leading = leading * powers(own.lengthened(steps.lengths), count)[:, None]
    if precision == "long double":
        return _Polynomials(own, leading, scaled[:, :, count:])
    rest = shortened(steps.coefficients[:, :, count:], np.longdouble)
    by_power = powers(shortened(steps.lengths, np.longdouble), length)[:, None, count:]
    return _Polynomials(own, leading, rest * by_power)


def _until_small(sizes: Array, least: int) -> int:
    """Return the number of terms, at least `least`, after which all are as small as expected.

    `sizes` are those of the terms of the four variables, shape (4, p + 1).
    """
    expected = math.exp(-2 * least) * sizes.max(axis=1, keepdims=True)
    large = np.flatnonzero((sizes[:, least:] > expected).any(axis=0))
    return least + int(large[-1]) + 1 if len(large) else least


def _sums(coefficients: Any, nodes: Any, first: int) -> tuple[Any, Any]:
    """Return the values and slopes at nodes of Σ c_k τ^(k + first), each of shape (4, n, nodes).

    The coefficients have shape (n, 4, number of terms).
    """
    n, four, length = coefficients.shape
    # From the highest power, as the sums then have less round-off.
    k = np.arange(first + length - 1, first - 1, -1.0)[:, None].astype(nodes.dtype)
    both = np.concatenate([nodes**k, k * nodes ** np.maximum(k - 1, 0)], axis=1)
    found = coefficients[:, :, ::-1].reshape(n * four, length).dot(both)
    values, slopes = found.reshape(n, four, 2, len(nodes)).transpose(2, 1, 0, 3)
    return np.ascontiguousarray(values), np.ascontiguousarray(slopes)
