"""Hard cases of friction and stops: limits of sticking, and simultaneous events.

Most of them use a chain whose second link is balanced on the elbow: M is then diagonal and
constant, and the motion has a closed form in numbers that are exact in float64.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_friction import JointFriction
from twolink.effects.joint_stop import JointStop
from twolink.effects.joint_torque import JointTorque
from twolink.effects.sampled_torque import SampledTorque
from twolink.engines.marks import Result
from twolink.hardcases.record import Case
from twolink.hardcases.reference_integrator import ReferenceStates
from twolink.hardcases.trajectory_trial import Answer, Judge, TrajectoryTrial, near
from twolink.scene import Scene
from twolink.verification.states import Array

# M = diag(2, 1/2) kg m²: a torque in B accelerates link 2, and link 1 in the opposite sense.
BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.75, 0.5))

_BARS = Chain.uniform_bars()
_CLOSED = "closed form"
_ACCURACY = "the requested global accuracy"


def _case(
    name: str,
    hard: str,
    trial: TrajectoryTrial,
    expected: str,
    bound: str = _ACCURACY,
    reference: str = _CLOSED,
) -> Case:
    return Case(name, "friction", hard, expected, reference, bound, trial)


def by_formula(formula: Callable[[float], tuple[float, float, float, float]]) -> Judge:
    """Return a check against q1, q2, u1, u2 as functions of time (s)."""

    def expected(times: Array) -> ReferenceStates:
        rows = np.array([formula(t) for t in times.tolist()]).T
        return ReferenceStates(times, rows[:2], rows[2:])

    return near(expected)


def stays(answer: Answer) -> Result:
    """Check rest: in this library no bit of the state may change."""
    moved = float(np.abs(answer.q - answer.q[:, :1]).max() + np.abs(answer.u).max())
    if answer.trajectory is not None:
        return Result(0.0 if moved == 0 else math.inf, said=f"it moves by {moved:.2g}")
    return Result(moved / answer.accuracy, said=f"it moves by {moved:.2g}")


def events_at(times: tuple[float, ...], within: float) -> Judge:
    """Return a check of the times (s) of mode changes after the start."""

    def judge(answer: Answer) -> Result:
        if answer.trajectory is None:
            return Result(0.0)
        found = [event.time for event in answer.trajectory.events if event.time > 0]
        if len(found) != len(times):
            return Result(math.inf, said=f"modes begin at {found} s; expected {list(times)}")
        off = max(abs(ours - true) for ours, true in zip(found, times, strict=True))
        return Result(off / within, said=f"a mode begins {off:.2g} s too early or late")

    return judge


def _leaning(share: float) -> TrajectoryTrial:
    """Return the trial of bars held by friction in both joints, at a fraction of its limit."""
    q1, q2 = 0.3, -0.4
    B = 9.81 * 0.5 * math.cos(q2)
    A = 9.81 * 1.5 * math.cos(q1) + B
    holding = A / share, B / share
    friction = JointFriction((0.8 * holding[0], 0.8 * holding[1]), holding)
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 100.0, (Gravity(9.81), friction), 1e-10)
    return TrajectoryTrial(scene, (stays,))


def _breaking_loose() -> TrajectoryTrial:
    """Return the trial of motors with 1.001 of the friction limit in both joints."""
    holding = 4.0 / 1.001, 1.0 / 1.001
    friction = JointFriction(holding)
    effects = (JointTorque((4.0, 1.0)), friction)
    scene = Scene(BALANCED, (0.5, 0.25), (0.0, 0.0), 2.0, effects, 1e-10)
    A, B = 4.0 - holding[0], 1.0 - holding[1]
    du1, du2 = (A - B) / 2, B / 0.5

    def formula(t: float) -> tuple[float, float, float, float]:
        return 0.5 + du1 / 2 * t * t, 0.25 + du2 / 2 * t * t, du1 * t, du2 * t

    return TrajectoryTrial(scene, (by_formula(formula),))


# Time (s) between the slip of both joints: a binary microsecond.
_MOMENT = 2.0**-20


def _within_a_microsecond() -> TrajectoryTrial:
    """Return the trial of growing torques: A slips at 1/2 s, and B slightly later.

    While only A slips, link 2 moves with link 1 and needs 1/2 du1 from B: B transmits
    t − (4 t − 2)/5 N m, and its limit is the value at 1/2 s + h.
    """
    h = _MOMENT
    holds = 0.5 + 0.2 * h
    ramps = SampledTorque((0.0, 2.0), (0.0, 8.0), (0.0, 2.0), "linear")
    scene = Scene(
        BALANCED, (0.0, 0.0), (0.0, 0.0), 1.0, (ramps, JointFriction((2.0, holds))), 1e-10
    )

    def formula(t: float) -> tuple[float, float, float, float]:
        s = t - 0.5
        if s <= 0:
            return 0.0, 0.0, 0.0, 0.0
        if s <= h:
            return 0.8 * s**3 / 3, 0.8 * s**3 / 3, 0.8 * s * s, 0.8 * s * s
        x = s - h
        u, q = 0.8 * h * h, 0.8 * h**3 / 3 + 0.8 * h * h * x
        return (
            q + 0.8 * h * x * x + 0.25 * x**3,
            q + 0.8 * h * x * x + x**3 / 3,
            u + 1.6 * h * x + 0.75 * x * x,
            u + 1.6 * h * x + x * x,
        )

    # A torque of 2 N m has 64 roundings; the torque in B grows by 1/5 N m/s.
    within = 64 * 2.0**-52 * 2.0 / 0.2
    return TrajectoryTrial(scene, (by_formula(formula), events_at((0.5, 0.5 + h), within)), 21)


def _reversal_at_a_stop() -> TrajectoryTrial:
    """Return the trial of a slip of A that reverses at 1/2 s, when B reaches its stop.

    Before: du1 = (−3 − 1)/2. At the stop u = (0, 2) becomes (0.6, −0.4): P = 1.5 · 2/(2 + 1/2).
    After: du1 = −2 until A stops 0.3 s later, and −1 from there on.
    """
    effects = (
        JointTorque((-3.0, 0.0)),
        JointFriction((1.0, 0.0)),
        JointStop("B", upper=0.75, restitution=0.5),
    )
    scene = Scene(BALANCED, (0.0, 0.0), (1.0, 2.0), 1.0, effects, 1e-10)

    def formula(t: float) -> tuple[float, float, float, float]:
        x = t - 0.5
        if x < 0:
            return t - t * t, 2 * t, 1 - 2 * t, 2.0
        if x < 0.3:
            return 0.25 + 0.6 * x - x * x, 1 - 0.4 * x, 0.6 - 2 * x, -0.4
        return 0.34 - (x - 0.3) ** 2 / 2, 1 - 0.4 * x, -(x - 0.3), -0.4

    # A sample at the impact would be before or after it, so there is none.
    return TrajectoryTrial(scene, (by_formula(formula),), 8)


def _two_stops() -> TrajectoryTrial:
    stops = (JointStop("A", upper=0.5), JointStop("B", upper=1.0))
    scene = Scene(BALANCED, (0.0, 0.0), (1.0, 3.0), 2.0, stops, 1e-10)

    def formula(t: float) -> tuple[float, float, float, float]:
        return (t, 3 * t, 1.0, 3.0) if t < 0.5 else (0.5, 1.5, 0.0, 0.0)

    return TrajectoryTrial(scene, (by_formula(formula),), 8)


def _stop_at_no_speed() -> TrajectoryTrial:
    effects = (JointTorque((-4.0, 0.0)), JointStop("A", upper=0.25, restitution=0.5))
    scene = Scene(BALANCED, (0.0, 0.0), (1.0, 0.0), 1.0, effects, 1e-6)

    def formula(t: float) -> tuple[float, float, float, float]:
        return t - t * t, 0.0, 1 - 2 * t, 0.0

    return TrajectoryTrial(scene, (by_formula(formula),))


CASES = (
    _case(
        "stick-at-0.999",
        "both joints hold 0.999 of the friction limit for 100 s: smoothed friction creeps",
        _leaning(0.999),
        "rest, with every bit of q unchanged",
        "no bit may change; an external engine may creep by 1e-6",
    ),
    _case(
        "loose-at-1.001",
        "both joints carry 1.001 of the friction limit: neither sticks while the other slips",
        _breaking_loose(),
        "both slip simultaneously, with constant accelerations of a thousandth",
    ),
    _case(
        "loose-within-a-microsecond",
        "one joint slips 2⁻²⁰ s after the other, whose slip changes its load",
        _within_a_microsecond(),
        "two events a microsecond apart, and cubic motion after them",
        _ACCURACY + "; for event times, 64 roundings of the torque over the rate of B's torque",
    ),
    _case(
        "reversal-as-a-stop-is-hit",
        "a slip reverses at the instant at which the other joint reaches its stop",
        _reversal_at_a_stop(),
        "the impact restores the speed of link 1: it slips, stops, and then reverses",
    ),
    _case(
        "two-stops-at-once",
        "both joints reach a stop simultaneously, without rebound",
        _two_stops(),
        "rest at both stops from 1/2 s on",
    ),
    _case(
        "stop-at-no-speed",
        "a joint reverses exactly at its stop: rounding decides whether there is an impact",
        _stop_at_no_speed(),
        "it reverses as without a stop",
        "√(2 a η) of a gap known to η, 64 roundings: 2e-7 rad/s; the requirement is 1e-6 rad/s",
    ),
)
