"""Long-time energy drift: theoretical exponents of each method, and errors."""

import csv
import io
import json
from dataclasses import replace
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from tests.verification.chains import GENERAL
from twolink import lagrange
from twolink.accuracy import drift as module
from twolink.accuracy.drift import CONSERVING, energy_drift, total_energy
from twolink.accuracy.error_growth import Binned, ErrorGrowth
from twolink.accuracy.long_runs import LONG_METHODS, many_starts
from twolink.accuracy.step_maps import StageIteration
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects import EFFECTS, potential_energy
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.motor_inertia import MotorInertia
from twolink.errors import ParameterError, SimulationError
from twolink.scene import Scene
from twolink.simulation.smooth.equations import MomentumEquations

pytestmark = pytest.mark.slow

SWINGS = Scene.load(data_path("scenes") / "small_swings.toml")
KEEPING = (
    Gravity(9.7, (0.3, 1.0)),
    JointSpring((3.0, 2.0), (0.4, -0.1)),
    MotorInertia((0.01, 0.02), (5.0, 3.0)),
)
NAMES = [method.name for method in LONG_METHODS]


@pytest.fixture(scope="module")
def found():
    return energy_drift(SWINGS, seconds=3000.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_method_drifts_as_theory_predicts(found, name):
    drift = next(one for one in found.drifts if one.method.name == name)
    assert drift.as_expected, (drift.growth, drift.failure)
    assert not drift.failure
    # Where the error is the method's own, its power is sharp; that of rounding has few walks.
    if name != "taylor-21":
        assert drift.growth.exponent == pytest.approx(drift.method.expected, abs=0.1)


@pytest.mark.parametrize(
    ("exponent", "uncertainty", "expected", "decided", "right"),
    [
        (0.34, 0.07, 0.5, False, False),
        (0.44, 0.05, 0.5, True, True),
        (0.92, 0.01, 1.0, True, True),
        (0.74, 0.02, 1.0, False, False),
        (0.02, 0.01, 0.5, True, False),
    ],
)
def test_an_uncertain_power_is_not_called_expected(exponent, uncertainty, expected, decided, right):
    method = next(one for one in LONG_METHODS if one.expected == expected)
    growth = ErrorGrowth(exponent, uncertainty, 1.0, 100.0)
    nothing = Binned(np.empty(0), np.empty((0, method.starts)))
    drift = module.Drift(method, nothing, growth, 0.1, 0, 0.0, 1.0, 1.0)
    assert (drift.decided, drift.as_expected) == (decided, right)
    study = module.DriftStudy(SWINGS, 100.0, 1.0, 1.0, None, (drift,))
    assert bool(study.unexpected) == (not right)
    assert ("too uncertain" in "".join(study.unexpected)) == (not decided)


def test_the_scene_is_regular_and_a_fall_is_not(found):
    assert not found.divergence.chaotic
    assert found.divergence.factor < 1e4
    fall = Scene.load(data_path("scenes") / "free_fall.toml")
    assert energy_drift(fall, seconds=100.0, methods=("taylor-11",)).divergence.chaotic


def test_lines_stay_apart_at_the_end(found):
    """Each is legible on one plot: no two end within a factor of two."""
    ends = sorted(drift.errors[-1] for drift in found.drifts)
    assert min(np.diff(np.log10(ends))) > 0.3


def test_rounding_is_far_below_the_error_of_each_method(found):
    errors = {drift.method.name: drift.errors[-1] for drift in found.drifts}
    assert errors["taylor-21"] < 1e-12
    assert all(errors[name] > 100 * errors["taylor-21"] for name in NAMES if name != "taylor-21")


def test_unconverged_stages_drift_and_are_reported(monkeypatch):
    """Three iterations instead of sixteen make a symplectic method lose energy steadily."""
    monkeypatch.setattr(StageIteration, "needed", lambda self, states: 3)
    (drift,) = energy_drift(SWINGS, seconds=300.0, methods=("implicit-midpoint",)).drifts
    assert drift.errors[-1] > 10 * drift.errors[10]
    assert drift.growth is None
    assert "unconverged by" in drift.failure
    monkeypatch.setattr(module, "_FINISHED", np.inf)
    study = energy_drift(SWINGS, seconds=3000.0, methods=("implicit-midpoint",))
    assert study.drifts[0].growth.exponent > 0.8
    assert study.unexpected[0].startswith("implicit-midpoint: a power of 0 is expected and ")


@pytest.mark.slow
def test_errors_of_taylor_series_grow_with_the_size_of_the_angles():
    """The same swing, a thousand turns away: tolerances and roundings are relative to angles."""
    turns = 1000 * 2 * np.pi
    away = replace(SWINGS, q=(SWINGS.q[0] + turns, SWINGS.q[1] + turns))
    names = ("rk4", "taylor-11", "taylor-21")
    near, far = (energy_drift(scene, seconds=200.0, methods=names) for scene in (SWINGS, away))
    rk4, coarse, full = (
        there.errors[-1] / here.errors[-1]
        for here, there in zip(near.drifts, far.drifts, strict=True)
    )
    # The radius is that of steps of Taylor series, which are longer there; rk4 errs by h⁵ a time.
    longer = far.drifts[0].step / near.drifts[0].step
    assert rk4 == pytest.approx(longer**5, rel=0.02)
    assert longer < 2
    assert coarse > 100
    assert full > 100
    assert near.farthest < 3
    assert far.farthest > turns


@pytest.mark.slow
def test_short_steps_keep_symplectic_methods_bounded_in_a_chaotic_motion(monkeypatch):
    fall = Scene.load(data_path("scenes") / "free_fall.toml")
    found = {}
    for factor in (1.0, 0.25):
        long = tuple(replace(one, share=factor * one.share) for one in LONG_METHODS)
        monkeypatch.setattr(module, "LONG_METHODS", long)
        (drift,) = energy_drift(fall, seconds=2000.0, methods=("gauss-legendre-4",)).drifts
        found[factor] = drift
    assert not found[1.0].as_expected
    assert found[0.25].as_expected


@pytest.mark.parametrize("share", [1.5, 4.0])
def test_a_method_that_fails_is_a_row_and_not_a_gap(monkeypatch, share):
    long = tuple(
        replace(method, share=share) if method.name in ("rk4", "implicit-midpoint") else method
        for method in LONG_METHODS
    )
    monkeypatch.setattr(module, "LONG_METHODS", long)
    names = ("implicit-midpoint", "rk4", "taylor-11")
    study = energy_drift(SWINGS, seconds=Fraction(300), methods=names)
    midpoint, rk4, taylor = study.drifts
    assert "does not converge" in midpoint.failure
    assert not rk4.as_expected
    assert taylor.as_expected
    assert len(study.unexpected) == 2
    assert json.loads(json.dumps(study.document()["methods"][0]["energy_errors"])) == []


def test_energy_is_computed_more_accurately_than_in_float64():
    """Against 50 digits, with the chain's float64 numbers as they are."""
    scene = replace(SWINGS, chain=Chain.uniform_bars((1.1, 0.7), (0.9, 1.3)), effects=KEEPING)
    states = many_starts(scene, 20, spread=0.5, seed=3)
    energies = total_energy(scene, states)
    chain = scene.moving_chain.convert(float).convert(mpmath.mpf)
    with mpmath.workdps(50):
        for state, energy in zip(states.T, energies, strict=True):
            q1, q2, p1, p2 = (mpmath.mpf(float(x)) for x in state)
            u = MomentumEquations().to_speeds(chain, (q1, q2), (p1, p2))
            terms = [lagrange.kinetic_energy(chain, (q1, q2), u)]
            terms += [e.potential_energy(chain, (q1, q2)) for e in KEEPING[:2]]
            # Gravity's own direction is float64; the rest is the rounding of long double.
            largest = max(abs(term) for term in terms)
            high = float(energy)
            exact = mpmath.mpf(high) + mpmath.mpf(float(energy - np.longdouble(high)))
            assert abs(exact - mpmath.fsum(terms)) < 2e-18 * largest


def test_the_accepted_effects_conserve_energy():
    """dE/dt along the motion, by a complex step, is rounding; that of damping is not."""
    scene = replace(SWINGS, chain=GENERAL, effects=KEEPING)
    assert all(isinstance(effect, CONSERVING) for effect in KEEPING)
    assert power(scene) < 1e-12
    assert power(replace(scene, effects=(*KEEPING, JointDamping((0.1, 0.1))))) > 1e-3


def power(scene: Scene) -> float:
    """Return the greatest |dE/dt| (W) of a few states."""
    equations, chain = MomentumEquations(), scene.moving_chain.convert(float)
    worst = 0.0
    for state in many_starts(replace(scene, u=(0.7, -1.1)), 10, spread=1.0, seed=5).T.tolist():
        rates = equations.rates(chain, scene.effects, tuple(state[:2]), tuple(state[2:]), 0.3)
        q1, q2, p1, p2 = (
            complex(x, 1e-30 * rate) for x, rate in zip(state, (*rates[0], *rates[1]), strict=True)
        )
        u = equations.to_speeds(chain, (q1, q2), (p1, p2))
        energy = lagrange.kinetic_energy(chain, (q1, q2), u)
        energy = energy + potential_energy(scene.effects, chain, (q1, q2))
        worst = max(worst, abs(energy.imag) / 1e-30)
    return worst


def test_only_gravity_springs_and_motor_inertia_are_accepted():
    """No effect is forgotten: those of scene files that conserve energy are these three."""
    from twolink.effects import effect_class

    let_in = {name for name in EFFECTS if issubclass(effect_class(name), CONSERVING)}
    assert let_in == {"gravity", "joint_spring", "motor_inertia"}


@pytest.mark.parametrize("name", ["acrobot", "drop", "sampled_torque", "joint_stops", "stick_slip"])
def test_scenes_that_do_not_conserve_energy_are_refused(name):
    scene = Scene.load(data_path("scenes") / f"{name}.toml")
    with pytest.raises(SimulationError, match=r"the scene must conserve energy, .*; got"):
        energy_drift(scene)


def test_wrong_methods_times_and_chains_at_rest_are_refused():
    with pytest.raises(SimulationError, match="method must be one of semi-implicit-euler"):
        energy_drift(SWINGS, methods=("euler",))
    for seconds in (1.0, -5.0, 1e13):
        with pytest.raises(SimulationError, match="the time must be 100 s to"):
            energy_drift(SWINGS, seconds=seconds)
    for seconds in (np.inf, np.nan):
        with pytest.raises(ParameterError, match="seconds must be a finite real number"):
            energy_drift(SWINGS, seconds=seconds)
    with pytest.raises(SimulationError, match="the chain must move; it stays at rest"):
        energy_drift(replace(SWINGS, effects=()))


def test_progress_increases_to_one():
    reports = []
    energy_drift(
        SWINGS, seconds=100.0, methods=("rk4", "taylor-11"), progress=lambda *w: reports.append(w)
    )
    shares = [share for _, share in reports]
    assert shares == sorted(shares)
    assert shares[0] == 0
    assert shares[-1] == pytest.approx(1.0, abs=1e-3)
    assert {name for name, _ in reports} == {"rk4", "taylor-11"}


def test_files_contain_the_measured_values(found):
    document = json.loads(json.dumps(found.document()))
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == sum(len(drift.times) for drift in found.drifts)
    for method, drift in zip(document["methods"], found.drifts, strict=True):
        own = [row for row in rows if row["method"] == drift.method.name]
        assert [float(row["energy_error"]) for row in own] == method["energy_errors"]
        assert method["energy_errors"] == drift.errors.tolist()
        assert method["exponent"] == drift.growth.exponent
    assert document["unexpected"] == []


@pytest.mark.long
def test_powers_over_twenty_thousand_seconds():
    study = energy_drift(SWINGS, seconds=2e4)
    for drift in study.drifts:
        allowed = 3 * drift.growth.uncertainty if drift.method.name == "taylor-21" else 0.05
        assert drift.growth.exponent == pytest.approx(drift.method.expected, abs=allowed)
    assert study.unexpected == ()
