"""The requirement of variational equations: a motion without modes, and corners if need be."""

from __future__ import annotations

from twolink.effects import PiecewiseEffect, contact_elements, discontinuities, names_of
from twolink.errors import SimulationError
from twolink.scene import Scene


def check_smooth(scene: Scene, *, corners: bool = False) -> None:
    """Raise `SimulationError` unless a scene is smooth.

    With `corners`, loads may have corners in time, between which the motion is smooth.
    """
    for name, effect in zip(names_of(scene.effects), scene.effects, strict=True):
        modes = bool(contact_elements((effect,), scene.moving_chain))
        with_corners = not corners and isinstance(effect, PiecewiseEffect)
        with_corners &= bool(discontinuities((effect,)))
        if modes or with_corners:
            raise SimulationError(
                "a scene must be smooth for variational equations; got"
                f" {name}, which has {'modes and events' if modes else 'corners in time'}: runs"
                " of `sweep` with neighbouring values show how its motion depends on them"
            )
