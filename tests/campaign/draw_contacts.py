"""Random stops and surfaces, placed with respect to the start: away, touched, near or pressed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.campaign.dice import Dice
from tests.campaign.elements import Way
from twolink import Chain, Scene, kinematics, lagrange
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.joint_stop import JointStop
from twolink.effects.surface import Surface

POINTS: tuple[Any, ...] = ("B", "C1", "C2", "D")
RIGID_LAWS: tuple[Any, ...] = ("stronge", "stronge", "poisson", "newton", "newton-routh")
STEEL, ALUMINIUM = (2.1e11, 0.3), (7.0e10, 0.33)

# A pressed start is this deep at most (m).
_DEEPEST = 1e-4


@dataclass
class Pose:
    """The start of a scene; `u` (rad/s) may be replaced by motion along or into the surface."""

    chain: Chain
    q: tuple[float, float]
    u: tuple[float, float]


def joint_stops(dice: Dice, pose: Pose) -> list[Any]:
    """Return stops of the joints: the start is between them, some of it exactly on one."""
    return [_joint_stop(dice, pose, joint) for joint in "AB" if dice.wanted(0.5)]


def _joint_stop(dice: Dice, pose: Pose, joint: Any) -> JointStop:
    angle = pose.q[0] if joint == "A" else pose.q[1] - pose.q[0]
    room = [dice.between(0.05, 2.0), dice.between(0.05, 2.0)]
    if dice.chance(0.3):
        room[int(dice.chance(0.5))] = 0.0 if dice.chance(0.7) else dice.decades(-12, -3)
    lower, upper = angle - room[0], angle + room[1]
    given = dice.pick(((lower, upper), (lower, None), (None, upper)))
    return JointStop(joint, *given, restitution=_restitution(dice))


def _restitution(dice: Dice) -> float:
    return dice.pick((0.0, 0.0, 1.0, dice.size(0.0, 1.0), dice.size(0.3, 0.9)))


def _friction(dice: Dice) -> float:
    return dice.pick((0.0, dice.size(0.05, 0.7), dice.size(0.05, 0.7), dice.size(0.7, 3.0)))


def surfaces(dice: Dice, pose: Pose, *, touching: bool) -> list[Any]:
    """Return no, one, two or three rigid surfaces; the first is touched if that is asked for."""
    found = []
    most = sum(dice.wanted(weight) for weight in (1.6, 0.6, 0.4))
    for number in range(max(most, int(touching and dice.chance(0.7)))):
        how = "touched" if touching and number == 0 else _how_near(dice)
        on, normal, point = _placed(dice, pose, how)
        friction = _friction(dice)
        found.append(
            Surface(
                point,
                normal,
                on,
                restitution=_restitution(dice),
                law=dice.pick(RIGID_LAWS),
                friction=friction,
                static=dice.static(friction),
                name=f"s{number}",
            )
        )
    return found


def compliant_surfaces(dice: Dice, pose: Pose, *, touching: bool) -> list[Any]:
    """Return no, one or two compliant surfaces, some of them pressed from the start."""
    found = []
    for number in range(sum(dice.wanted(weight) for weight in (0.6, 0.3))):
        how = _how_near(dice)
        if touching and dice.chance(0.5):
            how = dice.pick(("touched", "pressed"))
        on, normal, point = _placed(dice, pose, how)
        friction = _friction(dice)
        found.append(
            CompliantSurface(
                point,
                normal,
                on=on,
                friction=friction,
                static=dice.static(friction),
                name=f"c{number}",
                **_material(dice, pose.chain),
            )
        )
    return found


def _material(dice: Dice, chain: Chain) -> dict[str, Any]:
    """Return a law of compliant contact and its parameters."""
    kind = dice.pick(("spring", "damper", "damper", "hertz", "hunt-crossley", "yields"))
    if kind in ("spring", "damper"):
        stiffness = dice.decades(3.0, 6.5)
        critical = 2 * math.sqrt(stiffness * min(chain.mass))
        damping = critical * dice.decades(-2, 0) if kind == "damper" else 0.0
        return {"law": "kelvin-voigt", "stiffness": stiffness, "loss": damping}
    bodies = [dice.pick((STEEL, ALUMINIUM)) for _ in range(2)]
    modulus, poisson = (tuple(body[i] for body in bodies) for i in range(2))
    ball = {"radius": dice.size(0.01, 0.05), "modulus": modulus, "poisson": poisson}
    if kind == "yields":
        strength = tuple(dice.decades(8.0, 9.0) for _ in bodies)
        return {"law": "elasto-plastic", "strength": strength, **ball}
    loss = {"loss": dice.decades(-1.5, -0.3)} if kind == "hunt-crossley" else {}
    if dice.chance(0.3):
        return {"law": kind, **ball, **loss}
    return {"law": kind, "stiffness": dice.decades(4.0, 8.0), **loss}


def _how_near(dice: Dice) -> str:
    return dice.pick(("away",) * 7 + ("touched", "near"))


def _placed(dice: Dice, pose: Pose, how: str) -> tuple[Any, Any, Any]:
    """Return the points on a surface, its normal, and a point of it, as near as asked for."""
    count = dice.pick((1, 1, 1, 2, 2, 3))
    on = tuple(POINTS[i] for i in dice.rng.permutation(4)[:count])
    normal = (0.0, -1.0) if dice.chance(0.5) else dice.unit()
    if dice.chance(0.15):
        # Along link 1: where the chain is stretched, several points may lie on the surface.
        normal = -math.sin(pose.q[0]), math.cos(pose.q[0])
    q = np.array(pose.q)
    nearest = min(on, key=lambda name: Way(name, normal).coordinate(pose.chain, q))
    x, y = kinematics.position(pose.chain, pose.q, getattr(pose.chain, nearest))
    margins = {
        "away": dice.between(0.02, 1.2) * (pose.chain.L1 + pose.chain.L2),
        "near": 10.0 ** dice.between(-12, -3),
        "touched": 0.0,
        "pressed": -(10.0 ** dice.between(-9, math.log10(_DEEPEST))),
    }
    if how != "away" and dice.chance(0.8):
        _set_off(dice, pose, Way(nearest, normal))
    room = margins[how]
    return on, normal, (float(x - room * normal[0]), float(y - room * normal[1]))


def _set_off(dice: Dice, pose: Pose, way: Way) -> None:
    """Change u so that a point moves in, along or away from a surface, or is at rest on it."""
    J = way.row(pose.chain, np.array(pose.q))
    long = float(J @ J)
    wanted = dice.pick((0.0, 0.0, math.nan, -dice.decades(-3, 0.5), dice.decades(-3, 0.5)))
    if math.isnan(wanted):
        pose.u = 0.0, 0.0
    elif long > 1e-12:
        off = (float(J @ np.array(pose.u)) - wanted) / long
        pose.u = float(pose.u[0] - off * J[0]), float(pose.u[1] - off * J[1])


def grazed(dice: Dice, pose: Pose, smooth: list[Any], duration: float) -> list[Any]:
    """Return a surface that the smooth motion touches at no speed, or passes by very closely."""
    scene = Scene(pose.chain, pose.q, pose.u, duration, tuple(smooth))
    until = dice.between(0.1, 0.8) * duration
    path = _path(scene, until)
    if not path:
        return []
    name = dice.pick(POINTS)
    last = tuple(path[-1][:2]), tuple(path[-1][2:4])
    point = getattr(scene.moving_chain, name)
    vx, vy = kinematics.velocity(scene.moving_chain, *last, point)
    if math.hypot(vx, vy) < 1e-6:
        return []
    normal = (float(-vy / math.hypot(vx, vy)), float(vx / math.hypot(vx, vy)))
    ax, ay = kinematics.acceleration(scene.moving_chain, *last, tuple(path[-1][4:]), point)
    if normal[0] * ax + normal[1] * ay < 0:
        normal = -normal[0], -normal[1]
    x, y = kinematics.position(scene.moving_chain, last[0], point)
    off = dice.pick((0.0, 0.0, 1.0, -1.0)) * 10.0 ** dice.between(-12, -4)
    place = float(x - off * normal[0]), float(y - off * normal[1])
    bound = normal[0] * place[0] + normal[1] * place[1]
    gap = Way(name, normal).coordinate(scene.moving_chain, np.array(path)[:, :2].T) - bound
    if gap[0] < 0:
        return []
    friction, e = _friction(dice), _restitution(dice)
    if dice.chance(0.7):
        return [Surface(place, normal, (name,), restitution=e, friction=friction, name="grazed")]
    material = _material(dice, pose.chain)
    return [CompliantSurface(place, normal, on=(name,), friction=friction, name="g", **material)]


def _path(scene: Scene, until: float, steps: int = 400) -> list[Any]:
    """Return q, u and du of the smooth motion, step by step (Runge and Kutta's fourth order).

    It is empty where the steps are too long for the motion.
    """
    h = until / steps

    def rates(t: float, x: Any) -> Any:
        q, u = (x[0], x[1]), (x[2], x[3])
        loads = tuple(
            y for effect in scene.effects for y in effect.loads(scene.moving_chain, q, u, t)
        )
        return np.array(
            [*u, *lagrange.forward_dynamics(scene.moving_chain, q, u, loads)], dtype=float
        )

    x, found = np.array([*scene.q, *scene.u]), []
    for number in range(steps):
        t = number * h
        k1 = rates(t, x)
        found.append([*x, *k1[2:]])
        k2 = rates(t + h / 2, x + h / 2 * k1)
        k3 = rates(t + h / 2, x + h / 2 * k2)
        k4 = rates(t + h, x + h * k3)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if not np.abs(x).max() < 1e3:
            return []
    return [*found, [*x, *rates(until, x)[2:]]]
