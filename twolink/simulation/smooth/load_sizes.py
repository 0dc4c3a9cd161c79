"""The size of the round-off of loads, from all terms of their formulas."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS, gathered_force
from twolink.simulation.smooth.sized import Sized, sized


class LoadSizes(NamedTuple):
    """The round-off that loads give to the second pair of rates, in roundings, shape (2, n).

    `errors` is a size whose relative rounding it is, alike in states that are alike; `excess` is
    the part of it beyond a rounding of the loads themselves. `spread` is independent in each state.
    """

    errors: Array
    excess: Array
    spread: Array


def load_sizes(scene: Scene, formulation: EquationsName, q: Any, u: Any, t: Any) -> LoadSizes:
    """Return the round-off of a scene's loads at angles and speeds, shape (2, n), and times."""
    return sizes_of_loads(scene.moving_chain.convert(float), scene.effects, formulation, q, u, t)


def sizes_of_loads(
    chain: Chain, effects: tuple[Effect, ...], formulation: EquationsName, q: Any, u: Any, t: Any
) -> LoadSizes:
    """Return the round-off of loads at angles and speeds, shape (2, n), and times, shape (n,).

    Large terms that nearly cancel count by their own sizes, within one effect too. The numbers of
    the chain, in float64, and of the effects may have shape (n,) as well.
    """
    angles, speeds = (Sized(q[0]), Sized(q[1])), (Sized(u[0]), Sized(u[1]))
    with np.errstate(all="ignore"):
        loads = smooth_loads(effects, chain, angles, speeds, Sized(t))
        forces = [sized(force) for force in gathered_force(chain, angles, loads)]
        values, excess, spread = (
            np.array([np.broadcast_to(getattr(force, name), np.shape(t)) for force in forces])
            for name in ("value", "excess", "spread")
        )
        none, of = np.zeros_like(excess[0]), EQUATIONS[formulation].by_forces

        def sizes(first: Array, second: Array) -> Array:
            """Return the size of the rates by forces that are independent."""
            single = of(chain, q, (first, none)), of(chain, q, (none, second))
            return np.abs(np.array(single)).sum(axis=0)

        beyond = sizes(*excess)
        return LoadSizes(np.abs(np.array(of(chain, q, values))) + beyond, beyond, sizes(*spread))
