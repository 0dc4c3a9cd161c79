import numpy as np
import pytest

from tests.ensembles.cases import starts
from tests.ensembles.falls import DURATION, FALL, check_bounds, random_starts, with_wild_neighbours
from twolink.chain import Chain
from twolink.effects import JointDamping, JointTorque
from twolink.ensembles.chunk import rows_of
from twolink.ensembles.compiled import System
from twolink.ensembles.ending import PLACES, Ending
from twolink.ensembles.motions import WIDTH, begun
from twolink.ensembles.quantity import Accumulator
from twolink.errors import SimulationError
from twolink.scene import Scene
from twolink.simulation import simulate

SYSTEM = System(FALL.moving_chain, FALL.effects, ())


def at_the_start(q, u, duration=DURATION):
    none = np.zeros((0, q.shape[1]))
    return Ending.at_the_start(SYSTEM, SYSTEM.lanes(none, q, u, duration), none)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("orders", [(7,), (11,), (15,), (7, 11, 15)])
def test_the_bound_holds_and_is_not_far_above_the_error(orders, random):
    q, u = random_starts(random, 21)
    ending = at_the_start(q, u)
    for order in orders:
        ends, lost, _ = ending.ends(order)
    assert not lost.any()
    check_bounds(ends, q, u)


def test_bits_do_not_depend_on_the_neighbours_in_lanes(random):
    q, u = random_starts(random, 3 * WIDTH)
    pairs = (q, u), with_wild_neighbours(q, u)
    one, other = (at_the_start(*pair).ends(11)[0] for pair in pairs)
    order = random.permutation(q.shape[1])
    mixed = at_the_start(q[:, order], u[:, order]).ends(11)[0]
    for k in range(3):
        assert np.array_equal(one[k][..., 1::2], other[k][..., 1::2])
        assert np.array_equal(one[k][..., order], mixed[k])


def test_the_judge_is_the_next_run_that_is_measured(random, monkeypatch):
    made = []

    def noted(runs, order, **more):
        made.append(order)
        return begun(runs, order, **more)

    monkeypatch.setattr("twolink.ensembles.ending.begun", noted)
    q, u = random_starts(random, 21)
    again = at_the_start(q, u)
    first, _, steps = again.ends(11)
    chosen = np.array([2, 3, 17])
    some = again.of(chosen)
    kept, _, taken = some.ends(15)
    assert made == [11, 15, 19]
    fresh, _, all_steps = at_the_start(q, u).ends(15)
    # The run that is kept was the judge before.
    assert taken == 0 < steps < all_steps
    assert (kept.errors < first.errors[chosen]).all()
    assert np.array_equal(kept.q, fresh.q[:, chosen])
    assert np.array_equal(kept.u, fresh.u[:, chosen])
    # The first pair has measured the growth of errors, which enlarges that of round-off.
    assert (kept.errors >= fresh.errors[chosen]).all()


def test_runs_whose_start_or_end_is_not_finite_are_lost_alone(random):
    q, u = random_starts(random, 21)
    u[0, [3, 5]] = 1e200
    q[1, 9] = np.inf
    ends, lost, _ = at_the_start(q, u).ends(11)
    assert np.flatnonzero(lost).tolist() == [3, 5, 9]
    alone = at_the_start(q[:, ~lost], u[:, ~lost]).ends(11)[0]
    assert np.array_equal(ends.u[:, ~lost], alone.u)
    assert np.isnan(ends.q[:, lost]).all()


def test_an_error_that_is_too_large_to_be_known_is_infinite():
    # A chaotic motion over a minute: two runs have nothing in common.
    q = np.full((2, 9), 2.8 - np.pi)
    q[0] += np.linspace(0, 0.1, 9)
    ends, _, _ = at_the_start(q, np.zeros((2, 9)), duration=40.0).ends(7)
    assert np.isinf(ends.errors).all()


def test_compiled_rates_that_are_not_those_of_the_formulas_are_noticed(random):
    heavier = System(FALL.moving_chain.convert(lambda x: 1.01 * float(x)), FALL.effects, ())
    q, u = random_starts(random, 21)
    none = np.zeros((0, q.shape[1]))
    ending = Ending.at_the_start(SYSTEM, heavier.lanes(none, q, u, 1.0), none)
    with pytest.raises(SimulationError, match="must be those of the formulas; got others"):
        ending.ends(11)


def test_ends_are_those_of_runs_that_are_followed():
    runs = {"accuracy": 1e-8, "duration": 5.0}
    ends = rows_of(starts(6, runs=runs, keep={"final": True}), 0, 36).arrays
    steps = rows_of(starts(6, runs=runs, keep={"final": True, "extremes": True}), 0, 36).arrays
    known = np.isfinite(ends["error"]) & np.isfinite(steps["error"])
    assert known.sum() > 30
    apart = np.abs(np.concatenate([ends[k] - steps[k] for k in "qu"], axis=1)).max(axis=1)
    assert (apart <= ends["error"] + steps["error"])[known].all()


def test_errors_are_measured_where_nothing_is_kept():
    bare, kept = (
        rows_of(starts(3, runs={"accuracy": 1e-8, "duration": 5.0}, keep=keep), 0, 9).arrays
        for keep in ({}, {"final": True})
    )
    assert np.array_equal(bare["error"], kept["error"])
    assert np.isfinite(bare["error"]).all()


class _Spy(Accumulator):
    """An accumulator that keeps what it is shown, asks for nothing, and ends runs at a place."""

    def __init__(self, count, last=99):
        self.shown, self._seen, self._last = [], np.zeros(count, int), last

    def add(self, block):
        raise AssertionError

    def values(self, ends):
        return {}

    def open_spans(self, spans):
        self.shown.append(spans)
        self._seen[spans.which] += spans.errors.shape[0]
        return np.zeros(spans.errors.shape, bool)

    def known(self):
        return self._seen >= self._last


def watched(q, u, spy, duration=DURATION, system=SYSTEM):
    none = np.zeros((0, q.shape[1]))
    lanes = system.lanes(none, q, u, duration)
    ending = Ending.at_the_start(system, lanes, none, brief=True)
    return ending, ending.ends(11, [spy])


def test_paths_bound_how_far_angles_turn(random):
    q, u = random_starts(random, 21)
    spy = _Spy(q.shape[1])
    watched(q, u, spy)
    paths = np.concatenate([spans.paths for spans in spy.shown], axis=1)
    assert paths.shape == (2, PLACES, q.shape[1])
    for lane in (0, 7, 20):
        start = {"q": tuple(q[:, lane]), "u": tuple(u[:, lane])}
        scene = Scene(FALL.chain, **start, duration=DURATION, effects=FALL.effects)
        truth = simulate(scene, samples=PLACES * 200 + 1)
        turned = np.abs(np.diff(truth.q)).reshape(2, PLACES, 200).sum(axis=2)
        assert (turned <= paths[:, :, lane]).all()
        # Speeds change by less than half within most of the intervals.
        assert np.median(paths[:, :, lane] / turned) < 1.1


def test_paths_of_slow_motions_after_fast_ones_are_not_lost_in_rounding():
    # Link 1, uncoupled from link 2, comes from 2e5 rad/s to a slow turning at a constant speed. By
    # then the integral of its squared speed is 2e8 rad²/s, and 2e-9 rad²/s are added in a step.
    speed, rate, duration, inertia = 0.02, 100.0, 0.3, 1 / 12 + 1 / 4 + 1
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (1 / 12, 0.5))
    effects = JointDamping((rate * inertia, 0.0)), JointTorque((speed * rate * inertia, 0.0))
    spy = _Spy(1)
    start = np.zeros((2, 1)), np.array([[2e5], [0.0]])
    watched(*start, spy, duration, System(chain, effects, ()))
    last = spy.shown[-1].paths[0, -1, 0]
    assert speed * duration / PLACES <= last < 0.1


def test_runs_end_where_all_is_known(random):
    q, u = random_starts(random, 21)
    _, (whole, _, all_steps) = watched(q, u, _Spy(q.shape[1]))
    spy = _Spy(q.shape[1], 8)
    ending, (ends, lost, steps) = watched(q, u, spy)
    assert not lost.any()
    assert steps < all_steps / 3
    assert (ends.errors <= whole.errors).all()
    assert len(spy.shown) == 1
    # The judge has no end: a run that is kept again and does not end there is lost.
    assert ending.ends(15, [_Spy(q.shape[1])])[1].all()
