"""The measured error against closed forms, and the choice between runs."""

from dataclasses import replace
from threading import Barrier, Event, get_ident
from time import monotonic, sleep

import numpy as np
import pytest

from tests.simulation.hybrid import BALANCED, tampered
from tests.simulation.hybrid import BOUNCE_TIMES as TIMES
from tests.simulation.hybrid import BOUNCES as SCENE
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import TooMuchError
from twolink.limits import DEFAULT_LIMITS, UNLIMITED
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.hybrid import effort, judged, measure
from twolink.simulation.hybrid.configurations import Configuration
from twolink.simulation.hybrid.measure import measured_run
from twolink.simulation.hybrid.run import hybrid_run


def exact(times):
    """Return q1 and u1 of the bounces up to 2.5 s."""
    q = np.where(times < 1, 1 - times**2, 0.0)
    u = np.where(times < 1, -2 * times, 0.0)
    for start, speed, flight in [(1.0, 1.0, 1.0), (2.0, 0.5, 0.5)]:
        t = times - start
        inside = (t >= 0) & (t < flight)
        q = np.where(inside, speed * t - t * t, q)
        u = np.where(inside, speed - 2 * t, u)
    return q, u


@pytest.mark.parametrize("accuracy", [1e-6, 1e-10])
def test_a_measured_run_meets_its_accuracy_and_states_no_less_than_its_error(accuracy):
    heard = []
    measured = measured_run(SCENE, TIMES, accuracy, "lagrange", heard.append)
    assert measured.errors.max() <= accuracy
    assert len(measured.runs) == 2
    assert len(heard) == 2
    assert measured.kept is measured.runs[0]
    assert {run.formulation for run in measured.runs} == {"kane", "lagrange"}
    assert len({run.precision for run in measured.runs}) == 2
    # At 1 s and 2 s an instant that is off by rounding decides the side of the jump.
    inside = np.array([abs(TIMES - t) > 1e-6 for t in (1.0, 2.0, 2.5)]).all(axis=0)
    q, u = exact(TIMES)
    miss = np.maximum(abs(measured.kept.q[0] - q), abs(measured.kept.u[0] - u))[inside]
    assert np.all(miss <= measured.errors[inside] + 16 * 2.0**-52)


@pytest.mark.parametrize("early", [1e-9, 1e-11, 1e-12, 2e-13])
def test_a_knot_just_before_a_joint_breaks_loose_is_no_smaller_error_than_it_makes(early):
    """A holds 2 N m, and slides with 1 N m. Its torque is t; the links turn together, 3.5 kg m².

    At a knot the limit counts as reached within round-off, in both runs if that is long doubles'.
    """
    none, limits = (0.0, 0.0), ((1.0, 1.0), (2.0, 1.0))
    ramp = SampledTorque((0.0, 4.0), (0.0, 4.0), none, "linear")
    knot = SampledTorque((0.0, 2.0 - early), none, none, "hold")
    scene = Scene(BALANCED, none, none, 3.0, (ramp, knot, JointFriction(*limits)))
    times = np.linspace(0.0, 3.0, 7)
    measured = measured_run(scene, times, 1e-6, "lagrange", lambda name: None)
    t = times[5:]
    u, q = ((t - 1) ** 2 - 1) / 7, ((t - 1) ** 3 - 1) / 21 - (t - 2) / 7
    miss = np.maximum(abs(measured.kept.u[0, 5:] - u), abs(measured.kept.q[0, 5:] - q))
    assert np.all(miss <= measured.errors[5:] + 2.0**-52)
    assert measured.errors.max() < early


def test_kane_is_judged_by_lagrange():
    measured = measured_run(SCENE, TIMES, 1e-6, "kane", lambda name: None)
    assert [run.formulation for run in measured.runs] == ["kane", "lagrange"]


def test_the_margin_is_larger_if_the_judge_has_the_same_precision(monkeypatch):
    """Two runs in quadruple precision may be as wrong as each other."""

    def differences(kept, judge, times, accuracy):
        return np.full(len(times), 0.1 if kept.precision == judge.precision else 1.0)

    monkeypatch.setattr(judged, "differences", differences)
    scene = Scene(BALANCED, (0.3, 0.2), (0.0, 0.0), 0.1, (JointFriction((0.1, 0.1)),))
    times = np.array([0.0, 0.1])
    measured = measured_run(scene, times, 1e-9, "lagrange", lambda name: None)
    assert measured.kept.precision == "quadruple"
    assert measured.errors == pytest.approx(3 * 0.1)


def test_the_error_includes_the_moments_after_a_force_jumped():
    """A damper in a surface pushes at once: two instants of the touch are two speeds after it."""
    floor = CompliantSurface(
        (0.0, 0.8), (0.0, -1.0), law="kelvin-voigt", stiffness=85_000.0, loss=230.0
    )
    scene = Scene(Chain.uniform_bars(), (0.0, 0.3), (3.0, -2.0), 0.6, (Gravity(), floor))
    times = np.linspace(0, 0.6, 61)
    found = measured_run(scene, times, 1e-9, "lagrange", lambda name: None)
    exact = hybrid_run(scene, times, formulation="kane", precision="quadruple")
    touches = [float(arc.start.t) for arc in found.kept.arcs[1:]]
    assert len(touches) >= 2
    after = np.array([t + dt for t in touches for dt in np.geomspace(1e-14, 1e-6, 25)])
    after = after[after < 0.6]
    ours, theirs = (np.concatenate(r.polynomials.at(after)) for r in (found.kept, exact))
    error = np.abs(ours - theirs.astype(float)).max()
    assert error <= found.errors[-1]


def limited_in(precision, **limits):
    """Return the limits of work with others in one precision."""

    def limited(own, *given):
        found = effort.effort_of(own, *given)
        return found._replace(**limits) if own == precision else found

    return limited


def test_a_run_that_ends_early_is_measured_slightly_beyond_its_end(monkeypatch):
    monkeypatch.setattr(measure, "effort_of", limited_in("double", jumps=1))
    measured = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    judge = next(run for run in measured.runs if run.formulation == "kane")
    assert measured.kept.failure
    assert measured.kept.reached < 2.5
    assert judge.reached == pytest.approx(measured.kept.reached + 0.025, abs=1e-12)
    assert not judge.failure


@pytest.mark.parametrize("limit", ["jumps", "work", "steps"])
def test_a_result_ends_where_it_can_no_longer_be_measured(monkeypatch, limit):
    """In long double it would reach the end, but the run that measures it has its limit of work."""
    monkeypatch.setattr(measure, "effort_of", limited_in("quadruple", **{limit: 1}))
    monkeypatch.setattr(measure, "configurations", lambda accuracy: [LONG_DOUBLE])
    measured = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    judge = next(run for run in measured.runs if run.formulation == "kane")
    assert judge.exhausted
    assert measured.kept.reached == judge.reached < 2.5
    assert measured.kept.failure == judge.failure
    assert measured.kept.exhausted
    assert np.isfinite(measured.errors).all()


def test_a_longer_run_replaces_a_shorter_one():
    """The first result ends early by itself, the second one does not: both have one judge."""
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    whole = runs.kept(LONG_DOUBLE)
    early = replace(whole, failure="it ends", reached=1.0)
    assert runs.judge(LONG_DOUBLE, early) is runs.judge(LONG_DOUBLE, whole)
    other = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    assert other.judge(LONG_DOUBLE, early).reached == pytest.approx(1.025)
    assert other.judge(LONG_DOUBLE, whole).reached == 2.5


LONG_DOUBLE = Configuration("long double", 23, "quadruple", 31)


def test_a_longer_precision_that_takes_too_long_leaves_the_best_run(monkeypatch):
    """An error is known from the runs before; without any the limit refuses the motion."""
    limited: list[str] = []

    def run_of(scene, times, *, precision, **given):
        if precision in limited:
            raise TooMuchError("the motion would take a year; the limit is an hour")
        return hybrid_run(scene, times, precision=precision, **given)

    double = Configuration("double", 21, "long double", 23)
    monkeypatch.setattr(measure, "configurations", lambda accuracy: [double, LONG_DOUBLE])
    monkeypatch.setattr(measure, "hybrid_run", run_of)
    limited.append("quadruple")
    found = measured_run(SCENE, TIMES, 1e-17, "lagrange", lambda name: None)
    assert found.kept.precision == "double"
    assert 1e-17 < found.errors.max() < 1e-12
    limited.append("long double")
    with pytest.raises(TooMuchError, match="an hour"):
        measured_run(SCENE, TIMES, 1e-17, "lagrange", lambda name: None)


def test_a_judge_that_takes_too_much_leaves_the_motion_to_a_longer_precision(monkeypatch):
    """Where its error is of order one, it may have gone to speeds that the motion never has."""

    def run_of(scene, times, *, precision, order, **given):
        if precision == "long double" and given["formulation"] == "kane":
            raise TooMuchError("the motion would take 14 GB; the limit is 1 GB")
        return hybrid_run(scene, times, precision=precision, order=order, **given)

    monkeypatch.setattr(measure, "hybrid_run", run_of)
    found = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    assert found.kept.precision == "long double"
    assert found.errors.max() <= 1e-9


def test_a_run_to_the_end_is_better_than_an_accurate_one_that_ends_early(monkeypatch):
    """A quadruple judge ends at its limit of work, and the run that it judges with it."""

    def made(*given, precision, **options):
        found = hybrid_run(*given, precision="double", **{**options, "order": 21})
        if precision == "quadruple":
            found = replace(found, reached=1.5, failure="too many modes", exhausted=True)
        off = {"double": 1e-5, "long double": 0.0, "quadruple": 0.0}
        return replace(tampered(found, 1.0, 0, off[precision]), precision=precision)

    monkeypatch.setattr(measure, "hybrid_run", made)
    found = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    assert found.kept.precision == "double"
    assert found.kept.reached == TIMES[-1]
    assert found.errors[-1] >= 1e-5


def test_an_error_that_a_more_precise_judge_contradicts_is_not_kept(monkeypatch):
    """Two runs may agree by chance, as in chaotic bounces, and both be wrong."""

    def made(*given, precision, order, **options):
        off = {"double": 1e-5, "long double": 1e-5 + 1e-7, "quadruple": (order in (31, 41)) * 3e-5}
        found = hybrid_run(*given, precision="double", order=21, **options)
        return replace(tampered(found, 1.5, 0, off[precision]), precision=precision)

    monkeypatch.setattr(measure, "hybrid_run", made)
    found = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    assert found.errors[TIMES < 1].max() < 1e-9
    assert found.errors[-1] >= 1e-5


def measured_with_errors(monkeypatch, by_precision, **changes):
    """Return the measured run, and the precisions of all runs, where pairs differ by these."""
    made_in = []

    def differences(kept, judge, times, accuracy):
        return np.where(times > 1, by_precision[kept.precision], 0.0)

    def made(*given, precision, order, **options):
        made_in.append(precision)
        found = hybrid_run(*given, precision="double", order=21, **options)
        return replace(found, precision=precision, order=order, **changes)

    monkeypatch.setattr(judged, "differences", differences)
    monkeypatch.setattr(measure, "hybrid_run", made)
    return measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None), made_in


@pytest.mark.parametrize("steps", [3, 1_000_000])
def test_a_run_in_long_doubles_is_the_result_if_a_twentieth_of_the_error_is_accurate(
    monkeypatch, steps
):
    """It is judged by the run that has judged the one in double precision.

    Also where runs in 113 bits would take too long.
    """
    errors = {"double": 1.5e-8, "long double": 1e-13}
    found, made_in = measured_with_errors(monkeypatch, errors, steps=steps)
    assert found.kept.precision == found.judge.precision == "long double"
    assert found.kept.formulation == "lagrange"
    assert found.judge.formulation == "kane"
    late = TIMES > 1
    assert found.errors[late] == pytest.approx(0.05 * 1.1 * 1.5e-8 + 3 * 1e-13, rel=1e-12)
    assert found.errors[~late].max() == 0
    assert made_in.count("long double") == 2
    assert "quadruple" not in made_in


def test_a_run_in_long_doubles_that_differs_from_its_judge_is_not_the_result(monkeypatch):
    """As where the start was moved onto a contact: both runs in long doubles start elsewhere."""
    errors = {"double": 3e-8, "long double": 2e-9, "quadruple": 1e-15}
    found, _ = measured_with_errors(monkeypatch, errors)
    assert found.kept.precision == "quadruple"
    assert found.errors.max() <= 1e-9


@pytest.mark.parametrize("speed", [7.0, 9.0])
def test_the_error_of_a_run_in_long_doubles_is_above_the_true_one(speed):
    """A fast chain bounces on a stop; the truth is a run of 113 bits."""
    stop = JointStop("A", upper=0.5, restitution=0.6)
    scene = Scene(Chain.uniform_bars(), (0.3, 1.4), (speed, 0.0), 2.5, (Gravity(), stop))
    found = measured_run(scene, TIMES, 1e-13, "lagrange", lambda name: None)
    assert found.kept.precision == found.judge.precision == "long double"
    assert found.errors.max() <= 1e-13
    exact = hybrid_run(scene, TIMES, formulation="kane", precision="quadruple", order=31)
    (q, u), (Q, U) = (run.polynomials.rounded_at(TIMES) for run in (found.kept, exact))
    true = np.abs(np.concatenate([q - Q, u - U])).max(axis=0).astype(float)
    assert np.all(true <= found.errors)


QUADRUPLE = Configuration("quadruple", 35, "quadruple", 31)


def test_a_quadruple_run_ends_where_its_judge_has_reached_its_limit(monkeypatch):
    """Both are made to the end, side by side, and the longer one is cut."""

    def made(*given, formulation, effort, **options):
        jumps = 1 if formulation == "kane" else effort.jumps
        effort = effort._replace(jumps=jumps)
        return hybrid_run(*given, formulation=formulation, effort=effort, **options)

    monkeypatch.setattr(measure, "hybrid_run", made)
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    trial = runs.trial(QUADRUPLE, 1e-9)
    assert trial.judge.exhausted
    assert trial.kept.reached == trial.judge.reached < TIMES[-1]
    assert trial.kept.exhausted
    assert trial.kept.failure == trial.judge.failure
    assert trial.errors.max() < 1e-12
    assert runs.known["quadruple", 35, "lagrange"].reached == TIMES[-1]


def test_two_quadruple_runs_are_made_in_two_threads(monkeypatch):
    threads = set()
    both_began = Barrier(2, timeout=30.0)

    def made(*given, **options):
        threads.add(get_ident())
        # A run that waits for the end of the other one breaks the barrier.
        both_began.wait()
        return hybrid_run(*given, **options)

    monkeypatch.setattr(measure, "hybrid_run", made)
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    runs.trial(QUADRUPLE, 1e-9)
    assert len(threads - {get_ident()}) == 2


def test_a_run_is_abandoned_where_the_laws_end_its_judge(monkeypatch):
    """The judge fails at once, and the run would take a minute; there is a longer pair."""
    abandoned = Event()

    def made(*given, formulation, progress, **options):
        found = hybrid_run(*given, formulation=formulation, **options)
        if formulation == "kane":
            return replace(found, failure="the modes follow each other")
        end = monotonic() + 60
        try:
            while monotonic() < end:
                progress(0.5)
                sleep(0.01)
        finally:
            abandoned.set()
        return found

    monkeypatch.setattr(measure, "hybrid_run", made)
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    with pytest.raises(measure._JudgeFailsError):
        runs.trial(QUADRUPLE, 1e-9, is_last=False)
    assert abandoned.wait(5.0)
    assert [key[2] for key in runs.known] == ["kane"]


def test_an_interrupted_pair_ends_both_runs(monkeypatch):
    """The progress of one raises; the other one is told to end, and the error is passed on."""
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: interrupting, DEFAULT_LIMITS)
    with pytest.raises(ZeroDivisionError):
        runs.trial(QUADRUPLE, 1e-9)
    assert not runs.known


def interrupting(share):
    raise ZeroDivisionError


def configurations_tried(monkeypatch, error_of, failing=(), limits=DEFAULT_LIMITS):
    """Return the orders of the pairs that are tried where runs have these errors by precision."""
    tried = []

    def differences(kept, judge, times, accuracy):
        tried.append((kept.precision, kept.order, judge.order))
        return np.where(times > 0, error_of(kept), 0.0)

    def made(*given, precision, order, formulation, **options):
        # The order of a motion without events that end its steps is that of its configuration.
        found = hybrid_run(*given, precision="double", order=21, formulation=formulation, **options)
        fails = "the modes follow each other" if (precision, order) in failing else ""
        return replace(found, precision=precision, order=order, failure=fails)

    monkeypatch.setattr(judged, "differences", differences)
    monkeypatch.setattr(measure, "hybrid_run", made)
    measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None, limits)
    return list(dict.fromkeys(tried))


def test_pairs_that_are_not_expected_to_suffice_are_not_made(monkeypatch):
    """An error of 1e-6 by accumulated bounces falls by 45 in long doubles, which is too little."""
    tried = configurations_tried(
        monkeypatch, lambda run: 1e-15 if run.precision == "quadruple" else 1e-6
    )
    assert tried[0] == ("double", 15, 21)
    assert ("long double", 23, 25) not in tried
    assert ("quadruple", 31, 25) in tried


def test_a_judge_that_is_known_to_fail_judges_no_other_run(monkeypatch):
    falling = {"double": 3e-8, "long double": 2e-9, "quadruple": 2e-9}
    tried = configurations_tried(
        monkeypatch,
        lambda run: 1e-15 if run.order == 35 else falling[run.precision],
        failing={("quadruple", 25)},
    )
    assert ("long double", 23, 25) in tried
    assert ("quadruple", 31, 25) not in tried
    assert tried[-1] == ("quadruple", 35, 31)


@pytest.mark.parametrize(("apart", "last"), [(0.0, 37), (1e-17, 25)])
def test_no_pair_follows_one_whose_errors_are_those_of_the_start(monkeypatch, apart, last):
    """D starts on the floor within a rounding, and the first pair in 113 bits shows 1e-6 rad."""
    falling = {"double": 1e-4, "long double": 1e-5, "quadruple": 1e-6}
    monkeypatch.setattr(judged.JudgedRun, "apart", property(lambda self: apart))
    tried = configurations_tried(monkeypatch, lambda run: falling[run.precision])
    assert ("quadruple", 31, 25) in tried
    assert tried[-1][2] == last


@pytest.mark.parametrize(("apart", "last"), [(0.0, 37), (1e-16, 25)])
def test_no_pair_follows_one_whose_errors_stay_in_longer_numbers(monkeypatch, apart, last):
    monkeypatch.setattr(judged.JudgedRun, "apart", property(lambda self: apart))
    tried = configurations_tried(monkeypatch, lambda run: 2e-9)
    assert ("long double", 23, 25) in tried
    assert max(judging for _, _, judging in tried) == last


@pytest.mark.parametrize(("limits", "last"), [(DEFAULT_LIMITS, 25), (UNLIMITED, 37)])
def test_the_work_of_all_runs_in_quadruple_precision_is_limited(monkeypatch, limits, last):
    """There may be two of them in all, and not a third."""
    run = hybrid_run(SCENE, TIMES, order=21)
    work = 2.5 * (run.steps + 4 * len(run.arcs))
    monkeypatch.setattr(measure, "most_work", lambda duration: work)
    tried = configurations_tried(monkeypatch, lambda run: 2e-9, limits=limits)
    assert ("quadruple", 31, 25) in tried
    assert tried[-1][2] == last


def test_the_work_of_a_motion_that_goes_on_is_not_known(monkeypatch):
    """Runs that have been made count in any case."""
    monkeypatch.setattr(measure, "most_work", lambda duration: 1)
    run = hybrid_run(SCENE, TIMES, order=21)
    runs = measure._Runs(SCENE, TIMES, "lagrange", lambda name: None, DEFAULT_LIMITS)
    search = measure._Search(runs, 1e-9)
    whole = judged.JudgedRun(run, run, np.zeros(len(TIMES)), 1e-9, 2.5)
    goes_on = replace(whole, kept=replace(run, reached=1.0))
    assert search._is_too_long(whole)
    assert not search._is_too_long(goes_on)
    runs.known["quadruple", 31, "kane"] = replace(run, precision="quadruple")
    assert search._is_too_long(goes_on)


@pytest.mark.parametrize("limits", [DEFAULT_LIMITS, UNLIMITED])
def test_a_search_that_is_limited_says_so(monkeypatch, limits):
    monkeypatch.setattr(measure, "most_work", lambda duration: 10)
    found = measured_run(SCENE, TIMES, 1e-16, "lagrange", lambda name: None, limits)
    assert found.limited == (limits is DEFAULT_LIMITS)
    # The first pair has a judge in quadruple precision.
    longest = [run for run in found.runs if run.precision == "quadruple"]
    assert (len(longest) == 1) == found.limited


def test_a_low_order_that_was_in_vain_leaves_less_work_to_the_next_runs(monkeypatch):
    """All of them have one limit."""
    given = []

    def spied(*arguments):
        given.append(arguments)
        return effort.effort_of(*arguments)

    monkeypatch.setattr(measure, "effort_of", spied)
    monkeypatch.setattr(measure, "_MANY_STEPS_OF_A_LOW_ORDER", 1)
    found = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    low, *others = found.runs
    assert low.order < 21 <= min(run.order for run in others)
    assert low.work > 0
    spent = [arguments[-1] for arguments in given if len(arguments) == 4]
    assert spent == [0] + len(others) * [low.work]


def test_a_low_order_that_has_reached_the_limit_of_work_is_the_result(monkeypatch):
    """A higher order would not reach farther, and would have nothing left."""
    monkeypatch.setattr(measure, "effort_of", limited_in("double", work=309.0))
    found = measured_run(SCENE, TIMES, 1e-9, "lagrange", lambda name: None)
    assert found.kept.order < 21
    assert found.kept.exhausted
    assert 0.3 < found.kept.reached < 2.5
    assert np.isfinite(found.errors).all()
    assert {run.order for run in found.runs if run.precision == "double"} == {found.kept.order}


@pytest.mark.slow
def test_a_run_that_takes_a_small_speed_for_zero_is_judged_by_one_that_does_not():
    """D slides at 1e-18 m/s in a folded pose, which is a speed in long doubles only."""
    heavy = Chain((1.0, 2304.94), (1.0, 1.64019), ((0.5, 0.0), (0.820095, 0.0)), (1 / 12, 516.7))
    floor = Surface(
        (-0.64019, 2.0086534334934972e-16), (0.0, -1.0), ("D",), 0.0, "poisson", 0.2, 0.3
    )
    torque = JointTorque((0.0, 0.0), (77806.2, 102240.0), (12.3969, 2.0), (0.0, 0.0))
    scene = Scene(
        heavy, (0.0, np.pi), (-0.00853822981648667, -0.005205634601166127), 0.1,
        (Gravity(direction=(0.0, 1.0)), floor, torque),
    )  # fmt: skip
    times = np.linspace(0.0, 0.1, 101)
    found = measured_run(scene, times, 1e-9, "lagrange", lambda name: None)
    exact = hybrid_run(scene, times, formulation="kane", precision="quadruple", order=31)
    true = [abs(a - b).max() for a, b in ((found.kept.q, exact.q), (found.kept.u, exact.u))]
    assert max(true) <= found.errors[-1]


def test_the_round_off_of_values_between_the_compared_places_is_in_the_error():
    """The error decays within each step, to round-off: 5.2e-14 was reported for 5.4e-14."""
    chain = Chain.uniform_bars(
        (7.063146775213445, 0.26568497683053294), (1.604583265297154, 2.0531343447331984)
    )
    damping = JointDamping((59.46786225918528, 7482.341371212577))
    motor = SampledTorque((0.0005912797951034344,), (42.77835891024945,), (0.0,), "hold")
    scene = Scene(
        chain,
        (-2.7027432487035616, 2.491610236884746),
        (5.13424865744251, 2.0527756006869793),
        0.0015902037506578665,
        (damping, motor),
    )
    found = simulate(scene, accuracy=1e-7, samples=2)
    exact = simulate(scene, accuracy=3e-16, samples=2, formulation="kane")
    times = np.linspace(0.0, scene.duration, 20_001)
    assert found.precision == "double"
    assert np.abs(np.subtract(found.at(times), exact.at(times))).max() <= found.error
