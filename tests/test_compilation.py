import math

import mpmath
import numpy as np
import pytest
from hypothesis import given

from tests.strategies import chains, states
from twolink import kane, lagrange
from twolink.arithmetic import cos, sin
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.errors import ParameterError
from twolink.loads import Force

FORMULATIONS = [kane, lagrange]


def texts(f, chain):
    gravity = Gravity(9.81)

    def inverse_dynamics(q, u, du):
        return f.inverse_dynamics(chain, q, u, du, gravity.loads(chain, q, u))

    return {
        "mass matrix": (lambda q: f.mass_matrix(chain, q), 1),
        "determinant": (lambda q: f.determinant(chain, q), 1),
        "inverse dynamics": (inverse_dynamics, 3),
        "forward dynamics": (
            lambda q, u: f.forward_dynamics(chain, q, u, gravity.loads(chain, q, u)),
            2,
        ),
        "Coriolis matrix": (lambda q, u: f.coriolis_matrix(chain, q, u), 2),
    }


@pytest.mark.slow
@pytest.mark.parametrize("formulation", FORMULATIONS)
@given(chain=chains(), state=states())
def test_compiled_formulas_agree_with_their_source_to_the_last_bit(formulation, chain, state):
    for text, arguments in texts(formulation, chain).values():
        inputs = (state.q, state.u, state.du)[:arguments]
        assert np.array_equal(Compiled(text)(*inputs), text(*inputs))


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_batch_is_its_states_one_by_one(formulation, random):
    chain = Chain((1.0, 2.0), (1.0, 0.7), ((0.4, 0.1), (0.3, -0.2)), (0.1, 0.05))
    n = 40_000
    states = [random.uniform(-5, 5, (2, n)) for _ in range(3)]
    for text, arguments in texts(formulation, chain).values():
        compiled = Compiled(text)
        values = compiled.batch(*states[:arguments])
        for index in (0, 1, 16383, 16384, n - 1):
            one = compiled(*(tuple(map(float, state[:, index])) for state in states[:arguments]))
            # Sine and cosine of arrays may differ in the last place.
            assert values[..., index] == pytest.approx(np.array(one), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("largest", [1e-8, 1.0, 7.0, 1e6])
def test_sine_and_cosine_of_arrays_are_within_one_unit(largest, random):
    """Against 40 digits, in units of 2⁻⁵², the last place of 1."""
    compiled = Compiled(lambda q: (sin(q[0]), cos(q[0])))
    angles = np.concatenate(
        [
            random.uniform(-largest, largest, 2000),
            [0.0, math.pi, -math.pi, math.pi / 2, 3 * math.pi, 2 * math.pi],
        ]
    )
    sines, cosines = compiled.batch(np.stack([angles, angles]))
    with mpmath.workdps(40):
        for angle, s, c in zip(angles, sines, cosines, strict=True):
            exact = mpmath.mpf(float(angle))
            assert abs(mpmath.sin(exact) - mpmath.mpf(float(s))) <= 2.0**-52
            assert abs(mpmath.cos(exact) - mpmath.mpf(float(c))) <= 2.0**-52


def test_operations_with_zero_and_one_are_omitted():
    # A mass of 1 kg, a length of 1 m and a centre on the axis: no product, no term for them.
    chain = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.5, 0.0)), (0.1, 0.1))
    assert Compiled(lambda q: lagrange.mass_matrix(chain, q)).operations == {
        "*": 1,
        "-": 1,
        "cos": 1,
    }


def test_a_common_subexpression_is_computed_once():
    compiled = Compiled(lambda q: (sin(q[0]) * q[1] + sin(q[0]), q[1] * sin(q[0])))
    assert compiled.operations == {"*": 1, "+": 1, "sin": 1}
    assert compiled.depth == 3


def test_signs_are_carried_along():
    compiled = Compiled(lambda q: (-q[0] * (-2.0) - -q[1], -(q[0] - q[1]), q[1] - q[0]))
    assert compiled.operations == {"*": 1, "+": 1, "-": 1}
    assert compiled((3.0, 5.0)) == (11.0, 2.0, 2.0)


def test_arguments_may_have_any_name():
    compiled = Compiled(lambda t, e: (t[0] * t[1] + e[0], sin(t[0] * t[1]) - e[1]))
    assert compiled((2.0, 3.0), (1.0, 4.0)) == (7.0, math.sin(6.0) - 4.0)


def test_sizes():
    compiled = Compiled(lambda q: (abs(q[0]) + q[1], abs(-q[0]), -abs(q[0] - q[1])))
    assert compiled((-3.0, 5.0)) == (8.0, 3.0, -8.0)
    assert compiled.operations == {"+": 1, "-": 1, "abs": 2}
    assert compiled.batch([[-3.0, 1.0], [5.0, -2.0]]).tolist() == [[8, -1], [3, 1], [-8, -3]]


def test_division_and_constants():
    compiled = Compiled(lambda q: (q[0] / q[1], -1.0 / q[0], q[0] / -4.0, 0 / q[1], 7.0))
    assert compiled((3.0, 5.0)) == (3.0 / 5.0, -1.0 / 3.0, -0.75, 0.0, 7.0)


def test_complex_states_give_exact_derivatives(random):
    compiled = Compiled(lambda q: (sin(q[0]) * cos(q[1]), q[0] / q[1]))
    q = random.uniform(1, 2, (2, 5))
    stepped = q.astype(complex)
    stepped[0] += 1e-100j
    slopes = compiled.batch(stepped).imag / 1e-100
    assert slopes[0] == pytest.approx(np.cos(q[0]) * np.cos(q[1]), rel=1e-15)
    assert slopes[1] == pytest.approx(1 / q[1], rel=1e-15)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1j, "1"])
def test_a_constant_that_is_not_a_finite_float_is_rejected(value):
    chain = Chain.uniform_bars()
    with pytest.raises(ParameterError, match="must be finite floats; got"):
        Compiled(lambda q: kane.generalized_active_force(chain, q, (Force(chain.D, (value, 1.0)),)))


@pytest.mark.parametrize("shape", [(3, 4), (2,), (4, 2)])
def test_a_batch_of_another_shape_is_refused(shape):
    compiled = Compiled(lambda q: q[0] * q[1])
    if shape == (2,):
        with pytest.raises(ParameterError, match="batch of states"):
            compiled.batch(np.zeros(shape), np.zeros(shape))
    else:
        with pytest.raises(ParameterError, match="must have one shape"):
            compiled.batch(np.zeros(shape))


def test_roots_exponentials_and_powers():
    from twolink.arithmetic import exp, sqrt, tanh

    def text(q):
        return (sqrt(q[0]) * exp(-q[1]), q[0] ** 5 + np.float64(2.0) * q[1] ** 0, tanh(q[0]))

    compiled = Compiled(text)
    q = (1.7, 0.3)
    first, second, third = compiled(q)
    assert third == math.tanh(1.7)
    assert first == math.sqrt(1.7) * math.exp(-0.3)
    assert second == pytest.approx(1.7**5 + 2, rel=1e-15)
    assert compiled.batch(np.array([[1.7, 2.0], [0.3, 0.1]]))[:, 0] == pytest.approx(
        [first, second, third], rel=1e-15
    )
    assert (
        compiled.operations["tanh"]
        == compiled.operations["sqrt"]
        == compiled.operations["exp"]
        == 1
    )
