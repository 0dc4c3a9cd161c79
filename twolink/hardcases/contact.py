"""Hard cases of contact: limits of impacts, lasting rest, and nearly rigid surfaces."""

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
from twolink.engines.marks import Result
from twolink.hardcases import exact
from twolink.hardcases.friction import BALANCED, by_formula, stays
from twolink.hardcases.record import Case
from twolink.hardcases.reference_integrator import ReferenceMotion
from twolink.hardcases.run import result_of
from twolink.hardcases.trajectory_trial import (
    Answer,
    Judge,
    TrajectoryTrial,
    keeps_energy,
    near_run,
)
from twolink.scene import Scene

_BARS = Chain.uniform_bars()
_DOWN = Gravity(9.81)
_CLOSED = "closed form"
_FLIGHT = "the impact in closed form to a hundred digits, and the flight after it in 113 bits"
_ACCURACY = "the requested global accuracy"


def _case(
    name: str,
    hard: str,
    trial: TrajectoryTrial,
    expected: str,
    reference: str = _CLOSED,
    bound: str = _ACCURACY,
    seconds: float = Case.seconds,
) -> Case:
    return Case(name, "contact", hard, expected, reference, bound, trial, seconds)


def _bounce(t: float, e: float) -> tuple[float, float]:
    """Return height and speed of a body that falls from 1/2 onto 0 with the acceleration 1.

    It lands at 1 s with the speed 1, and rebounds with e, e², …
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


def _bouncing(
    e: float, duration: float, accuracy: float, samples: int, *judges: Judge
) -> TrajectoryTrial:
    """Return the trial of link 1 driven against a stop by a constant torque; link 2 stays still."""
    effects = (JointTorque((-2.0, 0.0)), JointStop("A", lower=0.0, restitution=e))
    scene = Scene(BALANCED, (0.5, 0.0), (0.0, 0.0), duration, effects, accuracy)

    def formula(t: float) -> tuple[float, float, float, float]:
        q, u = _bounce(t, e)
        return q, 0.0, u, 0.0

    return TrajectoryTrial(scene, (by_formula(formula), *judges), samples)


def impacts_are(count: int) -> Judge:
    """Return a check of the number of impacts."""

    def judge(answer: Answer) -> Result:
        if answer.trajectory is None:
            return Result(0.0)
        found = len(answer.trajectory.impacts)
        return result_of(None if found == count else f"there are {found} impacts, not {count}")

    return judge


def _endless_bouncing() -> TrajectoryTrial:
    """Return the trial of bounces without loss: the n-th is at 2 n − 1 s."""
    bounces = 10_000
    effects = (JointTorque((-2.0, 0.0)), JointStop("A", lower=0.0, restitution=1.0))
    scene = Scene(BALANCED, (0.5, 0.0), (0.0, 0.0), 2.0 * bounces, effects, 1e-6)

    def formula(t: float) -> tuple[float, float, float, float]:
        # All bounces have the initial height; samples are at the tops and between them.
        x = t - 2 * math.floor(t / 2)
        height = 0.5 - min(x, 2 - x) ** 2 / 2
        return height, 0.0, -x if x < 1 else 2 - x, 0.0

    return TrajectoryTrial(scene, (by_formula(formula), impacts_are(bounces)), 17)


def _floor(y: float, **others: object) -> Surface:
    return Surface((0.0, y), (0.0, -1.0), **others)  # type: ignore[arg-type]


def _elastic() -> TrajectoryTrial:
    """Return the trial of bars that bounce on a smooth floor without loss."""
    scene = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 5.0, (_DOWN, _floor(1.0, restitution=1.0)), 1e-6)
    return TrajectoryTrial(scene, (keeps_energy(1e3), _outside(1.0)), 51)


def _outside(y: float) -> Judge:
    """Return a check that D is not below a floor, within the tolerance of q."""

    def judge(answer: Answer) -> Result:
        chain = answer.scene.moving_chain
        _, height = kinematics.position(chain, tuple(answer.q), chain.D)
        allowed = answer.accuracy * (chain.L1 + chain.L2)
        below = float(np.max(height - y))
        return Result(max(below, 0.0) / allowed, said=f"D is {below:.2g} m below the floor")

    return judge


def _dead() -> TrajectoryTrial:
    """Return the trial of a stretched chain that turns flat into a wall without rebound."""
    arrives = (math.pi / 2 - 0.5) / 2
    wall = Surface((0.0, 0.0), (1.0, 0.0), on=("B", "D"))
    scene = Scene(_BARS, (0.5, 0.5), (2.0, 2.0), 2.0, (wall,), 1e-9)

    def formula(t: float) -> tuple[float, float, float, float]:
        if t < arrives:
            return 0.5 + 2 * t, 0.5 + 2 * t, 2.0, 2.0
        return math.pi / 2, math.pi / 2, 0.0, 0.0

    return TrajectoryTrial(scene, (by_formula(formula),))


def _turning(y: float, accuracy: float, *judges: Judge) -> TrajectoryTrial:
    """Return the trial of a stretched chain at 1 rad/s with a floor near D's lowest point."""
    scene = Scene(_BARS, (0.0, 0.0), (1.0, 1.0), 3.0, (_floor(y, restitution=0.5),), accuracy)

    def formula(t: float) -> tuple[float, float, float, float]:
        return t, t, 1.0, 1.0

    return TrajectoryTrial(scene, (by_formula(formula), *judges))


def _struck(
    q: tuple[float, float],
    u: Callable[[Chain], tuple[float, float]],
    friction: float,
    restitution: float,
    duration: float,
    law: str = "stronge",
    *judges: Judge,
) -> TrajectoryTrial:
    """Return the trial of bars whose end strikes the floor at t = 0, and the flight after it."""
    before = u(_BARS)
    after = exact.struck(_BARS, q, before, friction, restitution, law)
    y = math.sin(q[0]) + math.sin(q[1])
    floor = _floor(y, friction=friction, restitution=restitution, law=law)
    scene = Scene(_BARS, q, before, duration, (_DOWN, floor), 1e-9)

    def judge(answer: Answer) -> Result:
        # The first sample is either before or after the impact at t = 0.
        later = replace(answer, t=answer.t[1:], q=answer.q[:, 1:], u=answer.u[:, 1:])
        return flight(later)

    reference = ReferenceMotion(_BARS, q, after, duration)
    inner = near_run(reference)

    def flight(later: Answer) -> Result:
        whole = replace(
            later,
            t=np.concatenate([[0.0], later.t]),
            q=np.column_stack([q, later.q]),
            u=np.column_stack([after, later.u]),
        )
        return inner(whole)

    return TrajectoryTrial(scene, (judge, *judges))


def _just_stopping(chain: Chain) -> tuple[float, float]:
    """Return u for which sliding of D along x ends with compression, at an approach of 1 m/s.

    The condition is v_t = v_n (G_nt − μ G_tt)/(G_nn − μ G_nt).
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
    # Slower by a part in 1e12, so that sliding ends first.
    v_t = v_n * (G_nt - _ROUGH * G_tt) / (G_nn - _ROUGH * G_nt) * (1 - 1e-12)
    turn = across[0] * along[1] - across[1] * along[0]
    return (v_n * along[1] - v_t * across[1]) / turn, (across[0] * v_t - along[0] * v_n) / turn


_LEANING, _ROUGH = (0.5, 1.4), 0.8

_WEDGED = (1.1, 1.3), (0.2692905115792913, -0.4566342672120719)


def _wedged() -> TrajectoryTrial:
    """Return the trial of bars that slide on a floor rough enough to jam them."""
    q, u = _WEDGED
    # D slides along the floor to rounding; the exact initial state has no normal speed.
    return _struck(q, lambda _: u, 2.0, 0.5, 0.02)


def _gaining() -> TrajectoryTrial:
    """Return the trial of Kane and Levinson's bars, 20° and 30° from vertical, with their law."""

    def judge(answer: Answer) -> Result:
        if answer.trajectory is None:
            return Result(0.0)
        first = answer.trajectory.impacts[0]
        before, after = first.kinetic_energy
        if not first.creates_energy:
            return result_of("the log does not mention the energy increase")
        # Published to five digits.
        return Result(
            abs(after / before - 1.5875) / 5e-5, said=f"T grows {after / before:.6f}-fold"
        )

    q, u = (1.2217304763960306, 1.0471975511965979), (0.1, 0.2)
    return _struck(q, lambda _: u, 0.5, 0.5, 0.01, "newton", judge)


def _nearly_rigid() -> TrajectoryTrial:
    """Return the trial of bars falling onto a floor of 1e12 N/m: a contact of 1 µm and 3 µs."""
    q, y, k = (0.3, -0.2), 1.2, 1e12
    cushion = CompliantSurface((0.0, y), (0.0, -1.0), "kelvin-voigt", k)
    scene = Scene(_BARS, q, (0.0, 0.0), 0.7, (_DOWN, cushion), 1e-7)
    return TrajectoryTrial(
        scene, (near_run(ReferenceMotion(_BARS, q, (0.0, 0.0), 0.7, presses=k, floor=y)),), 8
    )


def _resting() -> TrajectoryTrial:
    q = (1.2, 0.3)
    floor = _floor(math.sin(q[0]) + math.sin(q[1]), friction=2.0, restitution=0.5)
    return TrajectoryTrial(
        Scene(_BARS, q, (0.0, 0.0), 100.0, (_DOWN, floor), 1e-10), (stays, impacts_are(0))
    )


def _leaving() -> TrajectoryTrial:
    q, u = (0.5, 1.4), (-1.0, -1.5)
    floor = _floor(math.sin(q[0]) + math.sin(q[1]), restitution=0.5)
    scene = Scene(_BARS, q, u, 0.2, (_DOWN, floor), 1e-10)
    return TrajectoryTrial(scene, (near_run(ReferenceMotion(_BARS, q, u, 0.2)), impacts_are(0)))


def _sliding() -> TrajectoryTrial:
    """Return the trial of a chain whose end slides on a smooth floor for 200 s.

    Link 1 swings below A, D stays on the floor above it; energy and floor contact are invariants.
    """
    y = 0.5
    q1 = math.pi / 2 + 0.3
    q2 = math.asin(y - math.sin(q1))
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 200.0, (_DOWN, _floor(y)), 1e-8)

    def judge(answer: Answer) -> Result:
        chain = answer.scene.moving_chain
        _, height = kinematics.position(chain, tuple(answer.q), chain.D)
        off = float(np.abs(height - y).max())
        # Each step adds rounding errors of speed; stabilisation removes them within 1/8 s.
        allowed = _GAP if answer.trajectory is not None else answer.accuracy
        return Result(off / allowed, said=f"D is {off:.2g} m off the floor")

    return TrajectoryTrial(scene, (judge, keeps_energy(1e4), impacts_are(0)), 101)


# 64 roundings of D's position (m), plus as many of its speed (at most 3 m/s) over 1/8 s.
_GAP = 64 * 2.0**-52 * (2.0 + 3.0 / 8)

CASES = (
    _case(
        "restitution-0",
        "no rebound: the first impact is the last",
        _bouncing(0.0, 4.0, 1e-9, 9, impacts_are(1)),
        "rest from 1 s on, after one impact",
    ),
    _case(
        "restitution-1",
        "a lossless floor: any gain or loss of energy is an error of the method",
        _elastic(),
        "the initial energy, and D never below the floor",
        "conservation",
        "1e3 roundings of the energy, plus the effect of the tolerance of u on it",
    ),
    _case(
        "bounces-1e4",
        "ten thousand bounces of equal height: each inherits the errors of all previous ones",
        _endless_bouncing(),
        "10 000 impacts, the n-th at 2 n − 1 s, all at one speed",
        bound=_ACCURACY + ": 1e-6, of 1e4 impacts with 64 roundings of 2e4 s each",
        # Four times the time on an idle machine.
        seconds=150.0,
    ),
    _case(
        "zeno",
        "each bounce halves the speed: infinitely many bounces end at 3 s",
        _bouncing(0.5, 5.0, 1e-9, 11),
        "rest from 3 s on",
    ),
    _case(
        "zeno-slow",
        "each bounce keeps 0.9 of the speed: 300 bounces accumulate until 19 s",
        _bouncing(0.9, 25.0, 1e-9, 11),
        "rest from 19 s on",
    ),
    _case(
        "grazing",
        "D touches the floor at its lowest point with zero normal speed: rounding decides",
        _turning(2.0, 1e-6),
        "it continues to turn as without a floor",
        bound="√(2 a η) of a gap known to η, 64 roundings: 3e-7 m/s; the requirement is 1e-6 m/s",
    ),
    _case(
        "nearly-grazing",
        "D passes the floor at a distance of a picometre",
        _turning(2.0 + 1e-12, 1e-9, impacts_are(0)),
        "it continues to turn, without an impact",
    ),
    _case(
        "slide-ends-with-compression",
        "sliding stops as compression ends: two phase changes of the impact coincide",
        _struck(_LEANING, _just_stopping, _ROUGH, 0.5, 0.05),
        "the impulse of Stronge's law, with sticking from there on",
        _FLIGHT,
    ),
    _case(
        "elbow-and-tip-at-once",
        "a stretched chain turns flat into a wall: two points strike simultaneously",
        _dead(),
        "rest at the wall: for e = 0 the only solution consistent with the balance laws",
    ),
    _case(
        "painleve",
        "a rough floor jams a sliding bar: neither sliding nor separation is possible",
        _wedged(),
        "a tangential impact (impact without collision), by Stronge's law",
        _FLIGHT,
    ),
    _case(
        "compliant-1e12",
        "a floor of 1e12 N/m: a contact of 3 µs in a motion of a second",
        _nearly_rigid(),
        "compression and rebound, both resolved",
        "the same floor and motion by independent equations in 113 bits, computed in the run",
    ),
    _case(
        "on-the-surface-at-rest",
        "D starts exactly on a rough floor, at rest under its load",
        _resting(),
        "rest, with no impact and no bit changed, for 100 s",
        bound="no bit may change; an external engine may creep by 1e-6",
    ),
    _case(
        "on-the-surface-leaving",
        "D starts exactly on the floor with a separating speed",
        _leaving(),
        "free flight, without impact or contact force",
        "the flight by independent equations in 113 bits, computed in the run",
    ),
    _case(
        "sliding-200-s",
        "D slides on a smooth floor: a constraint on the acceleration accumulates rounding",
        _sliding(),
        "D on the floor, and the initial energy",
        "conservation, and the constraint itself",
        "64 roundings of position, and of speed with stabilisation at 8/s; 1e4 roundings of the "
        "energy plus the effect of the tolerance of u on it",
    ),
    _case(
        "newtons-gain",
        "Newton's restitution with friction creates energy, and the log must say so",
        _gaining(),
        "T grows 1.5875-fold (T. R. Kane and D. A. Levinson's bars), and the log says so",
        _FLIGHT + "; the ratio is published",
    ),
)
