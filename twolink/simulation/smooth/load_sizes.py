"""The size of the round-off of loads, from all terms of their formulas."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple, cast

import numpy as np

from twolink.chain import Chain
from twolink.effects import Effect, smooth_loads
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.run import Array
from twolink.simulation.smooth.equations import EQUATIONS, gathered_force
from twolink.simulation.smooth.sized import Sized, sized
from twolink.values import Content


class LoadSizes(NamedTuple):
    """The round-off that loads give to the second pair of rates, in roundings, shape (2, n).

    `errors` is a size whose relative rounding it is, alike in states that are alike; `excess` is
    the part of it beyond a rounding of what the loads add to the rates. `spread` is independent in
    each state.
    """

    errors: Array
    excess: Array
    spread: Array


class ForceSizes(NamedTuple):
    """Generalized forces (N m) in states, and the round-off of their formulas, shape (2, n)."""

    values: Array
    excess: Array
    spread: Array

    def in_rates(self, chain: Chain, formulation: EquationsName, q: Any, u: Any) -> LoadSizes:
        """Return the round-off of the rates of some equations by forces, at angles and speeds.

        Large terms that nearly cancel count by their own sizes: those of the forces, and those of
        the equations that are solved for accelerations. The numbers of the chain are in float64,
        and may have shape (n,).
        """
        given, equations = self.given(chain, formulation, q), EQUATIONS[formulation]
        with np.errstate(all="ignore"):
            errors = equations.solved(chain, q, u, self.values) + given.excess
        return given._replace(errors=errors, excess=errors - (given.errors - given.excess))

    def given(self, chain: Chain, formulation: EquationsName, q: Any) -> LoadSizes:
        """Return the round-off that the forces alone give to the rates of some equations."""
        # The forces, and then the excess and the spread of each alone, as they are independent.
        alone = np.zeros((2, 5, *self.values.shape[1:]))
        alone[:, 0] = self.values
        alone[[0, 1], [1, 2]], alone[[0, 1], [3, 4]] = self.excess, self.spread
        with np.errstate(all="ignore"):
            found = np.abs(np.array(EQUATIONS[formulation].by_forces(chain, q, alone)))
            beyond = found[:, 1] + found[:, 2]
            return LoadSizes(found[:, 0] + beyond, beyond, found[:, 3] + found[:, 4])


def load_sizes(scene: Scene, formulation: EquationsName, q: Any, u: Any, t: Any) -> LoadSizes:
    """Return the round-off of a scene's loads at angles and speeds, shape (2, n), and times."""
    chain = scene.moving_chain.convert(float)
    return force_sizes(chain, scene.effects, q, u, t).in_rates(chain, formulation, q, u)


def force_sizes(chain: Chain, effects: tuple[Effect, ...], q: Any, u: Any, t: Any) -> ForceSizes:
    """Return the forces of effects at angles and speeds, shape (2, n), and times, shape (n,).

    The numbers of the chain, in float64, and of the effects may have shape (n,) as well.
    """
    angles, speeds = (Sized(q[0]), Sized(q[1])), (Sized(u[0]), Sized(u[1]))
    with np.errstate(all="ignore"):
        try:
            own = _in_sizes(chain)
            loads = smooth_loads(effects, own, angles, speeds, Sized(t))
        except (TypeError, AttributeError, ValueError):
            # A formula of one's own may take floats of the chain only.
            own, loads = chain, smooth_loads(effects, chain, angles, speeds, Sized(t))
        found = np.empty((3, 2, *np.shape(t)))
        for place, force in enumerate(gathered_force(own, angles, loads)):
            sizes = sized(force)
            found[0, place], found[1, place] = sizes.value, sizes.excess
            found[2, place] = sizes.spread
        return ForceSizes(*found)


def _in_sizes(chain: Chain) -> Chain:
    """Return a chain of numbers that carry their round-off: sums of constants may cancel as well.

    That of float64 numbers is wanted many times.
    """
    key = Content((chain,))
    return _kept(key) if key.is_value else chain.convert(sized)


@functools.lru_cache(maxsize=64)
def _kept(chain: Content) -> Chain:
    (given,) = chain.objects
    return cast("Chain", given.convert(sized))
