"""A random scene of extreme proportions: of masses, lengths, speeds, frictions, stiffnesses, gaps.

Stops leave a joint hardly any room, points rattle in narrow channels, surfaces are parallel but for
a rounding, friction is a millionth of the weight or many times the normal force, and static
friction up to ten times the kinetic one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from tests.campaign.dice import Dice
from tests.campaign.draw_contacts import POINTS
from twolink import Chain, Scene, kinematics
from twolink.contact.impact_laws import LAWS
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.effects.surface import Surface

_LAWS: Any = tuple(LAWS)

Pair = tuple[float, float]

# The longest motion (s).
_LONGEST = 3.0


def draw_extreme(seed: int, index: int) -> Scene:
    """Return the scene of a seed and an index: always the same."""
    dice = Dice(seed, index)
    chain = _chain(dice)
    q = dice.pair(-math.pi, math.pi)
    if dice.chance(0.15):
        q = q[0], q[0] + dice.pick((0.0, 1.0, -1.0)) * dice.decades(-9, -1)
    gravity = Gravity(dice.pick((9.81, 9.81, 9.81, dice.decades(-3, 3))))
    pace = math.sqrt(gravity.g / (chain.L1 + chain.L2))
    speed = pace * dice.decades(-3, 1.5)
    u = (0.0, 0.0) if dice.chance(0.3) else (dice.normal(speed), dice.normal(speed))
    units = _Units(chain, gravity.g)
    effects: list[Any] = [gravity]
    makers: tuple[tuple[float, Callable[..., list[Any]]], ...] = (
        (0.5, _forces), (0.5, _frictions), (0.5, _stops), (0.6, _surfaces), (0.3, _channel),
        (0.3, _cushions),
    )  # fmt: skip
    for probability, make in makers:
        if dice.chance(probability):
            effects += make(dice, chain, q, units)
    return Scene(
        chain=chain,
        q=q,
        u=u,
        duration=min(_LONGEST, dice.between(0.3, 3.0) / max(pace, speed / 5)),
        effects=tuple(effects),
        accuracy=dice.pick((1e-9, 1e-9, 1e-6)),
        title=f"campaign {seed} {index}: extremes",
    )


class _Units:
    """The inertia (kg m²), weight (N) and torque (N m) of a chain, by which effects are drawn."""

    def __init__(self, chain: Chain, g: float) -> None:
        self.length = chain.L1 + chain.L2
        self.weight = (chain.m1 + chain.m2) * g
        self.torque = self.weight * self.length
        self.inertia = (chain.m1 + chain.m2) * self.length**2
        self.stiffness = self.weight / self.length


def _chain(dice: Dice) -> Chain:
    """Return links whose masses and lengths differ by up to a million and ten thousand times."""
    mass = dice.decades(-3, 3), dice.decades(-3, 3)
    length = dice.decades(-3, 1), dice.decades(-3, 1)
    across = 0.5 if dice.chance(0.4) else 0.0
    first, second = ((L * dice.size(0.0, 1.5), L * across * dice.size(-1, 1)) for L in length)
    I1, I2 = (m * L * L * dice.decades(-4, 0) for m, L in zip(mass, length, strict=True))
    return Chain(mass, length, (first, second), (I1, I2))


def _forces(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return motors, gears, springs, control and losses, some of each."""

    def pair(low: float, high: float, unit: float) -> Pair:
        return unit * dice.decades(low, high), unit * dice.decades(low, high)

    def torque() -> JointTorque:
        frequency = pair(-1, 2, math.sqrt(units.stiffness / (chain.m1 + chain.m2)))
        return JointTorque(pair(-3, 1, units.torque), pair(-3, 1, units.torque), frequency)

    def control() -> PdControl:
        target = dice.pair(-3.0, 3.0)
        return PdControl(target, pair(0, 4, units.torque), pair(-2, 1, units.torque))

    def motors() -> MotorInertia:
        ratio = dice.size(1.0, 300.0), -dice.size(1.0, 300.0)
        felt = pair(-4, 1, units.inertia)
        return MotorInertia((felt[0] / ratio[0] ** 2, felt[1] / ratio[1] ** 2), ratio)

    makers: tuple[Callable[[], Any], ...] = (
        torque, control, motors,
        lambda: JointSpring(pair(-2, 4, units.torque), dice.pair(-3.0, 3.0)),
        lambda: JointDamping(pair(-4, 2, units.torque)),
        lambda: EndDrag(chain.m2 / units.length * dice.decades(-2, 2)),
    )  # fmt: skip
    return [make() for make in makers if dice.chance(0.3)]


def _frictions(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return friction of the joints, and of the end."""
    found: list[Any] = []
    if dice.chance(0.8):
        kinetic = units.torque * dice.decades(-6, 1), units.torque * dice.decades(-6, 1)
        more = dice.decades(0, 1), dice.decades(0, 1)
        static = (kinetic[0] * more[0], kinetic[1] * more[1]) if dice.chance(0.4) else None
        found.append(JointFriction(kinetic, static))
    if dice.chance(0.4):
        mu = dice.decades(-4, 1.3)
        static_end = mu * dice.decades(0, 1) if dice.chance(0.4) else None
        force = units.weight * dice.decades(-3, 1) * dice.pick((1, -1))
        found.append(EndForce(force, mu, None, static_end))
    return found


def _stops(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return stops that leave a joint hardly any room, from 1e-9 rad on."""
    found = []
    for joint, angle in (("A", q[0]), ("B", q[1] - q[0])):
        if dice.chance(0.6):
            room = dice.decades(-9, 0.5), dice.decades(-9, 0.5)
            name: Any = joint
            found.append(
                JointStop(name, angle - room[0], angle + room[1], restitution=_restitution(dice))
            )
    return found


def _restitution(dice: Dice) -> float:
    return dice.pick((0.0, 0.0, 1.0, dice.size(0.0, 1.0), 1 - dice.decades(-6, -1)))


def _friction(dice: Dice) -> dict[str, Any]:
    mu = dice.pick((0.0, dice.decades(-6, -1), dice.decades(-1, 1.3)))
    return {"friction": mu, "static": mu * dice.decades(0, 1) if dice.chance(0.4) else None}


def _height(chain: Chain, q: Pair, normal: Pair, on: Any) -> float:
    """Return the place along a normal of the foremost point (m)."""
    places = [kinematics.position(chain, q, getattr(chain, name)) for name in on]
    return min(float(normal[0] * x + normal[1] * y) for x, y in places)


def _placed(normal: Pair, height: float) -> Pair:
    return height * normal[0], height * normal[1]


def _on(dice: Dice) -> Any:
    return tuple(str(POINTS[i]) for i in dice.rng.permutation(4)[: dice.pick((1, 1, 2, 4))])


def _rigid(dice: Dice, height: float, normal: Pair, on: Any, name: str) -> Surface:
    return Surface(
        _placed(normal, height), normal, on, restitution=_restitution(dice), law=dice.pick(_LAWS),
        name=name, **_friction(dice),
    )  # fmt: skip


def _surfaces(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return one to three surfaces, the later ones parallel to the first but for a rounding."""
    normal, on = dice.unit(), _on(dice)
    found = []
    for number in range(dice.pick((1, 1, 2, 3))):
        if number:
            angle = math.atan2(normal[1], normal[0]) + dice.decades(-16, 0) * dice.pick((1, -1))
            normal = math.cos(angle), math.sin(angle)
            on = on if dice.chance(0.5) else _on(dice)
        room = units.length * dice.pick((dice.decades(-12, -1), dice.decades(-2, 0)))
        height = _height(chain, q, normal, on) - room
        found.append(_rigid(dice, height, normal, on, f"s{number}"))
    return found


def _channel(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return two walls that face each other, with a point between them in hardly any room."""
    normal, on = dice.unit(), (dice.pick(POINTS),)
    tilt = math.atan2(-normal[1], -normal[0]) + dice.decades(-9, -0.5) * dice.pick((1, -1))
    other = math.cos(tilt), math.sin(tilt)
    found = []
    for number, way in enumerate((normal, other)):
        room = units.length * dice.decades(-9, -1)
        found.append(_rigid(dice, _height(chain, q, way, on) - room, way, on, f"w{number}"))
    return found


def _cushions(dice: Dice, chain: Chain, q: Pair, units: _Units) -> list[Any]:
    """Return one or two soft surfaces, whose stiffness ranges over ten decades."""
    found = []
    for number in range(dice.pick((1, 1, 2))):
        normal, on = dice.unit(), _on(dice)
        height = _height(chain, q, normal, on) - units.length * dice.decades(-9, 0)
        stiffness = units.stiffness * dice.decades(0, 9)
        law: Any = dice.pick(("kelvin-voigt", "hertz", "hunt-crossley"))
        losses = {
            "kelvin-voigt": 2 * math.sqrt(stiffness * (chain.m1 + chain.m2)) * dice.decades(-4, 1),
            "hunt-crossley": dice.decades(-2, 0),
        }
        found.append(
            CompliantSurface(
                _placed(normal, height), normal, law, stiffness, losses.get(law, 0.0), on=on,
                name=f"c{number}", **_friction(dice),
            )
        )  # fmt: skip
    return found
