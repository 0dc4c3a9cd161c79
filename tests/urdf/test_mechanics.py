import pytest

from tests.urdf.drawing import arm, at, axis, joint, link
from twolink.urdf import parse_planar_urdf
from twolink.urdf.mechanics import difference, mechanics_of, same_motion
from twolink.urdf.reading import parse_xml

NONE: frozenset[str] = frozenset()


def of(text: str) -> dict[str, object]:
    return mechanics_of(parse_xml(text))


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"upper": link("upper", "")}, "link 'upper'"),
        ({"extra": link("extra")}, "link 'extra'"),
        ({"elbow": joint("elbow", "upper", "lower", inside=at("1 0 0.001"))}, "joint number 2"),
        ({"elbow": joint("elbow", "upper", "lower", inside=at("1 0 0") + axis("0 -1 0"))}, "2"),
        (
            {
                "elbow": joint(
                    "elbow", "upper", "lower", inside=at("1 0 0") + '<dynamics damping="1"/>'
                )
            },
            "joint number 2",
        ),
        ({"wrist": joint("wrist", "upper", "hand", "fixed", at("1 0 0"))}, "joint number 3"),
    ],
)
def test_a_change_of_mechanics_is_located(change, where):
    assert where in difference(of(arm()), of(arm(**change)), NONE)


def test_names_of_joints_limits_and_frames_are_no_mechanics():
    elbow = joint("bend", "upper", "lower", "revolute", at("1 0 0") + '<limit effort="1"/>')
    assert difference(of(arm()), of(arm(elbow=elbow, frame=link("frame", ""))), NONE) == ""


def test_an_isotropic_inertia_is_free_but_its_mass_is_not():
    inertial = '<inertial><origin xyz="0.5 0 0"/><mass value="{}"/><inertia ixx="9"/></inertial>'
    before, free = of(arm()), frozenset({"upper"})
    assert difference(before, of(arm(upper=link("upper", inertial.format(1)))), free) == ""
    assert difference(before, of(arm(upper=link("upper", inertial.format(2)))), free)


def test_the_same_motion():
    plain, heavy = (
        parse_planar_urdf(arm()),
        parse_planar_urdf(arm(tool=link("tool"), m=joint("m", "lower", "tool", "fixed"))),
    )
    assert same_motion(plain, plain)
    assert not same_motion(plain, heavy)
