import json
import math
from dataclasses import dataclass, replace
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.strategies import EFFECT_STRATEGIES, scenes
from tests.urdf.drawing import arm_with_elbow
from tests.verification.chains import GENERAL
from twolink.chain import Chain, Rotor
from twolink.cli import app
from twolink.data import data_path
from twolink.effects import EFFECTS, Effect, effect_class
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.errors import ParameterError, SceneError
from twolink.integration.methods import METHODS
from twolink.scene import LARGEST_FILE, Scene, scene_model
from twolink.simulation import simulate

TEXT = """
title = "A test"
[chain]
mass = [1.0, 2]
length = [1.0, 0.5]
[start]
q = [0.1, 0.2]
[run]
duration = 3.0
[effects.gravity]
g = 9.81
[effects.joint_damping]
coefficient = [0.1, 0.0]
"""

LISTED = ", ".join(METHODS)
SCENES = sorted(data_path("scenes").rglob("*.toml"))


def refusal_from(source, load):
    """Return the one sentence, which names the source, with which a scene is refused."""
    with pytest.raises(SceneError) as caught:
        load()
    sentence = str(caught.value)
    assert sentence.startswith(f"{source}: ")
    assert "\n" not in sentence
    return sentence


def test_a_parsed_scene_has_the_values_of_its_file():
    scene = Scene.parse(TEXT)
    assert scene == Scene(
        chain=Chain.uniform_bars((1.0, 2.0), (1.0, 0.5)),
        q=(0.1, 0.2),
        u=(0.0, 0.0),
        duration=3.0,
        effects=(Gravity(9.81), JointDamping((0.1, 0.0))),
        title="A test",
    )


def test_an_effect_may_act_twice():
    twice = TEXT.replace(
        "[effects.gravity]\ng = 9.81", "[[effects.gravity]]\n[[effects.gravity]]\ng=1.0"
    )
    assert Scene.parse(twice).effects[:2] == (Gravity(), Gravity(1.0))


def test_a_scene_without_effects_has_none():
    assert Scene.parse(TEXT.partition("[effects")[0]).effects == ()


def test_the_chain_may_be_a_urdf_beside_the_scene(tmp_path):
    Chain.uniform_bars().to_urdf(tmp_path / "arm.urdf")
    file = tmp_path / "scene.toml"
    file.write_text(TEXT.replace("mass = [1.0, 2]\nlength = [1.0, 0.5]", 'urdf = "arm.urdf"'))
    assert Scene.load(file).chain == Chain.uniform_bars()


DRIVEN = arm_with_elbow(
    '<limit lower="-1" upper="2" effort="1" velocity="1"/>', '<dynamics damping="0.3"/>'
)


def with_urdf(folder: Path, more: str = "", urdf: str = DRIVEN) -> Path:
    """Return a scene file beside a URDF, with more lines in its [chain] table."""
    (folder / "arm.urdf").write_text(urdf)
    numbers = "mass = [1.0, 2]\nlength = [1.0, 0.5]"
    file = folder / "scene.toml"
    file.write_text(TEXT.replace(numbers, f'urdf = "arm.urdf"\n{more}'))
    return file


def test_a_urdfs_joints_act_where_the_scene_asks_for_them(tmp_path):
    named = (Gravity(9.81), JointDamping((0.1, 0.0)))
    plain = Scene.load(with_urdf(tmp_path))
    assert plain.effects == named
    asked = Scene.load(with_urdf(tmp_path, 'effects = ["limits", "friction", "damping"]'))
    stop = JointStop("B", -1.0, 2.0)
    assert asked.effects == (*named, stop, JointDamping((0.0, 0.3)))
    assert replace(asked, effects=named) == plain


def test_an_empty_list_of_urdf_effects_adds_none(tmp_path):
    assert Scene.load(with_urdf(tmp_path, "effects = []")) == Scene.load(with_urdf(tmp_path))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (
            'effects = ["limit"]',
            "got 'limit' (did you mean 'limits'?)",
        ),
        ("effects = [1]", "must be 'damping', 'friction' or 'limits'; got 1"),
        ('effects = "damping"', "chain.effects must be a list; got 'damping'"),
        (
            'effects = ["damping", "limits", "damping"]',
            "chain.effects must be a list of words, each at most once; got ('damping', 'limits', ",
        ),
        ('effects = ["friction"]', "joints 'shoulder', 'elbow' have no friction"),
        ('effects = ["damping"]\nmass = [1.0, 1.0]', "must have urdf or mass, not both"),
    ],
)
def test_wrong_lists_of_urdf_effects_are_refused(tmp_path, more, words):
    file = with_urdf(tmp_path, more)
    assert words in refusal_from(str(file), lambda: Scene.load(file))


def test_the_schema_lists_the_effects_of_a_urdf():
    chain = scene_model(()).model_json_schema()["$defs"]["Chain"]["properties"]
    words, nothing = chain["effects"]["anyOf"]
    assert words["items"]["enum"] == ["damping", "friction", "limits"]
    assert words["uniqueItems"]
    assert nothing == {"type": "null"}
    assert chain["effects"]["description"]


def test_any_chain_may_be_given():
    general = TEXT.replace(
        "[start]", "centre = [[0.3, 0.1], [0.2, -0.1]]\ninertia = [0.1, 0.2]\n[start]"
    )
    assert Scene.parse(general).chain.centre == ((0.3, 0.1), (0.2, -0.1))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("g = 9.81", "h = 9.81", "a key of effects.gravity must be one of g, direction; got 'h'"),
        (
            "g = 9.81",
            'g = "9.81"',
            "effects.gravity.g must be a number, without quotes; got '9.81'",
        ),
        ("g = 9.81", "g = nan", "effects.gravity.g must be a finite number; got nan"),
        ("g = 9.81", "g = true", "effects.gravity.g must be a valid number; got True"),
        ("effects.gravity", "effects.gravitas", "got 'gravitas' (did you mean 'gravity'?)"),
        ("duration = 3.0", "duration = -3.0", "run.duration must be greater than 0; got -3.0"),
        ("duration = 3.0", "duration = inf", "run.duration must be a finite number; got inf"),
        ("duration = 3.0", "", "key 'run.duration' is missing"),
        (
            "duration = 3.0",
            'duration = 3.0\nmethod = "DOP835"',
            f"run.method must be one of {LISTED}; got 'DOP835' (did you mean 'DOP853'?)",
        ),
        (
            "duration = 3.0",
            "duration = 3.0\naccuracy = 0.0",
            "run.accuracy must be greater than 0; got 0.0",
        ),
        ("[1.0, 2]", "[1.0]", "chain.mass must be two numbers; got (1.0,)"),
        ("[1.0, 2]", "[1.0, 2, 3]", "chain.mass must be two numbers; got (1.0, 2, 3)"),
        ("[1.0, 2]", "[0.0, 2]", "link 1: mass must be a positive"),
        ("mass = [1.0, 2]", "", "chain.mass is missing"),
        (
            "mass = [1.0, 2]",
            'mass = [1.0, 2]\nurdf = "a"',
            "chain must have urdf or length, mass, not both",
        ),
        ("[start]", "inertia = [0.1, 0.1]\n[start]", "chain must have both of centre and inertia"),
        ("[start]", 'effects = ["damping"]\n[start]', "got ('damping',) and no chain.urdf"),
        ("[start]", "effects = []\n[start]", "got () and no chain.urdf"),
        ("[start]", "[start", "a scene file must be TOML; got another text"),
        ("[start]", "[begin]", "key 'start' is missing"),
        (
            "[start]",
            "colour = 1\n[start]",
            "a key of chain must be one of mass, length, centre, inertia, joint_sign, ",
        ),
        ("[0.1, 0.0]", "[-0.1, 0.0]", "joint damping at A must be zero or positive"),
        (
            "[effects.gravity]",
            "[effects]\norder = 1\n[effects.gravity]",
            "effects.order must be a list; got 1",
        ),
        (
            "[effects.gravity]",
            '[effects]\norder = ["gravity"]\n[effects.gravity]',
            "effects.order must name each effect as often as it is given; got ('gravity',)",
        ),
    ],
)
def test_a_bad_scene_is_refused_in_one_sentence(old, new, words):
    assert old in TEXT
    text = TEXT.replace(old, new, 1)
    assert words in refusal_from("s.toml", lambda: Scene.parse(text, source="s.toml"))


def test_files_that_cannot_be_read_are_refused(tmp_path):
    with pytest.raises(SceneError, match="no file of this name"):
        Scene.load(tmp_path / "none.toml")
    with pytest.raises(SceneError, match=r"got a (folder|device|pipe)"):
        Scene.load(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'title = "\xe4"')
    with pytest.raises(SceneError, match="byte 9 is not UTF-8"):
        Scene.load(latin)
    marked = tmp_path / "marked.toml"
    marked.write_bytes(b"\xef\xbb\xbf" + TEXT.encode())
    with pytest.raises(SceneError, match="without a byte order mark; got a mark of UTF-8"):
        Scene.load(marked)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_every_shipped_scene_loads_and_has_a_description(file):
    scene = Scene.load(file)
    assert scene.shows
    assert scene.title != "untitled"
    assert scene.effects


def test_the_schema_has_every_effect():
    schema = scene_model().model_json_schema()
    text = json.dumps(schema)
    for name in EFFECTS:
        assert f'"{name}"' in text
        assert effect_class(name).__doc__


def test_the_command_lists_scenes_and_prints_the_schema():
    listed = CliRunner().invoke(app, ["scenes"])
    assert listed.exit_code == 0
    for file in SCENES:
        assert file.stem in listed.stdout.split()
    schema = CliRunner().invoke(app, ["scenes", "--schema"])
    assert json.loads(schema.stdout)["properties"]["run"]


@pytest.mark.parametrize("effects", ["1", '"gravity"', "[{}]"])
def test_effects_that_are_no_table_are_refused(effects):
    plain = TEXT.partition("[effects")[0]
    with pytest.raises(SceneError, match=r"scene\.toml: effects.* must be .*; got"):
        Scene.parse(f"effects = {effects}\n{plain}", source="scene.toml")


def test_the_order_of_effects_may_be_given():
    order = 'order = ["joint_damping", "gravity"]'
    turned = Scene.parse(
        TEXT.replace("[effects.gravity]", f"[effects]\n{order}\n[effects.gravity]")
    )
    assert turned.effects == Scene.parse(TEXT).effects[::-1]


# Scenes as TOML.


def assert_it_reads_back(scene):
    """To the last bit: also the sign of zero, and a bar's inertia as a rational."""
    back = Scene.parse(scene.to_toml())
    assert back == scene
    assert repr(back) == repr(scene)
    assert back.chain._exact_inertia == scene.chain._exact_inertia


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_reads_back_from_toml(name):
    @given(scenes(st.tuples(EFFECT_STRATEGIES[name])))
    def reads_back(scene):
        assert f"\n[effects.{name}]\n" in scene.to_toml()
        assert_it_reads_back(scene)

    reads_back()


@pytest.mark.slow
@given(scenes())
def test_effects_in_any_order_read_back_from_toml(scene):
    assert_it_reads_back(scene)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_every_shipped_scene_reads_back_from_toml(file):
    assert_it_reads_back(Scene.load(file))


def test_a_scene_of_a_urdf_reads_back_from_toml(tmp_path):
    assert_it_reads_back(Scene.load(with_urdf(tmp_path, 'effects = ["limits", "damping"]')))


def test_toml_omits_values_that_are_defaults():
    gravity, damping = Gravity(9.80665), JointDamping((0.1, 0.0))
    bars = Chain.uniform_bars((1.0, 2.0), (1.0, 0.5))
    scene = Scene(bars, (0.1, 0.2), (0.0, 0.0), 3.0, (gravity, damping, Gravity()), title='"1"')
    assert (
        scene.to_toml()
        == """\
title = "\\"1\\""

[chain]
mass = [1.0, 2.0]
length = [1.0, 0.5]

[start]
q = [0.1, 0.2]
u = [0.0, 0.0]

[run]
duration = 3.0

[effects]
order = ["gravity", "joint_damping", "gravity"]

[[effects.gravity]]
g = 9.80665

[[effects.gravity]]

[effects.joint_damping]
coefficient = [0.1, 0.0]
"""
    )


@pytest.mark.parametrize(
    "chain",
    [
        replace(Chain.uniform_bars(), mass=(2.0, 2.0)),
        replace(Chain.uniform_bars(), length=(1.0, 0.0)),
        Chain.uniform_bars((1, 2)).convert(float),
    ],
)
def test_a_chain_changed_from_uniform_bars_is_written_in_full(chain):
    scene = replace(Scene.parse(TEXT), chain=chain)
    assert "inertia" in scene.to_toml()
    assert Scene.parse(scene.to_toml()) == scene


def test_numpys_floats_are_written_as_numbers():
    scene = replace(Scene.parse(TEXT), q=tuple(np.array([0.1, 0.2])), duration=np.float64(3.0))
    assert scene.to_toml() == Scene.parse(TEXT).to_toml()


@dataclass(frozen=True)
class Wind(Effect):
    """A user-defined effect."""

    force: float

    def loads(self, chain, q, u, t=0.0):
        return ()


class Heavier(Gravity):
    """A subclass of a registered effect, which is not registered itself."""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"effects": (Wind(1.0),)}, "must be among gravity, "),
        ({"effects": (Heavier(),)}, "got an effect of type Heavier"),
        (
            {"effects": (Gravity(np.longdouble(9) / 7),)},
            "must be a number that float64 holds, a word, true, false, or a tuple; got Fraction(",
        ),
        ({"effects": (Gravity(2**60 + 1),)}, "must be held by float64 and its words by UTF-8"),
        ({"title": "\ud800"}, "must be held by float64 and its words by UTF-8"),
        (
            {"chain": replace(GENERAL, rotors=(Rotor(0.1, (1.0, 0.0)),))},
            "the chain must have no rotors to be written, as motor_inertia among the effects adds",
        ),
    ],
)
def test_scenes_that_no_file_can_express_are_refused(change, words):
    with pytest.raises(SceneError) as caught:
        replace(Scene.parse(TEXT), **change).to_toml()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"q": (math.inf, 0.0)}, "start: q must be finite numbers; got (inf, 0.0)"),
        ({"u": (math.nan, 0.0)}, "start: u must be finite numbers; got (nan, 0.0)"),
        ({"duration": -1.0}, "run: duration must be positive and finite; got -1.0"),
        ({"duration": math.nan}, "run: duration must be positive and finite; got nan"),
        ({"duration": 5e-324}, "run: duration must be 1e-290 s or more; got 5e-324"),
        ({"accuracy": 0.0}, "run: accuracy must be positive and finite; got 0.0"),
        (
            {"method": "DOP835"},
            f"method must be one of {', '.join(METHODS)}; got 'DOP835' (did you mean 'DOP853'?)",
        ),
        ({"joints": "foo"}, "joints must be a JointConvention; got 'foo'"),
        ({"joints": (1, 1)}, "joints must be a JointConvention; got (1, 1)"),
        ({"notes": "abc"}, "notes must be a sequence of strings; got 'abc'"),
        ({"notes": 5}, "notes must be a sequence of strings; got 5"),
        ({"notes": (5,)}, "notes[0] must be a string; got 5"),
    ],
)
def test_a_scene_that_is_no_motion_is_refused(change, words):
    with pytest.raises(ParameterError) as caught:
        replace(Scene.parse(TEXT), **change)
    assert str(caught.value) == words


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gravity(math.inf), "gravity: g must be a finite number; got inf"),
        (
            lambda: JointSpring((math.nan, 0.0)),
            "joint spring: stiffness must be finite numbers; got (nan, 0.0)",
        ),
        (
            lambda: JointTorque((math.inf, 0.0)),
            "joint torque: torque must be finite numbers; got (inf, 0.0)",
        ),
        (
            lambda: PdControl((0.0, 0.0), (1.0, math.nan)),
            "PD control: proportional must be finite numbers; got (1.0, nan)",
        ),
        (lambda: EndForce(math.nan), "end force: normal must be a finite number; got nan"),
    ],
)
def test_non_finite_parameters_of_effects_are_refused(make, words):
    with pytest.raises(ParameterError) as caught:
        make()
    assert str(caught.value) == words


DOTS = ".".join(["a"] * 100_000)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = " + "[" * 100_000, "tables must not be nested deeper"),
        ("x = " + "[" * 50 + "]" * 50, "tables must not be nested deeper"),
        # tomllib alone would take memory by the square of the number of names.
        (f"{DOTS} = 1", "tables must not be nested deeper"),
        (f"[{DOTS}]", "tables must not be nested deeper"),
        ("x = " + "9" * 5000, "a scene file must be TOML; got another text (Exceeds the limit"),
        ('<?xml version="1.0"?>\n<robot name="r">\n</robot>', "got a URDF, which has no motion"),
        (TEXT.replace("9.81", "0x" + "f" * 9000), "an integer of thousands of digits"),
        (TEXT.replace("9.81", "[" + "1, " * 9000 + "]"), "must be a valid number; got (1, 1, 1"),
    ],
    ids=[
        "lists",
        "fifty lists",
        "dots",
        "dots of a table",
        "digits",
        "urdf",
        "hexadecimal",
        "entries",
    ],
)
def test_hostile_text_is_refused_in_one_short_sentence(text, words):
    with pytest.raises(SceneError) as caught:
        Scene.parse(text)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_numbers_with_many_dots_are_no_deep_nesting():
    times = ", ".join(f"{index / 10!r}" for index in range(200))
    table = f"[effects.sampled_torque]\ntimes = [{times}]\nA = [{times}]\nB = [{times}]\n"
    scene = Scene.parse(TEXT + table + 'interpolation = "hold"\n')
    assert len(scene.effects[-1].times) == 200


def test_files_without_end_or_too_large_are_refused(tmp_path):
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * (LARGEST_FILE + 1))
    with pytest.raises(SceneError, match="must be at most 4 MB; got a larger file"):
        Scene.load(large)
    with pytest.raises(SceneError, match=r"got a (folder|device|pipe)"):
        Scene.load("/dev/zero")
    with pytest.raises(SceneError, match="is a name that is too long") as caught:
        Scene.load("x" * 10_000)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    "number", [np.array([1.0, 2.0]), 1 + 0j, mpmath.mpf(1), sympy.Symbol("x", positive=True)]
)
def test_chains_and_effects_that_do_not_compute_with_float64_are_for_formulas_only(number):
    words = "must be made of floats, whole numbers or fractions; got "
    chain = Chain.uniform_bars().convert(lambda x: x * number)
    with pytest.raises(ParameterError, match=f"^chain {words}"):
        Scene(chain, q=(0.0, 0.0), u=(0.0, 0.0), duration=1.0)
    if not isinstance(number, (complex, np.ndarray)):
        effects = (JointDamping((0.0, number)),)
        with pytest.raises(ParameterError, match=f"^JointDamping {words}"):
            Scene(Chain.uniform_bars(), (0.0, 0.0), (0.0, 0.0), 1.0, effects)


@pytest.mark.parametrize(
    "kind", [Fraction, Decimal, mpmath.mpf, sympy.Rational, sympy.Float, np.float32, np.longdouble]
)
def test_start_duration_and_accuracy_are_float64(kind):
    number = kind("0.25")
    scene = Scene(Chain.uniform_bars(), (number, 1), (0, number), number, (), number)
    assert repr((scene.q, scene.u)) == "((0.25, 1.0), (0.0, 0.25))"
    assert repr((scene.duration, scene.accuracy)) == "(0.25, 0.25)"
    assert np.isfinite(simulate(scene, samples=3).q).all()


@pytest.mark.parametrize(
    "number",
    [
        sympy.Symbol("x"),
        sympy.nan,
        sympy.I,
        sympy.Integer(10) ** 400,
        Decimal("NaN"),
        Fraction(10**400),
    ],
)
@pytest.mark.parametrize("name", ["q", "u", "duration", "accuracy"])
def test_a_number_outside_float64_is_refused(name, number):
    kept = {"q": (0.0, 0.0), "u": (0.0, 0.0), "duration": 1.0}
    given = {name: (0.0, number) if name in ("q", "u") else number}
    with pytest.raises(ParameterError, match=rf"{name}.* must be .*finite|float64 can hold"):
        Scene(Chain.uniform_bars(), **{**kept, **given})


@pytest.mark.parametrize(
    "make",
    [lambda name: Scene.parse("1", source=name), lambda name: Scene.from_dict({}, source=name)],
)
def test_a_long_name_of_a_text_is_shortened_in_messages(make):
    with pytest.raises(SceneError) as caught:
        make("x" * 5000)
    assert len(str(caught.value)) < 600
    with pytest.raises(ParameterError, match="source must be a string; got 3"):
        make(3)


def test_the_text_of_a_scene_is_one_line():
    text = repr(Scene.load("drop"))
    assert text == (
        "<Scene 'The drop onto a floor': q=(0, 0) rad, u=(0, 0) rad/s, 5.0 s with Gravity, Surface>"
    )
    assert Scene.load("free_fall").title in repr(Scene.load("free_fall"))
