import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.strategies import EFFECT_STRATEGIES, scenes
from tests.urdf.drawing import arm, at, joint
from tests.verification.chains import GENERAL
from twolink.chain import Chain, Rotor
from twolink.cli import app
from twolink.effects import EFFECTS, effect_class
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.errors import ParameterError, SceneError
from twolink.scene import LARGEST_FILE, Scene, scene_model
from twolink.shipped import shipped

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

SCENES = sorted(shipped("scenes").rglob("*.toml"))


def test_a_scene_holds_what_its_file_says():
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


DRIVEN = arm(
    elbow=joint(
        "elbow",
        "upper",
        "lower",
        "revolute",
        at("1 0 0")
        + '<limit lower="-1" upper="2" effort="1" velocity="1"/><dynamics damping="0.3"/>',
    )
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


def test_a_scene_may_ask_for_nothing_of_its_urdf(tmp_path):
    assert Scene.load(with_urdf(tmp_path, "effects = []")) == Scene.load(with_urdf(tmp_path))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('effects = ["limit"]', "is 'limit'; allowed is 'damping', 'friction' or 'limits'"),
        ("effects = [1]", "is 1; allowed is 'damping', 'friction' or 'limits'"),
        ('effects = "damping"', "chain.effects is 'damping'; allowed is a list"),
        (
            'effects = ["damping", "limits", "damping"]',
            "chain.effects is ('damping', 'limits', 'damping'); allowed is each word at most once",
        ),
        ('effects = ["friction"]', "joints 'shoulder', 'elbow' have no friction"),
        ('effects = ["damping"]\nmass = [1.0, 1.0]', "chain has both urdf and mass; allowed is"),
    ],
)
def test_what_cannot_be_asked_of_a_urdf_is_refused(tmp_path, more, words):
    file = with_urdf(tmp_path, more)
    with pytest.raises(SceneError) as caught:
        Scene.load(file)
    sentence = str(caught.value)
    assert sentence.startswith(f"{file}: ")
    assert words in sentence
    assert "\n" not in sentence


def test_the_schema_knows_what_may_be_asked_of_a_urdf():
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
        ("g = 9.81", "h = 9.81", "key 'effects.gravity.h' is unknown"),
        ("g = 9.81", 'g = "9.81"', "effects.gravity.g is '9.81'; allowed is a valid number"),
        ("g = 9.81", "g = nan", "effects.gravity.g is nan; allowed is a finite number"),
        ("g = 9.81", "g = true", "effects.gravity.g is True"),
        ("effects.gravity", "effects.gravitas", "effect 'gravitas' is unknown; allowed are"),
        ("duration = 3.0", "duration = -3.0", "run.duration is -3.0; allowed is greater than 0"),
        ("duration = 3.0", "duration = inf", "run.duration is inf"),
        ("duration = 3.0", "", "key 'run.duration' is missing"),
        ("duration = 3.0", 'duration = 3.0\nmethod = "euler"', "run.method is 'euler'; allowed is"),
        ("duration = 3.0", "duration = 3.0\naccuracy = 0.0", "run.accuracy is 0.0"),
        ("[1.0, 2]", "[1.0]", "chain.mass is (1.0,); allowed are two numbers"),
        ("[1.0, 2]", "[1.0, 2, 3]", "chain.mass is (1.0, 2, 3); allowed are two numbers"),
        ("[1.0, 2]", "[0.0, 2]", "link 1: mass is 0.0; allowed is a positive"),
        ("mass = [1.0, 2]", "", "chain.mass is missing"),
        ("mass = [1.0, 2]", 'mass = [1.0, 2]\nurdf = "a"', "chain has both urdf and length, mass"),
        ("[start]", "inertia = [0.1, 0.1]\n[start]", "chain has only one of centre and inertia"),
        ("[start]", 'effects = ["damping"]\n[start]', "('damping',) and there is no chain.urdf"),
        ("[start]", "effects = []\n[start]", "chain.effects is () and there is no chain.urdf"),
        ("[start]", "[start", "this is not TOML"),
        ("[start]", "[begin]", "key 'start' is missing"),
        ("[start]", "colour = 1\n[start]", "key 'chain.colour' is unknown"),
        ("[0.1, 0.0]", "[-0.1, 0.0]", "joint damping at A is -0.1"),
        ("[effects.gravity]", "[effects]\norder = 1\n[effects.gravity]", "effects.order is 1"),
        (
            "[effects.gravity]",
            '[effects]\norder = ["gravity"]\n[effects.gravity]',
            "effects.order is ('gravity',); allowed is each effect's name as often as it is given",
        ),
    ],
)
def test_a_bad_scene_is_refused_in_one_sentence(old, new, words):
    assert old in TEXT
    with pytest.raises(SceneError) as caught:
        Scene.parse(TEXT.replace(old, new, 1), source="scene.toml")
    sentence = str(caught.value)
    assert sentence.startswith("scene.toml: ")
    assert words in sentence
    assert "\n" not in sentence


def test_files_that_cannot_be_read_are_refused(tmp_path):
    with pytest.raises(SceneError, match="no file of this name"):
        Scene.load(tmp_path / "none.toml")
    with pytest.raises(SceneError, match="this is no plain file"):
        Scene.load(tmp_path)
    latin = tmp_path / "latin.toml"
    latin.write_bytes(b'title = "\xe4"')
    with pytest.raises(SceneError, match="cannot be read"):
        Scene.load(latin)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_every_shipped_scene_loads_and_says_what_it_shows(file):
    scene = Scene.load(file)
    assert scene.shows
    assert scene.title != "untitled"
    assert scene.effects


def test_the_schema_knows_every_effect():
    schema = scene_model().model_json_schema()
    text = json.dumps(schema)
    for name in EFFECTS:
        assert f'"{name}"' in text
        assert effect_class(name).__doc__


def test_the_command_lists_scenes_and_prints_the_schema():
    listed = CliRunner().invoke(app, ["scenes"])
    assert listed.exit_code == 0
    for file in SCENES:
        assert file.name in listed.stdout
    schema = CliRunner().invoke(app, ["scenes", "--schema"])
    assert json.loads(schema.stdout)["properties"]["run"]


@pytest.mark.parametrize("effects", ["1", '"gravity"', "[{}]"])
def test_effects_that_are_no_table_are_refused(effects):
    plain = TEXT.partition("[effects")[0]
    with pytest.raises(SceneError, match=r"scene\.toml: effects.* is .*; allowed is"):
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


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_reads_back_from_toml(name):
    @given(scenes(st.tuples(EFFECT_STRATEGIES[name])))
    def reads_back(scene):
        assert f"\n[effects.{name}]\n" in scene.to_toml()
        assert_it_reads_back(scene)

    reads_back()


@given(scenes())
def test_effects_in_any_order_read_back_from_toml(scene):
    assert_it_reads_back(scene)


@pytest.mark.parametrize("file", SCENES, ids=lambda file: file.stem)
def test_every_shipped_scene_reads_back_from_toml(file):
    assert_it_reads_back(Scene.load(file))


def test_a_scene_of_a_urdf_reads_back_from_toml(tmp_path):
    assert_it_reads_back(Scene.load(with_urdf(tmp_path, 'effects = ["limits", "damping"]')))


def test_toml_says_no_more_than_it_must():
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
        Chain.uniform_bars().convert(float),
    ],
)
def test_what_was_made_of_uniform_bars_is_written_in_full(chain):
    scene = replace(Scene.parse(TEXT), chain=chain)
    assert "inertia" in scene.to_toml()
    assert Scene.parse(scene.to_toml()) == scene


def test_numpys_floats_are_written_as_numbers():
    scene = replace(Scene.parse(TEXT), q=tuple(np.array([0.1, 0.2])), duration=np.float64(3.0))
    assert scene.to_toml() == Scene.parse(TEXT).to_toml()


@dataclass(frozen=True)
class Wind:
    """An effect of a user's own."""

    force: float

    def loads(self, chain, q, u, t=0.0):
        return ()


class Heavier(Gravity):
    """Nor is one that is made of a registered one."""


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"effects": (Wind(1.0),)}, "effect Wind is not one of scene files; allowed are gravity,"),
        ({"effects": (Heavier(),)}, "effect Heavier is not one of scene files; allowed are"),
        (
            {"effects": (Gravity(np.float32(9.81)),)},
            "effects.gravity.g is np.float32(9.81); allowed are numbers, words, true, false",
        ),
        ({"q": [0.1, 0.2]}, "start.q is [0.1, 0.2]; allowed are numbers, words"),
        ({"q": np.eye(2)}, "start.q is array([[1., 0.], [0., 1.]]); allowed are numbers"),
        ({"duration": 2**60 + 1}, "reads back otherwise; allowed are numbers that float64 can"),
        ({"method": "euler"}, "run.method is 'euler'; allowed is"),
        ({"title": None}, "title is None; allowed are numbers, words"),
        ({"title": "\ud800"}, "reads back otherwise; allowed are numbers that float64 can hold"),
        (
            {"chain": replace(GENERAL, rotors=(Rotor(0.1, (1.0, 0.0)),))},
            "the chain has 1 rotors; allowed are none, and motor_inertia among the effects",
        ),
    ],
)
def test_what_no_scene_file_can_say_is_refused(change, words):
    with pytest.raises(SceneError) as caught:
        replace(Scene.parse(TEXT), **change).to_toml()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"q": (math.inf, 0.0)}, "start: q is (inf, 0.0); allowed are finite numbers"),
        ({"u": (math.nan, 0.0)}, "start: u is (nan, 0.0); allowed are finite numbers"),
        ({"duration": -1.0}, "run: duration is -1.0; allowed is a positive number"),
        ({"duration": math.nan}, "run: duration is nan; allowed is a positive number"),
        ({"accuracy": 0.0}, "run: accuracy is 0.0; allowed is a positive number"),
    ],
)
def test_a_scene_that_is_no_motion_is_refused(change, words):
    with pytest.raises(ParameterError) as caught:
        replace(Scene.parse(TEXT), **change)
    assert str(caught.value) == words


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gravity(math.inf), "gravity: g is inf; allowed is a finite number"),
        (
            lambda: JointSpring((math.nan, 0.0)),
            "joint spring: stiffness is (nan, 0.0); allowed are finite numbers",
        ),
        (
            lambda: JointTorque((math.inf, 0.0)),
            "joint torque: torque is (inf, 0.0); allowed are finite numbers",
        ),
        (
            lambda: PdControl((0.0, 0.0), (1.0, math.nan)),
            "PD control: proportional is (1.0, nan); allowed are finite numbers",
        ),
        (lambda: EndForce(math.nan), "end force: normal is nan; allowed is a finite number"),
    ],
)
def test_effects_of_what_is_not_finite_are_refused(make, words):
    with pytest.raises(ParameterError) as caught:
        make()
    assert str(caught.value) == words


DOTS = ".".join(["a"] * 100_000)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = " + "[" * 100_000, "this is nested too deeply"),
        ("x = " + "[" * 50 + "]" * 50, "this is nested too deeply"),
        # tomllib alone would take memory by the square of the number of names.
        (f"{DOTS} = 1", "this is nested too deeply"),
        (f"[{DOTS}]", "this is nested too deeply"),
        ("x = " + "9" * 5000, "this is not TOML (Exceeds the limit"),
        (TEXT.replace("9.81", "0x" + "f" * 9000), "an integer of thousands of digits"),
        (TEXT.replace("9.81", "[" + "1, " * 9000 + "]"), "effects.gravity.g is (1, 1, 1"),
    ],
    ids=["lists", "fifty lists", "dots", "dots of a table", "digits", "hexadecimal", "entries"],
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
    with pytest.raises(SceneError, match="is larger than 4 MB; allowed is a smaller file"):
        Scene.load(large)
    with pytest.raises(SceneError, match="this is no plain file"):
        Scene.load("/dev/zero")
    with pytest.raises(SceneError, match=r"File name too long|no file of this name") as caught:
        Scene.load("x" * 10_000)
    assert len(str(caught.value)) < 500
