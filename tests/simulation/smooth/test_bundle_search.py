"""The bundle that measures a motion: which lane is the result, and when there is none."""

import numpy as np
import pytest

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.errors import IntegrationError
from twolink.scene import Scene
from twolink.simulation.smooth import bundle_search
from twolink.simulation.smooth import runs as runs_module
from twolink.simulation.smooth.bundle_plan import BundlePlan
from twolink.simulation.smooth.bundle_search import BundleSearch
from twolink.simulation.smooth.bundled import bundled
from twolink.simulation.smooth.longest_step import pace_of
from twolink.simulation.smooth.measure import measured_run
from twolink.simulation.smooth.pairs import Pairs
from twolink.simulation.smooth.prediction import Prediction
from twolink.simulation.smooth.runs import Runs
from twolink.simulation.smooth.taylor import taylor_run

TIMES = np.linspace(0, 10, 41)
GRAVITY = (Gravity(),)
GENERAL = Chain((1.3, 0.8), (1.1, 0.7), ((0.6, 0.1), (0.3, -0.08)), (0.12, 0.03))
WHIP = Scene(Chain.point_masses((1e-3, 1.0), (1.0, 1.0)), (0.3, 2.5), (0.0, 0.0), 4.0, GRAVITY)
CHAOTIC = Scene(Chain.uniform_bars(), (3.0, 1.5), (2.0, -3.0), 10.0, GRAVITY)
CALM = Scene(GENERAL, (1.2, 1.4), (0.0, 0.0), 10.0, GRAVITY)
SCENES = {
    "reference": Scene(Chain.uniform_bars(), (0.3, -0.4), (0.1, 0.2), 10.0, GRAVITY),
    "damped": Scene(
        GENERAL, (1.0, -2.0), (0.5, 0.0), 10.0, (*GRAVITY, JointDamping((0.3, 0.2)))
    ),
    "one mass is 400 times the other": Scene(
        Chain.uniform_bars((20.0, 0.05), (1.0, 0.3)), (1.0, -2.0), (0.5, 0.0), 10.0, GRAVITY
    ),
}  # fmt: skip


def quiet(name):
    return lambda share: None


def search_of(scene, accuracy, times=TIMES):
    runs = Runs(scene, times, "momenta", quiet, pace_of(scene).longest_step)
    return BundleSearch(runs, Pairs(runs), accuracy, Prediction())


def true_error(found, exact):
    """Return the largest error of a lane; the exact run is in quadruple precision."""
    return max(
        float(np.abs(exact.q - found.q.astype(exact.q.dtype)).max()),
        float(np.abs(exact.u - found.u.astype(exact.u.dtype)).max()),
    )


@pytest.mark.parametrize("accuracy", [1e-3, 1e-4])
@pytest.mark.parametrize("name", SCENES)
def test_a_bound_on_round_off_replaces_its_measure_where_it_is_negligible(
    name, accuracy, monkeypatch
):
    """The error is larger by a sixteenth at most, and the motion the same."""
    quick = search_of(SCENES[name], accuracy).found()
    assert quick.worst <= accuracy
    monkeypatch.setattr(bundle_search, "_NEGLIGIBLE", -1.0)
    in_detail = search_of(SCENES[name], accuracy).found()
    assert np.array_equal(quick.kept.q, in_detail.kept.q)
    assert in_detail.worst < quick.worst <= 1.07 * in_detail.worst


def test_round_off_leaves_no_lane_with_a_fine_accuracy():
    search = search_of(SCENES["reference"], 1e-12)
    assert search.found() is None
    assert len(search.runs.made) == 1


def test_the_finest_lanes_show_a_growth_that_ends_at_the_size_of_the_motion_for_others():
    """Known growth saves four runs in quadruple precision, which would measure it."""
    search = search_of(CHAOTIC, 1e-14)
    assert search.found() is None
    assert not search.pairs.knows_growth
    search.learn_growth()
    assert 1e6 < search.pairs.growth.from_start[-1] < 1e8
    assert [run.order for run in search.runs.made] == [11, 19]
    search.learn_growth()
    assert len(search.runs.made) == 2


def test_lanes_save_the_runs_that_would_measure_growth_in_quadruple_precision():
    found = measured_run(
        CHAOTIC, TIMES, 1e-16, "momenta", quiet, correct=True, pace=pace_of(CHAOTIC)
    )
    runs = [run for run in found.runs if run.precision == "quadruple"]
    assert len(runs) >= 2
    assert not any(run.moved for run in runs)


def test_a_bundle_of_a_large_error_shows_the_growth():
    search = search_of(SCENES["reference"], 1e-6)
    assert search.lane_of(search.runs.bundle(BundlePlan(13, 30.0))) is None
    assert np.isfinite(search.pairs.growth.from_start).all()
    assert search.prediction.growth > 1e3


def test_a_bundle_that_is_not_resolved_is_made_again():
    made = []

    def kept(*given, **options):
        made.append(bundled(*given, **options))
        return made[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runs_module, "bundled", kept)
        found = search_of(WHIP, 1e-3, np.array([0.0, 4.0])).found()
    assert not made[0].lanes.is_resolved
    assert made[-1].lanes.is_resolved
    assert len(found.runs) == len(made) > 1


def test_the_first_lane_is_the_result_if_only_it_has_the_accuracy(monkeypatch):
    monkeypatch.setattr(bundle_search, "bundle_plan", lambda *given: BundlePlan(15, 30.0))
    exact = taylor_run(CALM, TIMES, formulation="kane", precision="quadruple")
    coarse = search_of(CALM, 1e-3).found()
    fine = search_of(CALM, coarse.worst / 5).found()
    assert [coarse.kept.lane.number, fine.kept.lane.number] == [1, 0]
    for found in (coarse, fine):
        assert found.kept.order == 15
        assert true_error(found.kept, exact) <= found.worst
    assert true_error(coarse.kept, exact) > 0.1 * coarse.worst


def test_a_plan_that_is_no_finer_ends_the_search(monkeypatch):
    monkeypatch.setattr(bundle_search, "bundle_plan", lambda *given: BundlePlan(9, 30.0))
    search = search_of(CALM, 1e-9)
    assert search.found() is None
    assert len(search.runs.made) == 1


def test_there_is_no_lane_where_a_bundle_fails(monkeypatch):
    def fails(*given, **options):
        raise IntegrationError("lanes")

    monkeypatch.setattr(runs_module, "bundled", fails)
    search = search_of(SCENES["reference"], 1e-6)
    assert search.found() is None
    assert not search.runs.made
