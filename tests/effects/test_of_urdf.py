"""A URDF's damping, friction and limits as effects: Pinocchio reads the same, for any axes."""

import itertools
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tests.urdf.drawing import arm, at, axis, joint, link, robot
from twolink import kane, lagrange
from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.of_urdf import effects_of
from twolink.errors import ParameterError, UrdfError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.urdf import PlanarUrdf, parse_planar_urdf, read_planar_urdf

ALL = ("damping", "friction", "limits")
SIGNS = list(itertools.product([1, -1], repeat=2))


def limit(attributes: str) -> str:
    return f'<limit {attributes} effort="1" velocity="1"/>'


def dynamics(damping: float, friction: float) -> str:
    return f'<dynamics damping="{damping!r}" friction="{friction!r}"/>'


def driven(shoulder: str, elbow: str, kind: str = "revolute") -> str:
    """Return the plain arm with more inside its two joints."""
    return arm(
        shoulder=joint("shoulder", "ground", "upper", kind, shoulder),
        elbow=joint("elbow", "upper", "lower", kind, at("1 0 0") + elbow),
    )


def drawn(random: np.random.Generator, signs: tuple[int, int]) -> str:
    """Return an arm with axes of these signs, at any angle, with any limits and resistance."""
    inside = []
    for sign, xyz in zip(signs, ("0 0 0", "1 0 0"), strict=True):
        lower, upper = np.sort(random.uniform(-4, 4, 2)).tolist()
        damping, friction, turned = random.uniform(0.1, 3, 3).tolist()
        length = sign * random.uniform(0.1, 5)
        inside.append(
            at(xyz, f"0 {turned!r} 0")
            + axis(f"0 {length!r} 0")
            + limit(f'lower="{lower!r}" upper="{upper!r}"')
            + dynamics(damping, friction)
        )
    one, two = inside
    joints = [
        joint("shoulder", "ground", "upper", "revolute", one),
        joint("elbow", "upper", "lower", "revolute", two),
        joint("wrist", "lower", "hand", "fixed", at("1 0 0") + dynamics(9.0, 9.0)),
    ]
    random.shuffle(joints)
    return robot(link("ground", ""), link("upper"), link("lower"), link("hand", ""), *joints)


def entries(read: PlanarUrdf, model: pin.Model, values: np.ndarray) -> tuple[float, float]:
    """Return Pinocchio's values of the two joints, whose order is its own."""
    one, two = (float(values[model.idx_vs[model.getJointId(name)]]) for name in read.joint_names)
    return one, two


# The identified double pendulum of DFKI's RealAIGym (dfki-ric-underactuated-lab/double_pendulum,
# design_C.1/model_1.0): b1, b2, cf1, cf2 of its model_parameters.yml are in its URDF, hanging at 0.
DFKI = """\
<robot name="pendulum"><link name="base"/><link name="Link1"><inertial><origin xyz="0 0 -0.2"/>
<mass value="0.5234602302310271"/><inertia ixx="0.031887199591513114" ixy="0" ixz="0"
iyy="0.031887199591513114" iyz="0" izz="0.031887199591513114"/></inertial></link>
<link name="Link2"><inertial><origin xyz="0 0 -0.25569305436052964"/>
<mass value="0.6255677234174437"/><inertia ixx="0.05086984812807257" ixy="0" ixz="0"
iyy="0.05086984812807257" iyz="0" izz="0.05086984812807257"/></inertial></link>
<joint name="Joint1" type="revolute"><parent link="base"/><child link="Link1"/><axis xyz="1 0 0"/>
<limit lower="-3.1415926" upper="3.1415926" effort="10.0" velocity="20"/>
<dynamics damping="0.001" friction="0.16"/></joint>
<joint name="Joint2" type="revolute"><origin xyz="0 0 -0.2"/><parent link="Link1"/>
<child link="Link2"/><axis xyz="1 0 0"/>
<limit lower="-3.1415926" upper="3.1415926" effort="10.0" velocity="20"/>
<dynamics damping="0.001" friction="0.12"/></joint></robot>
"""


def test_the_published_pendulum():
    read = parse_planar_urdf(DFKI)
    damping, friction, at_A, at_B = effects_of(read, ALL)
    assert damping == JointDamping((0.001, 0.001))
    assert friction == JointFriction((0.16, 0.12))
    # It hangs along y at zero, and the x-axis is a quarter turn away.
    down, turn = math.pi / 2, 3.1415926
    assert at_A == JointStop("A", down - turn, down + turn)
    assert at_B == JointStop("B", -turn, turn)
    assert Chain.from_links(read.links).mass == (0.5234602302310271, 0.6255677234174437)


def test_effects_come_in_the_order_they_are_asked_for():
    read = parse_planar_urdf(DFKI)
    damping, friction, *stops = effects_of(read, ALL)
    assert effects_of(read, ["limits", "damping"]) == (*stops, damping)
    assert effects_of(read, iter(["friction"])) == (friction,)
    assert effects_of(read, ()) == ()


@pytest.mark.parametrize("signs", SIGNS)
def test_pinocchio_reads_the_same_damping_friction_and_limits(signs, random):
    for _ in range(25):
        read = parse_planar_urdf(drawn(random, signs))
        assert read.joints.sign == signs
        model = pin.buildModelFromXML(read.xml)
        damping, friction, at_A, at_B = effects_of(read, ALL)
        assert damping == JointDamping(entries(read, model, model.damping))
        assert friction == JointFriction(entries(read, model, model.upperDryFrictionLimit))
        assert friction == JointFriction(entries(read, model, -model.lowerDryFrictionLimit))
        lower = entries(read, model, model.lowerPositionLimit)
        upper = entries(read, model, model.upperPositionLimit)
        assert read.limits == tuple(zip(lower, upper, strict=True))
        # The angles at which a stop stands, counted as the joint counts them, are the limits.
        for index, stop in enumerate((at_A, at_B)):
            sign, offset = signs[index], read.joints.offset[index]
            ends = sorted(sign * (angle - offset) for angle in (stop.lower, stop.upper))
            assert ends == pytest.approx([lower[index], upper[index]], abs=1e-14)
            assert stop.restitution == 0


@pytest.mark.parametrize("signs", SIGNS)
def test_a_stop_bars_exactly_the_joint_angles_beyond_pinocchios_limits(signs, random):
    for _ in range(10):
        read = parse_planar_urdf(drawn(random, signs))
        model, chain = pin.buildModelFromXML(read.xml), Chain.from_links(read.links)
        lower = entries(read, model, model.lowerPositionLimit)
        upper = entries(read, model, model.upperPositionLimit)
        stops = effects_of(read, ["limits"])
        for theta in random.uniform(-6, 6, (50, 2)).tolist():
            q = read.joints.absolute_angles(theta)
            for index, stop in enumerate(stops):
                free = [
                    bar.normal.coordinate(chain, q) > bar.bound
                    for bar in stop.contact_elements(chain)
                ]
                assert len(free) == 2
                assert all(free) == (lower[index] < theta[index] < upper[index])


@pytest.mark.parametrize("signs", SIGNS)
@pytest.mark.parametrize("equations", [kane, lagrange])
def test_the_torques_resist_the_joint_speeds(signs, equations, random):
    """In joint angles: −d θ̇ and −f sign θ̇, with Pinocchio's d and f, about axes of any sign."""
    for _ in range(25):
        read = parse_planar_urdf(drawn(random, signs))
        model, chain = pin.buildModelFromXML(read.xml), Chain.from_links(read.links)
        d = entries(read, model, model.damping)
        f = entries(read, model, model.upperDryFrictionLimit)
        angles, speeds = random.uniform(-3, 3, (2, 2)).tolist()
        q, u = read.joints.absolute_angles(angles), read.joints.absolute_speeds(speeds)
        loads = [
            load for e in effects_of(read, ["damping", "friction"]) for load in e.loads(chain, q, u)
        ]
        torques = read.joints.joint_forces(equations.generalized_active_force(chain, q, loads))
        expected = [-d[i] * speeds[i] - f[i] * math.copysign(1, speeds[i]) for i in range(2)]
        assert torques == pytest.approx(expected, abs=1e-13)


def test_zero_or_absent_coefficients_make_no_effect():
    read = parse_planar_urdf(driven(dynamics(0.2, 0.0), "", kind="continuous"))
    assert effects_of(read, ALL) == (JointDamping((0.2, 0.0)),)
    read = parse_planar_urdf(driven("", dynamics(0.0, 0.3), kind="continuous"))
    assert effects_of(read, ALL) == (JointFriction((0.0, 0.3)),)


def test_only_a_revolute_joint_has_stops():
    """A continuous joint turns freely whatever its <limit> says, in Pinocchio as here."""
    inside = at("1 0 0") + limit('lower="-1" upper="2"')
    text = arm(
        shoulder=joint("shoulder", "ground", "upper", "continuous", inside),
        elbow=joint("elbow", "upper", "lower", "revolute", inside),
    )
    assert effects_of(parse_planar_urdf(text), ["limits"]) == (JointStop("B", -1.0, 2.0),)
    model = pin.buildModelFromXML(text)
    assert list(model.nqs) == [0, 2, 1]
    assert (model.lowerPositionLimit[2], model.upperPositionLimit[2]) == (-1.0, 2.0)


@pytest.mark.parametrize(("attributes", "stop"), [('lower="-1"', (-1, 0)), ('upper="2"', (0, 2))])
def test_a_limit_that_is_absent_is_zero(attributes, stop):
    text = driven(limit(attributes), limit(attributes))
    stops = effects_of(parse_planar_urdf(text), ["limits"])
    assert stops == (JointStop("A", *stop), JointStop("B", *stop))
    model = pin.buildModelFromXML(text)
    assert list(model.lowerPositionLimit) == [stop[0]] * 2
    assert list(model.upperPositionLimit) == [stop[1]] * 2


TURNED = at("0 0 0", "0 1.5 0")


@pytest.mark.parametrize(
    ("shoulder", "elbow", "asked", "words"),
    [
        ("", "", ALL, ["no damping or friction or limits", "must be of none"]),
        ("", "", ["limits"], ["'shoulder', 'elbow'", "no limits", "must be of none"]),
        (dynamics(0.0, 0.1), "", ["damping"], ["no damping", "must be of friction"]),
        (dynamics(0.0, 0.0), "", ["damping"], ["no damping", "must be of none"]),
        (dynamics(-0.1, 0.0), "", ["damping"], ["'shoulder'", "got -0.1", "N m s/rad"]),
        ("", dynamics(0.0, -0.2), ["friction"], ["'elbow'", "got -0.2", "N m"]),
    ],
)
def test_effects_that_the_joints_do_not_have_are_refused(shoulder, elbow, asked, words):
    refused(driven(shoulder, elbow, kind="continuous"), asked, words)


@pytest.mark.parametrize(
    ("attributes", "words"),
    [
        ("", ["lower 0.0 and upper 0.0"]),
        ('lower="1" upper="1"', ["lower 1.0 and upper 1.0"]),
        ('lower="1" upper="-1"', ["lower 1.0 and upper -1.0"]),
        ('lower="1"', ["lower 1.0 and upper 0.0"]),
        # Counted from x, these are one angle.
        ('lower="1e-20" upper="2e-20"', ["lower 1e-20 and upper 2e-20"]),
    ],
)
@pytest.mark.parametrize("turn", ["0 1 0", "0 -1 0"])
def test_limits_that_leave_no_room_are_refused_where_they_are_asked_for(attributes, words, turn):
    shoulder = TURNED + axis(turn) + limit(attributes)
    text = driven(shoulder, limit('lower="-1" upper="1"') + dynamics(0.1, 0.0))
    refused(text, ["limits"], ["'shoulder'", "lower limit must be below", *words])
    assert effects_of(parse_planar_urdf(text), ["damping"]) == (JointDamping((0.0, 0.1)),)


def refused(text: str, asked, words: list[str]) -> None:
    """Check that a URDF is read, and that requests for its effects are refused in one sentence."""
    read = parse_planar_urdf(text, source="arm.urdf")
    with pytest.raises(UrdfError) as caught:
        effects_of(read, asked)
    sentence = str(caught.value)
    assert sentence.startswith("arm.urdf: ")
    for word in ("must be", *words):
        assert word in sentence, (word, sentence)
    assert "\n" not in sentence


@pytest.mark.parametrize("asked", [["limit"], ["damping", "damping"], "damping", [None]])
def test_other_words_are_refused(asked):
    with pytest.raises(ParameterError, match="must be of damping, friction, limits, each at most"):
        effects_of(parse_planar_urdf(DFKI), asked)


@pytest.mark.slow_but_first
@pytest.mark.parametrize("signs", SIGNS)
def test_a_simulated_arm_stays_within_its_limits(signs, tmp_path):
    """Falling from the horizontal, both joints come to rest on a limit of the file."""
    texts = [axis(f"0 {sign} 0") + limit('lower="-0.4" upper="0.3"') for sign in signs]
    file = tmp_path / "arm.urdf"
    file.write_text(driven(*texts))
    read = read_planar_urdf(file)
    stops = effects_of(read, ["limits"])
    chain = Chain.from_links(read.links)
    scene = Scene(chain, (0.0, 0.0), (0.0, 0.0), 3.0, (Gravity(9.81), *stops))
    trajectory = simulate(scene)
    assert trajectory.impacts
    theta = np.array(read.joints.joint_angles(tuple(trajectory.q)))
    assert theta.min() >= -0.4 - 1e-9
    assert theta.max() <= 0.3 + 1e-9
    # It falls the way in which q1 grows.
    assert theta[0, -1] == pytest.approx(0.3 if signs[0] > 0 else -0.4, abs=1e-9)


@pytest.mark.slow
def test_the_module_is_imported_only_for_scenes_with_urdf_effects(tmp_path):
    (tmp_path / "arm.urdf").write_text(DFKI)
    scene = '[chain]\nurdf = "arm.urdf"\n{}\n[start]\nq = [0.0, 0.0]\n[run]\nduration = 1.0\n'
    (tmp_path / "plain.toml").write_text(scene.format(""))
    (tmp_path / "empty.toml").write_text(scene.format("effects = []"))
    (tmp_path / "damped.toml").write_text(scene.format('effects = ["damping"]'))
    assert imported_by(tmp_path / "plain.toml") == {"effect"}
    assert imported_by(tmp_path / "empty.toml") == {"effect"}
    assert imported_by(tmp_path / "damped.toml") == {"effect", "of_urdf", "joint_damping"}


def imported_by(scene: Path) -> set[str]:
    """Return the effects that a fresh interpreter has imported after loading a scene."""
    program = (
        "import sys\n"
        "from twolink.scene import Scene\n"
        f"Scene.load({str(scene)!r})\n"
        "print(*[m.split('.')[2] for m in sys.modules if m.startswith('twolink.effects.')])"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    return set(run.stdout.split())
