"""Random effects that are forces: gravity, motors, springs, losses, and dry friction."""

from __future__ import annotations

from typing import Any

from tests.campaign.dice import Dice
from twolink import Chain
from twolink.effects.end_drag import EndDrag
from twolink.effects.end_force import EndForce
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_spring import JointSpring
from twolink.effects.joint_torque import JointTorque
from twolink.effects.motor_inertia import MotorInertia
from twolink.effects.pd_control import PdControl
from twolink.effects.sampled_torque import SampledTorque


class Scales:
    """Sizes of a chain by joint, A and B: inertia (kg m²) and weight at arm's length (N m)."""

    def __init__(self, chain: Chain) -> None:
        (m1, m2), (L1, L2) = chain.mass, chain.length
        self.inertia = (m1 + m2) * L1 * L1 + m2 * L2 * L2, m2 * L2 * L2
        self.weight = 9.81 * (m1 * L1 + m2 * (L1 + L2)), 9.81 * m2 * L2

    def inertias(self, dice: Dice, low: float, high: float) -> tuple[float, float]:
        """Return the inertias times 10 to powers between two; B's is now and then zero."""
        first, second = (dice.rounded(size * dice.decades(low, high)) for size in self.inertia)
        return first, second * dice.chance(0.75)

    def torques(self, dice: Dice, scale: float) -> tuple[float, float]:
        """Return normally distributed torques (N m); B's is now and then zero."""
        first, second = (dice.rounded(w * dice.normal(scale)) for w in self.weight)
        return first, second * dice.chance(0.7)


def smooth_effects(dice: Dice, chain: Chain, duration: float) -> list[Any]:
    """Return some of the effects that make no modes."""
    scales = Scales(chain)
    found: list[Any] = []
    if dice.chance(0.88):
        found.append(_gravity(dice))
    makers = (
        (0.5, _joint_torque),
        (0.5, lambda d, s: _sampled_torque(d, s, duration)),
        (0.6, lambda d, s: JointDamping(s.inertias(d, -1.5, 0.7))),
        (0.6, _motor_inertia),
        (0.6, lambda d, s: JointSpring(s.inertias(d, -0.5, 2.5), d.pair(-3.0, 3.0))),
        (0.6, _pd_control),
        (0.3, lambda d, s: EndDrag(chain.m2 * d.decades(-2, 0.7))),
    )
    return found + [make(dice, scales) for weight, make in makers if dice.wanted(weight)]


def dry_frictions(dice: Dice, chain: Chain) -> list[Any]:
    """Return friction in the joints, and the force on the end with its own, or none of them."""
    found: list[Any] = []
    if dice.wanted(0.9):
        weights = Scales(chain).weight
        k1, k2 = (dice.rounded(w * dice.decades(-2, 0)) * dice.chance(0.75) for w in weights)
        more = dice.between(1.0, 2.0), dice.between(1.0, 2.0)
        static = (k1 * more[0], k2 * more[1]) if dice.chance(0.35) else None
        found.append(JointFriction((k1, k2), static))
    if dice.wanted(0.5):
        friction = dice.pick((0.0, dice.size(0.05, 0.6), dice.size(0.6, 2.0)))
        sliding = dice.pick((1, -1)) if dice.chance(0.08) else None
        static_end = None if sliding else dice.static(friction)
        force = dice.rounded(chain.m2 * dice.normal(8.0))
        found.append(EndForce(force, friction, sliding, static_end))
    return found


def _gravity(dice: Dice) -> Gravity:
    if dice.chance(0.8):
        return Gravity(9.81)
    return Gravity(dice.size(1.0, 20.0), dice.unit())


def _joint_torque(dice: Dice, scales: Scales) -> JointTorque:
    torque = scales.torques(dice, 0.4)
    if dice.chance(0.4):
        return JointTorque(torque)
    return JointTorque(torque, scales.torques(dice, 0.6), dice.pair(0.5, 15.0), dice.pair(-3, 3))


def _sampled_torque(dice: Dice, scales: Scales, duration: float) -> SampledTorque:
    kind: Any = dice.pick(("hold", "linear", "cubic"))
    count = int(dice.rng.integers(8, 16))
    times = sorted({round(dice.between(-0.1, 1.1) * duration, 3) for _ in range(count)})
    A, B = zip(*(scales.torques(dice, 0.4) for _ in times), strict=True)
    return SampledTorque(tuple(times), A, B, kind)


def _motor_inertia(dice: Dice, scales: Scales) -> MotorInertia:
    ratio = dice.size(1.0, 60.0) * dice.pick((1, -1)), dice.size(1.0, 60.0) * dice.pick((1, -1))
    felt = scales.inertias(dice, -2.5, 0.0)
    inertia = felt[0] / ratio[0] ** 2, felt[1] / ratio[1] ** 2
    return MotorInertia(inertia, ratio, dice.chance(0.7))


def _pd_control(dice: Dice, scales: Scales) -> PdControl:
    proportional = scales.inertias(dice, 0.0, 2.8)
    damping = dice.decades(-2, 0.0), dice.decades(-2, 0.0)
    (p1, p2), (I1, I2) = proportional, scales.inertia
    derivative = 2 * damping[0] * (p1 * I1) ** 0.5, 2 * damping[1] * (p2 * I2) ** 0.5
    return PdControl(dice.pair(-2.5, 2.5), proportional, derivative)
