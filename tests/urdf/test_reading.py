"""What is refused: each time in one line that names the file, the culprit and what is allowed."""

import os
from pathlib import Path

import pytest

from tests.urdf.robots import PLAIN, edited, without
from twolink import UrdfError
from twolink.urdf import parse_planar_urdf, read_planar_urdf

LIMIT = '<limit effort="1" velocity="1"/>'
ELBOW_AXIS = '<axis xyz="0 1.0 0"/>'
ELBOW_ORIGIN = '<origin xyz="1 0 0" rpy="0 0 0"/>'


def refusal(text: str, **reading) -> str:
    with pytest.raises(UrdfError) as caught:
        parse_planar_urdf(text, source="arm.urdf", **reading)
    sentence = str(caught.value)
    assert len(sentence.splitlines()) == 1
    assert sentence.startswith("arm.urdf: ")
    assert sentence.count("arm.urdf") == 1
    assert "allowed" in sentence
    assert len(sentence) < 600
    return sentence


def names(sentence: str, *words: str) -> None:
    for word in words:
        assert word in sentence, (word, sentence)


def test_the_plain_robot_is_accepted():
    assert parse_planar_urdf(PLAIN).link_names == ("upper", "lower")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        pytest.param("", ["empty"], id="empty"),
        pytest.param(" \n\t", ["empty"], id="blank"),
        pytest.param(PLAIN[:-20], ["not well-formed"], id="cut short"),
        pytest.param("<robot name='r'/><robot/>", ["not well-formed"], id="two roots of XML"),
        pytest.param("no XML", ["not well-formed"], id="no XML"),
        pytest.param("<robot>\x00</robot>", ["not well-formed"], id="control character"),
        pytest.param("<robot>\ud800</robot>", ["not well-formed"], id="lone surrogate"),
        pytest.param("<robot>&nothing;</robot>", ["not well-formed"], id="unknown entity"),
        pytest.param("<sdf/>", ["sdf", "<robot>"], id="SDF"),
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
            ["xacro"],
            id="xacro element",
        ),
    ],
)
def test_text_that_is_not_urdf(text, words):
    names(refusal(text), *words)


def test_text_that_is_too_large():
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


def test_links_that_are_all_in_one_loop():
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
def test_what_the_standard_requires(edit, words):
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
    """What is absent is 0; whether they leave room is no matter of reading."""
    more = LIMIT.replace("/>", f" {attributes}/>")
    text = edited((f"{ELBOW_AXIS}\n  </joint>", f"{ELBOW_AXIS}{more}</joint>"))
    assert parse_planar_urdf(text).limits == (None, None)
    revolute = text.replace('name="elbow" type="continuous"', 'name="elbow" type="revolute"')
    assert parse_planar_urdf(revolute).limits == (None, limits)


def test_revolute_needs_a_limit():
    text = edited(('name="elbow" type="continuous"', 'name="elbow" type="revolute"'))
    names(refusal(text), "'elbow'", "limit")


def test_what_a_simulator_ignores_is_ignored():
    ignored = (
        '<material name="m"><color rgba="a b"/></material><gazebo><joint name="elbow"/></gazebo>'
        '<transmission name="t"><joint name="shoulder"/></transmission><!-- <!DOCTYPE> ${x} -->'
    )
    text = edited(('<link name="base"/>', f'{ignored}<link name="base"><visual/></link>'))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


def test_a_namespace_changes_nothing():
    # Drake's Acrobot.urdf has one.
    text = edited(("<robot ", '<robot xmlns="http://drake.mit.edu" '))
    assert parse_planar_urdf(text).links == parse_planar_urdf(PLAIN).links


def test_nothing_is_too_deep_for_a_stack():
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


def refused_file(path: Path | str) -> str:
    with pytest.raises(UrdfError) as caught:
        read_planar_urdf(path)
    sentence = str(caught.value)
    assert len(sentence.splitlines()) == 1
    assert sentence.startswith(f"{path}: ")
    assert "allowed" in sentence
    return sentence


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "empty"),
        (PLAIN.encode("utf-16"), "UTF-8"),
        (b"\xff\xfe\x00", "UTF-8"),
        (b"<robot>" + b" " * 17_000_000 + b"</robot>", "16 MB"),
        (PLAIN.encode()[:300], "not well-formed"),
    ],
)
def test_files_that_are_not_urdf(tmp_path, content, word):
    file = tmp_path / "arm.urdf"
    file.write_bytes(content)
    names(refused_file(file), word)


def test_paths_without_a_file(tmp_path):
    names(refused_file(tmp_path / "none.urdf"), "no file")
    names(refused_file(tmp_path), "folder")
    names(refused_file(tmp_path / "none" / "none.urdf"), "no file")
    with pytest.raises(UrdfError, match="cannot be read") as caught:
        read_planar_urdf(tmp_path / ("n" * 5000))
    assert len(str(caught.value)) < 200
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        names(refused_file(tmp_path / "pipe"), "no file")


def test_a_file_that_may_not_be_read(tmp_path, monkeypatch):
    file = tmp_path / "arm.urdf"
    file.write_text(PLAIN)

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    names(refused_file(file), "Permission denied")


def test_a_file_is_read_as_its_text(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_bytes(b"\xef\xbb\xbf" + PLAIN.encode())
    read = read_planar_urdf(file)
    assert (read.path, read.xml) == (str(file), PLAIN)
    assert read.links == parse_planar_urdf(PLAIN).links
    assert read_planar_urdf(str(file)) == read
