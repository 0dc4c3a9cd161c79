import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.urdf.drawing import arm, at, joint
from twolink.chain import Chain
from twolink.cli import app
from twolink.effects import EFFECTS, effect_class
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_stop import JointStop
from twolink.errors import SceneError
from twolink.scene import Scene, scene_model
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
    with pytest.raises(SceneError, match="cannot be read"):
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
