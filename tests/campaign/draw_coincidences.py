"""A random scene in the numbers that people write: right angles, unit lengths, exact places.

Surfaces pass exactly through points of the start, or of other poses at such angles, and stops are
at such angles. So contacts coincide, poses are stretched and folded, and forces balance.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from tests.campaign.dice import Dice
from twolink import Chain, Scene, kinematics
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque
from twolink.effects.surface import Surface

ANGLES = (
    *(k * math.pi / 6 for k in range(-6, 7)),
    *(k * math.pi / 4 for k in range(-4, 5)),
    *(0.0, 0.0, math.pi / 2, -math.pi / 2, math.atan2(3, 4), math.atan2(4, 3)),
)
SIZES = (1.0, 1.0, 2.0, 0.5)
SPEEDS = (
    *((0.0, 0.0),) * 3,
    *((1.0, 1.0), (-1.0, -1.0), (1.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (2.0, -1.0), (0.0, -2.0)),
)
TORQUES = (0.0, 5.0, -5.0, 10.0, -10.0, 1.0, -1.0)
NORMALS = ((0.0, -1.0), (0.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (0.6, -0.8), (-0.6, -0.8), (0.8, 0.6))
PLACES = (0.0, 0.5, 1.0, -1.0, 1.5, 2.0)
POINTS: tuple[Any, ...] = ("B", "C1", "C2", "D")
LAWS: tuple[Any, ...] = ("stronge", "poisson", "newton", "newton-routh")

Pose = tuple[float, float]

# A surface is drawn anew if the start is farther inside (m), this often at most.
_INSIDE, _TRIES = 1e-13, 12


def draw_coincidence(seed: int, index: int) -> Scene:
    """Return the scene of a seed and an index: always the same."""
    dice = Dice(seed, index)
    chain = _chain(dice)
    q = _start(dice)
    effects = [*_forces(dice), *_stops(dice, q)]
    for kind, most in ((_rigid, (0, 1, 1, 2, 2, 3)), (_soft, (0, 0, 0, 1, 1, 2))):
        for number in range(dice.pick(most)):
            effects += _outside(dice, chain, q, number, kind)
    return Scene(
        chain=chain,
        q=q,
        u=dice.pick(SPEEDS),
        duration=dice.pick((1.0, 1.0, 2.0)),
        effects=tuple(effects),
        accuracy=dice.pick((1e-9,) * 4 + (1e-6,)),
        title=f"campaign {seed} {index}: coincidences",
    )


def _chain(dice: Dice) -> Chain:
    mass, length = ((dice.pick(SIZES), dice.pick(SIZES)) for _ in range(2))
    make = dice.pick((Chain.uniform_bars, Chain.uniform_bars, Chain.point_masses))
    return make(mass, length)


def _start(dice: Dice) -> Pose:
    """Return angles (rad); many chains are stretched, and some folded."""
    q1, q2 = dice.pick(ANGLES), dice.pick(ANGLES)
    if dice.chance(0.25):
        return q1, q1
    return (q1, q1 + math.pi) if dice.chance(0.1) else (q1, q2)


def _forces(dice: Dice) -> list[Any]:
    """Return gravity, motors, springs, losses and dry friction, some of each."""

    def pair(choices: tuple[float, ...]) -> Pose:
        return dice.pick(choices), dice.pick(choices)

    def torque() -> JointTorque:
        if dice.chance(0.5):
            return JointTorque(pair(TORQUES))
        return JointTorque(pair(TORQUES), pair(TORQUES), pair((1.0, 2.0, math.pi, 2 * math.pi)))

    def sampled() -> SampledTorque:
        A, B = (tuple(dice.pick(TORQUES) for _ in range(4)) for _ in range(2))
        kind: Any = dice.pick(("hold", "linear"))
        return SampledTorque((0.0, 0.25, 0.5, 1.0), A, B, kind)

    def friction() -> JointFriction:
        kinetic = dice.pick((0.0, 1.0, 2.0, 5.0)), dice.pick((0.0, 0.5, 1.0, 2.0))
        static = (1.5 * kinetic[0], 2 * kinetic[1]) if dice.chance(0.35) else None
        return JointFriction(kinetic, static)

    makers: tuple[tuple[float, Callable[[], Any]], ...] = (
        (0.85, Gravity),
        (0.5, torque),
        (0.2, sampled),
        (0.15, lambda: JointSpring((dice.pick((10.0, 100.0)), 10.0), (dice.pick(ANGLES), 0.0))),
        (0.15, lambda: JointDamping((1.0, 0.5))),
        (0.1, lambda: PdControl((dice.pick(ANGLES), 0.0), (100.0, 20.0), (10.0, 2.0))),
        (0.55, friction),
        (0.15, lambda: EndForce(dice.pick(TORQUES), dice.pick((0.0, 0.5, 1.0)))),
    )
    return [make() for probability, make in makers if dice.chance(probability)]


def _stops(dice: Dice, q: Pose) -> list[Any]:
    """Return stops at angles of the list, or exactly at the start."""
    found = []
    for joint, angle in (("A", q[0]), ("B", q[1] - q[0])):
        if not dice.chance(0.35):
            continue
        below = dice.pick([x for x in ANGLES if x < angle] + [angle])
        above = dice.pick([x for x in ANGLES if x > angle] + [angle])
        lower, upper = dice.pick(((below, above), (below, None), (None, above)))
        if lower == upper:
            upper = None
        e = dice.pick((0.0, 0.0, 0.5, 1.0))
        found.append(JointStop(joint, lower, upper, restitution=e))
    return found


def _outside(dice: Dice, chain: Chain, q: Pose, number: int, kind: Callable[..., Any]) -> list[Any]:
    """Return a surface that the start is not inside, if one is drawn soon."""
    for _ in range(_TRIES):
        normal, on = (
            dice.pick(NORMALS),
            tuple(dice.rng.permutation(POINTS)[: dice.pick((1, 1, 2, 3))]),
        )
        place = _place(dice, chain, q, normal, on)
        bound = normal[0] * place[0] + normal[1] * place[1]
        if min(_heights(chain, q, normal, on)) - bound >= -_INSIDE:
            return [kind(dice, place, normal, tuple(str(name) for name in on), number)]
    return []


def _place(dice: Dice, chain: Chain, q: Pose, normal: Pose, on: Any) -> Pose:
    """Return a point of a surface: the foremost of its points in some pose, or round numbers."""
    how = dice.pick(("start", "start", "pose", "round"))
    if how == "round":
        return dice.pick(PLACES), dice.pick(PLACES)
    pose = q if how == "start" else (dice.pick(ANGLES), dice.pick(ANGLES))
    heights = _heights(chain, pose, normal, on)
    nearest = on[heights.index(min(heights))]
    x, y = kinematics.position(chain, pose, getattr(chain, nearest))
    return float(x), float(y)


def _heights(chain: Chain, q: Pose, normal: Pose, on: Any) -> list[float]:
    """Return the places of points along a normal (m)."""
    places = [kinematics.position(chain, q, getattr(chain, name)) for name in on]
    return [float(normal[0] * x + normal[1] * y) for x, y in places]


def _friction(dice: Dice) -> tuple[float, float | None]:
    mu = dice.pick((0.0, 0.0, 0.3, 0.5, 1.0, 2.0))
    return mu, 1.5 * mu if mu and dice.chance(0.35) else None


def _rigid(dice: Dice, place: Pose, normal: Pose, on: Any, number: int) -> Surface:
    mu, static = _friction(dice)
    e = dice.pick((0.0, 0.0, 0.5, 1.0))
    return Surface(
        place, normal, on, restitution=e, law=dice.pick(LAWS), friction=mu, static=static,
        name=f"s{number}",
    )  # fmt: skip


def _soft(dice: Dice, place: Pose, normal: Pose, on: Any, number: int) -> CompliantSurface:
    mu, static = _friction(dice)
    laws: Any = (
        ("kelvin-voigt", dice.pick((0.0, 10.0))), ("hertz", 0.0), ("hunt-crossley", 0.2)
    )  # fmt: skip
    law, loss = dice.pick(laws)
    more = {} if law == "hertz" else {"loss": loss}
    return CompliantSurface(
        place, normal, law, dice.pick((1e4, 1e5, 1e6)), on=on, friction=mu, static=static,
        name=f"c{number}", **more,
    )  # fmt: skip
