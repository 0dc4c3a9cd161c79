"""Contact: impacts in all their limits, rest that must last, and surfaces that are nearly rigid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twolink import kinematics
from twolink.chain import Chain
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.gravity import Gravity
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.surface import Surface
from twolink.hardcases import exact
from twolink.hardcases.friction import BALANCED, by_formula, stays
from twolink.hardcases.in_motion import Answer, InMotion, Judge, keeps_energy, near_run
from twolink.hardcases.quadruple import Reference
from twolink.hardcases.record import Case, Finding
from twolink.hardcases.run import finding_of
from twolink.scene import Scene

_BARS = Chain.uniform_bars()
_DOWN = Gravity(9.81)
_CLOSED = "closed form"
_FLIGHT = "the impact in closed form to a hundred digits, and the flight after it in 113 bits"
_ACCURACY = "the global accuracy that is asked for"


def _case(
    name: str,
    hard: str,
    trial: InMotion,
    expected: str,
    reference: str = _CLOSED,
    bound: str = _ACCURACY,
) -> Case:
    return Case(name, "contact", hard, expected, reference, bound, trial)


def _bounce(t: float, e: float) -> tuple[float, float]:
    """Return the height and the speed of what falls from 1/2 with the acceleration 1, onto 0.

    It lands at 1 s with the speed 1, and leaves with e, e², …
    """
    if t < 1:
        return 0.5 - t * t / 2, -t
    begin, v = 1.0, e
    while v > 1e-18:
        x = t - begin
        if x < 2 * v:
            return v * x - x * x / 2, v - x
        begin, v = begin + 2 * v, e * v
    return 0.0, 0.0


def _bouncing(e: float, duration: float, accuracy: float, samples: int, *judges: Judge) -> InMotion:
    """Return link 1 that a constant torque drives against a stop; link 2 does not turn."""
    effects = (JointTorque((-2.0, 0.0)), JointStop("A", lower=0.0, restitution=e))
    scene = Scene(BALANCED, (0.5, 0.0), (0.0, 0.0), duration, effects, accuracy)

    def formula(t: float) -> tuple[float, float, float, float]:
        q, u = _bounce(t, e)
        return q, 0.0, u, 0.0

    return InMotion(scene, (by_formula(formula), *judges), samples)


def impacts_are(count: int) -> Judge:
    """Judge the number of impacts, where it is known."""

    def judge(answer: Answer) -> Finding:
        if answer.trajectory is None:
            return Finding(0.0)
        found = len(answer.trajectory.impacts)
        return finding_of(None if found == count else f"there are {found} impacts, not {count}")

    return judge


def _endless_bouncing() -> InMotion:
    """Return bounces without loss: the n-th is at 2 n − 1 s."""
    bounces = 10_000
    effects = (JointTorque((-2.0, 0.0)), JointStop("A", lower=0.0, restitution=1.0))
    scene = Scene(BALANCED, (0.5, 0.0), (0.0, 0.0), 2.0 * bounces, effects, 1e-6)

    def formula(t: float) -> tuple[float, float, float, float]:
        # Between two bounces of the start's height: the samples are at tops and between.
        x = t - 2 * math.floor(t / 2)
        height = 0.5 - min(x, 2 - x) ** 2 / 2
        return height, 0.0, -x if x < 1 else 2 - x, 0.0

    return InMotion(scene, (by_formula(formula), impacts_are(bounces)), 17)


def _floor(y: float, **others: object) -> Surface:
    return Surface((0.0, y), (0.0, -1.0), **others)  # type: ignore[arg-type]


def _elastic() -> InMotion:
    """Return bars that fall onto a smooth floor again and again, without loss."""
    scene = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 5.0, (_DOWN, _floor(1.0, restitution=1.0)), 1e-6)
    return InMotion(scene, (keeps_energy(1e3), _outside(1.0)), 51)


def _outside(y: float) -> Judge:
    """Judge that D is never below a floor, by more than what is allowed of q makes."""

    def judge(answer: Answer) -> Finding:
        chain = answer.scene.equipped
        _, height = kinematics.position(chain, tuple(answer.q), chain.D)
        allowed = answer.accuracy * (chain.L1 + chain.L2)
        below = float(np.max(height - y))
        return Finding(max(below, 0.0) / allowed, said=f"D is {below:.2g} m below the floor")

    return judge


def _dead() -> InMotion:
    """Return a stretched chain that turns flat into a wall, and does not rebound."""
    arrives = (math.pi / 2 - 0.5) / 2
    wall = Surface((0.0, 0.0), (1.0, 0.0), on=("B", "D"))
    scene = Scene(_BARS, (0.5, 0.5), (2.0, 2.0), 2.0, (wall,), 1e-9)

    def formula(t: float) -> tuple[float, float, float, float]:
        if t < arrives:
            return 0.5 + 2 * t, 0.5 + 2 * t, 2.0, 2.0
        return math.pi / 2, math.pi / 2, 0.0, 0.0

    return InMotion(scene, (by_formula(formula),))


def _turning(y: float, accuracy: float, *judges: Judge) -> InMotion:
    """Return a stretched chain that turns at 1 rad/s, and a floor near where D is lowest."""
    scene = Scene(_BARS, (0.0, 0.0), (1.0, 1.0), 3.0, (_floor(y, restitution=0.5),), accuracy)

    def formula(t: float) -> tuple[float, float, float, float]:
        return t, t, 1.0, 1.0

    return InMotion(scene, (by_formula(formula), *judges))


def _struck(
    q: tuple[float, float],
    u: Callable[[Chain], tuple[float, float]],
    friction: float,
    restitution: float,
    duration: float,
    law: str = "stronge",
    *judges: Judge,
) -> InMotion:
    """Return bars whose end stands on a floor as it is struck, and the flight after it."""
    before = u(_BARS)
    after = exact.struck(_BARS, q, before, friction, restitution, law)
    y = math.sin(q[0]) + math.sin(q[1])
    floor = _floor(y, friction=friction, restitution=restitution, law=law)
    scene = Scene(_BARS, q, before, duration, (_DOWN, floor), 1e-9)

    def judge(answer: Answer) -> Finding:
        # The first sample is of the start or of what has become of it at once.
        later = replace(answer, t=answer.t[1:], q=answer.q[:, 1:], u=answer.u[:, 1:])
        return flight(later)

    reference = Reference(_BARS, q, after, duration)
    inner = near_run(reference)

    def flight(later: Answer) -> Finding:
        whole = replace(
            later,
            t=np.concatenate([[0.0], later.t]),
            q=np.column_stack([q, later.q]),
            u=np.column_stack([after, later.u]),
        )
        return inner(whole)

    return InMotion(scene, (judge, *judges))


def _just_stopping(chain: Chain) -> tuple[float, float]:
    """Return u with which D slides along x until compression ends, coming down at 1 m/s.

    That is at v_t = v_n (G_nt − μ G_tt)/(G_nn − μ G_nt).
    """
    q1, q2 = _LEANING
    across, along = (-math.cos(q1), -math.cos(q2)), (-math.sin(q1), -math.sin(q2))
    (M11, M12), (_, M22) = ((4 / 3, math.cos(q2 - q1) / 2), (0, 1 / 3))
    det = M11 * M22 - M12 * M12

    def response(row: tuple[float, float], force: tuple[float, float]) -> float:
        x = (M22 * force[0] - M12 * force[1]) / det
        return row[0] * x + row[1] * (M11 * force[1] - M12 * force[0]) / det

    G_nn, G_nt, G_tt = response(across, across), response(across, along), response(along, along)
    v_n = -1.0
    # A touch slower, so that it is the slide that ends first, by a part in 1e12.
    v_t = v_n * (G_nt - _ROUGH * G_tt) / (G_nn - _ROUGH * G_nt) * (1 - 1e-12)
    turn = across[0] * along[1] - across[1] * along[0]
    return (v_n * along[1] - v_t * across[1]) / turn, (across[0] * v_t - along[0] * v_n) / turn


_LEANING, _ROUGH = (0.5, 1.4), 0.8

_WEDGED = (1.1, 1.3), (0.2692905115792913, -0.4566342672120719)


def _wedged() -> InMotion:
    """Return bars that lean into their slide on a floor so rough that it wedges them."""
    q, u = _WEDGED
    # D slides along the floor to rounding; the true start has no speed into it.
    return _struck(q, lambda _: u, 2.0, 0.5, 0.02)


def _gaining() -> InMotion:
    """Return Kane and Levinson's bars, 20° and 30° from the vertical, and their law."""

    def judge(answer: Answer) -> Finding:
        if answer.trajectory is None:
            return Finding(0.0)
        first = answer.trajectory.impacts[0]
        before, after = first.kinetic_energy
        if not first.creates_energy:
            return finding_of("that energy is created is not said")
        # Published to five digits.
        return Finding(
            abs(after / before - 1.5875) / 5e-5, said=f"T grows {after / before:.6f}-fold"
        )

    q, u = (1.2217304763960306, 1.0471975511965979), (0.1, 0.2)
    return _struck(q, lambda _: u, 0.5, 0.5, 0.01, "newton", judge)


def _nearly_rigid() -> InMotion:
    """Return bars that fall onto a floor of 1e12 N/m: a touch of a micrometre and 3 µs."""
    q, y, k = (0.3, -0.2), 1.2, 1e12
    cushion = CompliantSurface((0.0, y), (0.0, -1.0), "kelvin-voigt", k)
    scene = Scene(_BARS, q, (0.0, 0.0), 0.7, (_DOWN, cushion), 1e-7)
    return InMotion(scene, (near_run(Reference(_BARS, q, (0.0, 0.0), 0.7, presses=k, floor=y)),), 8)


def _resting() -> InMotion:
    q = (1.2, 0.3)
    floor = _floor(math.sin(q[0]) + math.sin(q[1]), friction=2.0, restitution=0.5)
    return InMotion(
        Scene(_BARS, q, (0.0, 0.0), 100.0, (_DOWN, floor), 1e-10), (stays, impacts_are(0))
    )


def _leaving() -> InMotion:
    q, u = (0.5, 1.4), (-1.0, -1.5)
    floor = _floor(math.sin(q[0]) + math.sin(q[1]), restitution=0.5)
    scene = Scene(_BARS, q, u, 0.2, (_DOWN, floor), 1e-10)
    return InMotion(scene, (near_run(Reference(_BARS, q, u, 0.2)), impacts_are(0)))


def _sliding() -> InMotion:
    """Return a chain whose end slides to and fro on a smooth floor, for 200 s.

    Link 1 swings below A, D rests above it; the energy and the floor keep.
    """
    y = 0.5
    q1 = math.pi / 2 + 0.3
    q2 = math.asin(y - math.sin(q1))
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 200.0, (_DOWN, _floor(y)), 1e-8)

    def judge(answer: Answer) -> Finding:
        chain = answer.scene.equipped
        _, height = kinematics.position(chain, tuple(answer.q), chain.D)
        off = float(np.abs(height - y).max())
        # Each step leaves some roundings of speed, and they are pulled back within 1/8 s.
        allowed = _GAP if answer.trajectory is not None else answer.accuracy
        return Finding(off / allowed, said=f"D is {off:.2g} m off the floor")

    return InMotion(scene, (judge, keeps_energy(1e4), impacts_are(0)), 101)


# 64 roundings of where D is (m), and what as many of its speed (3 m/s at most) make in 1/8 s.
_GAP = 64 * 2.0**-52 * (2.0 + 3.0 / 8)

CASES = (
    _case(
        "restitution-0",
        "no rebound at all: the first touch is the last",
        _bouncing(0.0, 4.0, 1e-9, 9, impacts_are(1)),
        "rest from 1 s on, after one impact",
    ),
    _case(
        "restitution-1",
        "a floor that takes nothing: what is gained or lost is the method's own",
        _elastic(),
        "the energy of the start, and D never below the floor",
        "conservation",
        "1e3 roundings of the energy, and what the allowed error of u makes of it",
    ),
    _case(
        "bounces-1e4",
        "ten thousand bounces of one height: each takes over the errors of all before it",
        _endless_bouncing(),
        "10 000 impacts, the n-th at 2 n − 1 s, all at one speed",
        bound=_ACCURACY + ": 1e-6, of 1e4 impacts with 64 roundings of 2e4 s each",
    ),
    _case(
        "zeno",
        "bounces halve each time: infinitely many are over at 3 s",
        _bouncing(0.5, 5.0, 1e-9, 11),
        "rest from 3 s on",
    ),
    _case(
        "zeno-slow",
        "each bounce keeps 0.9 of the speed: 300 bounces lead up to the last, at 19 s",
        _bouncing(0.9, 25.0, 1e-9, 11),
        "rest from 19 s on",
    ),
    _case(
        "grazing",
        "D touches the floor at its lowest point with no normal speed: rounding decides",
        _turning(2.0, 1e-6),
        "it turns on as if there were no floor",
        bound="√(2 a η) of a gap known to η, 64 roundings: a speed of 3e-7 m/s; 1e-6 is asked for",
    ),
    _case(
        "nearly-grazing",
        "D passes the floor at a distance of a picometre",
        _turning(2.0 + 1e-12, 1e-9, impacts_are(0)),
        "it turns on, and nothing is struck",
    ),
    _case(
        "slide-ends-with-compression",
        "sliding stops just as compression ends: both changes of the impact's law coincide",
        _struck(_LEANING, _just_stopping, _ROUGH, 0.5, 0.05),
        "the impulse of Stronge's law, with sticking from there on",
        _FLIGHT,
    ),
    _case(
        "elbow-and-tip-at-once",
        "a stretched chain turns flat into a wall: two points strike at one instant",
        _dead(),
        "rest at the wall: with e = 0 nothing else conserves and loses as it must",
    ),
    _case(
        "painleve",
        "a rough floor wedges what slides into its lean: it can neither slide on nor leave",
        _wedged(),
        "an impact without collision, by Stronge's law",
        _FLIGHT,
    ),
    _case(
        "compliant-1e12",
        "a floor of 1e12 N/m: a contact of 3 µs in a motion of a second",
        _nearly_rigid(),
        "the press and the rebound, resolved",
        "the same floor and motion by another text of the equations in 113 bits, in the run",
    ),
    _case(
        "on-the-surface-at-rest",
        "D starts exactly on a rough floor, at rest under its load",
        _resting(),
        "rest, with no impact and no bit changed, for 100 s",
        bound="no bit may change; a peer may creep by 1e-6",
    ),
    _case(
        "on-the-surface-leaving",
        "D starts exactly on the floor, on its way out",
        _leaving(),
        "free flight: nothing is struck, nothing is held",
        "the flight by another text of the equations in 113 bits, in the run",
    ),
    _case(
        "sliding-200-s",
        "D slides to and fro on a smooth floor: an acceleration kept at zero lets rounding add up",
        _sliding(),
        "D on the floor, and the energy of the start",
        "conservation, and the constraint itself",
        "64 roundings of place, and of speed pulled back at 8/s; 1e4 roundings of the energy and "
        "what the allowed error of u makes of it",
    ),
    _case(
        "newtons-gain",
        "Newton's law of restitution with friction creates energy: true to the law, and to be said",
        _gaining(),
        "T grows 1.5875-fold (T. R. Kane and D. A. Levinson's bars), and the log says so",
        _FLIGHT + "; the ratio is published",
    ),
)
