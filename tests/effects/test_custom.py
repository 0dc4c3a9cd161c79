"""Effects of users: one sentence for expressions that cannot be compiled, in every method."""

import math
import threading
from dataclasses import dataclass, replace
from math import sin as plain_sin

import numpy as np
import pytest

from tests.effects.test_custom_elements import Elements
from tests.effects.test_inputs_of_effects import GOOD
from twolink import arithmetic
from twolink.arithmetic import cos, exp, sign, sin, sqrt, tanh
from twolink.chain import Chain, Point
from twolink.effects import (
    EFFECTS,
    ContactEffect,
    Effect,
    PiecewiseEffect,
    RotorEffect,
    custom,
    effect_class,
)
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.motor_inertia import MotorInertia
from twolink.errors import ParameterError
from twolink.kinematics import velocity
from twolink.loads import Force, Torque, motor_loads
from twolink.scene import Scene
from twolink.simulation import simulate

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.2, -0.1), 0.5, (Gravity(),))


class Acting(Effect):
    """An effect whose loads are a function of the state."""

    def __init__(self, function):
        self.function = function

    def loads(self, chain, q, u, t=0.0):
        return self.function(chain, q, u, t)


def a_torque(function):
    return Acting(lambda chain, q, u, t: (Torque(1, function(q, u, t)),))


def branching(chain, q, u, t):
    if u[0] == 0:
        return ()
    return (Torque(1, u[0]),)


def branching_on_time(chain, q, u, t):
    if t < 1:
        return ()
    return (Torque(1, u[0]),)


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (a_torque(lambda q, u, t: np.sin(q[0])), "calls numpy.sin in `np.sin"),
        (a_torque(lambda q, u, t: math.sin(q[0])), "no value .*|none yet, in `math.sin"),
        (a_torque(lambda q, u, t: plain_sin(q[0])), "in `plain_sin"),
        (a_torque(lambda q, u, t: np.hypot(q[0], 1.0)), "calls numpy.hypot"),
        (a_torque(lambda q, u, t: abs(u[0])), "in `abs"),
        (a_torque(lambda q, u, t: max(u)), "compares a number"),
        (a_torque(lambda q, u, t: float(u[0])), "in `float"),
        (a_torque(lambda q, u, t: sign(u[0])), "takes a sign, which is not smooth"),
        (a_torque(lambda q, u, t: q[0] ** 0.5), "takes a power"),
        (a_torque(lambda q, u, t: 1.0 if u[0] else 2.0), "none yet, in `"),
        (Acting(branching), "compares a number that has no value yet, in `u"),
        (Acting(branching_on_time), "compares a number that has no value yet, in `t < 1"),
    ],
)
def test_loads_that_cannot_be_compiled(effect, words):
    with pytest.raises(ParameterError, match=words) as caught:
        replace(SCENE, effects=(effect,))
    sentence = str(caught.value)
    assert sentence.startswith("effect Acting: loads ")
    assert "twolink.arithmetic" in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda *_: None, "effect Acting: loads must be a tuple of Force and Torque; got None"),
        (
            lambda *_: Torque(1, 2.0),
            "effect Acting: loads must be a tuple of Force and Torque; got",
        ),
        (lambda *_: (1.0,), r"loads must be a tuple of Force and Torque; got 1\.0 in it"),
        (lambda *_: (Torque(3, 1.0),), "effect Acting: link must be 1 or 2; got 3"),
        (lambda *_: (Torque(1, "2"),), "effect Acting: moment must be a number; got '2'"),
        (lambda *_: (Torque(2.0, 1.0),), r"effect Acting: link must be 1 or 2; got 2\.0"),
        (lambda *_: (Torque(True, 1.0),), "effect Acting: link must be 1 or 2; got True"),
        (lambda c, *_: (Force(c.D, 1.0),), "components must be a pair of numbers; got 1"),
        (lambda c, *_: (Force(c.D, (1.0, 2.0, 3.0)),), "components must be a pair of numbers; got"),
        (lambda c, *_: (Force(c.D, (1.0,)),), "components must be a pair of numbers; got"),
        (lambda *_: (Force((2, 1.0, 0.0), (1.0, 2.0)),), "point must be a Point; got"),
        (
            lambda *_: (Force(Point(0, 1.0, 0.0), (1.0, 2.0)),),
            "effect Acting: point: link must be 1 or 2; got 0",
        ),
        (lambda c, q, u, t: 1 / 0, "raised ZeroDivisionError: division by zero"),
        (lambda chain: (), "raised TypeError: "),
    ],
)
def test_wrong_functions_of_loads_are_refused(function, words):
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(Acting(function),))


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_of_the_library_follow_the_rules_for_those_of_users(name):
    effect = effect_class(name)(**GOOD[name])
    assert custom.checked(effect, SCENE.chain) is effect


@pytest.mark.parametrize("name", EFFECTS)
def test_effects_of_the_library_are_smooth_at_rest(name):
    """The check of their formulas does not see a kink, such as that of −c w |w| at w = 0."""
    effect = effect_class(name)(**GOOD[name])
    if not isinstance(effect, ContactEffect):
        scene = Scene(SCENE.chain, (0.0, 0.0), (0.0, 0.0), 0.1, (effect,))
        assert simulate(scene).met


class WithEnergy(Gravity):
    """An effect whose potential energy is any object."""

    def __init__(self, energy):
        object.__setattr__(self, "energy", energy)

    def potential_energy(self, chain, q):
        return self.energy


@pytest.mark.parametrize("energy", [None, "x", (1.0, 2.0)])
def test_a_potential_energy_that_is_no_number_is_refused(energy):
    with pytest.raises(ParameterError, match="WithEnergy: potential_energy must be a number; got"):
        replace(SCENE, effects=(WithEnergy(energy),))


class WithRotors(RotorEffect):
    """An effect whose rotors are those of a function of the chain."""

    def __init__(self, function):
        self.function = function

    def with_rotors(self, chain):
        return self.function(chain)


@pytest.mark.parametrize(
    ("function", "sentence"),
    [
        (lambda chain: None, "effect WithRotors: with_rotors must be a Chain; got None"),
        (lambda chain: 5, "effect WithRotors: with_rotors must be a Chain; got 5"),
        (lambda chain: 1 / 0, "effect WithRotors: with_rotors raised ZeroDivisionError"),
    ],
)
def test_rotors_that_make_no_chain_are_refused(function, sentence):
    with pytest.raises(ParameterError, match=sentence):
        replace(SCENE, effects=(WithRotors(function),))


class WithoutInertia(MotorInertia):
    """An effect that does not set the fields of its class."""

    def __init__(self):
        pass


def test_a_field_that_is_not_set_is_one_sentence():
    with pytest.raises(ParameterError, match="WithoutInertia: a field raised AttributeError: "):
        replace(SCENE, effects=(WithoutInertia(),))


class Timeless(Effect):
    """An effect whose times cannot be had."""

    @property
    def shortest_time(self):
        return 1 / 0

    def loads(self, chain, q, u, t=0.0):
        return ()


def test_a_time_that_raises_an_error_is_one_sentence():
    with pytest.raises(ParameterError, match="Timeless: shortest_time raised ZeroDivisionError"):
        replace(SCENE, effects=(Timeless(),))


@pytest.mark.parametrize("effect", [3, "gravity", None, Gravity, object(), Acting])
def test_objects_that_are_no_effects_are_refused(effect):
    words = "effects must be a sequence of instances of twolink.effects.Effect; got .* in it"
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(effect,))


@pytest.mark.parametrize("time", [0.0, -1e-3, math.nan, "1 ms", None])
def test_a_declared_shortest_time_is_a_positive_number(time):
    @dataclass(frozen=True)
    class Quick(Effect):
        @property
        def shortest_time(self):
            return time

        def loads(self, chain, q, u, t=0.0):
            return motor_loads(1.0, 0.0)

    with pytest.raises(ParameterError, match="effect Quick: shortest_time must be"):
        Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, (Quick(),))


def test_effects_that_cannot_be_copied_or_compared_are_refused():
    locked = Acting(lambda *_: ())
    locked.lock = threading.Lock()
    with pytest.raises(ParameterError, match="Acting must be an object that copy"):
        replace(SCENE, effects=(locked,))

    @dataclass
    class Field(Effect):
        values: object

        def loads(self, chain, q, u, t=0.0):
            return ()

    with pytest.raises(ParameterError, match="effect Field must be an object that can be compared"):
        replace(SCENE, effects=(Field(np.zeros(3)),))


class Everything(Effect):
    """All that loads may do, and the same by hand for floats."""

    def __init__(self, size=1.0):
        self.size = size

    def loads(self, chain, q, u, t=0.0):
        vx, vy = velocity(chain, q, u, chain.D)
        drag = Force(chain.D, (-0.1 * vx * vx * vx, np.float64(-0.1) * vy**3))
        tau = self.size * sin(3 * t) * exp(-(u[0] ** 2)) / sqrt(1 + u[1] * u[1]) - tanh(u[0] / 2)
        return (drag, *motor_loads(tau, cos(q[0]) - 0.5))


@pytest.mark.slow_but_first
@pytest.mark.parametrize("method", ["taylor", "DOP853", "rk4", "gauss-legendre-4", "LSODA"])
def test_all_functions_of_arithmetic_act_by_every_method(method):
    scene = replace(SCENE, effects=(Gravity(), Everything()), accuracy=1e-6, method=method)
    expected = simulate(replace(scene, method="taylor"), accuracy=1e-11)
    found = simulate(scene)
    assert found.met
    assert found.q == pytest.approx(expected.q, abs=1e-6)


def test_a_changed_effect_is_never_served_from_a_cache():
    wind = Everything(1.0)
    first = simulate(replace(SCENE, effects=(wind,)))
    wind.size = 5.0
    second = simulate(replace(SCENE, effects=(wind,)))
    assert abs(first.q - second.q).max() > 1e-3
    fresh = simulate(replace(SCENE, effects=(Everything(5.0),)))
    assert (second.q == fresh.q).all()


def test_a_scene_keeps_the_effect_that_it_was_given():
    wind = Everything(1.0)
    scene = replace(SCENE, effects=(wind,))
    before = simulate(scene)
    wind.size = 5.0
    assert (simulate(scene).q == before.q).all()
    assert (before.at(before.t)[0] == before.q).all()


def test_a_changed_effect_of_a_scene_is_simulated_anew_and_old_trajectories_stay():
    scene = replace(SCENE, effects=(Everything(1.0),))
    before = simulate(scene)
    scene.effects[0].size = 5.0
    assert abs(simulate(scene).q - before.q).max() > 1e-3
    assert (before.at(before.t)[0] == before.q).all()
    assert before.scene.effects[0].size == 1.0


def test_a_frozen_effect_is_kept_as_it_is():
    @dataclass(frozen=True)
    class Steady(Effect):
        tau: float

        def loads(self, chain, q, u, t=0.0):
            return motor_loads(self.tau, 0.0)

    effect = Steady(1.0)
    scene = replace(SCENE, effects=[effect])
    assert scene.effects[0] is effect
    simulate(scene)
    assert simulate(replace(scene, q=(0.1, 0.1))).statistics.compile_seconds < 0.02


def test_functions_of_arithmetic_are_all_known():
    """All functions for users are tried, except the sign, which is not smooth."""
    offered = {n for n in vars(arithmetic) if n in ("sin", "cos", "sqrt", "exp", "tanh", "sign")}
    assert offered == {"sin", "cos", "sqrt", "exp", "tanh", "sign"}


@dataclass(frozen=True)
class Pieces(PiecewiseEffect):
    """Gravity that is replaced by another effect at given times."""

    times: tuple
    other: object = Gravity(1.0)

    @property
    def discontinuities(self):
        return self.times

    def piece_at(self, t):
        return Gravity() if t < 0.2 else self.other


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (Pieces((0.2, 0.1)), "discontinuities must be increasing finite times in s; got "),
        (Pieces((0.2, 0.2)), "discontinuities must be increasing"),
        (Pieces((math.nan,)), "discontinuities must be increasing"),
        (Pieces(("0.2",)), "a discontinuity must be a number; got '0.2'"),
        (Pieces((0.2,), JointFriction((1.0, 1.0))), "piece_at must return an effect of smooth"),
        (Pieces((0.2,), MotorInertia((1.0, 1.0))), "without friction, contact, rotors or pieces"),
        (Pieces((0.2,), 3), "piece_at must return .*; got 3"),
    ],
)
def test_pieces_must_be_smooth_loads_in_the_order_of_time(effect, words):
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(effect,))
    assert simulate(replace(SCENE, effects=(Pieces((0.2,)),)), samples=3).met


class Failing(Pieces):
    """An effect whose methods raise errors."""

    def piece_at(self, t):
        return {}[t]


class FailingElements(Elements):
    """An effect whose elements cannot be computed."""

    def contact_elements(self, chain):
        return 1 / 0


@pytest.mark.parametrize(
    ("effect", "words"),
    [
        (Failing((0.2,)), "effect Failing: piece_at raised KeyError: 0"),
        (FailingElements(()), "contact_elements raised ZeroDivisionError: division by zero"),
    ],
)
def test_an_error_of_a_method_is_one_sentence(effect, words):
    with pytest.raises(ParameterError, match=words):
        replace(SCENE, effects=(effect,))


def test_the_loads_of_every_piece_are_tried():
    later = a_torque(lambda q, u, t: abs(u[0]))
    with pytest.raises(ParameterError, match="in `abs"):
        replace(SCENE, effects=(Pieces((0.2,), later),))


class Unheard(Effect):
    """An effect with a method of another contract."""

    def loads(self, chain, q, u, t=0.0):
        return ()


@pytest.mark.parametrize(
    ("method", "contract"),
    [
        ("contact_elements", "ContactEffect"),
        ("piece_at", "PiecewiseEffect"),
        ("potential_energy", "ConservativeEffect"),
        ("with_rotors", "RotorEffect"),
    ],
)
def test_a_method_that_would_have_no_effect_is_refused(method, contract):
    own = type("Unheard", (Unheard,), {method: lambda self, *given: ()})
    with pytest.raises(ParameterError, match=f"must inherit from {contract} for its {method}"):
        replace(SCENE, effects=(own(),))


def test_contact_in_pieces_is_refused():
    """The pieces of an effect have loads alone: the contact would be gone."""

    class Both(ContactEffect, PiecewiseEffect):
        discontinuities = (0.1,)

        def piece_at(self, t):
            return Unheard()

        def contact_elements(self, chain):
            return ()

        def smooth_loads(self, chain, q, u, t=0.0):
            return ()

        loads = smooth_loads

    with pytest.raises(ParameterError, match="ContactEffect or a PiecewiseEffect, not both"):
        replace(SCENE, effects=(Both(),))
