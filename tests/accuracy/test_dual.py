"""Dual numbers differentiate, in scalars of any type."""

import math
import random

import pytest
import sympy

from twolink import arithmetic, lagrange
from twolink.accuracy.dual import Dual, slopes, variables
from twolink.chain import Chain

x = sympy.Symbol("x")
RULES = [
    (lambda a, b: a + b),
    (lambda a, b: a - b),
    (lambda a, b: a * b),
    (lambda a, b: a / b),
    (lambda a, b: 3 + a - (2 - b)),
    (lambda a, b: 5 / (a * 2) / 7 - (-b)),
    (lambda a, b: arithmetic.sin(a) * arithmetic.cos(b)),
    (lambda a, b: a**3 - (+b) ** -2 + a**0 * b**1),
    (lambda a, b: arithmetic.exp(b) + arithmetic.sqrt(a)),
    (lambda a, b: arithmetic.tanh(a - 2 * b) * a),
]


@pytest.mark.parametrize("rule", RULES)
def test_the_slope_is_the_derivative(rule):
    a, b = sympy.exp(x) + 1, sympy.log(x) + 2
    found = rule(Dual(a, a.diff(x)), Dual(b, b.diff(x)))
    assert sympy.simplify(found.value - rule(a, b)) == 0
    assert sympy.simplify(found.slope - rule(a, b).diff(x)) == 0


@pytest.mark.parametrize("rule", RULES)
def test_one_evaluation_has_the_slopes_by_all_variables(rule):
    a, b, _ = state = sympy.symbols("a b c", positive=True)
    first, second, third = variables(state)
    found = rule(first * second, second + 2)
    wanted = rule(a * b, b + 2)
    assert sympy.simplify(found.value - wanted) == 0
    for slope, by in zip(slopes(found, state), state, strict=True):
        assert sympy.simplify(slope - wanted.diff(by)) == 0
    assert 2 not in found.slope.by
    assert slopes(third, state) == [0, 0, 1]
    assert slopes(5, state) == [0, 0, 0]


def test_the_formulas_of_the_project_are_differentiated():
    chain, numbers = Chain.uniform_bars((1.5, 0.5), (0.8, 1.2)), random.Random(3)
    q, u = ([numbers.uniform(-2, 2) for _ in range(2)] for _ in range(2))

    def energy(angle):
        return lagrange.kinetic_energy(chain, (angle, q[1]), (u[0], u[1]))

    step = 1e-6
    difference = (energy(q[0] + step) - energy(q[0] - step)) / (2 * step)
    found = energy(Dual(q[0], 1.0))
    assert math.isclose(found.slope, difference, rel_tol=1e-8)
    assert found.value == energy(q[0])
