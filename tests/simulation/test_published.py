"""Numbers that others published, reproduced by the shipped scenes."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from twolink import kane
from twolink.data import data_path
from twolink.scene import Scene
from twolink.simulation import simulate


def published(name: str) -> Scene:
    return Scene.load(data_path("scenes") / "published" / f"{name}.toml")


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


@pytest.mark.slow
@pytest.mark.parametrize("formulation", ["momenta", "lagrange", "kane"])
@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-13])
def test_the_reference_point(formulation, accuracy):
    scene = Scene.load(data_path("scenes") / "general.toml")
    trajectory = simulate(scene, accuracy=accuracy, formulation=formulation)
    assert trajectory.error <= accuracy
    state = [*trajectory.q[:, -1], *trajectory.u[:, -1]]
    for value, exact in zip(state, REFERENCE, strict=True):
        assert abs(mpmath.mpf(float(value)) - mpmath.mpf(exact)) <= accuracy


# Solfec's wall: times (s), who strikes, and normal speeds before (m/s).
SOLFEC = (
    (0.545229944, "B on wall", -1.985505770),
    (0.707571786, "D on wall", -4.015730732),
    (1.284071674, "B on wall", -0.679961108),
    (2.096669998, "D on wall", -0.490201681),
    (2.130553544, "B on wall", -1.031062438),
)


def test_solfec():
    """Potra et al. 2006: the energy lost is 11.6767 by theirs, 11.67666 in the limit."""
    trajectory = simulate(published("solfec_wall"))
    assert len(trajectory.impacts) == len(SOLFEC)
    for impact, (time, name, speed) in zip(trajectory.impacts, SOLFEC, strict=True):
        assert impact.time == pytest.approx(time, abs=1e-8)
        assert impact.name == name
        assert impact.speeds == pytest.approx((speed, -0.1 * speed), abs=1e-8)
    energy = trajectory.energy
    assert energy[0] - energy[-1] == pytest.approx(11.67666, abs=5e-6)


@pytest.mark.parametrize(
    ("law", "restitution", "friction", "ratio"),
    [
        ("newton", 0.5, 0.5, "1.5875"),
        ("poisson", 0.5, 0.5, "0.54508"),
        ("stronge", 0.5, 0.5, "0.55319"),
        ("newton", 0.7, 0.5, "2.7576"),
        ("poisson", 0.7, 0.5, "0.57167"),
        ("stronge", 0.7, 0.5, "0.60009"),
        ("poisson", 0.5, 0.7, "0.51695"),
        ("stronge", 0.5, 0.7, "0.52584"),
    ],
)
def test_kane_and_levinson(law, restitution, friction, ratio):
    scene = published("kane_levinson_impact")
    floor = replace(scene.effects[1], law=law, restitution=restitution, friction=friction)
    trajectory = simulate(replace(scene, effects=(scene.effects[0], floor), duration=0.01))
    impact = trajectory.impacts[0]
    assert impact.speeds[0] == pytest.approx(-0.13420201, abs=5e-9)
    assert impact.sliding[0] == pytest.approx(-0.26717434, abs=5e-9)
    before, after = impact.kinetic_energy
    decimals = len(ratio.partition(".")[2])
    assert f"{after / before:.{decimals}f}" == ratio


# Acrobot (Drake's parameters) and DFKI's pendulum C.1/1.0: joint accelerations by the matrices that
# are published with them, in angles from down, for states (θ1, θ2, θ1', θ2').
STATES = ((0.3, -0.7, 0.5, 1.1), (2.1, 0.4, -1.3, 0.2), (-1.0, 2.5, 0.0, 3.0))


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", ["acrobot", "dfki"])
def test_parameter_sets_in_use(name, state):
    if name == "acrobot":
        scene = Scene.load(data_path("scenes") / "acrobot.toml")
        m, l1, r = (1.0, 1.0), 1.0, (0.5, 1.0)
        about_joints, J, n = (0.083 + 0.25, 0.33 + 1.0), 0.0, 0.0
        damping, coulomb = (0.1, 0.1), (0.0, 0.0)
    else:
        scene = published("dfki_double_pendulum")
        m, l1, r = (0.52346, 0.62557), 0.2, (0.2, 0.25569305)
        about_joints, J, n = (0.0318872, 0.0508698), 6.2872e-5, 6.0
        damping, coulomb = (0.001, 0.001), (0.16, 0.12)
    a, b, da, db = state
    I1, I2 = about_joints
    c = m[1] * l1 * r[1]
    M = np.array(
        [
            [I1 + I2 + m[1] * l1**2 + 2 * c * np.cos(b) + (n * n + 1) * J, 0.0],
            [I2 + c * np.cos(b) - n * J, I2 + n * n * J],
        ]
    )
    M[0, 1] = M[1, 0]
    coriolis = c * np.sin(b) * np.array([-2 * da * db - db * db, da * da])
    g = 9.81
    weights = -g * np.array(
        [
            (m[0] * r[0] + m[1] * l1) * np.sin(a) + m[1] * r[1] * np.sin(a + b),
            m[1] * r[1] * np.sin(a + b),
        ]
    )
    resistance = np.array(damping) * [da, db] + np.array(coulomb) * np.sign([da, db])
    expected = np.linalg.solve(M, weights - coriolis - resistance)
    # Angles from down, counted as the absolute ones are from the x-axis to y: q = φ + π/2.
    q, u = (a + np.pi / 2, a + b + np.pi / 2), (da, da + db)
    chain = scene.moving_chain
    loads = tuple(load for effect in scene.effects for load in effect.loads(chain, q, u))
    du1, du2 = kane.forward_dynamics(chain, q, u, loads)
    assert (du1, du2 - du1) == pytest.approx(tuple(expected), rel=1e-11)
