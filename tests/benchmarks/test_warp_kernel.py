import numpy as np
import pytest

from benchmarks.warp_kernel import ends, rates_at, source
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

FALL = Scene.load("free_fall")
DAMPED = Scene(FALL.chain, (0.3, -0.8), (1.0, -2.0), 2.0, (Gravity(), JointDamping((0.1, 0.2))))


def test_the_source_has_the_operations_of_the_formula_alone():
    text = source(FALL)
    # One sine and one cosine of the elbow, and of each angle.
    assert text.count("wp.sin(") + text.count("wp.cos(") <= 6
    assert text.count("rates(y + h") == 11
    assert source(DAMPED) != text


@pytest.mark.engines
@pytest.mark.parametrize("scene", [FALL, DAMPED])
def test_the_rates_are_those_of_twolink(scene, random):
    pytest.importorskip("warp")
    states = random.normal(size=(200, 4)) * 3
    q, p = tuple(states[:, :2].T), tuple(states[:, 2:].T)
    first, second = EQUATIONS["momenta"].rates(scene.moving_chain, scene.effects, q, p, 0.0)
    own = np.array([*first, *second]).T
    found = rates_at(scene, states)
    # Sine and cosine are those of another library: a few roundings of the largest terms.
    assert np.abs(found - own).max() <= 1e-13 * np.abs(own).max()


@pytest.mark.engines
def test_the_motion_is_that_of_twolink():
    pytest.importorskip("warp")
    truth = simulate(DAMPED, accuracy=1e-12, samples=2)
    momenta = EQUATIONS["momenta"]
    start = [*DAMPED.q, *momenta.from_speeds(DAMPED.chain, DAMPED.q, DAMPED.u)]
    errors = []
    for steps in (40, 160, 320):
        q1, q2, p1, p2 = ends(DAMPED, np.array([start]), steps)[0]
        u = momenta.to_speeds(DAMPED.chain, (q1, q2), (p1, p2))
        errors.append(np.abs(np.array([q1, q2, *u]) - [*truth.q[:, -1], *truth.u[:, -1]]).max())
    # A wrong entry of the table would reduce the order, which is 8, to 6 or less.
    assert 7.0 < np.log(errors[0] / errors[1]) / np.log(4) < 9.0
    assert errors[2] <= 1e-12 + truth.error
