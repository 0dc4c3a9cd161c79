"""The linearized motion along the steps of a run, in float64."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.integration.precisions import PRECISIONS
from twolink.simulation.run import Array
from twolink.simulation.series import powers
from twolink.simulation.smooth.flows import exponentials, magnus
from twolink.simulation.smooth.quadrature import gauss_nodes
from twolink.simulation.smooth.rates import Jacobians
from twolink.simulation.smooth.steps import Steps


class Linear(NamedTuple):
    """The linearized motion over n steps.

    `starts` and `lengths` (s) have shape (n,), `states` at the starts shape (n, 4), and the
    `jacobians` of the rates at Gauss's three nodes shape (3, n, 4, 4); `by_time`, shape (n, 4), are
    the derivatives of the rates by t at the middle of each step. The `flows`, shape (n, 4, 4),
    carry a small deviation over each step; `exponents`, shape (n,), are the sizes of their
    logarithms. The `differences`, shape (n, 4, 4), are those of the logarithms from others of lower
    order.
    """

    starts: Array
    lengths: Array
    states: Array
    jacobians: Array
    by_time: Array
    flows: Array
    exponents: Array
    differences: Array

    @property
    def scaled(self) -> Array:
        """The Jacobians times the length of the step."""
        return self.jacobians * self.lengths[:, None, None]


def scaled_polynomials(steps: Steps) -> Array:
    """Return the polynomials of steps for the share of the step, in float64: (n, 4, p + 1)."""
    return scaled(steps.coefficients, steps.lengths)


def scaled(coefficients: Any, lengths: Any) -> Array:
    """Return polynomials of time, shape (n, m, p + 1), for the share of a step, in float64.

    Coefficients of a long precision alone may be beyond the range of float64.
    """
    own = coefficients * powers(lengths, coefficients.shape[2])[:, None]
    return np.asarray(shortened(own, np.float64))


def linearized(derivatives: Jacobians, steps: Steps, polynomials: Array) -> Linear:
    """Return the linearized motion along steps, by the derivatives of their rates.

    `polynomials` are those of `scaled_polynomials`.
    """
    lengths = shortened(steps.lengths, np.float64)
    jacobians = _jacobians(derivatives, steps.starts, lengths, polynomials)
    logarithms, differences = magnus(*(jacobians * lengths[:, None, None]))
    flows, exponents = exponentials(logarithms)
    return Linear(
        starts=steps.starts,
        lengths=lengths,
        states=polynomials[:, :, 0].copy(),
        jacobians=jacobians,
        by_time=_by_time(lengths, polynomials, jacobians[1]),
        flows=flows,
        exponents=exponents,
        differences=differences,
    )


def shortened(values: Any, kind: Any) -> Any:
    """Return numbers of any precision as float64 or long doubles."""
    if values.dtype in (np.float64, np.longdouble):
        return values.astype(kind, copy=False)
    return PRECISIONS["quadruple"].mixable(values).astype(kind, copy=False)


def _by_time(lengths: Array, scaled: Array, jacobians: Array) -> Array:
    """Return ∂f/∂t = y″ − J y′ at the middle of each step, shape (n, 4)."""
    k = np.arange(scaled.shape[2])
    weights = np.array([k * 0.5 ** (k - 1.0), k * (k - 1) * 0.5 ** (k - 2.0)])
    n, count, length = scaled.shape
    found = scaled.reshape(n * count, length).dot(weights.T).reshape(n, count, 2)
    first, second = found.transpose(2, 0, 1) / lengths[:, None]
    return np.asarray(second / lengths[:, None] - (jacobians @ first[..., None])[..., 0])


def _jacobians(derivatives: Jacobians, starts: Array, lengths: Array, scaled: Array) -> Array:
    """Return the derivatives of the rates at three nodes of each step, shape (3, n, 4, 4)."""
    nodes = gauss_nodes(3)
    found = derivatives(values(scaled, nodes), starts[:, None] + lengths[:, None] * nodes)
    return np.ascontiguousarray(found.transpose(3, 2, 0, 1))


def values(scaled: Array, nodes: Array) -> Array:
    """Return the values of polynomials, shape (n, 4, p + 1), at nodes in [0, 1]: (4, n, nodes)."""
    n, count, length = scaled.shape
    # From the highest power, as the sums then have less round-off.
    by_power = nodes ** np.arange(length - 1, -1, -1)[:, None]
    found = scaled[:, :, ::-1].reshape(n * count, length).dot(by_power)
    return np.ascontiguousarray(found.reshape(n, count, -1).transpose(1, 0, 2))
