"""Directions of a scene between two discontinuities of its effects.

There a piecewise effect acts as another one, its piece, whose numbers follow from its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice

from twolink.arithmetic import Scalar
from twolink.chain import Chain
from twolink.effects import Effect, PiecewiseEffect
from twolink.ensembles.numbers import numbers_in
from twolink.scene import Scene
from twolink.variations.directions import Direction

Slopes = tuple[Scalar, ...]
SlopesOfPieces = Callable[[float], Slopes]
"""From a time (s) to the slopes of the numbers of the chain and of the effects that act there.

Numbers are in the order of `numbers_in`.
"""


def slopes_of_pieces(scene: Scene, direction: Direction) -> SlopesOfPieces:
    """Return the slopes in a direction. Raises `SimulationError` where an effect has none."""
    parts = [_of_pieces(thing, slopes) for thing, slopes in _parts(scene, direction)]
    return lambda t: tuple(slope for part in parts for slope in part(t))


def varies_pieces(scene: Scene, direction: Direction) -> bool:
    """Return whether a direction changes a number of a piecewise effect."""
    parts = _parts(scene, direction)
    return any(isinstance(thing, PiecewiseEffect) and any(slopes) for thing, slopes in parts)


def _of_pieces(thing: Chain | Effect, slopes: Slopes) -> SlopesOfPieces:
    """Return the slopes of the numbers of a part of a scene, which has itself these slopes."""
    if not isinstance(thing, PiecewiseEffect):
        return lambda t: slopes
    if any(slopes):
        return thing.slopes_of(slopes)
    return lambda t: (0.0,) * len(numbers_in(thing.piece_at(t))[0])


def _parts(scene: Scene, direction: Direction) -> Iterator[tuple[Chain | Effect, Slopes]]:
    """Yield the chain and each effect, with the slopes of its numbers."""
    left = iter(direction.numbers)
    things: tuple[Chain | Effect, ...] = (scene.moving_chain, *scene.effects)
    for thing in things:
        yield thing, tuple(islice(left, len(numbers_in(thing)[0])))
