"""Friction and stops: rest at its limit, and things that happen at one instant.

Most of these use a chain whose second link is balanced on the elbow: M is then diagonal and
constant, and what happens is known in closed form, by numbers that float64 has exactly.
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
from twolink.hardcases.in_motion import Answer, InMotion, Judge, near
from twolink.hardcases.quadruple import Truth
from twolink.hardcases.record import Case, Finding
from twolink.scene import Scene
from twolink.verification.states import Array

# M = diag(2, 1/2) kg m²: a torque in B turns link 2, and link 1 the other way.
BALANCED = Chain((1.0, 1.0), (1.0, 1.0), ((0.5, 0.0), (0.0, 0.0)), (0.75, 0.5))

_BARS = Chain.uniform_bars()
_CLOSED = "closed form"
_ACCURACY = "the global accuracy that is asked for"


def _case(
    name: str,
    hard: str,
    trial: InMotion,
    expected: str,
    bound: str = _ACCURACY,
    reference: str = _CLOSED,
) -> Case:
    return Case(name, "friction", hard, expected, reference, bound, trial)


def by_formula(formula: Callable[[float], tuple[float, float, float, float]]) -> Judge:
    """Judge by q1, q2, u1, u2 as functions of time (s)."""

    def truth(times: Array) -> Truth:
        rows = np.array([formula(t) for t in times.tolist()]).T
        return Truth(times, rows[:2], rows[2:])

    return near(truth)


def stays(answer: Answer) -> Finding:
    """Judge what rests: of ours it does not move by a bit."""
    moved = float(np.abs(answer.q - answer.q[:, :1]).max() + np.abs(answer.u).max())
    if answer.trajectory is not None:
        return Finding(0.0 if moved == 0 else math.inf, said=f"it moves by {moved:.2g}")
    return Finding(moved / answer.accuracy, said=f"it moves by {moved:.2g}")


def events_at(times: tuple[float, ...], within: float) -> Judge:
    """Judge the times (s) at which modes begin after the start, where they are known."""

    def judge(answer: Answer) -> Finding:
        if answer.trajectory is None:
            return Finding(0.0)
        found = [event.time for event in answer.trajectory.events if event.time > 0]
        if len(found) != len(times):
            return Finding(math.inf, said=f"modes begin at {found} s; true are {list(times)}")
        off = max(abs(ours - true) for ours, true in zip(found, times, strict=True))
        return Finding(off / within, said=f"a mode begins {off:.2g} s too early or late")

    return judge


def _leaning(share: float) -> InMotion:
    """Return bars held by the friction of both joints, at a share of what they can hold."""
    q1, q2 = 0.3, -0.4
    B = 9.81 * 0.5 * math.cos(q2)
    A = 9.81 * 1.5 * math.cos(q1) + B
    holding = A / share, B / share
    friction = JointFriction((0.8 * holding[0], 0.8 * holding[1]), holding)
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 100.0, (Gravity(9.81), friction), 1e-10)
    return InMotion(scene, (stays,))


def _breaking_loose() -> InMotion:
    """Return a chain that motors pull with 1.001 of what friction holds, in both joints."""
    holding = 4.0 / 1.001, 1.0 / 1.001
    friction = JointFriction(holding)
    effects = (JointTorque((4.0, 1.0)), friction)
    scene = Scene(BALANCED, (0.5, 0.25), (0.0, 0.0), 2.0, effects, 1e-10)
    A, B = 4.0 - holding[0], 1.0 - holding[1]
    du1, du2 = (A - B) / 2, B / 0.5

    def formula(t: float) -> tuple[float, float, float, float]:
        return 0.5 + du1 / 2 * t * t, 0.25 + du2 / 2 * t * t, du1 * t, du2 * t

    return InMotion(scene, (by_formula(formula),))


# One joint breaks loose so much (s) after the other: a binary microsecond.
_MOMENT = 2.0**-20


def _within_a_microsecond() -> InMotion:
    """Return motors whose torques grow until A breaks loose at 1/2 s, and B a moment later.

    While A alone slips, link 2 is carried along and asks 1/2 du1 of B: B holds t − (4 t − 2)/5 N m,
    and its limit is what that is at 1/2 s + h.
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

    # A torque of 2 N m is known to 64 roundings; what B holds grows by 1/5 N m/s.
    within = 64 * 2.0**-52 * 2.0 / 0.2
    return InMotion(scene, (by_formula(formula), events_at((0.5, 0.5 + h), within)), 21)


def _reversal_at_a_stop() -> InMotion:
    """Return a slip of A that reverses at 1/2 s, when B meets its stop.

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

    # At the very instant of the impact a sample is of before or after it: none is taken there.
    return InMotion(scene, (by_formula(formula),), 8)


def _two_stops() -> InMotion:
    stops = (JointStop("A", upper=0.5), JointStop("B", upper=1.0))
    scene = Scene(BALANCED, (0.0, 0.0), (1.0, 3.0), 2.0, stops, 1e-10)

    def formula(t: float) -> tuple[float, float, float, float]:
        return (t, 3 * t, 1.0, 3.0) if t < 0.5 else (0.5, 1.5, 0.0, 0.0)

    return InMotion(scene, (by_formula(formula),), 8)


def _stop_at_no_speed() -> InMotion:
    effects = (JointTorque((-4.0, 0.0)), JointStop("A", upper=0.25, restitution=0.5))
    scene = Scene(BALANCED, (0.0, 0.0), (1.0, 0.0), 1.0, effects, 1e-6)

    def formula(t: float) -> tuple[float, float, float, float]:
        return t - t * t, 0.0, 1 - 2 * t, 0.0

    return InMotion(scene, (by_formula(formula),))


CASES = (
    _case(
        "stick-at-0.999",
        "both joints hold 0.999 of what they can: friction that is smoothed creeps, for 100 s",
        _leaning(0.999),
        "rest, and q to the last bit as it was",
        "no bit may change; a peer may creep by 1e-6",
    ),
    _case(
        "loose-at-1.001",
        "both joints are pulled by 1.001 of what they can hold: neither rests as the other slips",
        _breaking_loose(),
        "both move at once, with constant accelerations of a thousandth",
    ),
    _case(
        "loose-within-a-microsecond",
        "one joint breaks loose 2⁻²⁰ s after the other, whose limit the first one's slip has moved",
        _within_a_microsecond(),
        "two events a microsecond apart, and cubic motion after them",
        _ACCURACY + "; of the events' times, 64 roundings of the torque over the rate of what B "
        "holds",
    ),
    _case(
        "reversal-as-a-stop-is-hit",
        "a slip reverses at the very instant at which the other joint meets its stop",
        _reversal_at_a_stop(),
        "the impact gives link 1 a speed again: it slips on, stops, and then reverses",
    ),
    _case(
        "two-stops-at-once",
        "both joints meet a stop at one instant, and neither rebounds",
        _two_stops(),
        "rest at both stops from 1/2 s on",
    ),
    _case(
        "stop-at-no-speed",
        "a joint turns back exactly where its stop is: rounding decides whether it is hit",
        _stop_at_no_speed(),
        "it turns back as if there were no stop",
        "√(2 a η) of a gap known to η, 64 roundings: a speed of 2e-7 rad/s; 1e-6 is asked for",
    ),
)
