"""Refusals: one line with the file, the element, the requirement and the received text."""

import pytest

from tests.urdf.robots import ELBOW_AXIS, ELBOW_ORIGIN, PLAIN, edited, without
from tests.urdf.sentences import names, refusal
from twolink.urdf import parse_planar_urdf
from twolink.urdf.reading import parse_tree

LIMIT = '<limit effort="1" velocity="1"/>'


def test_the_plain_robot_is_accepted():
    assert parse_planar_urdf(PLAIN).link_names == ("upper", "lower")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("", ["empty"], id="empty"),
        pytest.param(" \n\t", ["empty"], id="blank"),
        pytest.param(PLAIN[:-20], ["well-formed"], id="cut short"),
        pytest.param("<robot name='r'/><robot/>", ["well-formed"], id="two roots of XML"),
        pytest.param("no XML", ["well-formed"], id="no XML"),
        pytest.param("<robot>\x00</robot>", ["well-formed"], id="control character"),
        pytest.param("<robot>\ud800</robot>", ["well-formed"], id="lone surrogate"),
        pytest.param("<robot>&nothing;</robot>", ["well-formed"], id="unknown entity"),
        pytest.param("<sdf/>", ["<sdf>", "<robot>", "sdformat_urdf"], id="SDF"),
        pytest.param('<mujoco model="arm"/>', ["<mujoco>", "MJCF"], id="MJCF"),
        pytest.param("<html><body/></html>", ["web page"], id="web page"),
        pytest.param("<roboter/>", ["<roboter>", "<robot>"], id="another root"),
        pytest.param("<robot/>", ["name"], id="robot without name"),
        pytest.param('<robot name="r"/>', ["no link"], id="no links"),
        pytest.param(f"<!DOCTYPE robot>{PLAIN}", ["DOCTYPE"], id="DOCTYPE"),
        pytest.param(
            '<!DOCTYPE r [<!ENTITY a "aa"><!ENTITY b "&a;&a;">]><robot name="&b;"/>',
            ["DOCTYPE"],
            id="entities",
        ),
        pytest.param(
            '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]><robot name="r">&a;</robot>',
            ["DOCTYPE"],
            id="a file's content as an entity",
        ),
        pytest.param(edited(('value="2.0"', 'value="${m}"')), ["xacro", "mass"], id="xacro value"),
        pytest.param(
            '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>',
            ["xacro", "arm"],
            id="xacro element",
        ),
        pytest.param(
            '<robot name="r"><xacro:arm/></robot>', ["xacro", "expanded"], id="xacro, no namespace"
        ),
        pytest.param(edited(('name="plain"', 'name="$(arg n)"')), ["xacro", "$(arg n)"], id="$()"),
        pytest.param(
            edited(('child link="tool"', 'child link="${side}_tool"')),
            ["xacro", "${side}_tool", "<child>"],
            id="xacro name",
        ),
    ],
)
def test_text_that_is_not_urdf(text, words):
    names(refusal(text), *words)


def test_text_that_is_too_large_is_refused():
    names(refusal("<robot>" + " " * 17_000_000 + "</robot>"), "16 MB")


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        pytest.param(('name="shoulder"', ""), ["joint number 1", "name"], id="nameless joint"),
        pytest.param(('<link name="tool"/>', "<link/>"), ["link number 4"], id="nameless link"),
        pytest.param(('name="mount"', 'name=""'), ["joint number 3"], id="empty name"),
        pytest.param(('<link name="tool"/>', '<link name="lower"/>'), ["two", "lower"], id="twins"),
        pytest.param(('name="mount"', 'name="elbow"'), ["two joints", "'elbow'"], id="twin joints"),
        pytest.param(
            ('child link="tool"', 'child link="gripper"'), ["'mount'", "'gripper'"], id="child?"
        ),
        pytest.param(
            ('parent link="lower"', 'parent link="gone"'), ["'mount'", "'gone'"], id="parent?"
        ),
        pytest.param(('<child link="tool"/>', ""), ["'mount'", "child"], id="no child"),
        pytest.param(('<parent link="lower"/>', ""), ["'mount'", "parent"], id="no parent"),
        pytest.param(('parent link="lower"', "parent"), ["'mount'", "parent"], id="blank parent"),
        pytest.param(
            ('child link="tool"', 'child link="lower"'), ["'lower'", "'mount'"], id="two parents"
        ),
        pytest.param(without('<joint name="mount"', "</joint>"), ["'tool'", "'base'"], id="roots"),
        pytest.param(
            ('parent link="upper"', 'parent link="tool"'), ["loop"], id="loop beside the root"
        ),
        pytest.param(('parent link="lower"', 'parent link="tool"'), ["'mount'", "loop"], id="self"),
        pytest.param(('parent link="base"', 'parent link="tool"'), ["loop"], id="base apart"),
    ],
)
def test_links_that_are_not_a_tree(edit, words):
    names(refusal(edited(edit)), *words)


def test_a_loop_of_all_links_is_refused():
    joint = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/></joint>'
    loop = joint.format("i", "a", "b") + joint.format("j", "b", "a")
    sentence = refusal(f'<robot name="r"><link name="a"/><link name="b"/>{loop}</robot>')
    names(sentence, "loop", "'a'", "'b'")


@pytest.mark.parametrize(
    "number", ["nan", "inf", "-inf", "1e999", "one", "", "1 2", "1,5", "1_0", "0x1", "٣"]
)
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('value="2.0"', 'value="{}"', ["'upper'", "mass"]),
        ('iyy="0.3"', 'iyy="{}"', ["'upper'", "iyy"]),
        ('xyz="0.25 0 0"', 'xyz="0.25 0 {}"', ["'lower'", "xyz"]),
        ('xyz="1 0 0"', 'xyz="{} 0 0"', ["'elbow'", "xyz"]),
        ('xyz="1 0 0" rpy="0 0 0"', 'xyz="1 0 0" rpy="0 {} 0"', ["'elbow'", "rpy"]),
        ('axis xyz="0 1.0 0"', 'axis xyz="0 {} 0"', ["'elbow'", "axis"]),
        (ELBOW_AXIS, ELBOW_AXIS + '<limit effort="{}" velocity="1"/>', ["'elbow'", "effort"]),
        (ELBOW_AXIS, ELBOW_AXIS + LIMIT.replace("/>", ' lower="{}"/>'), ["'elbow'", "lower"]),
        (ELBOW_AXIS, ELBOW_AXIS + LIMIT.replace("/>", ' upper="{}"/>'), ["'elbow'", "upper"]),
        (ELBOW_AXIS, ELBOW_AXIS + '<dynamics damping="{}"/>', ["'elbow'", "damping"]),
        (ELBOW_AXIS, ELBOW_AXIS + '<dynamics friction="{}"/>', ["'elbow'", "friction"]),
    ],
)
def test_numbers_that_are_not_finite_numbers(old, new, words, number):
    names(refusal(edited((old, new.format(number)))), *words)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        pytest.param(('<mass value="2.0"/>', ""), ["'upper'", "mass is missing"], id="no mass"),
        pytest.param(('iyy="0.3"', ""), ["'upper'", "iyy is missing"], id="no iyy"),
        pytest.param(('value="2.0"', 'value="-2"'), ["'upper'", "-2.0"], id="negative mass"),
        pytest.param(('xyz="1 0 0"', 'xyz="1 0"'), ["'elbow'", "'1 0'"], id="two coordinates"),
        pytest.param(('"0 1.0 0"', '"0 0.0 0"'), ["'elbow'", "zero"], id="zero axis"),
        pytest.param((ELBOW_AXIS, "<axis/>"), ["'elbow'", "axis is missing"], id="blank axis"),
        pytest.param(
            (ELBOW_ORIGIN, '<origin quat_xyzw="0 0 0 1"/>'), ["'elbow'", "quat"], id="quaternion"
        ),
        pytest.param(
            (ELBOW_AXIS, ELBOW_AXIS + '<limit velocity="1"/>'), ["'elbow'", "effort"], id="limit"
        ),
        pytest.param(('type="fixed"', 'type="welded"'), ["'mount'", "'welded'"], id="type?"),
        pytest.param(('type="fixed"', ""), ["'mount'", "type"], id="no type"),
    ],
)
def test_files_that_break_the_standard_are_refused(edit, words):
    names(refusal(edited(edit)), *words)


def test_a_long_name_is_shortened_and_kept_on_one_line():
    sentence = refusal(edited(('child link="tool"', f'child link="a&#10;{"x" * 100_000}"')))
    names(sentence, "'mount'", "\\n")


def test_many_names_are_shortened():
    many = "".join(f'<link name="n{i}"/>' for i in range(1000))
    names(refusal(edited(('<link name="tool"/>', f'<link name="tool"/>{many}'))), "more")


@pytest.mark.parametrize("kind", ["revolute", "continuous"])
def test_limits(kind):
    edit = (f"{ELBOW_AXIS}\n  </joint>", f"{ELBOW_AXIS}{LIMIT}</joint>")
    text = edited(edit).replace('name="elbow" type="continuous"', f'name="elbow" type="{kind}"')
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


@pytest.mark.parametrize(
    ("attributes", "limits"),
    [
        ("", (0.0, 0.0)),
        ('lower="-1.5"', (-1.5, 0.0)),
        ('upper="2e-1"', (0.0, 0.2)),
        ('lower="-1" upper=" 2 "', (-1.0, 2.0)),
        ('lower="2" upper="-1"', (2.0, -1.0)),
    ],
)
def test_limits_are_read_as_they_stand(attributes, limits):
    """Absent limits are 0; the reader does not check their range."""
    more = LIMIT.replace("/>", f" {attributes}/>")
    text = edited((f"{ELBOW_AXIS}\n  </joint>", f"{ELBOW_AXIS}{more}</joint>"))
    assert parse_planar_urdf(text).limits == (None, None)
    revolute = text.replace('name="elbow" type="continuous"', 'name="elbow" type="revolute"')
    assert parse_planar_urdf(revolute).limits == (None, limits)


def test_effort_and_velocity_are_read_as_they_stand():
    more = '<limit effort="-2.5" velocity="0"/>'
    text = edited((f"{ELBOW_AXIS}\n  </joint>", f"{ELBOW_AXIS}{more}</joint>"))
    joints = {joint.name: joint for joint in parse_tree(text).joints}
    assert (joints["elbow"].effort, joints["elbow"].velocity) == (-2.5, 0.0)
    assert (joints["shoulder"].effort, joints["shoulder"].velocity) == (None, None)


def test_revolute_needs_a_limit():
    text = edited(('name="elbow" type="continuous"', 'name="elbow" type="revolute"'))
    names(refusal(text), "'elbow'", "limit")


def test_elements_for_simulators_are_ignored():
    ignored = (
        '<material name="m"><color rgba="a b"/></material><gazebo><joint name="elbow"/></gazebo>'
        '<transmission name="t"><joint name="shoulder"/></transmission><!-- <!DOCTYPE> ${x} -->'
    )
    text = edited(('<link name="base"/>', f'{ignored}<link name="base"><visual/></link>'))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


def test_a_namespace_is_ignored():
    # Drake's Acrobot.urdf has one.
    text = edited(("<robot ", '<robot xmlns="http://drake.mit.edu" '))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


@pytest.mark.slow
def test_deep_trees_and_nesting_do_not_overflow_the_stack():
    count = 20_000
    links = "".join(f'<link name="n{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="f{i}" type="fixed"><parent link="n{i}"/><child link="n{i + 1}"/></joint>'
        for i in range(count - 1)
    )
    hung = '<joint name="f" type="fixed"><parent link="tool"/><child link="n0"/></joint>'
    nested = "<a>" * 200_000 + "</a>" * 200_000
    text = edited(('<link name="tool"/>', f'<link name="tool"/>{links}{joints}{hung}{nested}'))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


def test_an_axis_of_a_fixed_joint_is_not_read():
    """Pinocchio does not read it either, nor does any other engine."""
    for xyz in ("0 0 0", "nan", "", "1 2"):
        text = edited(('<origin xyz="0.6 0 0"/>', f'<origin xyz="0.6 0 0"/><axis xyz="{xyz}"/>'))
        assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


def test_xacro_where_a_simulator_does_not_look():
    ignored = (
        '<gazebo><plugin filename="$(find pkg)/x.so"><a b="${c}"/>$(arg d)</plugin></gazebo>'
        '<link name="base"><visual><geometry><mesh filename="$(find pkg)/x.stl"/></geometry>'
        "</visual></link>"
    )
    text = edited(('<link name="base"/>', ignored))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links
