"""The linearized motion over steps: how errors are carried from step to step."""

from __future__ import annotations

import math

import numpy as np

from twolink.simulation.run import Array

# The norm up to which the sixth power ends the series of an exponential at 1e-8.
_NORM = 0.25


def magnus(first: Array, second: Array, third: Array) -> Array:
    """Return Ω, whose exponential is the flow of steps, from h J at Gauss's three nodes."""
    slope = math.sqrt(15) / 3 * (third - first)
    bend = 10 / 3 * (third - 2 * second + first)
    inner = _commutator(second, slope)
    outer = _commutator(second, 2 * bend + inner) / 60
    return second + bend / 12 + _commutator(inner - 20 * second - bend, slope - outer) / 240


def _commutator(one: Array, other: Array) -> Array:
    return one @ other - other @ one


def exponentials(matrices: Array) -> Array:
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


def sizes(matrices: Array) -> Array:
    """Return estimates of the spectral radii of matrices of shape (n, 4, 4), from above: (n,).

    They are sixth roots of the norms of sixth powers, little larger if columns differ in size.
    """
    second = matrices @ matrices
    sixth = second @ second @ second
    return np.asarray(np.sqrt(np.einsum("ijk,ijk->i", sixth, sixth)) ** (1 / 6))


def accumulated(flows: Array, sources: Array, start: Array) -> Array:
    """Return e of e_{i+1} = Φ_i e_i + l_i for several l at once, shape (n + 1, 4, m).

    Blocks of steps are followed side by side from zero and from unit vectors, and then joined.
    """
    n, _, m = sources.shape
    width = math.isqrt(n) + 1
    count = -(-n // width)
    across, added = np.zeros((width, count, 4, 4)), np.zeros((width, count, 4, m))
    for place, values in ((across, flows), (added, sources)):
        columns = values.shape[2]
        padded = np.zeros((count * width, 4, columns))
        padded[:n] = values
        place[:] = padded.reshape(count, width, 4, columns).transpose(1, 0, 2, 3)
    both = np.zeros((width + 1, count, 4, 4 + m))
    both[0, :, :, :4] = np.eye(4)
    for k in range(width):
        np.matmul(across[k], both[k], out=both[k + 1])
        both[k + 1, :, :, 4:] += added[k]
    starts = [start]
    for end in both[-1]:
        starts.append(end[:, :4] @ starts[-1] + end[:, 4:])
    blocks = both[1:].transpose(1, 0, 2, 3)
    found = np.empty((1 + count * width, 4, m))
    found[0] = start
    ends = found[1:].reshape(count, width, 4, m)
    np.matmul(blocks[:, :, :, :4], np.array(starts[:-1])[:, None], out=ends)
    ends += blocks[:, :, :, 4:]
    return found[: n + 1]
