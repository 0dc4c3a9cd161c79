"""Random scenes of impacts: chains over a floor of any law, or between stops, or both."""

import random

from twolink.chain import Chain
from twolink.contact.impact_laws import LAWS
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface
from twolink.scene import Scene


def bouncing_scene(seed):
    """Return a scene of 1.5 s."""
    dice = random.Random(seed)
    length = dice.uniform(0.4, 1.2), dice.uniform(0.4, 1.2)
    mass = dice.uniform(0.3, 2), dice.uniform(0.3, 2)
    centre = tuple((L * dice.uniform(0.2, 0.8), L * dice.uniform(-0.2, 0.2)) for L in length)
    inertia = tuple(m * L * L * dice.uniform(0.02, 0.2) for m, L in zip(mass, length, strict=True))
    effects = [Gravity(9.81)]
    if dice.random() < 0.5:
        effects.append(JointDamping((dice.uniform(0, 0.2), dice.uniform(0, 0.2))))
    kind = dice.choice(["floor", "stops", "both"])
    if kind != "stops":
        effects.append(_floor(dice, sum(length)))
    if kind != "floor":
        effects.append(
            JointStop(
                "B",
                lower=-dice.uniform(0.5, 2.5),
                upper=dice.uniform(0.5, 2.5),
                restitution=dice.choice([0.3, 0.6, 0.9]),
            )
        )
    q = dice.uniform(-0.3, 0.6), dice.uniform(-0.3, 0.6)
    u = dice.uniform(-2, 2), dice.uniform(-2, 2)
    return Scene(Chain(mass, length, centre, inertia), q, u, 1.5, tuple(effects))


def _floor(dice, reach):
    return Surface(
        (0, dice.uniform(0.5, 1) * reach),
        (dice.uniform(-0.3, 0.3), -1),
        on=dice.choice([("D",), ("D",), ("B", "D"), ("C2",), ("B",)]),
        restitution=dice.choice([0.3, 0.5, 0.8, 1.0]),
        friction=dice.choice([0, 0.2, 0.5, 1.0]),
        law=dice.choice(LAWS),
        name="floor",
    )
