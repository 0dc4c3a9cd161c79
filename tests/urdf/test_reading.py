"""Files that are no URDF, or no tree: each is refused in one sentence that names the culprit."""

import pytest

from tests.urdf.drawing import BAR, arm, at, axis, joint, link, robot
from twolink.errors import UrdfError
from twolink.urdf import parse_planar_urdf, read_planar_urdf
from twolink.urdf.reading import LARGEST_FILE, parse_tree

MIMIC = '<mimic joint="shoulder"/>'


def refusal(text: str, **reading) -> str:
    with pytest.raises(UrdfError) as caught:
        parse_planar_urdf(text, source="arm.urdf", **reading)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert sentence.startswith("arm.urdf: ")
    return sentence


def test_the_plain_arm_is_read():
    tree = parse_tree(arm(), "arm.urdf")
    assert tree.root == "ground"
    assert list(tree.links) == ["ground", "upper", "lower", "hand"]
    assert [joint.name for joint in tree.joints] == ["shoulder", "elbow", "wrist"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("  \n", "is empty"),
        ("<robot", "not well-formed XML"),
        (arm()[:-30], "not well-formed XML"),
        (arm() + arm(), "not well-formed XML"),
        ("<sdf/>", "its root is <sdf>; allowed is <robot>"),
        (robot(), "no links"),
        ('<!DOCTYPE robot [<!ENTITY a "b">]>' + arm(), "document type or entities"),
        (arm(upper=link("${prefix}upper")), "run xacro"),
    ],
)
def test_no_urdf_is_refused(text, words):
    assert words in refusal(text)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"extra": link("upper")}, "link 'upper' is there twice"),
        ({"extra": link("")}, "a <link> has no name"),
        ({"extra": link("loose")}, "links 'ground' and 'loose' are both roots"),
        ({"hand": ""}, "joint 'wrist' names link 'hand'"),
        ({"extra": joint("again", "ground", "hand", "fixed")}, "link 'hand' hangs on joints"),
        ({"extra": joint("wrist", "hand", "hand2", "fixed")}, "joint 'wrist' is there twice"),
        ({"ground": "", "shoulder": joint("shoulder", "hand", "upper")}, "run in a circle"),
        (
            {
                "extra": link("a", "")
                + link("b", "")
                + joint("ab", "a", "b")
                + joint("ba", "b", "a")
            },
            "is in a circle",
        ),
        ({"wrist": '<joint name="wrist" type="fixed"><child link="hand"/></joint>'}, "<parent> is"),
        ({"wrist": joint("wrist", "lower", "", "fixed")}, "its <child> names no link"),
        ({"wrist": joint("wrist", "lower", "hand", "")}, "joint 'wrist': its type is ''"),
        ({"wrist": joint("wrist", "lower", "hand", "ball")}, "its type is 'ball'"),
        ({"elbow": joint("elbow", "upper", "lower", "prismatic")}, "joint 'elbow': it is prism"),
        ({"elbow": joint("elbow", "upper", "lower", "floating")}, "it is floating"),
        ({"elbow": joint("elbow", "upper", "lower", "planar")}, "it is planar"),
        ({"elbow": joint("elbow", "upper", "lower", inside=MIMIC)}, "'elbow': it mimics"),
        ({"elbow": joint("elbow", "upper", "lower", "revolute")}, "revolute without <limit>"),
        (
            {"elbow": joint("elbow", "upper", "lower", "revolute", '<limit effort="1"/>')},
            "joint 'elbow': limit: velocity is missing",
        ),
        ({"elbow": joint("elbow", "upper", "lower", inside=axis("0 0 0"))}, "its axis is 0 0 0"),
        ({"elbow": joint("elbow", "upper", "lower", inside=axis("0 nan 0"))}, "xyz is '0 nan 0'"),
        ({"elbow": joint("elbow", "upper", "lower", inside=axis("0 1"))}, "xyz is '0 1'"),
        ({"elbow": joint("elbow", "upper", "lower", inside="<axis/>" + at("1 0 0"))}, "is missing"),
        ({"elbow": joint("elbow", "upper", "lower", inside=at("1 inf 0"))}, "'elbow': origin: xyz"),
        ({"elbow": joint("elbow", "upper", "lower", inside=at("1 0 0", "0 0"))}, "rpy is '0 0'"),
        ({"upper": link("upper", BAR.replace('"1"', '"-1"'))}, "link 'upper': mass is -1.0"),
        ({"upper": link("upper", BAR.replace('"1"', '"abc"'))}, "value is 'abc'"),
        ({"upper": link("upper", BAR.replace('"1"', '"nan"'))}, "value is 'nan'"),
        ({"upper": link("upper", BAR.replace('"1"', '"1_0"'))}, "value is '1_0'"),
        ({"upper": link("upper", BAR.replace('"1"', '"1 2"'))}, "value is '1 2'"),
        ({"upper": link("upper", BAR.replace('iyy="0.1"', 'iyy="inf"'))}, "inertia: iyy is 'inf'"),
        ({"upper": link("upper", BAR.replace('iyy="0.1"', ""))}, "inertia: iyy is missing"),
        (
            {"upper": link("upper", '<inertial><mass value="1"/></inertial>')},
            "<inertia> is missing",
        ),
        ({"upper": link("upper", "<inertial/>")}, "<mass> is missing"),
        ({"upper": link("upper", BAR.replace('"1"', '"0"'))}, "it has inertia and no mass"),
    ],
)
def test_a_broken_tree_is_refused(changes, words):
    assert words in refusal(arm(**changes))


def test_long_values_are_shortened():
    sentence = refusal(arm(upper=link("upper", BAR.replace('"1"', f'"{"9" * 5000}x"'))))
    assert len(sentence) < 200


def test_files_that_cannot_be_read_are_refused(tmp_path):
    for path, words in ((tmp_path / "no.urdf", "no such file"), (tmp_path, "not a file")):
        with pytest.raises(UrdfError, match=words):
            read_planar_urdf(path)
    latin = tmp_path / "latin.urdf"
    latin.write_bytes(arm().replace("hand", "händ").encode("latin-1"))
    with pytest.raises(UrdfError, match="is not UTF-8"):
        read_planar_urdf(latin)
    big = tmp_path / "big.urdf"
    big.write_bytes(b" " * (LARGEST_FILE + 1))
    with pytest.raises(UrdfError, match="larger than"):
        read_planar_urdf(big)


def test_a_byte_order_mark_and_a_declaration_are_fine(tmp_path):
    file = tmp_path / "arm.urdf"
    file.write_bytes(b"\xef\xbb\xbf" + b'<?xml version="1.0" encoding="utf-8"?>' + arm().encode())
    assert read_planar_urdf(file).link_names == ("upper", "lower")


def test_deep_nesting_and_long_chains_are_bounded():
    deep = "<a>" * 100_000 + "</a>" * 100_000
    assert parse_planar_urdf(arm(extra=deep)).link_names == ("upper", "lower")
    n = 20_000
    frames = [link(f"f{i}", "") for i in range(n)]
    joints = [
        joint(f"j{i}", f"f{i - 1}" if i else "hand", f"f{i}", "fixed", at("0.001 0 0"))
        for i in range(n)
    ]
    long = parse_planar_urdf(arm(extra="".join(frames + joints)))
    assert long.links[1].length == pytest.approx(1 + n / 1000)
