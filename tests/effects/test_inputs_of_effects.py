"""Effects hold immutable values, and name the fault of their input."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
import sympy

from twolink.effects import EFFECTS, effect_class
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface
from twolink.errors import ParameterError
from twolink.values import is_value

GOOD = {
    "gravity": {"g": 9.81, "direction": (0.0, 1.0)},
    "end_force": {"normal": 1.0, "friction": 0.1, "static": 0.2},
    "joint_torque": {"torque": (1.0, 2.0), "amplitude": (0.1, 0.2)},
    "sampled_torque": {
        "times": (0.0, 1.0),
        "A": (1.0, 2.0),
        "B": (0.0, 1.0),
        "interpolation": "linear",
    },
    "joint_damping": {"coefficient": (0.1, 0.2)},
    "joint_friction": {"kinetic": (0.1, 0.2), "static": (0.2, 0.3)},
    "motor_inertia": {"inertia": (0.1, 0.1), "ratio": (10.0, 5.0), "carried": True},
    "joint_stop": {"joint": "A", "lower": -1.0, "upper": 1.0},
    "surface": {"point": (0.0, 1.0), "normal": (0.0, -1.0), "on": ("D",), "name": "floor"},
    "compliant_surface": {
        "point": (0.0, 1.0),
        "normal": (0.0, -1.0),
        "law": "hertz",
        "stiffness": 1e4,
        "on": ("D",),
    },
    "joint_spring": {"stiffness": (1.0, 2.0)},
    "pd_control": {"target": (0.1, 0.2), "proportional": (1.0, 2.0)},
    "end_drag": {"coefficient": 0.1},
}
FIELDS = [(name, field) for name, fields in GOOD.items() for field in fields]
WRONG = [None, "ab", object(), float, [None, None], ("a", "b"), np.eye(2), {"x": 1}, b"1"]


def test_every_effect_has_an_example():
    assert set(GOOD) == set(EFFECTS)


@pytest.mark.parametrize(
    ("name", "field"),
    [
        ("end_force", "friction"),
        ("end_force", "static"),
        ("joint_stop", "lower"),
        ("surface", "restitution"),
        ("compliant_surface", "stiffness"),
    ],
)
def test_numbers_of_contacts_are_real(name, field):
    with pytest.raises(ParameterError, match=f": {field} must be a real number; got x"):
        effect_class(name)(**{**GOOD[name], field: sympy.Symbol("x")})


@pytest.mark.parametrize(("name", "field"), FIELDS)
def test_wrong_values_are_refused_in_one_sentence(name, field):
    """Or accepted, where None stands for something, and any string is a name."""
    for value in WRONG:
        accepted = value is None or (field == "name" and isinstance(value, str))
        try:
            made = effect_class(name)(**{**GOOD[name], field: value})
        except ParameterError as error:
            sentence = str(error)
            assert "\n" not in sentence
            assert " must be " in sentence or "allowed" in sentence
        else:
            assert accepted
            assert is_value(made)


@pytest.mark.parametrize("name", GOOD)
def test_lists_arrays_and_generators_are_copied(name):
    expected = effect_class(name)(**GOOD[name])
    for kind in (list, iter, _array):
        fields = {k: kind(v) if isinstance(v, tuple) else v for k, v in GOOD[name].items()}
        made = effect_class(name)(**fields)
        assert made == expected
        assert is_value(made)


def _array(values):
    return list(values) if isinstance(values[0], str) else np.array(values)


def test_later_changes_to_the_arguments_do_not_change_the_effect():
    times, A, B = np.array([0.0, 1.0]), [1.0, 2.0], [0.0, 1.0]
    torque = SampledTorque(times, A, B, "linear")
    A[0], times[1] = 99.0, 5.0
    assert torque == SampledTorque((0.0, 1.0), (1.0, 2.0), (0.0, 1.0), "linear")
    assert torque.loads(None, None, None, 0.0) == SampledTorque(
        (0.0, 1.0), (1.0, 2.0), (0.0, 1.0), "linear"
    ).loads(None, None, None, 0.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gravity(None), "gravity: g must be a number; got None"),
        (lambda: Gravity("9.81"), "gravity: g must be a number; got '9.81'"),
        (lambda: Gravity(10**400), "gravity: g must be a number that float64 can hold; got 1"),
        (lambda: JointDamping("ab"), "joint damping: coefficient must be a pair of numbers; got"),
        (lambda: JointDamping(0.1), "joint damping: coefficient must be a pair of numbers; got 0"),
        (lambda: JointDamping((0.1,)), "joint damping: coefficient must be a pair of numbers; got"),
        (lambda: JointFriction((0.1, [0.2])), r"joint friction: kinetic\[1\] must be a number"),
        (lambda: Surface((0, 1), (0, -1), on="D"), "surface: on must be a sequence of strings"),
        (lambda: Surface((0, 1), (0, -1), law=["newton"]), "surface: law must be a string; got"),
        (lambda: JointDamping(np.float32((-1, 0))), r"joint damping at A must be .*; got -1\.0"),
    ],
)
def test_sentences(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


def test_long_doubles_become_the_fractions_that_they_are():
    third = np.longdouble(1) / 3
    found = JointDamping((third, np.longdouble(0.5))).coefficient
    assert [type(number) for number in found] == [Fraction, float]
    assert np.longdouble(found[0].numerator) / np.longdouble(found[0].denominator) == third
    with pytest.raises(ParameterError, match=r"joint damping at A must be .*; got inf"):
        JointDamping((np.longdouble(np.inf), 0.0))


def test_a_generator_of_a_thousand_numbers_is_no_pair():
    with pytest.raises(ParameterError):
        JointDamping(itertools.islice(itertools.repeat(0.1), 1000))
