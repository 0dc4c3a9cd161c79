"""Directions of a scene between two discontinuities of its effects.

There a piecewise effect acts as another one, its piece, whose numbers follow from its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

from twolink.chain import Chain
from twolink.effects import Effect, PiecewiseEffect
from twolink.ensembles.numbers import numbers_in
from twolink.scene import Scene
from twolink.variations.directions import Direction

Slopes = tuple[float, ...]


def slopes_of_piece(scene: Scene, direction: Direction, t: float) -> Slopes:
    """Return the slopes of the numbers of the chain and of the effects that act from a time (s).

    They are in the order of `numbers_in`. Raises `SimulationError` where an effect has none.
    """
    found: list[float] = []
    for thing, slopes in _parts(scene, direction):
        if not isinstance(thing, PiecewiseEffect):
            found += slopes
        elif any(slopes):
            found += thing.slopes_at(t, slopes)
        else:
            found += [0.0] * len(numbers_in(thing.piece_at(t))[0])
    return tuple(found)


def varies_pieces(scene: Scene, direction: Direction) -> bool:
    """Return whether a direction changes a number of a piecewise effect."""
    parts = _parts(scene, direction)
    return any(isinstance(thing, PiecewiseEffect) and any(slopes) for thing, slopes in parts)


def _parts(scene: Scene, direction: Direction) -> Iterator[tuple[Chain | Effect, Slopes]]:
    """Yield the chain and each effect, with the slopes of its numbers."""
    left = iter(direction.numbers)
    things: tuple[Chain | Effect, ...] = (scene.moving_chain, *scene.effects)
    for thing in things:
        yield thing, tuple(islice(left, len(numbers_in(thing)[0])))
