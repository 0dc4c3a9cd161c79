import pytest

from tests.urdf.drawing import arm, at, joint, link
from twolink.urdf.description import describe


def bar(mass: float = 1.0, centre: str = "0.5 0 0", **moments: float) -> str:
    values = {"ixx": 0.1, "iyy": 1 / 12, "izz": 0.1, "ixy": 0, "ixz": 0, "iyz": 0} | moments
    inertia = " ".join(f'{name}="{value!r}"' for name, value in values.items())
    return (
        f'<inertial><origin xyz="{centre}"/><mass value="{mass}"/><inertia {inertia}/></inertial>'
    )


def limited(attributes: str) -> str:
    inside = at("1 0 0") + f'<limit effort="1" velocity="1" {attributes}/>'
    return joint("elbow", "upper", "lower", "revolute", inside)


def test_a_plain_arm_is_plausible():
    assert describe(arm(upper=link("upper", bar()), lower=link("lower", bar()))).warnings == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"upper": link("upper", bar(ixx=0.3))},
            ["'upper'", "0.0833333, 0.1, 0.3", "exceeds the sum"],
        ),
        ({"upper": link("upper", bar(ixy=0.2))}, ["'upper'", "-0.108507", "negative"]),
        ({"upper": link("upper", bar(ixx=1.0, iyy=1.0, izz=1.0))}, ["identity"]),
        ({"upper": link("upper", bar(centre="1.5 0 0"))}, ["'upper'", "outside"]),
        ({"upper": link("upper", bar(centre="0.5 0 -0.6"))}, ["'upper'", "outside", "0.6 m"]),
        ({"lower": link("lower", bar(iyy=1 / 12 * 1.04))}, ["4% above", "0.2 m wide"]),
        ({"lower": link("lower", bar(ixx=6.0, iyy=6.0, izz=6.0))}, ["gyration", "2.449 m"]),
        ({"wrist": joint("wrist", "lower", "hand", "fixed", at("500 0 0"))}, ["500 m", "mm"]),
        ({"elbow": limited("")}, ["'elbow'", "0 to 0"]),
        ({"elbow": limited('lower="1" upper="-1"')}, ["'elbow'", "no room"]),
        ({"elbow": limited('lower="-90" upper="90"')}, ["'elbow'", "degrees"]),
    ],
)
def test_suspicious_numbers_are_named(change, words):
    plain = {"upper": link("upper", bar()), "lower": link("lower", bar())}
    warnings = describe(arm(**{**plain, **change})).warnings
    assert any(all(word in warning for word in words) for warning in warnings), warnings
