import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from tests.variations.cases import RICH, SPRING, STIFFNESS, TORQUES, J, family, oscillation
from twolink import sweep
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects import EndForce, Gravity, JointFriction, PdControl
from twolink.errors import ParameterError, SceneError, SimulationError, TooMuchError
from twolink.limits import Limits
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.variations.sensitivity import sensitivity


def test_an_oscillator_against_its_closed_form():
    names = ("start.q.0", "start.u.0", "effects.joint_spring.stiffness.0", "m2", "L1")
    found = sensitivity(SPRING, names, samples=101)
    motion, by_w, by_q, by_u = oscillation(found.t)
    w = np.sqrt(STIFFNESS / J)
    # ω² = k / J with J = I_A + m2 L1²: dω/dk, dω/dm2, dω/dL1.
    factors = (w / (2 * STIFFNESS), -w / (2 * J), -w / (2 * J) * 2)
    expected = [by_q, by_u, *(tuple(factor * x for x in by_w) for factor in factors)]
    rounding = 1e-14
    assert found.met
    assert np.abs(found.q[0] - motion[0]).max() <= found.error + rounding
    for k, (dq, du) in enumerate(expected):
        allowed = found.errors[k] + rounding
        assert (np.abs(found.dq[k, 0] - dq) <= allowed).all(), names[k]
        assert (np.abs(found.du[k, 0] - du) <= allowed).all(), names[k]
    assert found.errors.max() < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "names"),
    [
        ("general", ("q1", "q2", "u1", "u2", "m1", "m2", "L1", "L2", "g")),
        (RICH, ("start.theta.0", "start.omega.1", "chain.inertia.0", "chain.joint_offset.1")),
    ],
)
def test_differences_of_simulated_neighbours(scene, names):
    own = family(scene, *names)
    short = replace(own.scene(own.values), duration=2.0)
    if scene == "general":
        scene = short
    found = sensitivity(scene, names, samples=21)
    h = 2.0**-12
    for k in range(len(names)):
        ends = []
        for step in (h, h / 2):
            above, below = (
                replace(own.scene(np.array(own.values) + sign * step * np.eye(len(names))[k]))
                for sign in (1, -1)
            )
            runs = [
                simulate(replace(each, duration=2.0), accuracy=1e-13, samples=21)
                for each in (above, below)
            ]
            pairs = [np.array([run.q, run.u]) for run in runs]
            ends.append((pairs[0] - pairs[1]) / (2 * step))
        # Richardson's extrapolation, whose error is that of its coarser difference by far.
        truth, coarse = (4 * ends[1] - ends[0]) / 3, ends[0]
        got = np.array([found.dq[k], found.du[k]])
        roundings = 1e-13 / h
        assert np.abs(got - truth).max() <= 0.01 * np.abs(coarse - truth).max() + 4 * roundings


@pytest.mark.slow
def test_an_ensemble_has_the_same_slopes(tmp_path):
    h = 2.0**-14
    tables = {
        "scene": "free_fall",
        "axes": [{"parameter": "q1", "values": [-h, 0.0, h]}],
        "runs": {"accuracy": 1e-12, "duration": 2.0},
        "keep": {"final": True},
    }
    own = family("free_fall", "q1")
    value = own.values[0]
    tables["axes"][0]["values"] = [value - h, value, value + h]
    runs = sweep(tables, tmp_path / "a.zarr", workers=1)
    found = sensitivity(replace(Scene.load("free_fall"), duration=2.0), "q1")
    q, u = runs.array("q"), runs.array("u")
    for values, slope in ((q, found.dq[0, :, -1]), (u, found.du[0, :, -1])):
        middle = (values[2] - values[0]) / (2 * h)
        # One-sided differences tell the second derivative, and halves of h the third.
        bend = np.abs(values[2] - 2 * values[1] + values[0]).max() / h
        assert np.abs(middle - slope).max() <= bend * h * 100 + 1e-11 / h
        assert np.abs(slope).max() > 100 * bend * h


def test_names_are_those_of_sweep_files_and_symbols():
    by_key = sensitivity(SPRING, ("start.q.1", "chain.mass.0"), samples=3)
    by_symbol = sensitivity(Scene.from_dict(SPRING), ("q2", "m1"), samples=3)
    assert np.array_equal(by_key.dq, by_symbol.dq)
    assert by_key.values == by_symbol.values
    assert np.array_equal(by_symbol.of("m1")[1], by_symbol.du[1])
    with pytest.raises(ParameterError, match="must be one of q2, m1; got 'm2'"):
        by_symbol.of("m2")


@pytest.mark.slow
def test_a_uniform_bar_is_longer_as_a_bar():
    """A bar of explicit numbers keeps its inertia where another mass and length are."""
    bar = replace(Scene.load("free_fall"), duration=1.0)
    own = bar.chain
    explicit = replace(bar, chain=Chain(own.mass, own.length, own.centre, own.inertia))
    assert np.abs(sensitivity(bar, "L2", samples=3).dq[0, :, -1]).min() > 0.1
    # D is a point without mass, and does not move the chain.
    assert np.abs(sensitivity(explicit, "L2", samples=3).dq).max() == 0.0


@pytest.mark.slow
def test_a_urdf_s_joint_angles():
    scene = {
        "chain": {"urdf": str(data_path("twolink.urdf"))},
        "start": {"theta": [0.1, 0.2]},
        "run": {"duration": 1.0},
        "effects": {"gravity": {}},
    }
    found = sensitivity(scene, ("start.theta.0", "start.theta.1"), samples=5)
    # q2 = θ1 + θ2 up to constants: both angles turn link 2, and θ1 link 1 too.
    assert np.abs(found.dq[:, :, 0]).tolist() == [
        pytest.approx([1.0, 1.0]),
        pytest.approx([0.0, 1.0], abs=1e-15),
    ]


def test_an_accuracy_that_cannot_be_met_is_said():
    found = sensitivity(SPRING, "start.q.0", accuracy=1e-17, samples=11)
    assert not found.met
    assert found.holds_until < found.t[-1]
    assert "The accuracy 1.0e-17 holds until" in found.notes[-1]
    assert sensitivity(SPRING, "start.q.0", accuracy=1e-6, samples=11).notes == ()


@pytest.mark.parametrize(
    ("scene", "by", "error", "sentence"),
    [
        ("drop", "q1", SimulationError, "got Surface, which has modes and events"),
        ("general", "q3", ParameterError, r"by.0: the key in the scene must be one of .*'q2'"),
        ("general", "chain.q.1", ParameterError, "by.0: the key in chain must be one of mass"),
        ("general", "start.theta.0", ParameterError, "by.0: the key in start must be one of q, u"),
        ("general", (), ParameterError, "by must be a sequence of names"),
        ("general", 3, ParameterError, "by must be a sequence of names"),
        ("general", ("q1", "start.q.0"), ParameterError, "once; got 'start.q.0' again"),
        (
            TORQUES,
            "effects.sampled_torque.times.1",
            SimulationError,
            "moves no corner of a load in",
        ),
        ("none", "q1", SceneError, "none"),
        (
            "general",
            "effects.gravity.direction.0",
            SimulationError,
            "0 must be a number by which .* one that has to be a float in them$",
        ),
    ],
)
def test_what_has_no_derivative_is_refused(scene, by, error, sentence):
    with pytest.raises(error, match=sentence):
        sensitivity(scene, by)


SHORT = Scene(Chain.uniform_bars(), (0.3, -0.2), (0.0, 0.0), 0.5)


@pytest.mark.parametrize(
    ("effect", "by"),
    [
        (EndForce(2.0), ("g",)),
        (EndForce(2.0), ("effects.end_force.normal",)),
        (EndForce(2.0, 0.1, 1), ("effects.end_force.friction",)),
        (JointFriction((0.0, 0.0)), ("g",)),
    ],
)
def test_an_effect_that_has_no_friction_leaves_a_scene_smooth(effect, by):
    scene = replace(SHORT, effects=(Gravity(), effect))
    assert sensitivity(scene, by, accuracy=1e-6, samples=2).met


def test_friction_of_no_size_is_refused_where_its_own_number_is_varied():
    scene = replace(SHORT, effects=(Gravity(), JointFriction((0.0, 0.0))))
    sentence = r"kinetic.1 must be a number beside which no friction or contact acts, .*; got 0\.0$"
    with pytest.raises(SimulationError, match=sentence):
        sensitivity(scene, ("g", "effects.joint_friction.kinetic.1"))


def test_another_method_is_refused():
    with pytest.raises(SimulationError, match="must be taylor, which integrates derivatives; got"):
        sensitivity(replace(Scene.load("general"), method="DOP853"), "q1")


@pytest.mark.slow
@pytest.mark.parametrize("interpolation", ["hold", "linear", "cubic"])
def test_neighbours_of_a_motion_through_corners(interpolation):
    torque = {**TORQUES["effects"]["sampled_torque"], "interpolation": interpolation}
    scene = {**TORQUES, "effects": {**TORQUES["effects"], "sampled_torque": torque}}
    names = ("start.theta.0", "m2", "effects.sampled_torque.A.2")
    own = family(scene, *names)
    found = sensitivity(scene, names, samples=41)
    assert found.met
    h = 2.0**-12
    for k in range(len(names)):
        ends = []
        for step in (h, h / 2):
            pairs = []
            for sign in (1, -1):
                values = np.array(own.values)
                values[k] += sign * step
                run = simulate(own.scene(values), accuracy=1e-13, samples=41)
                pairs.append(np.array([run.q, run.u]))
            ends.append((pairs[0] - pairs[1]) / (2 * step))
        truth, coarse = (4 * ends[1] - ends[0]) / 3, ends[0]
        got, roundings = np.array([found.dq[k], found.du[k]]), 1e-13 / h
        assert np.abs(got - truth).max() <= 0.01 * np.abs(coarse - truth).max() + 4 * roundings
        assert np.abs(got).max() > 1e6 * roundings


def test_uncertainty_through_corners_is_compared_with_neighbours():
    found = sensitivity("sampled_torque", ("q1", "effects.sampled_torque.B.3"), samples=11)
    small = found.uncertainty({"effects.sampled_torque.B.3": 1e-4})
    assert small.linear_until == 1.0
    assert small.departure[-1] < 1e-2
    # Before the sample acts, at 0.3 s, it changes nothing.
    assert (small.deviation[:, :3] == 0).all()
    assert (small.deviation[:, -1] > 0).all()


def test_limits_are_kept():
    with pytest.raises(TooMuchError, match="1000 samples would take"):
        sensitivity("general", "q1", samples=1000, limits=Limits(memory=1e5))


def test_every_smooth_effect_has_derivatives():
    scene = replace(Scene.load("general"), duration=1.0)
    control = PdControl((0.1, 0.2), (1.0, 1.0), (0.1, 0.1))
    found = sensitivity(
        replace(scene, effects=(*scene.effects, control)),
        "effects.pd_control.proportional.0",
        samples=3,
    )
    assert np.abs(found.dq[0, :, -1]).max() > 0


def test_the_progress_ends_at_one():
    seen = []
    sensitivity(SPRING, "q1", samples=3, progress=lambda *said: seen.append(said))
    assert seen[-1][1] == 1.0
    assert {name for name, _ in seen} >= {"momenta, double", "lagrange, long double"}


def test_arrays_are_read_only():
    found = sensitivity(SPRING, "q1", samples=3)
    for array in (found.t, found.q, found.u, found.dq, found.du, found.errors):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def test_the_result_as_text_data_and_table():
    found = sensitivity({"title": "A spring", **SPRING}, ("q1", "m2"), samples=5)
    rows = list(csv.reader(io.StringIO(found.csv())))
    assert rows[0][:7] == ["t", "q1", "q2", "u1", "u2", "dq1/dq1", "dq2/dq1"]
    assert rows[0][-1] == "error of d/dm2"
    assert len(rows) == 6
    last = dict(zip(rows[0], map(float, rows[-1]), strict=True))
    assert last["du2/dm2"] == found.du[1, 1, -1]
    document = json.loads(json.dumps(found.document()))
    assert document["by"]["m2"]["du"][1][-1] == found.du[1, 1, -1]
    assert [cell.text for cell in found.summary().rows[1]][:1] == ["m2"]
    assert repr(found).startswith("<Sensitivity of 'A spring' by q1, m2: 5 samples, relative")
