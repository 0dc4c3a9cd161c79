"""A motion in pieces: the intervals between the discontinuities of its effects."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from twolink.effects import Effect, discontinuities, pieces_at
from twolink.scene import Scene

Array = NDArray[np.float64]


def pieces_of(scene: Scene, times: Array) -> Iterator[tuple[Array, tuple[Effect, ...]]]:
    """Yield the times (s) of each interval between discontinuities, with its ends, and its effects.

    `times` increase, and the motion goes from the first of them to the last.
    """
    inside = [t for t in discontinuities(scene.effects) if times[0] < t < times[-1]]
    for start, end in pairwise([float(times[0]), *inside, float(times[-1])]):
        within = times[(times > start) & (times < end)]
        yield np.array([start, *within, end]), pieces_at(scene.effects, start)
