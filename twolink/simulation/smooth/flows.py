"""The linearized motion over steps: how errors are carried from step to step."""

from __future__ import annotations

import math

import numpy as np

from twolink.simulation.run import Array

# The norm up to which the sixth power ends the series of an exponential at 2e-6.
_NORM = 0.5


def magnus(first: Array, second: Array, third: Array) -> tuple[Array, Array]:
    """Return Ω, whose exponential is the flow of steps, from h J at Gauss's three nodes.

    Ω is of sixth order. The second array is its difference from that of fourth order, which is far
    larger than its own error.
    """
    slope = math.sqrt(15) / 3 * (third - first)
    bend = 10 / 3 * (third - 2 * second + first)
    inner = _commutator(second, slope)
    outer = _commutator(second, 2 * bend + inner) / 60
    last = _commutator(inner - 20 * second - bend, slope - outer) / 240
    return second + bend / 12 + last, last + inner / 12


def _commutator(one: Array, other: Array) -> Array:
    return one @ other - other @ one


def exponentials(matrices: Array) -> tuple[Array, Array]:
    """Return the exponentials of matrices of shape (n, 4, 4), and the sizes of these, shape (n,).

    The exponentials are made by scaling and squaring. The sizes are estimates of the spectral radii
    from above: sixth roots of the norms of sixth powers, little larger if columns differ in size.
    """
    largest = float(np.abs(matrices).sum(axis=2).max())
    halvings = max(0, math.ceil(math.log2(largest / _NORM))) if 0 < largest < math.inf else 0
    # The series to the sixth power, in three products.
    first, one = matrices / 2**halvings, np.eye(4)
    second = first @ first
    third = first @ second
    found = one + first + second / 2 + third @ (one / 6 + first / 24 + second / 120 + third / 720)
    for _ in range(halvings):
        found = found @ found
    sixth = third @ third
    sizes = 2**halvings * np.sqrt(np.einsum("ijk,ijk->i", sixth, sixth)) ** (1 / 6)
    return found, sizes


def accumulated(
    flows: Array, sources: Array, variances: Array, start: tuple[Array, Array]
) -> tuple[Array, Array]:
    """Return errors at the ends of n steps, (n + 1, 4, m), and a covariance, (n + 1, 4, 4).

    The errors are e of e_{i+1} = Φ_i e_i + l_i, for m sources l, shape (n, 4, m). The covariance is
    that of independent errors with the variances v_i, shape (n, 4): P_{i+1} = Φ_i P_i Φ_iᵀ + diag
    v_i. Blocks of steps are followed side by side from zero and from unit vectors, and then joined.
    """
    n, _, m = sources.shape
    width = math.isqrt(n) + 1
    count = -(-n // width)
    across = _in_blocks(flows, width, count)
    along = np.concatenate([sources, np.zeros((n, 4, 4))], axis=2)
    np.einsum("ijj->ij", along[:, :, m:])[:] = variances
    added = _in_blocks(along, width, count)
    # The flow from the start of the block, the errors, and the covariance.
    both = np.zeros((width + 1, count, 4, 8 + m))
    both[0, :, :, :4] = np.eye(4)
    for flow, own, after, new in zip(across, both[:-1], both[1:], added, strict=True):
        np.matmul(flow, own, out=after)
        after[:, :, -4:] = after[:, :, -4:] @ flow.transpose(0, 2, 1)
        after[:, :, 4:] += new
    starts = [np.concatenate(start, axis=1)]
    for end in both[-1]:
        starts.append(_carried(end[:, :4], starts[-1]) + end[:, 4:])
    blocks = both[1:].transpose(1, 0, 2, 3)
    ends = _carried(blocks[..., :4], np.array(starts[:-1])[:, None]) + blocks[..., 4:]
    found = np.concatenate([starts[0][None], ends.reshape(-1, 4, m + 4)[:n]])
    return found[:, :, :m], found[:, :, m:]


def carried(flows: Array, sources: Array, start: Array) -> Array:
    """Return errors at the ends of n steps, shape (n + 1, 4), as `accumulated` does.

    The sources have shape (n, 4), and the error at the start shape (4,).
    """
    n = len(flows)
    width = math.isqrt(n) + 1
    count = -(-n // width)
    across = _in_blocks(flows, width, count)
    added = _in_blocks(sources[:, :, None], width, count)
    both = np.zeros((width + 1, count, 4, 5))
    both[0, :, :, :4] = np.eye(4)
    for flow, own, after, new in zip(across, both[:-1], both[1:], added, strict=True):
        np.matmul(flow, own, out=after)
        after[:, :, 4:] += new
    starts = [start[:, None]]
    for end in both[-1]:
        starts.append(end[:, :4] @ starts[-1] + end[:, 4:])
    blocks = both[1:].transpose(1, 0, 2, 3)
    ends = blocks[..., :4] @ np.array(starts[:-1])[:, None] + blocks[..., 4:]
    return np.concatenate([start[None], ends.reshape(-1, 4)[:n]])


def _in_blocks(values: Array, width: int, count: int) -> Array:
    """Return the k-th values of all blocks together: shape (width, count, 4, m), zeros at the end.

    The values have shape (n, 4, m).
    """
    n, _, m = values.shape
    padded = np.zeros((count * width, 4, m))
    padded[:n] = values
    return np.ascontiguousarray(padded.reshape(count, width, 4, m).transpose(1, 0, 2, 3))


def _carried(flows: Array, both: Array) -> Array:
    """Return errors and a covariance, shape (…, 4, m + 4), after flows of shape (…, 4, 4)."""
    found = flows @ both
    found[..., -4:] = found[..., -4:] @ np.swapaxes(flows, -1, -2)
    return found
