"""Expressions for long numbers, evaluated by compiled code against the same formulas in numbers."""

from dataclasses import dataclass
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from twolink.accuracy.reference import reference
from twolink.arithmetic import cos, exp, sin, sqrt, tanh
from twolink.chain import Chain
from twolink.contact.elastoplastic import Material
from twolink.effects import Effect
from twolink.effects.surface import Surface
from twolink.integration.expressions import Precise, plain, precise
from twolink.integration.precisions import PRECISIONS
from twolink.loads import Torque
from twolink.optional import heyoka
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.simulation.motion import motion_run

LONG = ["long double", "quadruple"]

FORMULAS = {
    "quotient": lambda x: x / 3.0,
    "of an integer": lambda x: 2 / (x - 7),
    "by NumPy's number": lambda x: np.float64(0.1) * x / np.float64(7),
    "sum of constants": lambda x: (0 * x + 0.1) + 0.2 - (0.7 - x) + (1 + x),
    "functions": lambda x: sin(x / 7) + cos(x / 9) * exp(-x / 25) - sqrt(x / 11) * tanh(x / 5),
    "powers": lambda x: x**2 - (x / 13) ** (5 / 12) + (+x) ** -1,
    "product of quotients": lambda x: (x / 3.0) * (x / 49.0) / x,
}


def compiled(formula, precision):
    """Return the value at 0.7 of compiled code for a formula."""
    hy, number = heyoka(), PRECISIONS[precision].number
    x = hy.make_vars("x")
    function = hy.cfunc([plain(formula(precise(x, number)))], [x], fp_type=number)
    return function(np.array([number(0.7)]))[0]


@pytest.mark.parametrize("name", FORMULAS)
@pytest.mark.parametrize("precision", LONG)
def test_compiled_formulas_have_the_digits_of_their_numbers(name, precision):
    number, formula = PRECISIONS[precision].number, FORMULAS[name]
    exact = formula(number(0.7))
    assert abs(float(compiled(formula, precision) - exact)) <= 8 * PRECISIONS[precision].rounding


def test_heyoka_itself_divides_by_a_rounded_reciprocal():
    """The reason for this module; without it, numbers would do."""
    hy, number = heyoka(), PRECISIONS["quadruple"].number
    x = hy.make_vars("x")
    found = hy.cfunc([x / 3.0], [x], fp_type=number)(np.array([number(1)]))[0]
    assert 1e-18 < abs(float(found - number(1) / number(3))) < 1e-16


@pytest.mark.parametrize("name", sorted(FORMULAS.keys() - {"powers"}))
def test_formulas_in_float64_are_those_of_heyoka(name):
    """Its quotients by floats are products, which take less time."""
    x, formula = heyoka().make_vars("x"), FORMULAS[name]
    assert str(plain(formula(precise(x, float)))) == str(formula(x))


def test_numbers_are_expressions_too():
    assert str(plain(2.0)) == str(heyoka().expression(2.0))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("exponent", [0, 1, 2, 3, 4, 5, 7, 13])
def test_series_of_whole_powers_exist_where_the_base_is_zero(exponent, precision):
    """x' = 1 and y' = x^n from 0: y = x^(n + 1) / (n + 1)."""
    hy, number = heyoka(), PRECISIONS[precision].number
    x, y = hy.make_vars("x", "y")
    rate = plain(precise(x, number) ** exponent)
    equations = [(x, hy.expression(number(1))), (y, rate)]
    start = np.array([number(0)] * 2)
    run = hy.taylor_adaptive(equations, start, fp_type=number, tol=number(1e-15))
    run.propagate_until(number(1.5))
    exact = number(1.5) ** (exponent + 1) / number(exponent + 1)
    assert abs(float(run.state[1] / exact - 1)) < 1e-14


def test_heyoka_itself_has_no_series_of_a_cube_at_zero():
    hy = heyoka()
    x = hy.make_vars("x")
    run = hy.taylor_adaptive([(x, 1 + x**3)], [0.0])
    run.step(0.1)
    assert np.isnan(run.state[0])


@pytest.mark.parametrize(
    "divisor",
    [3, 3.0, np.int64(3), np.float32(3), np.float64(3), np.longdouble(3), Fraction(3), 2**70 + 1,
     np.longdouble(1) / 3],
    ids=repr,
)  # fmt: skip
def test_numbers_of_any_type_are_converted_before_a_division(divisor):
    """A number of NumPy, too, would be combined in its own precision."""
    number = PRECISIONS["quadruple"].number
    exact = Fraction(*getattr(divisor, "item", lambda: divisor)().as_integer_ratio())
    expected = number(0.7) * (number(exact.denominator) / number(exact.numerator))
    found = compiled(lambda x: x / divisor, "quadruple")
    assert abs(float((found - expected) / expected)) < 1e-32


@pytest.mark.parametrize("other", [heyoka().make_vars("y"), heyoka().par[0]])
def test_symbols_of_heyoka_are_operands(other):
    number = PRECISIONS["quadruple"].number
    x = precise(heyoka().make_vars("x"), number)
    for value in (x + other, other + x, x * other, other - x, other / x, number(0.1) * x):
        assert isinstance(value, Precise)


@pytest.mark.parametrize("share", [2.0, 7.0, 40.0])
def test_the_force_of_a_yielding_surface_is_one_function(share):
    """Its value in numbers, at the start of a mode, and that of compiled code agree."""
    material = Material(1.2e11, 0.025, 1.1e9, 0.3)
    scale = share * material.yield_depth / 0.7
    exact = material.flow_force(PRECISIONS["quadruple"].number(0.7) * scale)
    found = compiled(lambda x: material.flow_force(x * scale), "quadruple")
    assert abs(float((found - exact) / exact)) < 1e-32


@dataclass(frozen=True)
class Springs(Effect):
    """Springs between each link and the ground, as a user may write them."""

    def loads(self, chain, q, u, t=0.0):
        return Torque(1, -q[0] / 3.0), Torque(2, -q[1] / 21.0)


# Both mass centres on the joints: M = diag(3, 1/2).
TURNING = Scene(
    Chain((1.0, 1.0), (1.0, 1.0), ((0.0, 0.0), (0.0, 0.0)), (2.0, 0.5)),
    (1.0, 0.5), (0.0, 0.0), 2.0, (Springs(),),
)  # fmt: skip


def exact_angles(digits):
    with mpmath.workdps(digits + 10):
        rates = [mpmath.sqrt(mpmath.mpf(1) / 9), mpmath.sqrt(mpmath.mpf(2) / 21)]
        return [mpmath.mpf(q) * mpmath.cos(2 * w) for q, w in zip(TURNING.q, rates, strict=True)]


def test_the_digits_of_a_reference_are_those_of_the_formula():
    """Two runs of 200 bits agreed on 50 digits, of which 16 were right."""
    found = reference(TURNING, digits=50)
    with mpmath.workdps(60):
        for digits, exact in zip(found.states[0][:2], exact_angles(50), strict=True):
            assert abs(mpmath.mpf(digits) - exact) < mpmath.mpf(10) ** -50


@pytest.mark.parametrize("formulation", ["kane", "lagrange", "momenta"])
def test_runs_in_longer_numbers_have_the_digits_of_the_formula(formulation):
    run = motion_run(TURNING, np.array([0.0, 2.0]), formulation=formulation, precision="quadruple")
    for value, exact in zip(run.q[:, -1], exact_angles(40), strict=True):
        parts = [float(value), float(value - type(value)(float(value)))]
        assert abs(sum(map(Fraction, parts)) - Fraction(str(mpmath.nstr(exact, 45)))) < 1e-31


FAR = Surface((0.0, 9.0), (0.0, -1.0))


@dataclass(frozen=True)
class Hardening(Effect):
    """A spring of the third power at A, and a torque of the fifth power of time at B."""

    def loads(self, chain, q, u, t=0.0):
        return Torque(1, -2 * q[0] ** 3), Torque(2, 0.3 * t**5)


@pytest.mark.parametrize("surfaces", [(), (FAR,)], ids=["smooth", "with a surface"])
def test_motions_begin_where_the_base_of_a_power_is_zero(surfaces):
    """3 q1'' = -2 q1³, and q2'' = 0.6 t⁵ in the angle of link 2, both from 0."""
    far = mpmath.mpf("1.25")
    with mpmath.workdps(25):
        # q1'² = 4 - q1⁴ / 3.
        time = mpmath.quad(lambda x: 1 / mpmath.sqrt(4 - x**4 / 3), [0, far / 2, far])
    scene = Scene(TURNING.chain, (0.0, 0.0), (2.0, 0.0), float(time), (Hardening(), *surfaces))
    found = simulate(scene, accuracy=1e-10)
    q, _ = found.at(scene.duration)
    assert q[:, 0] == pytest.approx([float(far), 0.6 * float(time) ** 7 / 42], abs=1e-10)
