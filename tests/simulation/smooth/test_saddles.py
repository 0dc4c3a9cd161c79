"""Motions along the stable mode of a saddle, from which round-off drives them away.

Links whose centres are in their joints, under springs alone, have linear equations: the exact
motion is an exponential of a matrix, in 60 digits. The start at rest has a shape of which one
direction of a moved start has no unstable part.
"""

from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.joint_spring import JointSpring
from twolink.ensembles.run import sweep
from twolink.scene import Scene
from twolink.simulation.simulate import simulate
from twolink.simulation.smooth.moved_start import FORWARD, Move, moved_start

# The shape of the start, which is a stable mode: the direction in which starts are moved first.
STABLE = np.array(moved_start((0.0, 0.0), (0.0, 0.0), Move(1.0, FORWARD))[0])


def saddle(y, share, size, duration, scale=1.0):
    """Return a scene that starts at rest in a stable mode; the unstable one, e^t, is (1, y).

    Both are normal by M, of which the start is the normal of the unstable momenta.
    """
    unstable = np.array([1.0, y])
    M = scale * np.array([-STABLE[1] * y, 1.0])
    of_unstable, of_stable = (
        np.outer(M * mode, M * mode) / (mode @ (M * mode)) for mode in (unstable, STABLE)
    )
    # Two springs give the links moments of which one is equal and opposite.
    square = (of_unstable[0, 1] + of_unstable[1, 1]) / (of_stable[0, 1] + of_stable[1, 1])
    K = square * of_stable - of_unstable
    springs = JointSpring((float(K[0, 0] - K[1, 1]), float(K[1, 1])))
    mass = share * M[0]
    chain = Chain((1.0, mass), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (M[0] - mass, M[1]))
    return Scene(chain, tuple(size * STABLE), (0.0, 0.0), duration, (springs,))


def exact_end(scene):
    """Return q and u at the end, in floats, from numbers of 60 digits."""
    chain, (springs,) = scene.chain, scene.effects
    with mp.workdps(60):
        k1, k2 = map(mp.mpf, springs.stiffness)
        M1, M2 = mp.mpf(chain.inertia[0]) + mp.mpf(chain.mass[1]), mp.mpf(chain.inertia[1])
        rows = [[0, 0, 1, 0], [0, 0, 0, 1], [-(k1 + k2) / M1, k2 / M1, 0, 0]]
        rates = mp.matrix([*rows, [k2 / M2, -k2 / M2, 0, 0]])
        start = mp.matrix([mp.mpf(float(x)) for x in (*scene.q, *scene.u)])
        return np.array([float(x) for x in mp.expm(rates * mp.mpf(scene.duration)) * start])


SCENES = [
    (0.75, 0.115, 1.8, 29.6),
    (0.6, 0.2, 1.5, 28.0),
    (0.3, 0.5, 0.02, 24.0),
    (0.9, 0.3, 12.0, 25.0),
    (0.14, 0.05, 2.9, 23.0),
]


@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
@pytest.mark.parametrize("accuracy", [1e-3, 1e-5, 1e-7, 1e-9, 1e-12])
@pytest.mark.parametrize("numbers", SCENES)
def test_the_error_of_a_motion_beside_an_unstable_mode_is_reported(numbers, accuracy, formulation):
    scene = saddle(*numbers)
    run = simulate(scene, accuracy=accuracy, formulation=formulation, samples=5)
    error = np.abs(np.concatenate([run.q[:, -1], run.u[:, -1]]) - exact_end(scene)).max()
    assert error <= run.error
    assert run.met


@pytest.mark.parametrize(
    ("numbers", "accuracy", "formulation"),
    [
        # The links turn by several radians in a step, which does not show in their rates.
        ((0.522, 0.245, 5.98, 26.2, 373.0), 5.4e-9, "kane"),
        ((0.328, 0.641, 16.8, 13.4, 1.55), 3.4e-12, "kane"),
        ((0.597, 0.701, 28.5, 9.67, 0.112), 2.2e-11, "kane"),
        # High terms of the series are large, as those of e^t are.
        ((0.827, 0.861, 0.00357, 22.8, 58.7), 9.9e-11, "kane"),
        ((0.528, 0.276, 0.00417, 26.5, 14.8), 4.2e-9, "kane"),
        # Terms beyond those of float64's last digits are too large for a long double.
        ((0.848, 0.435, 0.048, 17.4, 0.0461), 4e-12, "kane"),
        ((0.856, 0.295, 0.00571, 29.3, 50.4), 7e-8, "kane"),
    ],
)
def test_the_error_by_the_defect_of_long_steps_is_reported(numbers, accuracy, formulation):
    scene = saddle(*numbers)
    run = simulate(scene, accuracy=accuracy, formulation=formulation, samples=5)
    error = np.abs(np.concatenate([run.q[:, -1], run.u[:, -1]]) - exact_end(scene)).max()
    assert error <= run.error
    assert run.met


@pytest.mark.parametrize(
    ("numbers", "accuracy", "count", "keep"),
    [
        (SCENES[-1], 7e-8, 6, {}),
        (SCENES[-1], 7e-8, 6, {"samples": 5}),
        # Growth in the first direction alone misses the unstable mode by a factor of 100.
        ((0.677, 0.556, 7.2, 25.3), 2.2e-7, 4, {"samples": 5}),
        ((0.677, 0.556, 7.2, 25.3), 2.2e-7, 4, {"extremes": True}),
        ((0.538, 0.473, 5.64, 25.7), 4e-6, 4, {"samples": 5}),
    ],
)
def test_members_of_a_sweep_beside_an_unstable_mode_have_their_errors(
    numbers, accuracy, count, keep, tmp_path
):
    scene = saddle(*numbers)
    (k1, k2), chain = scene.effects[0].stiffness, scene.chain
    values = [k1 * (1 + j * 2.0**-50) for j in range(count)]
    table = {
        "chain": {name: getattr(chain, name) for name in ("mass", "length", "centre", "inertia")},
        "start": {"q": scene.q},
        "run": {"duration": scene.duration},
        "effects": {"joint_spring": {"stiffness": [k1, k2]}},
    }
    axis = {"parameter": "effects.joint_spring.stiffness.0", "name": "k", "values": values}
    runs, keep = {"accuracy": accuracy}, {"final": True, **keep}
    asked = {"scene": table, "axes": [axis], "runs": runs, "keep": keep}
    found = sweep(asked, tmp_path / "found.zarr", workers=1)
    for j, value in enumerate(values):
        exact = exact_end(replace(scene, effects=(JointSpring((value, k2)),)))
        ends = np.array([*found.array("q")[j], *found.array("u")[j]])
        assert np.abs(ends - exact).max() <= found.array("error")[j]
