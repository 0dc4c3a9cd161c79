"""The requirement of variational equations: a motion without modes and corners."""

from __future__ import annotations

from twolink.effects import (
    ContactEffect,
    PiecewiseEffect,
    contact_elements,
    discontinuities,
    names_of,
)
from twolink.errors import SimulationError
from twolink.scene import Scene


def check_smooth(scene: Scene, *, varied_effects: bool = False) -> None:
    """Raise `SimulationError` unless a scene is smooth, as are those with other numbers.

    With `varied_effects` the numbers of effects are varied: even an effect that acts with none of
    its own, such as friction with a coefficient of zero, is then refused.
    """
    for name, effect in zip(names_of(scene.effects), scene.effects, strict=True):
        modes = contact_elements((effect,), scene.moving_chain)
        corners = discontinuities((effect,))
        kinds = (ContactEffect, PiecewiseEffect)
        if modes or corners or (varied_effects and isinstance(effect, kinds)):
            raise SimulationError(
                "a scene must be smooth for variational equations; got"
                f" {name}, which has {'corners in time' if corners else 'modes and events'}: runs"
                " of `sweep` with neighbouring values show how its motion depends on them"
            )
