"""Scenes hold values: copies of their arguments, or one sentence on the fault."""

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

from twolink.chain import Chain, Rotor
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.errors import ParameterError, TwolinkError
from twolink.scene import Scene
from twolink.simulation import simulate

SCENE = Scene(Chain.uniform_bars(), (0.3, 0.5), (0.2, -0.1), 0.5, (Gravity(),))


@pytest.mark.parametrize("kind", [tuple, list, iter, lambda x: (e for e in x)])
def test_effects_may_be_any_sequence(kind):
    scene = replace(SCENE, effects=kind([Gravity(), JointDamping((0.1, 0.1))]))
    assert scene.effects == (Gravity(), JointDamping((0.1, 0.1)))
    assert hash(scene)
    assert simulate(scene).effects == ("Gravity", "JointDamping")


def test_a_start_is_copied():
    q = np.array([0.3, 0.5])
    scene = replace(SCENE, q=q, u=[0.2, -0.1], duration=np.float64(0.5))
    q[0] = 99.0
    assert scene == SCENE
    assert type(scene.q) is type(scene.u) is tuple
    assert type(scene.duration) is float


def test_a_chain_is_copied():
    mass = np.array([1.0, 2.0])
    chain = Chain.uniform_bars(mass, [1.0, 1.0])
    mass[0] = 99.0
    assert chain == Chain.uniform_bars((1.0, 2.0), (1.0, 1.0))
    centre = np.array([[0.5, 0.0], [0.5, 0.0]])
    same = Chain([1.0, 2.0], (1.0, 1.0), centre, iter(chain.inertia))
    centre[0, 0] = 9.0
    assert same == chain
    assert hash(same) == hash(chain)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"chain": None}, "chain must be a Chain; got None"),
        ({"q": 0.3}, "q must be a pair of numbers; got 0.3"),
        ({"q": (0.1, 0.2, 0.3)}, "q must be a pair of numbers; got (0.1, 0.2, 0.3)"),
        ({"q": "ab"}, "q must be a pair of numbers; got 'ab'"),
        ({"u": (0.1, "b")}, "u[1] must be a number; got 'b'"),
        ({"duration": "1"}, "duration must be a number; got '1'"),
        ({"duration": np.float32(-1)}, "run: duration must be positive and finite; got -1.0"),
        ({"duration": None}, "duration must be a number; got None"),
        ({"accuracy": True}, "accuracy must be a number; got True"),
        ({"method": ["taylor"]}, "method must be a string; got ['taylor']"),
        ({"title": None}, "title must be a string; got None"),
        (
            {"effects": Gravity()},
            "effects must be a sequence of effects, such as (Gravity(),); got "
            "Gravity(g=9.81, direction=(0.0, 1.0))",
        ),
        (
            {"effects": {Gravity()}},
            "effects must be a sequence of effects, such as (Gravity(),); got "
            "{Gravity(g=9.81, direction=(0.0, 1.0))}",
        ),
    ],
)
def test_wrong_fields_are_refused_on_construction(change, words):
    with pytest.raises(ParameterError) as caught:
        replace(SCENE, **change)
    assert str(caught.value) == words


@pytest.mark.parametrize("rotors", [3, (1.0,), "ab"])
def test_rotors_of_another_type_are_refused(rotors):
    with pytest.raises(ParameterError, match="rotors must be a sequence of rotors; got"):
        replace(SCENE.chain, rotors=rotors)
    assert replace(SCENE.chain, rotors=[Rotor(0.1, (1.0, 0.0))]).rotors == (Rotor(0.1, (1.0, 0.0)),)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"accuracy": "1e-6"}, "accuracy must be a number; got '1e-6'"),
        ({"accuracy": np.nan}, "accuracy must be positive and finite; got nan"),
        ({"samples": 2.5}, "samples must be a whole number of 2 or more; got 2.5"),
        ({"samples": 1}, "samples must be a whole number of 2 or more; got 1"),
        ({"samples": "9"}, "samples must be a whole number of 2 or more; got '9'"),
        ({"method": None, "formulation": ["kane"]}, "formulation must be a string; got ['kane']"),
        ({"method": 3}, "method must be a string; got 3"),
    ],
)
def test_wrong_arguments_of_simulate(change, words):
    with pytest.raises(TwolinkError) as caught:
        simulate(SCENE, **change)
    assert str(caught.value) == words


def test_simulate_refuses_an_argument_that_is_no_scene():
    with pytest.raises(ParameterError, match=r"scene must be a Scene; got 'free_fall\.toml'"):
        simulate("free_fall.toml")


def test_trajectories_are_compared_by_their_content():
    first, second = simulate(SCENE), simulate(SCENE)
    assert first == second
    assert hash(first) == hash(second)
    assert first != simulate(replace(SCENE, q=(0.3, 0.51)))
    assert first != replace(second, q=second.q + 1e-15)
    assert first != "a trajectory"
    assert first in [second]


@pytest.mark.parametrize(
    "copied", [lambda t: pickle.loads(pickle.dumps(t)), copy.deepcopy, copy.copy, replace]
)
def test_copies_of_trajectories_cannot_be_written_to(copied):
    trajectory = simulate(SCENE)
    found = copied(trajectory)
    assert found == trajectory
    for array in (found.t, found.q, found.u):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_a_trajectory_leaves_the_arrays_of_its_maker_alone():
    trajectory = simulate(SCENE)
    mine = np.array(trajectory.q)
    made = replace(trajectory, q=mine)
    mine[...] = 0
    assert (made.q == trajectory.q).all()


@pytest.mark.parametrize(
    ("times", "side", "words"),
    [
        ("abc", "right", "times must be a number of seconds, or a row of them; got 'abc'"),
        ([[0.1]], "right", r"times must be .*; got \[\[0.1\]\]"),
        (0.1, "middle", "side must be 'left' or 'right'; got 'middle'"),
        (np.nan, "right", "times must be .*; got times from nan"),
    ],
)
def test_wrong_times_of_a_trajectory(times, side, words):
    with pytest.raises(TwolinkError, match=words):
        simulate(SCENE).at(times, side)
