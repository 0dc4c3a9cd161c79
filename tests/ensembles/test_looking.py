import numpy as np
import pytest

from twolink.ensembles.compiled import FORMULATION, System
from twolink.ensembles.looking import CloserLook, Intervals
from twolink.ensembles.motions import WIDTH
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.smooth.equations import EQUATIONS

FALL = Scene.load("free_fall")
SYSTEM = System(FALL.moving_chain, FALL.effects, ())
ORDER = 11


def looked(q, u, starts, ends, cap=1.0):
    """Return a closer look that has come to the end, and its blocks."""
    count = q.shape[1]
    none = np.zeros((0, count))
    lanes = SYSTEM.lanes(none, q, u, 10.0)
    given = np.array([*q, *EQUATIONS[FORMULATION].from_speeds(lanes.chain, tuple(q), tuple(u))])
    judged = np.concatenate([given, np.zeros((2, count))])
    nothing = np.zeros((4, count))
    intervals = Intervals(np.arange(count), starts, ends, given, judged, *nothing)
    pools = (SYSTEM.integrator(ORDER, WIDTH), SYSTEM.integrator(ORDER + 4, WIDTH, paths=True))
    look = CloserLook(ORDER, *pools, lanes, none, np.full(count, cap), intervals)
    return look, list(look.blocks())


def intervals_of(random, count=11):
    q, u = random.uniform(-3, 3, (2, count)), random.normal(size=(2, count))
    starts = random.uniform(0, 1, count)
    return q, u, starts, starts + random.uniform(0.1, 1.0, count)


def test_the_bounds_hold_at_the_ends_of_steps(random):
    q, u, starts, ends = intervals_of(random)
    look, (block,) = looked(q, u, starts, ends)
    assert not look.lost.any()
    for lane in range(0, len(starts), 3):
        step = np.flatnonzero(block.lengths[:, lane])[-1]
        duration = float(block.starts[step, lane] - starts[lane])
        start = {"q": tuple(q[:, lane]), "u": tuple(u[:, lane])}
        scene = Scene(FALL.chain, **start, duration=duration, effects=FALL.effects)
        truth = simulate(scene, accuracy=1e-13, samples=2)
        error = np.abs(block.angles[step, :, 0, lane] - truth.q[:, -1]).max()
        bound = block.errors[step - 1, lane]
        assert error <= bound + truth.error
        assert look.intervals.differences[lane] > 0
        assert bound <= 1e4 * error + 1e-10


@pytest.mark.parametrize("cap", [1.0, 1e-3])
def test_steps_join_from_the_start_to_the_end(cap, random):
    q, u, starts, ends = intervals_of(random)
    _, blocks = looked(q, u, starts, ends, cap)
    assert (len(blocks) > 1) == (cap < 1)
    first, lengths = (
        np.concatenate([getattr(b, k) for b in blocks]) for k in ("starts", "lengths")
    )
    assert np.array_equal(first[0], starts)
    beyond = first + lengths
    assert np.abs(beyond[:-1] - first[1:])[lengths[1:] > 0].max() < 1e-12
    assert np.abs(beyond.max(axis=0) - ends).max() < 1e-12


def test_bits_do_not_depend_on_the_neighbours(random):
    q, u, starts, ends = intervals_of(random)
    order = random.permutation(len(starts))
    _, (one,) = looked(q, u, starts, ends)
    _, (other,) = looked(q[:, order], u[:, order], starts[order], ends[order])
    moves = one.lengths > 0
    for rows, mixed in zip(one[:4], other[:4], strict=True):
        own = np.where(moves if rows.ndim == 2 else moves[:, None, None], rows, 0.0)
        assert np.array_equal(own[..., order], np.where(own[..., order] == 0, 0.0, mixed))


def test_an_interval_without_an_end_is_lost_alone(random):
    q, u, starts, ends = intervals_of(random)
    wild = u.copy()
    wild[0, 4] = 1e200
    one, _ = looked(q, wild, starts, ends)
    assert np.flatnonzero(one.lost).tolist() == [4]
    assert (one.intervals.starts == ends)[~one.lost].all()
