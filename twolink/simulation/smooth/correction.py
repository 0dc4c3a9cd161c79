"""The estimated error of a run by Taylor series as a function of time.

Within a step the error is e(τ) = Φ(τ) e_i + l τ^(p+1), τ from 0 to 1. Φ(τ) e_i is a polynomial of
third degree that satisfies the linearized equations at Gauss's three nodes; the known change over
the step is added in proportion to τ. The defect l of the step arises like the first term that a
series of order p omits; the next terms, a factor exp(−2) smaller each, differ from it by a few
hundredths of l at most. The round-off in l arises at the end of the step, within the round-off of a
value.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twolink.simulation.run import Array
from twolink.simulation.smooth.linear import Linear
from twolink.simulation.smooth.quadrature import gauss_nodes

# Iterations for the values at the nodes. Each divides their error by some ten.
_ITERATIONS = 4


@dataclass(frozen=True, eq=False)
class Correction:
    """The estimated error of q and x as a function of time, on n steps.

    `starts` and `lengths` (s) have shape (n,), the `coefficients` of Φ(τ) e_i shape (n, 4, 4), the
    defects `added` by the steps shape (n, 4); `order` is that of the run.
    """

    starts: Array
    lengths: Array
    coefficients: Array
    added: Array
    order: int

    def at(self, times: Array) -> Array:
        """Return the errors of q and x at times (s), shape (4, number of times)."""
        place = np.searchsorted(self.starts, times, side="right") - 1
        share = np.clip((times - self.starts[place]) / self.lengths[place], 0.0, 1.0)
        powers = share[:, None] ** np.arange(4)
        carried = np.einsum("ijk,ik->ij", self.coefficients[place], powers)
        found: Array = (carried + self.added[place] * share[:, None] ** (self.order + 1)).T
        return found


def correction_of(parts: Sequence[tuple[Linear, Array, Array]], order: int) -> Correction:
    """Return the error along parts of a run of an order, each with the errors at the ends of steps.

    The errors have shape (n + 1, 4), and the defects that the steps add (n, 4).
    """
    return Correction(
        np.concatenate([linear.starts for linear, _, _ in parts]),
        np.concatenate([linear.lengths for linear, _, _ in parts]),
        np.concatenate(
            [_within(linear.scaled, e[:-1], e[1:] - added) for linear, e, added in parts]
        ),
        np.concatenate([added for _, _, added in parts]),
        order,
    )


def _within(scaled: Array, first: Array, last: Array) -> Array:
    """Return the coefficients of deviations on steps from their ends, shape (n, 4, 4).

    `scaled` are the Jacobians times the lengths of steps at Gauss's nodes, shape (3, n, 4, 4).
    """
    at_nodes, from_slopes = _basis()
    change = last - first
    along = change[None] * gauss_nodes(3)[:, None, None]
    for _ in range(_ITERATIONS):
        slopes = (scaled @ (first + along)[..., None])[..., 0]
        terms = np.tensordot(from_slopes, slopes, 1)
        along = np.tensordot(at_nodes, terms, 1)
    # The change over the step is known better than by these slopes.
    terms[0] += change - terms.sum(axis=0)
    return np.concatenate([first[None], terms]).transpose(1, 2, 0)


@functools.cache
def _basis() -> tuple[Array, Array]:
    """Return the first three powers at Gauss's nodes, and coefficients by the slopes there."""
    nodes = gauss_nodes(3)[:, None]
    k = np.arange(1, 4)
    return nodes**k, np.asarray(np.linalg.inv(k * nodes ** (k - 1)), dtype=float)
