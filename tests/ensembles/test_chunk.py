import numpy as np
import pytest

from tests.ensembles.cases import UNCOUPLED, axis, ensemble, starts, torques
from tests.strategies import EFFECT_STRATEGIES
from twolink.ensembles import chunk as chunks
from twolink.ensembles.chunk import goes_in_lanes, rows_of
from twolink.errors import TooMuchError
from twolink.limits import Limits
from twolink.simulation import simulate
from twolink.simulation.smooth.taylor import taylor_run

KEEP = {
    "final": True,
    "energy": True,
    "extremes": True,
    "extreme_speeds": True,
    "samples": 5,
    "first": [{"name": "flip", "of": "either"}],
}


def same(one, other):
    return all(
        np.array_equal(one[name], other[name], equal_nan=one[name].dtype.kind == "f")
        for name in one
    )


def joined(parts):
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


@pytest.mark.slow
@pytest.mark.parametrize("refine", [False, True])
def test_bits_do_not_depend_on_chunks(refine):
    runs = {"accuracy": 1e-8, "duration": 6.0, "refine": refine}
    asked = starts(7, keep=KEEP, runs=runs)
    whole = rows_of(asked, 0, 49).arrays
    parts = [rows_of(asked, k, min(k + 5, 49)).arrays for k in range(0, 49, 5)]
    assert same(whole, joined(parts))
    assert set(whole["precision"]) == ({1} if not refine else set(whole["precision"]))


SMOOTH = {
    "chain.mass.1": (0.5, 1.0, 2.0),
    "chain.length.0": (0.7, 1.3),
    "effects.gravity.g": (1.6, 9.81),
    "effects.joint_damping.coefficient.0": (0.0, 0.3),
    "effects.joint_spring.stiffness.1": (0.0, 2.0),
    "effects.joint_spring.rest.0": (-0.2, 0.3),
    "effects.joint_torque.torque.0": (0.0, 0.7),
    "effects.joint_torque.amplitude.1": (0.0, 0.4),
    "effects.joint_torque.frequency.1": (1.0, 3.0),
    "effects.motor_inertia.inertia.0": (0.01, 0.2),
    "effects.pd_control.target.1": (0.1, 0.6),
    "effects.end_drag.coefficient": (0.0, 0.4),
}
ALL_SMOOTH = {
    "chain": {"mass": [1.0, 1.0], "length": [1.0, 1.0]},
    "start": {"q": [0.2, 0.5]},
    "run": {"duration": 2.0},
    "effects": {
        "gravity": {},
        "joint_damping": {"coefficient": [0.1, 0.1]},
        "joint_spring": {"stiffness": [1.0, 1.0]},
        "joint_torque": {"torque": [0.1, 0.2], "amplitude": [0.1, 0.1], "frequency": [2.0, 2.0]},
        "motor_inertia": {"inertia": [0.05, 0.05], "ratio": [2.0, 2.0]},
        "pd_control": {"target": [0.5, 0.5], "proportional": [1.0, 1.0]},
        "end_drag": {"coefficient": 0.1},
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("parameter", SMOOTH)
def test_run_time_parameters_give_the_motions_of_their_scenes(parameter):
    asked = ensemble(
        scene=ALL_SMOOTH, axes=[axis(parameter, *SMOOTH[parameter])], keep={"final": True}
    )
    assert goes_in_lanes(asked)
    rows = rows_of(asked, 0, asked.runs.count)
    assert not any(rows.reasons)
    for run, value in enumerate(SMOOTH[parameter]):
        truth = simulate(asked.family.scene([value]), accuracy=1e-11, samples=2)
        error = np.abs(rows.arrays["q"][run] - truth.q[:, -1]).max()
        assert error <= rows.arrays["error"][run] + truth.error
    ends = rows.arrays["q"]
    assert len({tuple(row) for row in ends.tolist()}) == len(ends)


def test_every_effect_can_be_in_an_ensemble():
    """Effects that can be parameters are named above; the others are made one by one."""
    named = {parameter.split(".")[1] for parameter in SMOOTH if parameter.startswith("effects")}
    events = {
        *("end_force", "sampled_torque", "joint_friction", "joint_stop"),
        *("surface", "compliant_surface"),
    }
    assert named | events == {*EFFECT_STRATEGIES}


def test_a_scene_with_modes_is_made_run_by_run():
    asked = ensemble(
        scene="bounce_to_rest",
        axes=[axis("effects.surface.restitution", 0.3, 0.5)],
        keep={"final": True, "samples": 9, "extremes": True},
    )
    assert not goes_in_lanes(asked)
    rows = rows_of(asked, 0, 2)
    for run, value in enumerate((0.3, 0.5)):
        truth = simulate(asked.family.scene([value]), samples=9)
        assert np.array_equal(rows.arrays["q"][run], truth.q[:, -1])
        apart = np.abs(rows.arrays["q_samples"][run] - truth.q.T).max()
        assert apart <= 1e-12 + 2 * truth.error


def test_equations_without_a_form_for_parameters_are_made_run_by_run():
    asked = ensemble(axes=[axis("effects.gravity.direction.0", 0.0, 0.3)], keep={"final": True})
    assert not goes_in_lanes(asked)
    rows = rows_of(asked, 0, 2)
    truth = simulate(asked.family.scene([0.3]), samples=2)
    assert np.abs(rows.arrays["q"][1] - truth.q[:, -1]).max() <= 2 * truth.error


@pytest.mark.slow
def test_a_run_that_is_refused_is_a_row_with_its_reason():
    asked = ensemble(axes=[axis("chain.mass.1", 1.0, -1.0, 2.0)], keep={"final": True})
    rows = rows_of(asked, 0, 3)
    assert rows.reasons == ["", "link 2: mass must be a positive number of kg; got -1.0", ""]
    assert np.isnan(rows.arrays["q"][1]).all()
    assert np.isfinite(rows.arrays["q"][[0, 2]]).all()
    assert rows.arrays["precision"].tolist() == [1, 0, 1]


def test_a_run_that_blows_up_has_a_reason_and_leaves_its_neighbours_alone():
    # A negative derivative gain drives the chain: u grows as exp(kd t).
    scene = {
        **UNCOUPLED,
        "start": {"q": [0.0, 0.1], "u": [0.0, 1.0]},
        "run": {"duration": 20.0},
        "effects": {
            "pd_control": {
                "target": [0.0, 0.0],
                "proportional": [0.0, 0.0],
                "derivative": [0.0, 0.1],
            }
        },
    }
    parameter = "effects.pd_control.derivative.1"
    calm = ensemble(scene=scene, axes=[axis(parameter, 0.1, 0.2, 0.3)], keep=KEEP_END)
    wild = ensemble(scene=scene, axes=[axis(parameter, 0.1, -40.0, 0.2, 0.3)], keep=KEEP_END)
    one, other = rows_of(calm, 0, 3), rows_of(wild, 0, 4)
    assert not any(one.reasons)
    assert "could not be integrated beyond" in other.reasons[1]
    assert [bool(reason) for reason in other.reasons] == [False, True, False, False]
    assert np.array_equal(one.arrays["q"], other.arrays["q"][[0, 2, 3]])


KEEP_END = {"final": True}


@pytest.mark.slow
def test_undecided_and_inaccurate_runs_are_refined_until_they_are_decided():
    runs = {"accuracy": 1e-9, "duration": 14.0}
    plain, refined = (
        rows_of(starts(5, keep=KEEP, runs={**runs, "refine": refine}), 0, 25).arrays
        for refine in (False, True)
    )
    assert (plain["error"] > 1e-9).any()
    assert (refined["error"] <= 1e-9).all()
    assert (refined["flip_verdict"] > 0).all()
    again = refined["precision"] > 1
    assert again.any()
    # A verdict that double precision gives with its bound is that of longer precisions.
    decided = plain["flip_verdict"] > 0
    assert (plain["flip_verdict"] == refined["flip_verdict"])[decided].all()
    both = decided & (plain["flip_verdict"] == 1)
    apart = np.abs(plain["flip_time"] - refined["flip_time"])[both]
    assert (apart <= (plain["flip_bound"] + refined["flip_bound"])[both]).all()


@pytest.mark.slow
def test_numbers_that_vary_beyond_the_probes_are_made_run_by_run(monkeypatch):
    asked = ensemble(axes=[axis("chain.mass.1", 1.0, 2.0)], keep={"final": True})
    truth = rows_of(asked, 0, 2).arrays
    chunks._template.cache_clear()
    monkeypatch.setattr(chunks, "_probe", lambda ensemble, number: None)
    try:
        rows = rows_of(asked, 0, 2)
    finally:
        chunks._template.cache_clear()
    assert np.abs(rows.arrays["q"] - truth["q"]).max() < 1e-8


@pytest.mark.slow
def test_a_run_that_cannot_be_refined_keeps_its_results(monkeypatch):
    runs = {"accuracy": 1e-12, "duration": 2.0}
    plain = rows_of(starts(2, runs=runs), 0, 4)

    def refused(*args):
        raise TooMuchError("it would take years")

    monkeypatch.setattr(chunks, "single", refused)
    rows = rows_of(starts(2, runs={**runs, "refine": True}), 0, 4)
    assert rows.reasons == [""] * 4
    assert same(rows.arrays, plain.arrays)


@pytest.mark.slow
def test_a_touch_stays_undecided_in_any_precision():
    # q2 = 2 t - t²/2 has its top, 2, on the level.
    level = {"name": "x", "of": "q2", "level": 2.0}
    found = torques(-0.5, keep={"first": [level]}, u2=2.0, refine=True)
    rows = rows_of(found, 0, 1)
    assert rows.reasons == [""]
    assert rows.arrays["x_verdict"][0] == 0
    assert np.isnan(rows.arrays["x_time"][0])


ENDS = {"final": True}
WATCHED = {"final": True, "first": [{"name": "x", "of": "q1", "level": 9.0}]}
FOLLOWED = {"final": True, "extremes": True}


@pytest.mark.slow
@pytest.mark.parametrize("keep", [ENDS, WATCHED, FOLLOWED], ids=["ends", "watched", "followed"])
def test_the_rounding_of_the_momenta_at_the_start_is_a_part_of_the_error(keep):
    """M⁻¹ of a light link and a point enlarges it, and all runs of one start share it."""
    scene = {
        "chain": {
            "mass": [2e-5, 1.0],
            "length": [1.0, 1.0],
            "centre": [[0.5, 0.0], [1.0, 0.0]],
            "inertia": [6e-7, 8e-4],
        },
        "start": {"q": [0.0, 1e-3], "u": [1.1442, 1.1442]},
        "run": {"duration": 2e-3},
        "effects": {"gravity": {}},
    }
    angles = 0.0, 3e-7, 7e-7, 1.3e-6
    asked = ensemble(
        scene=scene,
        axes=[axis("start.q.0", *angles)],
        runs={"accuracy": 1e-12},
        keep=keep,
    )
    rows = rows_of(asked, 0, 4).arrays
    for run, angle in enumerate(angles):
        times = np.array([0.0, 2e-3])
        one = asked.family.scene([angle])
        exact = taylor_run(one, times, formulation="kane", precision="quadruple")
        found = np.concatenate([rows["q"][run], rows["u"][run]])
        truth = np.concatenate([exact.q, exact.u])[:, -1].astype(float)
        assert np.abs(found - truth).max() <= rows["error"][run]


def test_a_chunk_of_refused_runs_has_their_reasons():
    """No run is left for the lanes."""
    some = ensemble(axes=[axis("chain.mass.0", -1.0, -2.0)], keep={"final": True})
    rows = rows_of(some, 0, 2)
    assert all("mass must be a positive number" in reason for reason in rows.reasons)


def test_rows_have_the_notes_of_their_runs():
    asked = ensemble(
        scene="elbow_and_tip", axes=[axis("start.q.0", 0.5, 0.51)], keep={"final": True}
    )
    rows = rows_of(asked, 0, 2)
    notes = [simulate(asked.family.scene([value])).notes for value in (0.5, 0.51)]
    assert rows.notes == ["\n".join(own) for own in notes]
    assert "do not determine the order" in rows.notes[0]
    assert np.isnan(rows.arrays["limit"]).all()


def test_a_run_that_would_take_too_long_is_limited():
    asked = ensemble(scene="drop", axes=[axis("chain.mass.1", 1.0, -1.0)], keep={"final": True})
    rows = rows_of(asked, 0, 2, Limits(seconds=1e-9))
    assert "the limit is 1e-09 s" in rows.reasons[0]
    assert "mass must be a positive number" in rows.reasons[1]
    assert np.array_equal(rows.arrays["limit"], [1e-9, np.nan], equal_nan=True)


def test_numbers_that_leave_float64_have_reasons_and_no_warnings():
    """Warnings are errors in tests."""
    scene = {**UNCOUPLED, "effects": {"gravity": {"g": 9.81}}}
    asked = ensemble(scene=scene, axes=[axis("effects.gravity.g", 9.81, 1e308)], keep=KEEP_END)
    rows = rows_of(asked, 0, 2)
    assert [bool(reason) for reason in rows.reasons] == [False, True]
    assert np.isfinite(rows.arrays["q"][0]).all()
