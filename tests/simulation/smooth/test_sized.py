"""The round-off of formulas, against their evaluation with fifty digits."""

import mpmath
import numpy as np
import pytest

from twolink.arithmetic import cos, exp, sin, sqrt, tanh
from twolink.simulation.smooth.sized import Sized

EPS = np.finfo(float).eps
X = np.linspace(0.3, 2.7, 200)

FORMULAS = {
    "terms that cancel": lambda x: 1e8 + 1e8 * sin(1e-4 * x - 1.5707963267948966),
    "products of such terms": lambda x: (1 + sin(x / 100 - 1.57)) * (cos(x) + 2) * 1e5 / (x + 3),
    "a large phase": lambda x: 5 * sin(3 * x + 1e6),
    "a shifted square": lambda x: (x + 1e4) ** 2 - 2e4 * x - 1e8,
    "roots of small differences": lambda x: sqrt(1e6 + x - 1e6),
    "a saturation": lambda x: 1e3 * tanh((x - 1.4) * 300.0),
    "an exponential": lambda x: exp(-(((x - 1.4) / 0.05) ** 2) + 300.0) * 1e-130,
}


@pytest.mark.parametrize("name", FORMULAS)
def test_the_size_bounds_the_round_off_by_little_more_than_itself(name):
    formula = FORMULAS[name]
    found = formula(Sized(X))
    with mpmath.workdps(50):
        exact = [formula(mpmath.mpf(float(x))) for x in X]
        missed = [abs(mpmath.mpf(float(v)) - e) for v, e in zip(formula(X), exact, strict=True)]
    bound = EPS * (found.error + found.spread)
    missed = np.array(missed, dtype=float)
    assert np.all(missed <= 4 * bound)
    assert missed.max() > 0.02 * bound.max()


def test_numbers_that_do_not_cancel_have_one_rounding():
    x = Sized(X / 2)
    for found in (2 * x * x, sin(x), x * cos(x) + x, x / (1 + x), -exp(x), 3 - x):
        assert found.excess == pytest.approx(0.0, abs=1e-14)
