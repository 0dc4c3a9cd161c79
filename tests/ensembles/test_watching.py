import numpy as np
import pytest

from tests.ensembles.falls import FALL, random_starts
from twolink.ensembles.compiled import System
from twolink.ensembles.lane_rows import LEFT, Settings
from twolink.ensembles.marching import Begun, marched
from twolink.ensembles.quantity import Accumulator
from twolink.ensembles.step import compiled_step
from twolink.ensembles.watching import Watch
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

SYSTEM = System(FALL.moving_chain, FALL.effects, ())
DURATION = 1.5


class Spy(Accumulator):
    """An accumulator that keeps its intervals and steps, and asks for all or none."""

    def __init__(self, count, asks=False, last=99):
        self.spans, self.blocks = [], []
        self._asks, self._looks, self._last = asks, np.zeros(count, int), last

    def add(self, block):
        self.blocks.append(block)

    def values(self, ends):
        return {}

    def open_spans(self, spans):
        self.spans.append(spans)
        self._looks[spans.which] += 1
        return np.full(spans.errors.shape, self._asks)

    def known(self):
        return self._looks >= self._last


def begun(q, u, tolerance=1e-12):
    p = EQUATIONS["momenta"].from_speeds(FALL.chain, tuple(q), tuple(u))
    count = q.shape[1]
    own = Settings(np.full(count, tolerance), np.full(count, 0.1), *np.zeros((4, count)))
    return Begun(np.array([*q, *p]), np.array(own), DURATION)


def watched(q, u, spy, brief=False):
    runs = begun(q, u)
    watch = Watch(runs, [spy], brief)
    rows = marched(compiled_step(SYSTEM, paths=True), runs, watch)
    watch.show(SYSTEM)
    return rows


def spans_of(spy, lane):
    """Return angles at the ends (2, 2, m), paths (2, m) and errors (m,) of a run's intervals."""
    found = []
    for spans in spy.spans:
        places = np.flatnonzero(spans.which == lane)[:1]
        found += [(spans.angles[..., k], spans.paths[:, 0, k], spans.errors[0, k]) for k in places]
    return [np.moveaxis(np.array(rows), 0, -1) for rows in zip(*found, strict=True)]


def truth(q, u, times):
    scene = Scene(FALL.chain, tuple(q), tuple(u), DURATION, FALL.effects)
    return simulate(scene, accuracy=1e-13, samples=2).at(times)[0]


def test_paths_bound_how_far_angles_turn(random):
    q, u = random_starts(random, 11)
    spy = Spy(11)
    watched(q, u, spy)
    for lane in (0, 7, 10):
        angles, paths, _ = spans_of(spy, lane)
        assert (angles[:, 0, 1:] == angles[:, 1, :-1]).all()
        dense = truth(q[:, lane], u[:, lane], np.linspace(0, DURATION, 20001))
        total = np.abs(np.diff(dense)).sum(axis=1)
        assert (total <= paths.sum(axis=1) + 1e-9).all()
        # Bounds by the sizes of terms are not far above the paths.
        assert (paths.sum(axis=1) < 2 * total + 0.5).all()


def test_paths_are_those_of_one_interval(random):
    q, u = random_starts(random, 8)
    spy = Spy(8)
    watched(q, u, spy)
    angles, paths, _ = spans_of(spy, 3)
    assert (np.abs(angles[:, 1] - angles[:, 0]) <= paths).all()
    assert paths.max() < 0.7 * paths.sum()


@pytest.mark.parametrize("count", [1, 8, 13])
def test_steps_join_and_have_the_angles_within_their_errors(count, random):
    q, u = random_starts(random, count)
    spy = Spy(count, asks=True)
    watched(q, u, spy)
    (block,) = spy.blocks
    for lane in {0, count // 2, count - 1}:
        # Lanes without a run of their own repeat another.
        own = np.flatnonzero(block.which == lane)
        own = own[np.unique(block.starts[0, own], return_index=True)[1]]
        starts, lengths, errors = (
            rows[:, own].T.ravel() for rows in (block.starts, block.lengths, block.errors)
        )
        moves = lengths > 0
        starts, lengths, errors = starts[moves], lengths[moves], errors[moves]
        assert starts[0] == 0
        assert np.abs(starts[:-1] + lengths[:-1] - starts[1:]).max() < 1e-15
        assert starts[-1] + lengths[-1] == DURATION
        angles = block.angles[..., own].transpose(3, 0, 1, 2).reshape(-1, 2, 21)[moves]
        for share in (0.0, 0.6, 1.0):
            values = np.array(
                [
                    [np.polyval(row[::-1], share * h) for row in y]
                    for y, h in zip(angles, lengths, strict=True)
                ]
            )
            apart = np.abs(values.T - truth(q[:, lane], u[:, lane], starts + share * lengths))
            assert (apart.max(axis=0) <= errors + 2e-15).all()
        assert errors.max() < 1e-9


def test_runs_that_need_no_more_end_at_once(random):
    q, u = random_starts(random, 20)
    whole = watched(q, u, Spy(20))
    spy = Spy(20, last=1)
    rows = watched(q, u, spy, brief=True)
    assert (whole[LEFT] == 0).all()
    assert (rows[LEFT] > 0).all()
    assert len(spy.spans) == 1


def test_an_interval_that_is_asked_for_is_shown_after_its_run_has_ended(random):
    q, u = random_starts(random, 8)
    spy = Spy(8, asks=True, last=1)
    watched(q, u, spy, brief=True)
    (block,) = spy.blocks
    assert sorted(block.which.tolist()) == list(range(8))
    assert (block.lengths > 0).all()


def test_unknown_errors_are_infinite():
    q, u = np.full((2, 1), np.nan), np.zeros((2, 1))
    spy = Spy(1)
    assert np.isnan(watched(q, u, spy)).all()
    assert np.isinf(spy.spans[0].errors).all()
