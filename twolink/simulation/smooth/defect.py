"""The defect of the steps of a run by Taylor series, in the precision of the run or a longer one.

On each step the polynomial y(t) leaves a defect, y(0) + ∫ f(y) dt − y(h) with y(h) the start of the
next step: truncation and round-off together. The integral is Gauss's rule, whose error is far below
that of the series. Where it should not suffice, its error is seen on the slopes of the polynomials
themselves, whose integrals are known.
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
from twolink.simulation.smooth import linear
from twolink.simulation.smooth.quadrature import GaussRule, gauss_rule
from twolink.simulation.smooth.rates import Rates, rates_of
from twolink.simulation.smooth.taylor import Steps

# The ratio of a step to the radius of convergence (heyoka's choice of steps), and the part of a
# rounding that the error of Gauss's rule may reach. With m nodes it is (ratio / 4)^(2 m).
_RATIO, _OF_A_ROUNDING = math.exp(-2), 1 / 64

# The same where the defect is evaluated in a longer precision, and round-off hides no part of it.
_OF_A_ROUNDING_OF_THE_RUN = 1e-4

# The terms of a series that are computed in numbers of a precision; shorter numbers suffice for the
# others. Each is exp(−2) times the one before: the round-off of the others in float64 is a tenth of
# that of the first in long doubles, and in long doubles 1e-7 of that of a run in long doubles.
_LEADING_TERMS: dict[PrecisionName, int] = {"long double": 5, "quadruple": 8}


class Defects(NamedTuple):
    """Defects of n steps, shape (n, 4), their moments, (8, n, 4), and the sizes of h f, (n, 4).

    Moment k is that of h f − y′ with (1 − τ)^k/k!, k from 1, where 1 − τ is the rest of the step.
    `quadrature`, shape (n, 4), is the error of Gauss's rule on the slopes of the polynomials, whose
    integral is known.
    """

    defects: Array
    moments: Array
    rates: Array
    quadrature: Array


@dataclass(frozen=True)
class Evaluation:
    """The evaluation of defects: the rates in a precision, and Gauss's rule."""

    name: PrecisionName
    rates: Rates
    rule: GaussRule

    @property
    def precision(self) -> Precision:
        """The precision of the evaluation."""
        return PRECISIONS[self.name]

    def of(self, steps: Steps) -> Defects:
        """Return the defects of the polynomials of steps."""
        longer, rule = self.precision.lengthened, self.rule
        h, polynomials = longer(steps.lengths), _scaled(steps, self.name)
        first = polynomials.leading[:, :, 0]
        starts = steps.starts
        if starts.dtype != h.dtype:
            starts = longer(starts[:1]) + (np.add.accumulate(h) - h)
        t = starts[:, None] + h[:, None] * rule.nodes
        rates = h[:, None] * self.rates(polynomials.at(rule.nodes), t)
        # The weights' round-off multiplies only the differences from the mean.
        mean = _dot(rates, longer(np.full(len(rule.nodes), 1 / len(rule.nodes))))
        integrals = mean + _dot(rates - mean[..., None], rule.weights)
        following = np.concatenate([first[1:], longer(steps.end)[None]])
        residuals = rates - polynomials.slopes.at(rule.nodes)
        moments = residuals.astype(float) @ rule.moments
        return Defects(
            ((first - following) + integrals.T).astype(float),
            moments.transpose(2, 1, 0),
            np.abs(mean.astype(float)).T,
            np.abs(polynomials.combined(rule.errors_of_slopes(polynomials.length))),
        )


def evaluation_of(
    scene: Scene, formulation: EquationsName, precision: PrecisionName, evaluated_in: PrecisionName
) -> Evaluation:
    """Return the evaluation of the defects of runs in a precision, in the same or a longer one."""
    share = _OF_A_ROUNDING if evaluated_in == precision else _OF_A_ROUNDING_OF_THE_RUN
    error = PRECISIONS[precision].rounding * share
    count = math.ceil(math.log(error, _RATIO / 4) / 2)
    rates = rates_of(scene, formulation, evaluated_in)
    return Evaluation(evaluated_in, rates, gauss_rule(count, evaluated_in))


@dataclass(frozen=True, eq=False)
class _Polynomials:
    """Polynomials on [0, 1] whose `leading` coefficients are in a precision, the `rest` in shorter.

    The coefficients have shape (n, 4, number of terms).
    """

    precision: Precision
    leading: Any
    rest: Any

    @property
    def length(self) -> int:
        """The number of coefficients."""
        return int(self.leading.shape[2] + self.rest.shape[2])

    def at(self, nodes: Any) -> Any:
        """Return the values at nodes in [0, 1], shape (4, n, nodes)."""
        if not self.rest.size:
            return linear.values(self.leading, nodes)
        rest = linear.values(self.rest, _shortened(nodes, self.rest.dtype))
        rest = self.precision.lengthened(rest)
        if self.leading.dtype == np.longdouble:
            return linear.values(self.leading, nodes) + rest * nodes ** self.leading.shape[2]
        for coefficient in reversed(np.ascontiguousarray(self.leading.transpose(2, 1, 0))):
            rest = rest * nodes + coefficient[..., None]
        return rest

    @property
    def slopes(self) -> _Polynomials:
        """The derivatives of the polynomials."""
        count = self.leading.shape[2]
        k = np.arange(1.0, self.length)
        leading = self.leading[:, :, 1:] * self.precision.lengthened(k[: count - 1])
        rest = self.rest * k[count - 1 :].astype(self.rest.dtype)
        return _Polynomials(self.precision, leading, rest)

    def combined(self, weights: Array) -> Array:
        """Return the sums of the coefficients times weights, shape (n, 4), in float64."""
        count = self.leading.shape[2]
        leading, rest = (_shortened(x, np.float64) for x in (self.leading, self.rest))
        return np.asarray(leading @ weights[:count] + rest @ weights[count:])


def _scaled(steps: Steps, precision: PrecisionName) -> _Polynomials:
    """Return the polynomials of steps as functions of the share of the step."""
    own, coefficients = PRECISIONS[precision], steps.coefficients
    length = coefficients.shape[2]
    count = min(_LEADING_TERMS.get(precision, length), length)
    leading = own.lengthened(coefficients[:, :, :count])
    leading = leading * powers(own.lengthened(steps.lengths), count)[:, None]
    kind = np.float64 if precision == "long double" else np.longdouble
    rest = _shortened(coefficients[:, :, count:], kind)
    if rest.size:
        rest = rest * powers(_shortened(steps.lengths, kind), length)[:, None, count:]
    return _Polynomials(own, leading, rest)


def _shortened(values: Any, kind: Any) -> Any:
    """Return numbers of any precision as float64 or long doubles."""
    if values.dtype in (np.float64, np.longdouble):
        return values.astype(kind, copy=False)
    return PRECISIONS["quadruple"].mixable(values).astype(kind, copy=False)


def _dot(values: Any, vector: Any) -> Any:
    """Return the sums over the last axis of values times a vector, in numbers of any length."""
    if values.dtype in (np.float64, np.longdouble):
        return values.dot(vector)
    return np.add.reduce(values * vector, -1)
