"""Files as people draw them, read by us and by Pinocchio, and verified against each other."""

import io
import math

import numpy as np
import pytest
import yourdfpy

from tests.urdf.drawing import INERTIA, LINK, arm, at, axis, joint, link, robot
from twolink import kinematics, lagrange
from twolink.chain import Chain
from twolink.engines.pinocchio_chain import PinocchioChain
from twolink.urdf import parse_planar_urdf
from twolink.verification import verify

QUARTER = repr(math.pi / 2)
LIMIT = '<limit effort="1" velocity="1"/>'


def assert_agrees(text: str, **reading):
    """Read a URDF, and verify it against Pinocchio, which reads it in its own way."""
    urdf = parse_planar_urdf(text, **reading)
    verdict = verify(urdf, states=50, seed=1)
    assert verdict.passed, verdict.sentence
    return urdf


def test_the_plain_arm():
    urdf = assert_agrees(arm())
    assert urdf.joint_names == ("shoulder", "elbow")
    assert urdf.joints.sign == (1, 1)
    assert urdf.joints.offset == (0.0, 0.0)
    assert urdf.axes == ((1, 0, 0), (0, 0, -1), (0, 1, 0))
    assert [(p.mass, p.length, p.centre, p.inertia) for p in urdf.links] == [
        (1.0, 1.0, (0.5, 0.0), 0.1)
    ] * 2
    assert urdf.tip == "hand"
    assert len(urdf.notes) == 1


DRAWINGS = {
    "revolute": {"elbow": joint("elbow", "upper", "lower", "revolute", LIMIT + at("1 0 0"))},
    "hanging down": {
        "elbow": joint("elbow", "upper", "lower", inside=at("0 0 -1")),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("0 0 -1")),
    },
    "standing up": {
        "elbow": joint("elbow", "upper", "lower", inside=at("0 0 1")),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("0 0 1")),
    },
    "drawn to the left": {
        "elbow": joint("elbow", "upper", "lower", inside=at("-1 0 0")),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("-1 0 0")),
    },
    "folded": {"wrist": joint("wrist", "lower", "hand", "fixed", at("-0.7 0 0.1"))},
    "axis backwards": {
        "shoulder": joint("shoulder", "ground", "upper", inside=axis("0 -1 0")),
        "elbow": joint("elbow", "upper", "lower", inside=axis("0 -3 0") + at("1 0 0")),
    },
    "axes opposed": {
        "elbow": joint("elbow", "upper", "lower", inside=axis("0 -1 0") + at("1 0 0"))
    },
    "axis along x": {
        "shoulder": joint("shoulder", "ground", "upper", inside=axis("1 0 0")),
        "elbow": joint("elbow", "upper", "lower", inside=axis("1 0 0") + at("0 0.3 0.8")),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("0.2 0.5 0")),
    },
    "default axis": {
        "shoulder": joint("shoulder", "ground", "upper").replace('<axis xyz="0 1 0"/>', ""),
        "elbow": joint("elbow", "upper", "lower", inside=axis("2 0 0") + at("0 0 1")),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("0 1 0")),
    },
    "placed and turned": {
        "shoulder": joint("shoulder", "ground", "upper", inside=at("3 -2 5", "0 0.4 0.9"))
    },
    "elbow turned": {
        "elbow": joint("elbow", "upper", "lower", inside=at("1 0.2 0.3", "0 0.7 0")),
    },
    "elbow turned over": {
        "elbow": joint("elbow", "upper", "lower", inside=at("1 0.2 0.3", f"0 0 {math.pi!r}")),
    },
    "axis turned by rpy": {
        "elbow": joint(
            "elbow", "upper", "lower", inside=at("1 0 0", f"{QUARTER} 0 0") + axis("0 0 -1")
        ),
        "wrist": joint("wrist", "lower", "hand", "fixed", at("0.6 0.2 0")),
    },
    "inertial turned": {
        "upper": link(
            "upper",
            LINK.format(inertia=INERTIA).replace(
                'xyz="0.5 0 0"', 'xyz="0.4 0.3 0.1" rpy="0.3 0.5 -0.7"'
            ),
        )
    },
    "mass on fixed links": {
        "hand": link("hand"),
        "tool": link("tool", LINK.format(inertia=INERTIA)),
        "mount": joint("mount", "hand", "tool", "fixed", at("0.1 0.2 0.3", "0.1 0.2 0.3")),
    },
    "carrier without inertial": {
        "upper": link("upper", ""),
        "sleeve": link("sleeve"),
        "glue": joint("glue", "upper", "sleeve", "fixed", at("0.1 0 0")),
    },
    "ground with mass": {"ground": link("ground")},
    "other things in the file": {
        "more": '<transmission name="t"/><gazebo/><material name="m"/>',
    },
}


@pytest.mark.slow_but_first
@pytest.mark.parametrize("drawing", DRAWINGS)
def test_real_drawings_agree_with_pinocchio(drawing):
    assert_agrees(arm(**DRAWINGS[drawing]))


def test_the_frame_follows_gravity_and_the_world():
    """y is down; x points where the world's axes do, whichever way the joint's axis points."""
    for drawing in ("plain", "axis backwards"):
        urdf = parse_planar_urdf(arm(**DRAWINGS.get(drawing, {})))
        assert urdf.axes == ((1, 0, 0), (0, 0, -1), (0, 1, 0))
    assert urdf.joints.sign == (-1, -1)
    hanging = parse_planar_urdf(arm(**DRAWINGS["hanging down"]))
    assert hanging.joints.offset == (pytest.approx(math.pi / 2), 0.0)


VERTICAL_AXES = {
    "shoulder": joint("shoulder", "ground", "upper", inside=axis("0 0 1")),
    "elbow": joint("elbow", "upper", "lower", inside=axis("0 0 1") + at("1 0 0")),
}
OBLIQUE = {"shoulder": joint("shoulder", "ground", "upper", inside=at("0 0 0", "0.3 0 0"))}


def test_gravity_out_of_the_plane_when_asked_for():
    flat = assert_agrees(arm(**VERTICAL_AXES))
    assert flat.gravity == 0.0
    assert flat.axes == ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    tilted = assert_agrees(arm(**OBLIQUE))
    assert tilted.gravity == pytest.approx(9.81 * math.cos(0.3))


def test_gravity_of_another_direction_and_size():
    sideways = assert_agrees(arm(), gravity=(3.0, 0.0, 0.0))
    assert sideways.gravity == 3.0
    assert sideways.axes[1] == (1, 0, 0)
    none = assert_agrees(arm(), gravity=(0.0, 0.0, 0.0))
    assert none.gravity == 0.0


# Random files: a base anywhere, an axis in any direction and sign, links in several pieces with
# turned inertials, displacements out of the plane.


def random_rotation(random):
    return " ".join(repr(float(x)) for x in random.uniform(-3, 3, 3))


def messy(random) -> str:
    """A chain in a vertical plane, drawn as wildly as URDF allows."""

    def vector(size=1.0):
        return " ".join(repr(float(x)) for x in random.uniform(-size, size, 3))

    def piece(name):
        root = random.uniform(0.1, 1, (3, 3))
        body = root @ root.T + np.eye(3) * 0.1
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.tolist()
        return link(
            name,
            f'<inertial><mass value="{random.uniform(0.1, 3)!r}"/>'
            f'<origin xyz="{vector()}" rpy="{random_rotation(random)}"/>'
            f'<inertia ixx="{xx!r}" ixy="{xy!r}" ixz="{xz!r}" '
            f'iyy="{yy!r}" iyz="{yz!r}" izz="{zz!r}"/>'
            "</inertial>",
        )

    # The second axis must be the first one's in another frame: a turn about it keeps it.
    direction = random.choice(["1 0 0", "0 1 0", "0 0 1"])
    about = {"1 0 0": "{} 0 0", "0 1 0": "0 {} 0", "0 0 1": "0 0 {}"}[direction]
    turned = about.format(repr(float(random.uniform(-3, 3))))
    backwards = direction.replace("1", random.choice(["-1", "2.5"]))
    # The base turns about the vertical and about the axis, so that gravity stays in the plane.
    upright = {"1 0 0": "0 0 0", "0 1 0": "0 0 0", "0 0 1": f"{QUARTER} 0 0"}[direction]
    yaw = f"0 0 {float(random.uniform(-3, 3))!r}"
    return robot(
        link("ground", ""),
        link("base", ""),
        link("stand"),
        joint("feet", "ground", "base", "fixed", at(vector(5), yaw)),
        joint("column", "base", "stand", "fixed", at(vector(5), upright)),
        piece("upper"),
        piece("upper_half"),
        piece("lower"),
        piece("lower_half"),
        link("sensor", ""),
        joint("a", "stand", "upper", inside=at(vector(), turned) + axis(direction)),
        joint("a_half", "upper", "upper_half", "fixed", at(vector(), random_rotation(random))),
        # Fixed turns to and fro between the moving joints.
        link("bracket", ""),
        joint("bracket", "upper", "bracket", "fixed", at(vector(), turned)),
        joint("b", "bracket", "lower", inside=at(vector(), turned) + axis(backwards)),
        joint("b_half", "lower", "lower_half", "fixed", at(vector(), random_rotation(random))),
        joint("b_tip", "lower_half", "sensor", "fixed", at(vector(), random_rotation(random))),
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", range(40))
def test_messy_files_agree_with_pinocchio(number):
    random = np.random.default_rng([number, 7])
    assert_agrees(messy(random))


@pytest.mark.parametrize("number", range(5))
def test_forward_kinematics_of_three_readers(number):
    """yourdfpy, Pinocchio and this library put the end point and the mass centres in one place."""
    random = np.random.default_rng([number, 9])
    text = messy(random)
    urdf = parse_planar_urdf(text)
    chain = Chain.from_links(urdf.links)
    theirs = yourdfpy.URDF.load(io.StringIO(text), build_scene_graph=True, load_meshes=False)
    engine = PinocchioChain(urdf)
    plane, origin = np.array(urdf.axes[:2]), np.array(urdf.origin)
    for theta in random.uniform(-3, 3, (20, 2)):
        theirs.update_cfg(dict(zip(urdf.joint_names, theta, strict=True)))
        tip = plane @ (theirs.get_transform(urdf.tip, "ground")[:3, 3] - origin)
        q = urdf.joints.absolute_angles(tuple(map(float, theta)))
        ours = kinematics.position(chain, q, chain.D)
        column = theta[:, None]
        pinocchio = engine.point_motion("D", column, column, column)[0, :, 0]
        assert ours == pytest.approx(tuple(tip), abs=1e-13)
        assert ours == pytest.approx(tuple(pinocchio), abs=1e-13)


def test_a_published_arm_is_read_as_published():
    """Drake's Acrobot: inertias about the joints .333 and 1.33, centres at .5 and 1."""
    acrobot = Chain(
        mass=(1.0, 1.0),
        length=(1.0, 2.0),
        centre=((0.5, 0.0), (1.0, 0.0)),
        inertia=(0.333 - 0.25, 1.33 - 1.0),
    )
    urdf = assert_agrees(acrobot.to_urdf(name="acrobot"))
    read = Chain.from_links(urdf.links)
    assert read == acrobot
    (M11, _), (_, M22) = lagrange.mass_matrix(read, (0.0, 0.0))
    assert pytest.approx(0.333 + 1.0) == M11
    assert pytest.approx(1.33) == M22
