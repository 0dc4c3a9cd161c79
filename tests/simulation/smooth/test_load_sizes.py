"""The size of the round-off of loads, of all formulations."""

import math
from dataclasses import dataclass
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from tests.simulation.smooth.test_measure import GENERAL, measured, true_errors
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.loads import Force, Torque, motor_loads
from twolink.scene import Scene
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.load_sizes import force_sizes, load_sizes
from twolink.simulation.smooth.sized import Sized, sized
from twolink.simulation.smooth.taylor import taylor_run

STATE = np.array([[0.3, 1.0], [-0.4, 2.0]]), np.array([[0.1, -1.0], [0.2, 0.7]]), np.zeros(2)
THREE = np.linspace(0.0, 3.0, 61)


@dataclass(frozen=True)
class Rounded(Effect):
    """A torque a t², written as a difference of large squares."""

    a: float
    shift: float

    def loads(self, chain, q, u, t=0.0):
        x = t + self.shift
        return motor_loads(self.a * (x * x - 2 * x * self.shift + self.shift * self.shift), 0.0)


def rising(size, frequency):
    return JointTorque((size, 0.0), (size, 0.0), (frequency, 0.0), (-math.pi / 2, 0.0))


LOADS = {
    "torques within one effect": rising(1e8, 1e-4),
    "smaller ones": rising(1e6, 1e-3),
    "an effect of a user": Rounded(3.0, 1e5),
    "a phase": JointTorque((0.0, 0.0), (5.0, 0.0), (3.0, 0.0), (1e9, 0.0)),
}


def given(formulation, *effects):
    return force_sizes(GENERAL, effects, *STATE).given(GENERAL, formulation, STATE[0])


@pytest.mark.parametrize("formulation", EQUATIONS)
def test_gravity_has_little_more_than_its_own_rounding(formulation):
    sizes = given(formulation, Gravity())
    rates = []
    for effects in ((Gravity(),), ()):
        q, u, t = STATE
        x = EQUATIONS[formulation].from_speeds(GENERAL, q, u)
        rates.append(np.array(EQUATIONS[formulation].rates(GENERAL, effects, q, x, t)[1]))
    assert np.all(sizes.errors >= (1 - 1e-12) * np.abs(rates[0] - rates[1]))
    assert np.all(sizes.excess <= 0.7 * np.abs(rates[0] - rates[1]).max())
    assert np.all(sizes.spread == 0)


@pytest.mark.parametrize("formulation", EQUATIONS)
def test_terms_of_one_effect_that_cancel_count_by_their_sizes(formulation):
    sizes = given(formulation, rising(1e8, 1e-4))
    one = given(formulation, JointTorque((1.0, 0.0)))
    assert sizes.errors == pytest.approx(1e8 * one.errors, rel=0.01)


@pytest.mark.parametrize("name", LOADS)
def test_the_error_is_bounded_where_terms_cancel(name):
    """At 1e-8 a pair of runs in double precision served, and both had the same round-off."""
    bars = Chain.uniform_bars()
    acting = Scene(bars, (0.1, 0.3), (0.0, 0.0), 3.0, (LOADS[name],))
    exact = taylor_run(acting, THREE, formulation="kane", precision="quadruple")
    for accuracy in (1e-8, 1e-9, 1e-11):
        found = measured(acting, accuracy, THREE)
        assert found.worst <= accuracy
        assert np.all(true_errors(found.kept, exact) <= found.errors)


@pytest.mark.parametrize("formulation", ["kane", "lagrange"])
@pytest.mark.parametrize("effects", [(Gravity(),), ()], ids=["gravity", "no loads"])
@pytest.mark.parametrize("mass", [1e-9, 1e-6, 1e-3, 1.0])
def test_accelerations_have_the_round_off_of_the_terms_of_their_solution(
    mass, effects, formulation, random
):
    """M is nearly singular where the first link is light, and its terms cancel.

    The angle between links that are folded is rounded, and turning them needs nearly no force.
    """
    light = Chain.point_masses((mass, 0.3), (0.7, 1.1))
    q, u = random.uniform(-3, 3, (2, 300)), random.uniform(-3, 3, (2, 300))
    q[1, :200] = q[0, :200] + random.uniform(-1e-3, 1e-3, 200)
    q[1, 100:200] += math.pi
    acting = Scene(light, (0.0, 0.0), (0.0, 0.0), 1.0, effects)
    sizes = load_sizes(acting, formulation, q, u, np.zeros(300)).errors
    rates = EQUATIONS[formulation].rates
    found = np.array(rates(light, effects, tuple(q), tuple(u), 0.0)[1])
    with mpmath.workdps(40):
        own = light.convert(mpmath.mpf)
        exact = [
            rates(own, effects, *(tuple(map(mpmath.mpf, x)) for x in state), mpmath.mpf(0))[1]
            for state in zip(q.T.tolist(), u.T.tolist(), strict=True)
        ]
        missed = np.array(
            [
                [float(abs(x - y)) for x, y in zip(a, b, strict=True)]
                for a, b in zip(found.T.tolist(), exact, strict=True)
            ]
        ).T
    assert np.all(missed <= np.finfo(float).eps * sizes)


LIGHT = [
    (1e-3, 0.5, 1e-12, "kane"),
    (1e-4, 0.3, 1e-11, "lagrange"),
    (1e-5, 0.2, 1e-11, "lagrange"),
    (1e-6, 0.1, 1e-11, "kane"),
    (1e-6, 0.1, 1e-12, "lagrange"),
    (1e-6, 0.1, 1e-9, "kane"),
]


@pytest.mark.parametrize(("mass", "duration", "accuracy", "formulation"), LIGHT)
def test_the_error_of_a_chain_with_a_light_first_link_is_reported(
    mass, duration, accuracy, formulation
):
    light = Chain.point_masses((mass, 0.3), (0.7, 1.1))
    acting = Scene(light, (0.0, 0.0), (0.0, 0.0), duration, (Gravity(),))
    times = np.linspace(0.0, duration, 21)
    exact = taylor_run(
        acting, times, formulation="momenta", precision="quadruple", longest_step=duration / 200
    )
    found = measured(acting, accuracy, times, formulation=formulation)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


BALANCED = Chain((1.0, 0.7), (1.0, 0.8), ((0.0, 0.0), (0.8, 0.0)), (0.05, 0.03))
CANCELLING = {
    "torques of motors": (*(JointTorque((x, 0.0)) for x in (1e6 + 0.1, 2e6 + 0.2, -3e6 - 0.3)),),
    "small torques": (*(JointTorque((x, 0.0)) for x in (0.1, 0.2, -0.3)),),
    "a weight that a force carries": (Gravity(9.81), EndForce(-(0.7 * 9.81))),
    "gravities": (*(Gravity(x) for x in (1e4 + 0.1, 2e4 + 0.2, -3e4 - 0.3)),),
}


@pytest.mark.parametrize("formulation", ["momenta", "lagrange"])
@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize(
    ("name", "duration"), [*zip(CANCELLING, [10.0, 1e4, 1e4, 1e3], strict=True)]
)
def test_constants_of_several_effects_that_cancel_move_a_chain_at_rest(
    name, duration, accuracy, formulation
):
    """The sum of float64 numbers is no float64 number: a chain that seems to rest is slow."""
    acting = Scene(BALANCED, (0.3, 0.9), (0.0, 0.0), duration, CANCELLING[name])
    times = np.linspace(0.0, duration, 21)
    exact = taylor_run(acting, times, formulation="kane", precision="quadruple")
    assert 1e-11 < np.abs(exact.q[:, -1].astype(float) - acting.q).max() < 1e-5
    found = measured(acting, accuracy, times, formulation=formulation)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


@dataclass(frozen=True)
class Summed(Effect):
    """A torque that is a sum of constants, in the numbers of the chain."""

    parts: tuple[float, ...]

    def loads(self, chain, q, u, t=0.0):
        return motor_loads(sum(map(chain.scalar, self.parts)), 0.0)


@dataclass(frozen=True)
class Fixed(Effect):
    """Loads that do not depend on the motion."""

    own: tuple[object, ...]

    def loads(self, chain, q, u, t=0.0):
        return self.own


@dataclass(frozen=True)
class OfFloats(Effect):
    """A torque by a formula that takes floats of the chain only."""

    def loads(self, chain, q, u, t=0.0):
        size = math.hypot(chain.L1, 1.0) if chain.L1 > 0 else 0.0
        return motor_loads(size * q[0], 0.0)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize("parts", [(1e9, 0.1, -1e9), (1e6, 0.1, -1e6), (0.1, 0.2, -0.3)])
def test_constants_that_cancel_within_an_effect_count_by_their_sizes(parts, accuracy):
    acting = Scene(Chain.uniform_bars(), (0.3, 0.4), (0.0, 0.0), 2.0, (Gravity(), Summed(parts)))
    times = np.linspace(0.0, 2.0, 21)
    exact = taylor_run(acting, times, formulation="kane", precision="quadruple")
    found = measured(acting, accuracy, times)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


@pytest.mark.parametrize("accuracy", [1e-6, 1e-9, 1e-12])
@pytest.mark.parametrize(("size", "duration"), [(0.3, 8.0), (1e-3, 1e3), (1e-6, 1e6), (1e-9, 1e8)])
def test_a_torque_that_is_zero_in_float64_alone_moves_a_chain_at_rest(size, duration, accuracy):
    """All of the motion is round-off: there are no speeds whose rounding would exceed it."""
    torque = JointTorque((-size * math.sin(0.7), 0.0), (size, 0.0), (0.0, 0.0), (0.7, 0.0))
    acting = Scene(BALANCED, (0.0, 0.0), (0.0, 0.0), duration, (torque,))
    times = np.linspace(0.0, duration, 5)
    exact = taylor_run(acting, times, formulation="kane", precision="quadruple")
    found = measured(acting, accuracy, times)
    assert found.worst <= accuracy
    assert np.all(true_errors(found.kept, exact) <= found.errors)


def test_formulas_of_floats_and_fractions_have_sizes():
    third = Fraction(1, 3)
    for load in (Torque(1, third), Force(GENERAL.D, (third, 0))):
        assert given("momenta", Fixed((load,))).errors.max() > 0.3
    assert given("momenta", OfFloats()).errors[0].min() > 0


BUILT_IN = [
    Gravity(9.81, (0.6, 0.8)),
    EndForce(-3.0),
    EndDrag(0.3),
    JointDamping((0.3, 0.2)),
    JointSpring((3.0, 2.0), (0.1, 0.2)),
    PdControl((1.0, 1.0), (40.0, 30.0), (4.0, 3.0)),
    rising(5.0, 0.3),
]


@pytest.mark.parametrize("effect", BUILT_IN, ids=lambda effect: type(effect).__name__)
def test_built_in_effects_are_formulas_for_numbers_with_sizes(effect):
    angles, speeds = (tuple(map(Sized, pair)) for pair in STATE[:2])
    chain = GENERAL.convert(sized)
    for load in effect.smooth_loads(chain, angles, speeds, Sized(STATE[2])):
        numbers = (load.moment,) if isinstance(load, Torque) else load.components
        assert any(isinstance(number, Sized) for number in numbers)
