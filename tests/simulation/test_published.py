"""Numbers that others published, reproduced by the shipped scenes."""

import mpmath
import numpy as np
import pytest

from twolink.scene import Scene
from twolink.shipped import shipped
from twolink.simulation import simulate


def published(name: str) -> Scene:
    return Scene.load(shipped("scenes") / "published" / f"{name}.toml")


# t: φ1, w1, φ2, w2 of DoublePendulumInitTip, Modelica Standard Library v4.0.0, DASSL at 1e-6.
MODELICA = {
    0.5: (-1.28792549332, -4.11644004485, -1.05082418095, -5.18654574676),
    1.0: (-3.41892946996, 0.77638978814, 1.48753027640, 0.56833631145),
    2.0: (-0.43032820073, -0.65678033467, 3.18686740428, 6.40604208592),
}


@pytest.mark.parametrize("t", MODELICA)
def test_modelica(t):
    phi1, w1, phi2, w2 = MODELICA[t]
    q, u = simulate(published("modelica_double_pendulum")).at(t)
    assert q[:, 0] == pytest.approx((-phi1, -(phi1 + phi2)), abs=3e-4)
    assert u[:, 0] == pytest.approx((-w1, -(w1 + w2)), abs=1e-3)


# t: φ1, φ2, w1, w2 of Project Chrono's utest_CH_double_pend, in the limit of small steps.
CHRONO = {
    0.25: (-0.19778071, -0.04625643, -1.57603315, -0.37838445),
    0.5: (-0.76918157, -0.21317991, -2.89966988, -1.06951203),
    1.0: (-2.22720284, -1.48968770, -1.94959746, -3.94804271),
}


@pytest.mark.parametrize("t", CHRONO)
def test_chrono(t):
    phi1, phi2, w1, w2 = CHRONO[t]
    q, u = simulate(published("chrono_double_pendulum")).at(t)
    assert q[:, 0] == pytest.approx((-phi1, -phi2), abs=1e-7)
    assert u[:, 0] == pytest.approx((-w1, -w2), abs=1e-7)


def test_iftomm_a01():
    """After one exact period the pendulum is back where it was released."""
    scene = published("iftomm_a01_pendulum")
    with mpmath.workdps(30):
        period = float(4 / mpmath.sqrt(mpmath.mpf(9.81)) * mpmath.ellipk(mpmath.mpf(1) / 2))
    assert scene.duration == period
    assert period == pytest.approx(2.3678419476, abs=5e-11)
    trajectory = simulate(scene)
    assert abs(trajectory.q[0, -1]) < 1e-10
    assert abs(trajectory.u[0, -1]) < 1e-9
    half, _ = trajectory.at(period / 2)
    assert half[0, 0] == pytest.approx(np.pi, abs=1e-10)


# The state at t = 10 s from (0.3, −0.4, 0.1, 0.2), by 256-bit Taylor integration; every input is
# taken as its float64 number.
REFERENCE = (
    "0.63169544965324369677714",
    "14.846153572263320406222",
    "1.6832078686201083588420",
    "7.1716794367334515948596",
)


@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-13])
def test_the_reference_point(formulation, accuracy):
    scene = Scene.load(shipped("scenes") / "general.toml")
    trajectory = simulate(scene, accuracy=accuracy, formulation=formulation)
    assert trajectory.error <= accuracy
    state = [*trajectory.q[:, -1], *trajectory.u[:, -1]]
    for value, exact in zip(state, REFERENCE, strict=True):
        assert abs(mpmath.mpf(float(value)) - mpmath.mpf(exact)) <= accuracy
