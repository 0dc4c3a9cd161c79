"""Counts of operations against heyoka's code, and against numbers that count what is done."""

import math
import re
from types import SimpleNamespace

import heyoka as hy
import numpy as np
import pytest
from scipy.integrate import DOP853, RK45
from scipy.integrate._ivp.rk import rk_step

from twolink.integration import operations
from twolink.integration.fixed_step import explicit, implicit, semi_implicit_euler
from twolink.integration.methods import NUMERIC_METHODS
from twolink.integration.operations import Extent, Operations, of_taylor_step
from twolink.integration.precisions import PRECISIONS
from twolink.integration.tableaus import GAUSS_LEGENDRE, RK4, Tableau
from twolink.scene import Scene
from twolink.simulation.motion import motion_run
from twolink.simulation.smooth import numeric
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.numeric import numeric_run
from twolink.simulation.smooth.taylor import taylor_run

X, Y = hy.make_vars("x", "y")
PARAMETER = hy.par[0]
CALLS = {
    "llvm.sqrt.f64": 1,
    "llvm.exp.f64": 23,
    "heyoka.combined_sin.double": 26,
    "heyoka.combined_cos.double": 26,
    "llvm.pow.f64": 88,
}


def taylor(rate, order=7):
    """Return an integrator of dx/dt = rate, dy/dt = x, in unrolled code as heyoka writes it."""
    system, tolerance = [(X, rate), (Y, X)], PRECISIONS["double"].step_tolerance(order)
    found = hy.taylor_adaptive(system, [0.1, 0.2], tol=tolerance, opt_level=0, compact_mode=False)
    assert found.order == order
    return found


def in_code(integrator):
    """Return the operations in the code of a step, before the compiler changes it."""
    functions = re.split(r"(?m)^define", integrator.llvm_state.ir)
    (step,) = (text for text in functions if re.match(r"[^\n]*@step\(", text))
    found = len(re.findall(r"= (?:fadd|fsub|fmul|fdiv)\b", step))
    for name, cost in CALLS.items():
        found += cost * len(re.findall(rf"call [^@\n]*@{re.escape(name)}\(", step))
    return found


@pytest.mark.parametrize(
    "rate",
    [
        Y,
        -Y,
        hy.expression(2.0),
        X * Y,
        X * X,
        3.0 * X,
        PARAMETER * X,
        PARAMETER * hy.par[1] * X,
        X / Y,
        2.0 / X,
        PARAMETER / X,
        X / PARAMETER,
        X + 2.0,
        2.0 - X,
        X - Y,
        hy.sum([X, Y, X * Y, PARAMETER]),
        hy.sin(X),
        hy.exp(X),
        hy.time * X,
        hy.cos(hy.time),
        hy.sqrt(X),
        *(X**power for power in (2.0, 3.0, 7.0, -1.0, -2.0, 1.5, -1.5, 1.3)),
    ],
    ids=str,
)
@pytest.mark.parametrize("order", [7, 8])
def test_each_element_of_a_taylor_step_costs_what_heyokas_code_has(rate, order):
    integrator = taylor(rate, order)
    assert of_taylor_step(integrator) == Operations(in_code(integrator), Extent.COUNTED)


def test_a_taylor_step_worked_out_by_hand():
    """x' = x y, y' = x, at order 7: a product of seven coefficients, and two variables."""
    product = sum(n + 1 for n in range(7)) + sum(n for n in range(7))
    variables = 2 * (7 + 7 + 7)
    length = 2 * 88 + 2 + 2
    assert of_taylor_step(taylor(X * Y)).number == product + variables + length == 271


def test_a_function_of_unknown_cost_makes_a_lower_bound():
    assert of_taylor_step(taylor(hy.tanh(X))).extent is Extent.AT_LEAST


@pytest.mark.parametrize("element", ["?", "u_0 ? u_1", "(u_0 * u_1 * u_2)"])
def test_an_element_that_is_not_known_makes_a_lower_bound(element):
    """As elements of another version of heyoka may be."""
    texts = ["x", "y", element, "u_1", "u_2"]
    other = SimpleNamespace(order=7, dim=2, decomposition=[(text, []) for text in texts])
    assert of_taylor_step(other).extent is Extent.AT_LEAST


class Counting:
    """A float that counts the operations of all numbers of its class."""

    done = 0

    def __init__(self, value):
        self.value = float(value)

    def _result(self, value, cost=1):
        Counting.done += cost
        return Counting(value)

    def __add__(self, other):
        return self._result(self.value + float(other))

    def __sub__(self, other):
        return self._result(self.value - float(other))

    def __rsub__(self, other):
        return self._result(float(other) - self.value)

    def __mul__(self, other):
        if isinstance(other, np.ndarray):
            return NotImplemented
        # The end of an iteration compares with this part of a size, which is not counted.
        return self._result(self.value * float(other), cost=other != 1e-12)

    def __truediv__(self, other):
        return self._result(self.value / float(other))

    def __pow__(self, exponent):
        return self._result(self.value**exponent)

    def sqrt(self):
        return self._result(math.sqrt(self.value))

    def __abs__(self):
        return Counting(abs(self.value))

    def __float__(self):
        return self.value

    def __lt__(self, other):
        return self.value < float(other)

    def __le__(self, other):
        return self.value <= float(other)

    def __gt__(self, other):
        return self.value > float(other)

    def __ge__(self, other):
        return self.value >= float(other)

    def __eq__(self, other):
        return self.value == float(other)

    __hash__ = None
    __radd__, __rmul__ = __add__, __mul__


def sin(x):
    """Count a sine: the functions of a number's type are those of its module."""
    Counting.done += 26
    return Counting(math.sin(x.value))


def cos(x):
    Counting.done += 26
    return Counting(math.cos(x.value))


def counting(values):
    return np.array([Counting(value) for value in values])


class Rates:
    """The rates of a spring and of a pendulum, whose operations do not count."""

    def __init__(self):
        self.calls = 0

    def __call__(self, t, x):
        self.calls += 1
        q1, q2, u1, u2 = map(float, x)
        return counting([u1, u2, -q1 - 0.1 * float(t), -math.sin(q2)])


START = (0.1, 0.2, 0.3, 0.4)


@pytest.mark.parametrize(
    ("step", "beside"),
    [
        (explicit(RK4), operations.explicit(RK4)),
        (semi_implicit_euler, operations.semi_implicit_euler),
        *((implicit(tableau), operations.implicit(tableau)) for tableau in GAUSS_LEGENDRE.values()),
    ],
    ids=["rk4", "semi-implicit-euler", *map(str, GAUSS_LEGENDRE)],
)
def test_a_step_beside_the_rates_costs_what_numbers_count(step, beside):
    rates, start = Rates(), counting(START)
    Counting.done = 0
    step(rates, Counting(0.5), start, Counting(0.01))
    # The start of a step, start + index h, is an argument of it.
    assert beside(1, rates.calls) == Counting.done + 2


def test_rk4_worked_out_by_hand():
    """Three moves h a k, four times t + c h, the sum of four weighted slopes, and x + h k."""
    moves, times, combined = 3 * (1 + 4 + 4), 4 * 2, 4 * 4 + 3 * 4 + 4 + 4
    start_of_step = 2
    each = moves + times + combined + start_of_step
    method = NUMERIC_METHODS["rk4"]
    assert method.beside_rates(10, 40) == 10 * each
    assert operations.of_rates(40, 100, 10 * each) == Operations(4000 + 10 * each)


@pytest.mark.parametrize("kind", [RK45, DOP853])
def test_an_attempt_of_scipys_methods_costs_what_numbers_count(kind):
    stages, rates = kind.n_stages, Rates()
    slopes = np.empty((stages + 1, 4), dtype=object)
    x, h = counting(START), Counting(0.1)
    solver = object.__new__(kind)
    slope = rates(0.0, x)
    rates.calls = Counting.done = 0
    new, _ = rk_step(rates, Counting(0.0), x, slope, h, kind.A, kind.B, kind.C, slopes)
    scale = 1e-6 + np.maximum(np.abs(x), np.abs(new)) * 1e-6
    solver._estimate_error_norm(slopes, h, scale)
    # The times, the factor of the next step by a power, and the next step.
    control = 7 + 88
    method = NUMERIC_METHODS[kind.__name__]
    assert rates.calls == stages
    assert method.beside_rates(1, 2 + stages) == Counting.done + control
    assert method.beside_rates(3, 2 + 4 * stages) == 4 * (Counting.done + control)


GENERAL = Scene.load("general")


@pytest.mark.parametrize("equations", EQUATIONS)
def test_an_evaluation_costs_what_numbers_count_in_its_formula(equations):
    formula = numeric._formula(GENERAL.moving_chain, GENERAL.effects, equations)
    names = {"sin": sin, "cos": cos}
    exec(formula.source, names)
    Counting.done = 0
    names["compiled"](counting([0.1, 0.2]), counting([0.3, 0.4]), counting([0.0, 0.0]))
    assert operations.of_formula(formula.operations) == Counting.done


@pytest.mark.parametrize("equations", EQUATIONS)
def test_a_run_by_taylor_series_costs_what_heyokas_code_has(equations):
    times = np.array([0.0, 0.1])
    run = taylor_run(GENERAL, times, formulation=equations, order=9)
    code = in_code(run.compiled.pool.original)
    assert run.arithmetic == Operations(run.steps * code, Extent.COUNTED)


def test_a_run_by_rk4_costs_its_evaluations_and_its_steps():
    times = np.array([0.0, 0.1])
    run = numeric_run(GENERAL, times, method="rk4", formulation="kane", setting=0.01)
    formula = numeric._formula(GENERAL.moving_chain, GENERAL.effects, "kane")
    beside = NUMERIC_METHODS["rk4"].beside_rates(10, 40)
    assert (run.steps, run.evaluations) == (10, 40)
    assert run.arithmetic == Operations(40 * operations.of_formula(formula.operations) + beside)


def test_a_run_with_events_has_a_lower_bound_of_all_its_arcs():
    run = motion_run(Scene.load("drop"), np.array([0.0, 0.6]), formulation="lagrange")
    assert len(run.arcs) > 1
    each = [(of_taylor_step(arc.compiled.pool.original).number, arc.step_count) for arc in run.arcs]
    assert run.arithmetic == Operations(sum(a * b for a, b in each), Extent.AT_LEAST)


def test_methods_whose_operations_are_unknown_have_lower_bounds():
    assert NUMERIC_METHODS["LSODA"].beside_rates(10, 40) is None
    assert NUMERIC_METHODS["DOP853"].beside_rates(40, 40) is None
    assert operations.of_rates(40, 100, None) == Operations(4000, Extent.AT_LEAST)


def test_a_total_with_a_lower_bound_is_one():
    exact, bound = Operations(3), Operations(4, Extent.AT_LEAST)
    assert operations.total([exact, exact]) == Operations(6)
    assert operations.total([exact, bound]) == Operations(7, Extent.AT_LEAST)
    assert operations.total([exact], Extent.AT_LEAST) == Operations(3, Extent.AT_LEAST)


def test_products_by_zero_are_left_out():
    euler = Tableau(A=((0.0,),), b=(1.0,))
    assert operations.explicit(euler)(1, 1) == 2 + 2 + 4 * 3
