"""Free falls from random starts, and the check of the errors at their ends."""

import numpy as np

from twolink.scene import Scene
from twolink.simulation import simulate

FALL = Scene.load("free_fall")
DURATION = 3.0


def random_starts(random, count):
    """Return q and u of starts, shape (2, count)."""
    return random.uniform(-3, 3, (2, count)), random.normal(size=(2, count))


def with_wild_neighbours(q, u):
    """Return starts of which every other turns by hundreds of radians, in ten times the steps."""
    q, u = q.copy(), u.copy()
    q[:, ::2] += 400.0
    u[:, ::2] *= 60.0
    return q, u


def check_bounds(ends, q, u):
    """Require of every fourth run that its bound holds, and is not far above its error."""
    for lane in range(0, q.shape[1], 4):
        start = {"q": tuple(q[:, lane]), "u": tuple(u[:, lane])}
        scene = Scene(FALL.chain, **start, duration=DURATION, effects=FALL.effects)
        truth = simulate(scene, accuracy=1e-13, samples=2)
        error = max(
            np.abs(ends.q[:, lane] - truth.q[:, -1]).max(),
            np.abs(ends.u[:, lane] - truth.u[:, -1]).max(),
        )
        bound = ends.errors[lane]
        assert error <= bound + truth.error
        if np.isfinite(bound):
            # The error may be smaller at the end than it was before.
            assert bound <= 1e4 * error + 1e-10
