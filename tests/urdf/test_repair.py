"""Repairs: each fault of files in use, one at a time; and faults that no repair can remove."""

import io

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from hypothesis import given, settings

from tests.urdf.drawing import arm, at, axis, joint, link, robot
from tests.urdf.robots import PLAIN, Messy, edited, messy_robots, without
from twolink import ParameterError, UrdfError
from twolink.data import data_path
from twolink.urdf import parse_planar_urdf
from twolink.urdf.repair import Repair, repair_file, repair_urdf

SHIPPED = data_path("twolink.urdf").read_text(encoding="utf-8")
LIMIT = '<limit effort="1" velocity="1"/>'

# An arm to which nothing needs to be done.
SOUND = repair_urdf(PLAIN).text


def changed(*edits: tuple[str, str]) -> str:
    text = SOUND
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    return text


def only(repair: Repair, *words: str) -> None:
    assert len(repair.changes) == 1, repair.changes
    for word in words:
        assert word in repair.changes[0]


def readable(text: str) -> None:
    """Pinocchio and yourdfpy read it; the import suite has other engines."""
    assert pin.buildModelFromXML(text).nv == 2
    model = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    assert model.num_actuated_joints == 2


ELBOW = '<joint name="elbow" type="continuous">'
REVOLUTE = ELBOW.replace("continuous", "revolute")
ELBOW_AXIS = '<axis xyz="0 1.0 0" />'
WELD = (
    "</robot>",
    '<joint name="weld" type="fixed"><parent link="world"/><child link="b"/></joint></robot>',
)
FAULTS = {
    "no name of the robot": ([(' name="plain"', "")], ["'robot'"]),
    "undeclared parent": (
        [('<link name="base">', '<link name="b">'), ('link="base"', 'link="world"'), WELD],
        ["declared link 'world'", "'shoulder'"],
    ),
    "axis of a fixed joint": (
        [('type="fixed">', 'type="fixed"><axis xyz="0 0 0"/>')],
        ["removed <axis>", "'mount'"],
    ),
    "limit of a fixed joint": (
        [('type="fixed">', 'type="fixed"><limit lower="0"/>')],
        ["removed <limit>", "'mount'"],
    ),
    "no effort": (
        [(ELBOW, REVOLUTE), (ELBOW_AXIS, f'{ELBOW_AXIS}<limit velocity="1"/>')],
        ["effort", "'elbow'", "unlimited"],
    ),
    "no velocity": (
        [(ELBOW, REVOLUTE), (ELBOW_AXIS, f'{ELBOW_AXIS}<limit effort="0" lower="-1"/>')],
        ["velocity", "'elbow'", "unlimited"],
    ),
    "limit of a joint that turns freely": (
        [(ELBOW_AXIS, f'{ELBOW_AXIS}<limit velocity="1"/>')],
        ["effort", "'elbow'"],
    ),
    "revolute without limit": ([(ELBOW, REVOLUTE)], ["'elbow'", "continuous"]),
    "empty dynamics": (
        [(ELBOW_AXIS, f"{ELBOW_AXIS}<dynamics/>")],
        ["removed <dynamics>", "'elbow'"],
    ),
    "nameless joint": ([('<joint name="mount"', "<joint")], ["joint number 3", "'joint_3'"]),
    "two joints of one name": (
        [('<joint name="mount"', '<joint name="elbow"')],
        ["second joint 'elbow'", "'elbow_2'"],
    ),
    "nameless material": (
        [
            (
                '<link name="upper">',
                '<link name="upper"><visual><geometry><box size="1 1 1"/></geometry>'
                '<material><color rgba="1 0 0 1"/></material></visual>',
            )
        ],
        ["material", "'upper'"],
    ),
    "no products of inertia": ([('ixy="0" ixz="0" iyy="0.3" iyz="0"', 'iyy="0.3"')], ["ixy, ixz"]),
    "namespace": ([('<robot name="plain"', '<robot xmlns="http://d.e" name="plain"')], ["'http:"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_repaired_and_named(fault):
    edits, words = FAULTS[fault]
    text = changed(*edits)
    repaired = repair_urdf(text)
    only(repaired, *words)
    readable(repaired.text)
    assert parse_planar_urdf(repaired.text).links == parse_planar_urdf(SOUND).links
    assert repair_urdf(repaired.text) == Repair(repaired.text, (), repaired.notes)
    assert repair_urdf(text) == repaired


def test_a_valid_file_needs_no_repair():
    for text in (SOUND, SHIPPED):
        assert repair_urdf(text) == Repair(text, (), ())


def test_frames_have_an_inertial_of_zero():
    repaired = repair_urdf(PLAIN)
    assert len(repaired.changes) == 2
    assert "'base'" in repaired.changes[0]
    assert "'tool'" in repaired.changes[1]
    assert parse_planar_urdf(repaired.text).links == parse_planar_urdf(PLAIN).links


def test_an_undeclared_child_of_a_fixed_joint_is_a_frame():
    text = edited(('<link name="tool"/>', ""))
    repaired = repair_urdf(text)
    assert any("declared link 'tool', the child of joint 'mount'" in c for c in repaired.changes)
    assert parse_planar_urdf(repaired.text).links == parse_planar_urdf(PLAIN).links


@pytest.mark.parametrize("rpy", ["0 0 0", "0.3 -0.2 0.9"])
def test_inertias_of_no_body_keep_the_moment_about_the_axis(rpy):
    inertial = (
        f'<inertial><origin xyz="0.2 0.1 0" rpy="{rpy}"/><mass value="2"/>'
        '<inertia ixx="0.9" iyy="0.1" izz="0.2" ixy="0.05" ixz="0" iyz="-0.02"/></inertial>'
    )
    text = arm(upper=link("upper", inertial))
    repaired = repair_urdf(text)
    assert any("'upper'" in change and "ball" in change for change in repaired.changes)
    before, after = parse_planar_urdf(text), parse_planar_urdf(repaired.text)
    assert after.links[0].inertia == pytest.approx(before.links[0].inertia, rel=1e-15)
    assert after.links[1] == before.links[1]
    inertia = pin.buildModelFromXML(repaired.text).inertias[1].inertia
    assert np.linalg.eigvalsh(inertia) == pytest.approx([after.links[0].inertia] * 3)


def test_a_point_mass_is_noted_and_kept():
    text = arm(
        lower=link(
            "lower",
            '<inertial><origin xyz="1 0 0"/><mass value="1"/><inertia ixx="0" iyy="0" izz="0" '
            'ixy="0" ixz="0" iyz="0"/></inertial>',
        )
    )
    repaired = repair_urdf(text)
    assert not any("'lower'" in change for change in repaired.changes)
    (note,) = repaired.notes
    assert "'lower'" in note
    assert "MuJoCo and Drake" in note


def test_comments_and_the_text_before_the_robot_are_kept():
    inside = edited(('<link name="base"/>', '<!-- b --><link name="base"/>'))
    text = f"<!-- © Ä licence -->\n{inside}"
    repaired = repair_urdf(text).text
    assert repaired.startswith(
        '<?xml version="1.0" encoding="utf-8"?>\n<!-- © Ä licence -->\n<robot'
    )
    assert "<!-- b -->" in repaired
    declared = repair_urdf(f"<?xml version='1.0' encoding='latin-1'?>\n{text}").text
    assert declared == repaired


def test_text_after_the_robot_is_kept():
    repaired = repair_urdf(f"{PLAIN}<!-- </robot> the end -->\n")
    assert repaired.text.endswith("</robot>\n<!-- </robot> the end -->\n")
    assert repair_urdf(repaired.text).changes == ()


@pytest.mark.parametrize("declared", ["", '<?xml version="1.0"?>\n', "<?xml\n version='1.0' ?>"])
@pytest.mark.parametrize(
    "before",
    [
        '<?xml-model href="robot.rnc"?>',
        '<?xml-stylesheet href="a.css" type="text/css"?>\n<?xml-model href="a"?>\n<!-- ?> -->',
    ],
)
def test_instructions_before_the_robot_are_kept(declared, before):
    repaired = repair_urdf(f"{declared}{before}\n{PLAIN}")
    assert repaired.changes
    expected = f'<?xml version="1.0" encoding="utf-8"?>\n{before}\n<robot'
    assert repaired.text.startswith(expected)


def test_namespaces_that_are_not_used_are_removed_with_the_rest():
    text = PLAIN.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    repaired = repair_urdf(text)
    assert repaired.changes[-1] == "removed declarations of XML namespaces: 'xacro'"
    assert "xmlns" not in repaired.text
    # They alone are no reason to write a file anew.
    sound = SOUND.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    assert repair_urdf(sound) == Repair(sound, (), ())


def test_prefixes_of_extensions_are_kept():
    """Drake looks for the prefix: with another one it does not read the inertia of a rotor."""
    inner = '<drake:rotor_inertia drake:unit="kg" value="0.5"/><other:gear/>'
    declared = 'xmlns:drake="http://drake.mit.edu" xmlns:xacro="http://www.ros.org/wiki/xacro"'
    text = PLAIN.replace("<robot", f"<robot {declared}").replace(
        "</robot>",
        f'<transmission><actuator xmlns:other="o">{inner}</actuator></transmission></robot>',
    )
    repaired = repair_urdf(text)
    assert repaired.changes[-1] == "removed declarations of XML namespaces: 'xacro'"
    for word in (
        'xmlns:drake="http://drake.mit.edu"', 'xmlns:other="o"', "<drake:rotor_inertia ",
        'drake:unit="kg"', "<other:gear",
    ):  # fmt: skip
        assert repaired.text.count(word) == 1
    assert "ns0" not in repaired.text


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xef\xbb\xbf" + SOUND.encode(), "byte order mark"),
        (SOUND.encode("utf-16"), "UTF-16"),
        (SOUND.encode("utf-32"), "UTF-32"),
        (SOUND.replace("<robot", "<!-- Ä -->\n<robot").encode("cp1252"), "Windows-1252"),
    ],
)
def test_encodings_are_rewritten(tmp_path, content, words):
    file = tmp_path / "arm.urdf"
    file.write_bytes(content)
    repaired = repair_file(file)
    only(repaired, words)
    assert parse_planar_urdf(repaired.text).links == parse_planar_urdf(SOUND).links
    file.write_bytes(repaired.text.encode())
    assert repair_file(file) == Repair(repaired.text, (), ())


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<sdf/>", "SDF"),
        (f"<!DOCTYPE r>{PLAIN}", "DOCTYPE"),
        (PLAIN[:-20], "well-formed"),
        (edited(('value="2.0"', 'value="${m}"')), "xacro"),
        (edited(('type="fixed"', 'type="continuous"')), "exactly two joints"),
        (edited(('value="2.0"', 'value="0"')), "'upper'"),
        (edited(('value="2.0"', 'value="-1"')), "'upper': mass"),
        (edited(('"0 1.0 0"', '"0 0 0"')), "'elbow': axis"),
        (edited(('<link name="tool"/>', '<link name="lower"/>')), "two links named 'lower'"),
        (edited(('child link="lower"', 'child link="other"')), "'other'"),
        (edited(('parent link="upper"', 'parent link="tool"')), "loop"),
        (edited(without('<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.3"', "/>")), "inertia ixx"),
        (robot(link("a"), link("b"), joint("j", "a", "b", inside=axis("0 1 0"))), "got 1, 'j'"),
        (edited(('"0 1.0 0"/>', '"0 1.0 0"/><mimic joint="shoulder"/>')), "mimics"),
    ],
)
def test_files_that_cannot_be_repaired_are_refused_with_the_reason(text, words):
    with pytest.raises(UrdfError, match=words) as caught:
        repair_urdf(text, source="arm.urdf")
    sentence = str(caught.value)
    assert sentence.startswith("arm.urdf: ")
    assert sentence.count("arm.urdf") == 1
    assert ": : " not in sentence
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"text": 5}, "text must be a string; got 5"),
        ({"text": PLAIN.encode()}, "text must be a string; got b'"),
        ({"text": PLAIN, "source": 5}, "source must be a string; got 5"),
    ],
)
def test_arguments_that_are_no_strings(arguments, words):
    with pytest.raises(ParameterError, match=f"^{words}"):
        repair_urdf(**arguments)


def test_a_step_that_changes_mechanics_is_caught(monkeypatch):
    from twolink.urdf import repair

    def spoil(element):
        element.find("link[@name='upper']/inertial/mass").set("value", "3.0")
        yield "spoiled"

    monkeypatch.setattr(repair, "_STEPS", (*repair._STEPS, spoil))
    with pytest.raises(UrdfError, match="got a change of link 'upper'"):
        repair_urdf(PLAIN)


@pytest.mark.slow
@settings(max_examples=30)
@given(messy=messy_robots())
def test_messy_robots_keep_their_mechanics(messy: Messy):
    repaired = repair_urdf(messy.text)
    assert repair_urdf(repaired.text).changes == ()
    before = parse_planar_urdf(messy.text, gravity=messy.gravity)
    after = parse_planar_urdf(repaired.text, gravity=messy.gravity)
    assert (after.links, after.joints) == (before.links, before.joints)


def test_many_faults_of_an_arm_are_repaired():
    text = robot(
        link("upper"),
        link("lower"),
        link("hand", ""),
        joint("weld", "world", "base", "fixed", axis("0 0 0")),
        link("base", ""),
        joint("shoulder", "base", "upper", "revolute", axis("0 1 0") + '<limit effort="1"/>'),
        joint("shoulder", "upper", "lower", "revolute", at("1 0 0")),
        joint("wrist", "lower", "hand", "fixed", at("1 0 0")),
    )
    repaired = repair_urdf(text)
    assert len(repaired.changes) == 7
    readable(repaired.text)
    assert parse_planar_urdf(repaired.text).links == parse_planar_urdf(arm()).links
