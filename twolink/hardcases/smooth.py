"""Smooth motion: where steps, symmetries, instability and time itself are what is hard."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from twolink.chain import Chain
from twolink.effects.gravity import Gravity
from twolink.effects.joint_damping import JointDamping
from twolink.effects.joint_spring import JointSpring
from twolink.effects.sampled_torque import SampledTorque
from twolink.hardcases import exact, long_truths
from twolink.hardcases.in_motion import (
    Answer,
    Check,
    InMotion,
    Judge,
    keeps,
    keeps_energy,
    momentum,
    near,
    near_run,
)
from twolink.hardcases.quadruple import Reference, Truth
from twolink.hardcases.record import Case, Finding
from twolink.scene import Scene
from twolink.simulation import motion
from twolink.verification.states import Array

_BARS = Chain.uniform_bars()
_DOWN = Gravity(9.81)
# Link 1 hangs along x, so that rest is at 0, which float64 has exactly.
_ALONG_X = Gravity(9.81, (1.0, 0.0))
# Half of the mass at the end of link 1; the rest is link 2, balanced on the elbow: a pendulum.
_PENDULUM = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 0.1))

_RUN = "the same motion by another text of the equations in 113 bits, in the run"
_KEPT = (
    "the same motion by another text of the equations in 113 bits or more, kept in "
    "references.json and made again by `python -m twolink.hardcases.long_truths`"
)
_BOUND = (
    "the global accuracy that is asked for; a peer's is 1e-6 or ours, or a thousand of its "
    "tolerances times the growth of errors over the run, and 0.01 at most"
)


def _case(
    name: str, hard: str, trial: InMotion, expected: str, reference: str = _RUN, bound: str = _BOUND
) -> Case:
    return Case(name, "smooth", hard, expected, reference, bound, trial)


def _of_reference(reference: Reference, accuracy: float, growth: float, samples: int) -> InMotion:
    """Return the trial of a motion under gravity alone, against its run in 113 bits."""
    scene = Scene(reference.chain, reference.q, reference.u, reference.duration, (_DOWN,), accuracy)
    return InMotion(scene, (near_run(reference, growth),), samples)


_NATURAL = Reference(_BARS, (0.0, 0.0), (0.0, 0.0), 3.0)
_NATURAL_SCENE = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 3.0, (_DOWN,))
# By the growth of an error of the start, which a test measures again.
_NATURAL_GROWTH = 200.0

_EVERY_ORDER = range(5, 32, 2)
_ORDERS_SAMPLES = 4


def _every_order(formulation: str, check: Check) -> Iterator[Finding]:
    """Take each order that the library takes: none may take an endless step.

    A step errs by exp(−2 (p + 1)) at order p, and by the rounding of all N operations; over the
    run all steps' errors grow.
    """
    times = np.linspace(0.0, _NATURAL.duration, _ORDERS_SAMPLES)
    truth = _natural_truth(tuple(times.tolist()))
    for order in _EVERY_ORDER:
        check()
        run = motion.motion_run(_NATURAL_SCENE, times, formulation=formulation, order=order)
        step = math.exp(-2 * (order + 1)) + 1e-15
        # heyoka's error control is of the last two terms, and a step errs by a few of them.
        bound = 10 * run.steps * step * _NATURAL_GROWTH
        error = max(
            float(np.abs(np.asarray(run.q, dtype=float) - truth.q).max()),
            float(np.abs(np.asarray(run.u, dtype=float) - truth.u).max()),
        )
        yield Finding(error / bound, said=f"order {order} is off by {error:.2g} of {bound:.2g}")


_NATURAL_TRUTHS: dict[tuple[float, ...], Truth] = {}


def _natural_truth(times: tuple[float, ...]) -> Truth:
    if times not in _NATURAL_TRUTHS:
        _NATURAL_TRUTHS[times] = _NATURAL.truth(times)
    return _NATURAL_TRUTHS[times]


def _swinging(start: float) -> Judge:
    """Judge link 1 as a pendulum from rest; the balanced link 2 does not turn."""

    def truth(times: Array) -> Truth:
        found = [exact.pendulum(start, 9.81, t) for t in times.tolist()]
        q, u = np.array(found).T
        return Truth(times, np.array([q, 0 * q]), np.array([u, 0 * u]))

    return near(truth)


def _long(name: str, accuracy: float, *more: Judge) -> InMotion:
    """Return the trial of a motion whose truth is kept in a file."""
    reference = long_truths.REFERENCES[name]
    scene = Scene(reference.chain, reference.q, reference.u, reference.duration, (), accuracy)
    if any(reference.gravity):
        scene = replace(scene, effects=(_DOWN,))
    if any(reference.stiffness):
        spring = JointSpring(reference.stiffness, reference.rest)
        scene = replace(scene, effects=(*scene.effects, spring))

    def judge(answer: Answer) -> Finding:
        truth, growth = long_truths.kept(name)
        return near(lambda _: truth, growth)(answer)

    return InMotion(scene, (judge, *more), long_truths.SAMPLES)


def _chaotic() -> InMotion:
    """Return a motion that no number of 113 bits can follow to its end: a claim must hold."""
    trial = _long("chaos", 1e-9)

    def judge(answer: Answer) -> Finding:
        truth, growth = long_truths.kept("chaos")
        if answer.trajectory is None:
            return near(lambda _: truth, growth)(answer)
        claimed = answer.trajectory.holds_until
        must = float(truth.t[growth * _ROUNDINGS_OF_113_BITS <= answer.accuracy].max())
        if claimed < must:
            return Finding(math.inf, said=f"it is known until {claimed:.6g} s; {must:g} s can be")
        known = truth.t <= claimed
        parts = replace(answer, t=answer.t[known], q=answer.q[:, known], u=answer.u[:, known])
        return near(lambda _: Truth(truth.t[known], truth.q[:, known], truth.u[:, known]))(parts)

    return replace(trial, judges=(judge, keeps_energy(1e4)), _found={})


# A thousand of them.
_ROUNDINGS_OF_113_BITS = 1e-31


def _creeping() -> InMotion:
    """Return a chain in joints so viscous that it creeps: Q is used up by the dampers at once."""
    c, (q1, q2) = 1e8, (0.3, -0.4)
    Q1, Q2 = 9.81 * 1.5 * math.cos(q1), 9.81 * 0.5 * math.cos(q2)
    u1 = (Q1 + Q2) / c
    u = np.array([[u1], [u1 + Q2 / c]])

    def truth(times: Array) -> Truth:
        return Truth(times, np.array([[q1], [q2]]) + u * times, u * (times > 0))

    effects = (_DOWN, JointDamping((c, c)))
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 100.0, effects, 1e-9, method="Radau")
    return InMotion(scene, (near(truth),))


def _soft() -> InMotion:
    """Return a straight chain at rest, and a torque t³ in its elbow: a spline draws it exactly."""
    times = (0.0, 1.0, 2.0, 3.0, 4.0)
    torque = SampledTorque(times, (0.0,) * 5, tuple(t**3 for t in times), "cubic")
    scene = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 4.0, (torque,), 1e-3)
    growth = 1e3
    reference = Reference(_BARS, scene.q, scene.u, 4.0, gravity=(0.0, 0.0), cubic=(0.0, 1.0))
    return InMotion(scene, (near_run(reference, growth),), 5, accuracies=(1e-3, 1e-6, 1e-9))


def _sampled(interpolation: str) -> InMotion:
    """Return a chain that is driven by five samples a second, each held or drawn on to the next."""
    times = (0.0, 0.2, 0.4, 0.6, 0.8)
    A, B = (8.0, -8.0, 12.0, 0.0, -5.0), (-3.0, 4.0, -4.0, 2.0, 0.0)
    rows = []
    for index, t in enumerate(times):
        rates = (0.0, 0.0)
        if interpolation == "linear" and index + 1 < len(times):
            step = times[index + 1] - t
            rates = (A[index + 1] - A[index]) / step, (B[index + 1] - B[index]) / step
        rows.append((t, (A[index], B[index]), rates))
    torque = SampledTorque(times, A, B, interpolation)  # type: ignore[arg-type]
    scene = Scene(_BARS, (0.3, -0.4), (0.0, 0.0), 1.0, (_DOWN, torque), 1e-10)
    reference = Reference(_BARS, scene.q, scene.u, 1.0, torques=tuple(rows))
    return InMotion(scene, (near_run(reference),), 21)


# Link 2 is a light pendulum on a heavy one of the same length: the frequencies differ by 1 %.
_BEATING = Reference(
    Chain((1.0, 1e-4), (1.0, 1.0), ((1.0, 0.0), (1.0, 0.0)), (0.0, 0.0)),
    (math.pi / 2 + 1e-3, math.pi / 2),
    (0.0, 0.0),
    200.0,
)

_UPRIGHT = Reference(_BARS, (-math.pi / 2, -math.pi / 2), (0.0, 0.0), 5.0)
_NEARLY = replace(_UPRIGHT, q=(-math.pi / 2 + 1e-12, -math.pi / 2 + 1e-12), duration=4.0, _made={})
_SEPARATRIX = Reference(
    _PENDULUM, (0.0, 0.0), (2 * math.sqrt(9.81), 0.0), 20.0, gravity=(9.81, 0.0)
)
_DAMPED = Reference(_BARS, (0.3, -0.4), (1.0, -1.0), 1e-6, damping=(1e8, 1e8))

# The rate at which the faster of two modes leaves the upright pose of equal bars (1/s), squared the
# larger root of 7/36 s² − 7/6 g s + 3/4 g² = 0.
_LEAVES = math.sqrt(9.81 * (7 / 6 + math.sqrt(49 / 36 - 7 / 12)) / (7 / 18))

CASES = (
    _case(
        "natural-start",
        "the source's start, all zeros: of a series in t only every fourth term is there, and an "
        "order that ends on two missing ones sees no reason for a step to end",
        InMotion(
            _NATURAL_SCENE,
            (near(lambda times: _natural_truth(tuple(times.tolist())), _NATURAL_GROWTH),),
            _ORDERS_SAMPLES,
            accuracies=(1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12),
            tolerances=(1e-3, 1e-4, 1e-6, 1e-8, 1e-9, 1e-12),
            also=_every_order,
        ),
        "free fall from the horizontal for 3 s, at every accuracy, and at every odd order from "
        "5 to 31: the library takes no even one",
        bound=_BOUND + "; of an order p, steps × (exp(−2 (p + 1)) + 1e-15) × the growth",
    ),
    _case(
        "upright-rest",
        "unstable rest, but for what π/2 lacks in float64: q cannot resolve how it begins to fall",
        _of_reference(_UPRIGHT, 1e-9, math.exp(5.0 * _LEAVES), 11),
        "it falls from 6e-17 rad and is well on its way after 5 s",
    ),
    _case(
        "upright-by-a-picoradian",
        "released 1e-12 rad from upright: an error of 1e-16 is one of the motion's fourth digit",
        _of_reference(_NEARLY, 1e-9, math.exp(4.0 * _LEAVES), 11),
        "it falls the way it leans, after 4 s by half a turn and more",
    ),
    _case(
        "chaos-100-s",
        "an error of the start grows by 5e31 in 100 s: float64 has no digit left after 60 s, and "
        "113 bits after 100 s",
        _chaotic(),
        "the motion to 1e-9 for 70 s at least, the energy for all of 100 s, and a sentence that "
        "says until when the motion is known",
        _KEPT,
        _BOUND
        + "; it must be met as long as the growth × 1e-31, a thousand roundings of 113 bits, "
        "is below it, and nothing may be claimed beyond",
    ),
    _case(
        "small-oscillation-1e6-s",
        "half a million swings in six million steps: what a step errs by adds up in the phase",
        InMotion(
            Scene(_PENDULUM, (0.1, 0.0), (0.0, 0.0), 1e6, (_ALONG_X,), 1e-5),
            (_swinging(0.1), keeps_energy(1e4)),
        ),
        "a pendulum's swings by Jacobi's elliptic functions, and link 2 that never turns",
        "closed form, to a hundred digits, in the run",
    ),
    _case(
        "separatrix",
        "thrown from below with the speed that just reaches the top: rounding decides, and a run "
        "must know on which side this float64 speed is",
        InMotion(
            Scene(_PENDULUM, _SEPARATRIX.q, _SEPARATRIX.u, _SEPARATRIX.duration, (_ALONG_X,), 1e-9),
            (near_run(_SEPARATRIX, 1e16),),
            21,
        ),
        "it stays near the top for seconds, and leaves it to the side that the true sum decides",
    ),
    _case(
        "spin-1e5",
        "link 2 spins at 1e5 rad/s while both fall: ten thousand radians in a tenth of a second",
        _long("spin", 1e-4),
        "the fast motion in phase and the slow one beside it",
        _KEPT,
    ),
    _case(
        "beats",
        "two pendulums whose frequencies differ by 1 %: all energy goes over to the light one, "
        "slowly, and comes back",
        InMotion(
            Scene(_BEATING.chain, _BEATING.q, _BEATING.u, _BEATING.duration, (_DOWN,), 1e-9),
            (near_run(_BEATING, 1e3), keeps_energy(1e4)),
        ),
        "beats of 200 s, at their right time",
    ),
    _case(
        "zero-gravity-1e5-s",
        "nothing acts for 1e5 s: what drifts is the method's own",
        _long(
            "zero-gravity",
            1e-4,
            keeps_energy(1e4),
            keeps("angular momentum", momentum, momentum, 1e4),
        ),
        "the motion; energy and angular momentum are those of the start",
        _KEPT,
    ),
    _case(
        "stiff-spring-1e10",
        "a spring of 1e10 N m/rad in the elbow: it trembles at 4e5 rad/s with 1e-9 rad while the "
        "chain falls as if it were one bar",
        _long("stiff-spring", 1e-6),
        "the fall, and the tremble in phase",
        _KEPT,
    ),
    _case(
        "strong-damping-creep",
        "dampers of 1e8 N m s/rad for 100 s: the slow is 1e-7 rad/s, the fast dies in 1e-9 s",
        _creeping(),
        "it creeps with u of C u = Q",
        "closed form: the first term in 1/c; the next is 1e-16",
    ),
    _case(
        "strong-damping-at-once",
        "the same dampers seize a moving chain: followed for a microsecond, with 3000 time "
        "constants in it",
        InMotion(
            Scene(
                _BARS,
                _DAMPED.q,
                _DAMPED.u,
                _DAMPED.duration,
                (_DOWN, JointDamping((1e8, 1e8))),
                1e-9,
            ),
            (near_run(_DAMPED),),
        ),
        "u falls from 1 to 1e-7 rad/s, and creeps on from there",
    ),
    _case(
        "soft-torque",
        "a torque that begins as t³ on a chain at rest: q begins as t⁵ and goes on with t¹⁵, so at "
        "orders up to 13 a step sees no end, and two orders agree on what is wrong",
        _soft(),
        "the motion, also where little accuracy is asked for",
    ),
    _case(
        "discontinuous-torque",
        "motor torques that jump five times: a step over a jump loses its order",
        _sampled("hold"),
        "the motion from jump to jump",
    ),
    _case(
        "coarsely-sampled-torque",
        "five samples a second with straight lines between: kinks that an integrator smears",
        _sampled("linear"),
        "the motion from kink to kink",
    ),
)
