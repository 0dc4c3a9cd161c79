import numpy as np
import pytest
from scipy import stats

from twolink.ensembles.axes import Axis, Grid, Listed, Normal, Runs, Uniform
from twolink.errors import ParameterError

GRID = Axis("start.q.0", Grid(-1.0, 1.0, 3), "q1")
LIST = Axis("effects.gravity.g", Listed((1.6, 9.81)), "g")
MASS = Axis("chain.mass.1", Normal(1.0, 0.1), "m")
SPEED = Axis("start.u.0", Uniform(-2.0, 3.0), "u")


def test_all_combinations_of_fixed_axes_are_run_with_each_draw():
    runs = Runs((GRID, MASS, LIST), draws=4, seed=1)
    assert runs.shape == (3, 2, 4)
    values = runs.values(0, runs.count)
    assert values.shape == (24, 3)
    assert sorted({(q, g) for q, _, g in values.tolist()}) == [
        (q, g) for q in (-1.0, 0.0, 1.0) for g in (1.6, 9.81)
    ]
    # The draws of every combination are the same.
    draws = values[:, 1].reshape(6, 4)
    assert (draws == draws[0]).all()
    assert len(set(draws[0])) == 4


def test_a_grid_of_one_value_has_one_end():
    assert Grid(2.0, 2.0, 1).numbers.tolist() == [2.0]


def test_a_run_is_a_function_of_its_number_alone():
    runs = Runs((MASS, SPEED), draws=1000, seed=7)
    every = runs.values(0, 1000)
    for first, last in ((0, 1), (1, 2), (3, 9), (997, 1000), (500, 500)):
        assert (runs.values(first, last) == every[first:last]).all()


def test_draws_differ_by_seed_and_by_axis():
    one, other = (Runs((SPEED,), 50, seed).values(0, 50)[:, 0] for seed in (1, 2))
    assert not set(one) & set(other)
    both = Runs((SPEED, Axis("start.u.1", SPEED.values, "v")), 50, 1).values(0, 50)
    assert (both[:, 0] == one).all()
    assert not set(both[:, 1]) & set(one)


@pytest.mark.parametrize(
    ("values", "law"),
    [(Uniform(-2.0, 3.0), stats.uniform(-2, 5)), (Normal(1.0, 0.1), stats.norm(1, 0.1))],
    ids=["uniform", "normal"],
)
def test_draws_have_their_distribution(values, law):
    drawn = Runs((Axis("x", values, "x"),), 100_000, 3).values(0, 100_000)[:, 0]
    # Kolmogorov and Smirnov: a sample of the law exceeds this once in a thousand.
    assert stats.kstest(drawn, law.cdf).pvalue > 1e-3
    neighbours = np.corrcoef(drawn[:-1], drawn[1:])[0, 1]
    assert abs(neighbours) < 4 / np.sqrt(len(drawn))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Grid(0.0, float("inf"), 2), "grid: last must be a finite real number; got inf"),
        (lambda: Grid(0.0, 1.0, 0), "grid: count must be a whole number of 1 or more; got 0"),
        (
            lambda: Grid(0.0, 1.0, 1),
            r"grid: last must be first = 0\.0 where count is 1; got 1\.0",
        ),
        (lambda: Listed(()), r"values must be one number or more; got \(\)"),
        (lambda: Listed(("a",)), r"values\[0\] must be a number; got 'a'"),
        (lambda: Uniform(1.0, 1.0), "uniform: high must be above low = 1.0; got 1.0"),
        (
            lambda: Uniform(-1e308, 1.7e308),
            r"uniform: high - low must be finite; got 1\.7e\+308 - -1e\+308",
        ),
        (
            lambda: Grid(1.7e308, -1e308, 3),
            r"grid: last - first must be finite; got -1e\+308 - 1\.7e\+308",
        ),
        (lambda: Normal(0.0, 0.0), "normal: deviation must be a positive number; got 0.0"),
    ],
)
def test_values_that_make_no_sense_are_refused(make, sentence):
    with pytest.raises(ParameterError, match=sentence):
        make()
