import numpy as np
import pytest

from tests.ensembles.evaluated import evaluated, symbolic
from twolink.ensembles.deviations import INDICES, Region

ROOT = np.array([[2.0, 0, 0, 0], [0.5, 1.0, 0, 0], [-0.3, 0.2, 0.7, 0], [0.1, 0.4, -0.6, 0.5]])
SHAPE = ROOT @ ROOT.T
CENTRE = np.array([0.3, -0.2, 0.1, 0.5])
FLOW = np.array([[1.0, 0.1, 0.2, 0], [0.3, 1.2, 0, 0.1], [-0.4, 0, 0.9, 0.2], [0, -0.5, 0.1, 1.1]])
UNITS = np.array([1.0, 1.0, 2.0, 0.5])
NONE = [0.0] * 4


def array(numbers):
    return np.array(symbolic(numbers), object)


def matrix(numbers):
    return np.array([symbolic(row) for row in numbers], object)


def region(shape=SHAPE):
    return Region.of(symbolic(CENTRE), symbolic(shape[i, j] for i, j in INDICES))


def values(found):
    """Return the centre and the shape of a region as arrays."""
    flat = evaluated([*found.centre, *(x for row in found.shape for x in row)])
    return flat[:4], flat[4:].reshape(4, 4)


def test_entries_are_those_of_a_symmetric_matrix():
    assert evaluated(region().entries) == pytest.approx([SHAPE[i, j] for i, j in INDICES])
    assert np.array_equal(values(region())[1], SHAPE)


def test_a_flow_carries_every_point_of_the_region(random):
    centre, shape = values(region().carried(matrix(FLOW)))
    assert centre == pytest.approx(FLOW @ CENTRE)
    assert shape == pytest.approx(FLOW @ SHAPE @ FLOW.T)
    inside = ROOT @ directions(random)
    after = FLOW @ inside
    assert np.einsum("ik,ik->k", after, np.linalg.solve(shape, after)) == pytest.approx(1.0)


def directions(random, count=200):
    found = random.normal(size=(4, count))
    return found / np.linalg.norm(found, axis=0)


def test_shared_errors_add_to_the_region_whatever_their_signs(random):
    shared = np.array([0.2, 0.5, 0.1, 0.3])
    truncation = np.array([0.01, -0.02, 0.03, 0.0])
    found = region().with_step(array(truncation), array(shared), array(NONE), array(UNITS))
    centre, shape = values(found)
    assert centre == pytest.approx(CENTRE + truncation)
    moved = ROOT @ directions(random) + shared[:, None] * directions(random)
    assert (np.einsum("ik,ik->k", moved, np.linalg.solve(shape, moved)) <= 1 + 1e-12).all()
    # Of all ellipsoids of this family it has the least trace in these units.
    old, new = (np.sqrt((np.diag(s) / UNITS**2).sum()) for s in (SHAPE, np.diag(shared**2)))
    assert (np.diag(shape) / UNITS**2).sum() == pytest.approx((old + new) ** 2)


def test_independent_errors_add_as_variances():
    independent = np.array([0.2, 0.5, 0.1, 0.3])
    nothing = array(NONE)
    found = region().with_step(nothing, nothing, array(independent), array(UNITS))
    assert values(found)[1] == pytest.approx(SHAPE + np.diag(independent**2))


def test_a_region_that_is_empty_stays_finite():
    empty = region(np.zeros((4, 4)))
    nothing = array(NONE)
    found = values(empty.with_step(nothing, nothing, nothing, array(UNITS)))
    assert np.array_equal(found[1], np.zeros((4, 4)))


def test_sizes_in_directions(random):
    rows = random.normal(size=(4, 4))
    shift, spread = evaluated([region().shift(matrix(rows)), region().spread(matrix(rows))])
    assert shift == pytest.approx(np.abs(rows @ CENTRE).max())
    assert spread == pytest.approx(np.linalg.norm(rows @ ROOT, axis=1).max())
