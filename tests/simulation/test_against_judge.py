"""Random scenes of friction, stops and rigid surfaces, by the simulator and by its judge."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from tests.conftest import SEED
from tests.judge import JudgeGivesUp, judge
from tests.judge.equations import Contact, System
from twolink import Scene, simulate
from twolink.chain import Chain
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.errors import SimulationError

# Largest difference in q (rad) and u (rad/s) at samples that are not next to an impact.
TOLERANCE = 1e-6
# Samples so near to an impact (s) are not compared: its instant is known to rounding only.
NEXT_TO_AN_IMPACT = 1e-6
SAMPLES = 41
LAWS = ("newton", "newton-routh", "poisson", "stronge")


@dataclass(frozen=True)
class Comparison:
    """The largest difference of the two motions, or why there is none."""

    scene: Scene
    difference: float = np.inf
    given_up: str = ""
    refused: str = ""

    @property
    def agrees(self):
        return self.difference <= TOLERANCE


def compared(scene):
    """Return the comparison of a scene's two motions."""
    times = np.linspace(0, scene.duration, SAMPLES)
    try:
        true = judge(scene, times)
    except JudgeGivesUp as reason:
        return Comparison(scene, given_up=str(reason))
    try:
        found = simulate(scene, samples=SAMPLES)
    except (SimulationError, ArithmeticError, RecursionError) as error:
        return Comparison(scene, refused=repr(error))
    struck = np.array([impact.time for impact in true.impacts])[:, None]
    near = (np.abs(struck - times) <= NEXT_TO_AN_IMPACT).any(axis=0) if len(struck) else False
    keep = ~np.broadcast_to(near, times.shape)
    apart = max(np.abs(found.q - true.q)[:, keep].max(), np.abs(found.u - true.u)[:, keep].max())
    return Comparison(scene, float(apart))


def pair(random, low, high):
    return tuple(random.uniform(low, high, 2).tolist())


def number(random, low, high):
    return float(random.uniform(low, high))


def random_chain(random):
    if random.random() < 0.3:
        return Chain.uniform_bars(pair(random, 0.3, 3), pair(random, 0.4, 1.5))
    mass, length = pair(random, 0.3, 3), pair(random, 0.4, 1.5)
    centre = tuple(
        (L * number(random, 0.2, 0.8), L * number(random, -0.1, 0.1) * random.integers(2))
        for L in length
    )
    inertia = tuple(
        m * L * L * number(random, 0.03, 0.15) for m, L in zip(mass, length, strict=True)
    )
    return Chain(mass, length, tuple((float(a), float(b)) for a, b in centre), inertia)


def friction_pair(random, low, high):
    """A kinetic and a static friction, the same in half of all cases."""
    kinetic = pair(random, low, high)
    if random.random() < 0.5:
        return kinetic, None
    return kinetic, tuple(k * number(random, 1, 1.8) for k in kinetic)


def random_surface(random, chain, q, name):
    """A surface below or beside the chain; in a quarter of all cases D starts on it."""
    points = [("D",), ("D",), ("B", "D"), ("C2", "D"), ("B",), ("B", "C2", "D")]
    on = points[random.integers(len(points))]
    angle = number(random, -0.6, 0.6)
    normal = (float(np.sin(angle)), float(-np.cos(angle)))
    if random.random() < 0.2:
        normal = (0.0, -1.0)
    friction = number(random, 0, 0.9) * random.integers(2)
    static = friction * number(random, 1, 1.5) if random.random() < 0.3 else None
    surface = Surface(
        (0.0, 0.0), normal, on=on, friction=float(friction), static=static, name=name,
        restitution=float(number(random, 0, 0.8) * random.integers(2)),
        law=LAWS[random.integers(4)],
    )  # fmt: skip
    # The bound is set so far off that all points start outside.
    scene = Scene(chain, q, (0.0, 0.0), 1.0, (surface,))
    gaps = [e.gap(q) for e in System(scene).elements if isinstance(e, Contact)]
    space = 0.0 if random.random() < 0.25 else number(random, 0.02, 0.5)
    depth = min(gaps) - space
    return replace(surface, point=(normal[0] * depth, normal[1] * depth))


def random_stops(random, q):
    joint = "AB"[random.integers(2)]
    angle = q[0] if joint == "A" else q[1] - q[0]
    e = float(number(random, 0, 0.8) * random.integers(2))
    upper = angle + number(random, 0.05, 1) if random.random() < 0.6 else None
    return JointStop(joint, angle - number(random, 0.05, 1), upper, e)


def random_scene(random):
    """A scene with friction, stops and rigid surfaces in every mixture."""
    chain, q = random_chain(random), pair(random, -0.5, 2.5)
    u = pair(random, -2, 2) if random.random() < 0.6 else (0.0, 0.0)
    effects = [Gravity()]
    if random.random() < 0.5:
        effects.append(JointFriction(*friction_pair(random, 0, 4)))
    if random.random() < 0.5:
        effects.append(random_stops(random, q))
    for k in range(random.integers(3)):
        effects.append(random_surface(random, chain, q, f"s{k}"))
    if random.random() < 0.2:
        mu = number(random, 0, 0.8)
        effects.append(EndForce(number(random, -8, 8), mu, static=mu * number(random, 1, 1.3)))
    if random.random() < 0.3:
        effects.append(
            JointTorque(
                pair(random, -2, 2), pair(random, 0, 4), pair(random, 1, 6), pair(random, 0, 6)
            )
        )
    if random.random() < 0.15:
        effects.append(JointDamping(pair(random, 0, 0.5)))
    if random.random() < 0.15:
        effects.append(JointSpring(pair(random, 0, 10), pair(random, -1, 1)))
    duration = number(random, 0.5, 1.2)
    return Scene(chain, q, u, duration, tuple(effects), accuracy=1e-9)


def scene_of_static_friction(random):
    """A scene whose joints hold more at rest than while they turn."""
    chain, q = random_chain(random), pair(random, -3, 3)
    u = pair(random, -2, 2) if random.random() < 0.5 else (0.0, 0.0)
    weight = 9.81 * (chain.mass[0] + chain.mass[1]) * chain.length[0]
    static = number(random, 0.05, 1.2) * weight, number(random, 0.02, 0.6) * weight
    kinetic = tuple(s * number(random, 0.2, 0.95) for s in static)
    effects = [Gravity(), JointFriction(kinetic, static)]
    if random.random() < 0.5:
        size = (number(random, 0, weight), number(random, 0, weight / 2))
        effects.append(JointTorque(amplitude=size, frequency=pair(random, 1, 6)))
    return Scene(chain, q, u, number(random, 0.5, 1.5), tuple(effects), accuracy=1e-9)


def check(draw, count, most_given_up, part=0):
    """Compare many scenes; print the number that the judge gave up, and the disagreements."""
    random = np.random.default_rng(SEED + part)
    found = [compared(draw(random)) for _ in range(count)]
    given_up = [item.given_up for item in found if item.given_up]
    wrong = [k for k, item in enumerate(found) if not item.given_up and not item.agrees]
    print(f"\n{count} scenes, {len(given_up)} given up by the judge: {sorted(set(given_up))}")
    assert len(given_up) <= most_given_up
    assert not wrong, f"{len(wrong)} of {count} differ: {wrong}; the first: {found[wrong[0]]}"


# Parts of a hundred scenes share the processes of a test run evenly.
@pytest.mark.slow
@pytest.mark.parametrize("part", range(3))
def test_many_scenes_agree_with_the_judge(part):
    check(random_scene, 100, 1, part)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(3))
def test_static_friction_agrees_with_the_judge(part):
    check(scene_of_static_friction, 100, 1, part)
