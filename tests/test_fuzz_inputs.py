"""Whatever is given to the Python API: a value that can be hashed, or one sentence."""

import datetime
import math
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.effects.test_inputs_of_effects import GOOD
from twolink.accuracy.drift import energy_drift
from twolink.accuracy.enclosure import enclosure
from twolink.accuracy.reference import reference
from twolink.accuracy.study import study
from twolink.chain import Chain
from twolink.data import data_path
from twolink.effects import effect_class
from twolink.effects.gravity import Gravity
from twolink.errors import TwolinkError
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.simulation.effects_cost import effects_cost
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.urdf.description import read_description
from twolink.urdf.repair import repair_file
from twolink.values import is_value
from twolink.verification import verify
from twolink.verification.contact import verify_contact
from twolink.viz import display

LEAVES = st.one_of(
    st.floats(width=32),
    st.integers(-5, 5),
    st.sampled_from([10**400, -0.0, 5e-324, 1e308, math.nan, math.inf, None, True, 1j, "", "D"]),
    st.sampled_from(
        [object(), float, b"x", np.float32(0.5), np.int64(3), np.True_, len, Gravity()]
    ),
    st.text(max_size=3),
)
JUNK = st.recursive(
    LEAVES,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.tuples(inner, inner),
        st.tuples(st.floats(0.1, 2), st.floats(0.1, 2)),
        st.lists(st.floats(), max_size=3).map(np.array),
        st.dictionaries(st.text(max_size=1), inner, max_size=2),
        st.lists(inner, max_size=3).map(iter),
    ),
    max_leaves=6,
)
SCENE = {
    "chain": Chain.uniform_bars(),
    "q": (0.1, 0.2),
    "u": (0.0, 0.0),
    "duration": 1.0,
    "effects": (Gravity(),),
    "accuracy": 1e-9,
    "method": "taylor",
    "title": "t",
    "shows": "s",
}
CHAIN = {
    "mass": (1.0, 1.0),
    "length": (1.0, 1.0),
    "centre": ((0.5, 0.0), (0.5, 0.0)),
    "inertia": (0.1, 0.1),
    "rotors": (),
}
MAKERS = {name: (effect_class(name), fields) for name, fields in GOOD.items()}
MAKERS |= {"chain": (Chain, CHAIN), "scene": (Scene, SCENE)}


@pytest.mark.slow
@pytest.mark.parametrize("name", MAKERS)
@settings(max_examples=60)
@given(data=st.data())
def test_arbitrary_arguments_make_a_value_or_are_refused(name, data):
    maker, fields = MAKERS[name]
    changed = data.draw(st.sets(st.sampled_from(sorted(fields)), min_size=1, max_size=2))
    given_fields = {**fields, **{field: data.draw(JUNK, label=field) for field in changed}}
    try:
        made = maker(**given_fields)
    except TwolinkError as error:
        sentence = str(error)
    else:
        assert is_value(made)
        assert hash(made) == hash(made)
        return
    assert "\n" not in sentence
    assert len(sentence) < 700


ODD = [
    *[0, 1, -1, -0.0, 5e-324, 1e308, math.nan, math.inf, 10**400, 10**308, 2**70, None, True, 1j],
    *["", "D", b"x", object(), float, len, [], [1], {}, {1}, Gravity(), Decimal(1), Fraction(1, 3)],
    *[np.float32(0.5), np.longdouble(2), np.True_, np.array(2.0), np.zeros(2), np.zeros((2, 2))],
    *[np.datetime64("2020"), datetime.timedelta(1), np.array(["a", "b"])],
]


@pytest.mark.parametrize("name", MAKERS)
def test_odd_values_alone_and_in_pairs(name):
    maker, fields = MAKERS[name]
    pairs = [(odd, 0.5) for odd in ODD] + [((odd, 0.1), (0.5, 0.5)) for odd in ODD]
    for field in fields:
        for value in [*ODD, *pairs, *([odd] for odd in ODD), iter(())]:
            try:
                made = maker(**{**fields, field: value})
                # A chain of arrays is for single evaluations: it cannot be the key of a cache.
                assert name == "chain" or isinstance(hash(made), int)
            except TwolinkError as error:
                sentence = str(error)
                assert sentence.count("\n") == 0


FALL = Scene(**SCENE)
SWINGS = Scene.load("small_swings")
TRAJECTORY = simulate(FALL, samples=3)
URDF = data_path("twolink.urdf")


@pytest.mark.parametrize("wrong", [3, None, b"a", object(), ["a"], iter("a"), np.array(0.5)])
@pytest.mark.parametrize(
    "call",
    [
        Scene.load,
        Trajectory.load,
        TRAJECTORY.save,
        TRAJECTORY.record,
        Chain.from_urdf,
        read_planar_urdf,
        read_description,
        repair_file,
        lambda path: Chain.uniform_bars().to_urdf(path if path is not None else 3),
        lambda path: verify(path if path is not None else 3),
        lambda path: verify_contact(path if path is not None else 3),
        lambda folder: Scene.parse(FALL.to_toml(), folder=folder),
    ],
)
def test_arguments_that_are_no_paths_are_refused(call, wrong):
    with pytest.raises(TwolinkError, match=r"must be a path; got "):
        call(wrong)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: Scene.parse((1, 2)), r"text must be a string; got \(1, 2\)"),
        (lambda: parse_planar_urdf(b"<robot/>"), r"text must be a string; got b'<robot/>'"),
        (lambda: read_planar_urdf(URDF, tip=3), "tip must be a string; got 3"),
        (lambda: read_planar_urdf(URDF, gravity=3), "gravity must be three finite numbers"),
        (lambda: read_planar_urdf(URDF, gravity=(0, "g", 1)), r"gravity\[1\] must be a number"),
        (lambda: Chain.uniform_bars().to_urdf(name=3), "name must be a string; got 3"),
        (lambda: Chain.uniform_bars().to_urdf(name=""), "name must be printable text; got ''"),
        (lambda: simulate(FALL, limits=3600), "limits must be a Limits; got 3600"),
        (
            lambda: simulate(FALL, progress="bar"),
            "progress must be a function of name and share, or",
        ),
        (
            lambda: verify(states=2, progress=3),
            "progress must be a function of share, or None",
        ),
        (
            lambda: verify(states=10**400),
            "states must be a whole number of 9223372036854775807 or less; got 1000",
        ),
        (lambda: verify(states=2, limits=3600), "limits must be a Limits; got 3600"),
        (lambda: study(FALL, engines=np.array([1, 2])), r"engines must be True or False; got arr"),
        (lambda: simulate(FALL, progress=Scene), "progress must be a function of name and share"),
        (lambda: verify(states=2, seed=(1, 2)), "seed must be a whole number of 0 or more"),
        (lambda: verify_contact(states=2, seed="1"), "seed must be a whole number of 0 or more"),
        (lambda: reference(3), "scene must be a Scene; got 3"),
        (lambda: reference(FALL, limits=None), "limits must be a Limits; got None"),
        (lambda: enclosure((FALL,)), r"scene must be a Scene; got \(<Scene"),
        (lambda: enclosure(FALL, np.array(0.5)), r"digits must be a whole number .* array\(0\.5\)"),
        (lambda: study(FALL, methods="rk4"), "methods must be a sequence of strings; got 'rk4'"),
        (lambda: study(FALL, methods=(4,)), r"methods\[0\] must be a string; got 4"),
        (lambda: study(FALL, budget="1"), "budget must be a number; got '1'"),
        (lambda: study(FALL, budget=math.nan), "budget must be a positive number; got nan"),
        (lambda: energy_drift(None), "scene must be a Scene; got None"),
        (lambda: energy_drift(FALL, seconds=np.timedelta64(1, "s")), "seconds must be a number"),
        (lambda: effects_cost("drop"), "scene must be a Scene; got 'drop'"),
        (lambda: TRAJECTORY.at(0.1, np.zeros(2)), "side must be 'left' or 'right'; got array"),
        (lambda: TRAJECTORY.at([np.ma.masked]), "times must be a number of seconds, or a row of"),
        (lambda: TRAJECTORY.at(np.ma.array([0.1], mask=[True])), "times must be a number of secon"),
        (lambda: read_planar_urdf("\udcff\n"), r"^\\xff\\n: there is no file"),
        (lambda: energy_drift(SWINGS, seconds=1e308), "the time must be 100 s to 1e[+]12 s; got"),
        (lambda: TRAJECTORY.position("D"), "point must be a Point; got 'D'"),
        (lambda: TRAJECTORY.velocity((1, 2)), r"point must be a Point; got \(1, 2\)"),
        (lambda: TRAJECTORY.plot([]), r"kind must be a string; got \[\]"),
        (lambda: TRAJECTORY.plot("angles", FALL), "a motion must be a Trajectory; got <Scene"),
        (lambda: TRAJECTORY.plot("angles", names=3), "names must be a sequence of strings; got 3"),
        (lambda: TRAJECTORY.plot("angles", theme=[]), r"theme must be a string; got \[\]"),
        (lambda: TRAJECTORY.record("never.html", fps="30"), "fps must be a number; got '30'"),
        (lambda: TRAJECTORY.record("never.html", fps=math.nan), "fps must be 0.01 to 240; got nan"),
        (lambda: TRAJECTORY.record("never.html", speed=None), "speed must be a number; got None"),
        (lambda: TRAJECTORY.record("never.html", theme={}), "theme must be a string; got {}"),
        (lambda: TRAJECTORY.record("never.png", at="1"), "at must be a number; got '1'"),
        (
            lambda: TRAJECTORY.record("never.mp4", size=640),
            "size must be a pair of numbers; got 64",
        ),
        (lambda: TRAJECTORY.record("never.mp4", size=(640, "a")), r"size\[1\] must be a number; g"),
        (lambda: TRAJECTORY.record("never.mp4", size=(640.5, 360)), "size must be a whole number"),
        (lambda: display.film(TRAJECTORY, FALL), "a ghost must be a Trajectory; got <Scene"),
        (lambda: replace(TRAJECTORY, q="q"), "q must be an array of numbers; got 'q'"),
        (lambda: replace(TRAJECTORY, t=iter((1,))), "t must be an array of numbers; got <tuple_i"),
    ],
)
def test_misuse_is_one_sentence(call, words):
    with pytest.raises(TwolinkError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("accuracy", [1e-300, 1e-14])
def test_no_tolerance_is_asked_of_scipy_that_it_does_not_take(accuracy):
    """It would warn, and take another one."""
    assert not simulate(FALL, method="DOP853", accuracy=accuracy, samples=3).met


def test_a_urdf_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    file = tmp_path / "arm.urdf"
    file.write_text("before")

    def full(file):
        raise OSError(28, "full")

    monkeypatch.setattr("twolink.files._sync", full)
    with pytest.raises(TwolinkError, match=r"arm\.urdf: cannot be written \(full\)"):
        Chain.uniform_bars().to_urdf(file)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["before"]


def test_counts_of_numpy_are_whole_numbers_of_python():
    """Those of 8 bits would overflow in the memory that is estimated from them."""
    assert len(simulate(FALL, samples=np.uint8(200)).t) == 200
