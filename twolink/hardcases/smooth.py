"""Hard cases of smooth motion: step control, symmetries, instability and long times."""

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
from twolink.engines.marks import Result
from twolink.hardcases import exact, stored_references
from twolink.hardcases.record import Case
from twolink.hardcases.reference_integrator import ReferenceMotion, ReferenceStates
from twolink.hardcases.trajectory_trial import (
    Answer,
    Check,
    Judge,
    TrajectoryTrial,
    keeps,
    keeps_energy,
    momentum,
    near,
    near_run,
)
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation import motion
from twolink.verification.states import Array

_BARS = Chain.uniform_bars()
_DOWN = Gravity(9.81)
# Link 1 hangs along x, so that equilibrium is at 0, exact in float64.
_ALONG_X = Gravity(9.81, (1.0, 0.0))
# Half of the mass is at the end of link 1; link 2 has the rest, balanced on the elbow: a pendulum.
_PENDULUM = Chain((0.5, 0.5), (1.0, 1.0), ((1.0, 0.0), (0.0, 0.0)), (0.0, 0.1))

_RUN = "the same motion by independent equations in 113 bits, computed in the run"
_KEPT = (
    "the same motion by independent equations in 113 bits or more, stored in references.json and "
    "reproduced by `python -m twolink.hardcases.stored_references`"
)
_BOUND = (
    "the requested global accuracy; for an external engine the largest of 1e-6, ours, and a "
    "thousand of its tolerances times the error growth over the run, at most 0.01"
)


def _case(
    name: str,
    hard: str,
    trial: TrajectoryTrial,
    expected: str,
    reference: str = _RUN,
    bound: str = _BOUND,
    seconds: float = Case.seconds,
) -> Case:
    return Case(name, "smooth", hard, expected, reference, bound, trial, seconds)


def _of_reference(
    reference: ReferenceMotion, accuracy: float, growth: float, samples: int
) -> TrajectoryTrial:
    """Return the trial of a motion under gravity, compared with its run in 113 bits."""
    scene = Scene(reference.chain, reference.q, reference.u, reference.duration, (_DOWN,), accuracy)
    return TrajectoryTrial(scene, (near_run(reference, growth),), samples)


_NATURAL = ReferenceMotion(_BARS, (0.0, 0.0), (0.0, 0.0), 3.0)
_NATURAL_SCENE = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 3.0, (_DOWN,))
# Scaled by the growth of an initial error; a test measures it again.
_NATURAL_GROWTH = 200.0

_EVERY_ORDER = range(5, 32, 2)
_ORDERS_SAMPLES = 4


def _every_order(formulation: EquationsName, check: Check) -> Iterator[Result]:
    """Check every order of the library: the step size must stay finite.

    The error of a step is exp(−2 (p + 1)) at order p plus the rounding of all N operations; the
    errors of all steps grow over the run.
    """
    times = np.linspace(0.0, _NATURAL.duration, _ORDERS_SAMPLES)
    expected = _natural_states(tuple(times.tolist()))
    for order in _EVERY_ORDER:
        check()
        run = motion.motion_run(_NATURAL_SCENE, times, formulation=formulation, order=order)
        step = math.exp(-2 * (order + 1)) + 1e-15
        # heyoka controls the last two terms; the error of a step is a few times those.
        bound = 10 * run.steps * step * _NATURAL_GROWTH
        error = max(
            float(np.abs(np.asarray(run.q, dtype=float) - expected.q).max()),
            float(np.abs(np.asarray(run.u, dtype=float) - expected.u).max()),
        )
        yield Result(error / bound, said=f"order {order}: error {error:.2g}, bound {bound:.2g}")


_NATURAL_STATES: dict[tuple[float, ...], ReferenceStates] = {}


def _natural_states(times: tuple[float, ...]) -> ReferenceStates:
    if times not in _NATURAL_STATES:
        _NATURAL_STATES[times] = _NATURAL.states(times)
    return _NATURAL_STATES[times]


def _swinging(start: float) -> Judge:
    """Return a check of link 1 as a pendulum from rest; the balanced link 2 does not turn."""

    def expected(times: Array) -> ReferenceStates:
        found = [exact.pendulum(start, 9.81, t) for t in times.tolist()]
        q, u = np.array(found).T
        return ReferenceStates(times, np.array([q, 0 * q]), np.array([u, 0 * u]))

    return near(expected)


def _long(name: str, accuracy: float, *more: Judge) -> TrajectoryTrial:
    """Return the trial of a motion with a stored reference."""
    reference = stored_references.REFERENCES[name]
    scene = Scene(reference.chain, reference.q, reference.u, reference.duration, (), accuracy)
    if any(reference.gravity):
        scene = replace(scene, effects=(_DOWN,))
    if any(reference.stiffness):
        spring = JointSpring(reference.stiffness, reference.rest)
        scene = replace(scene, effects=(*scene.effects, spring))

    def judge(answer: Answer) -> Result:
        expected, growth = stored_references.stored(name)
        return near(lambda _: expected, growth)(answer)

    return TrajectoryTrial(scene, (judge, *more), stored_references.SAMPLES)


def _chaotic() -> TrajectoryTrial:
    """Return the trial of a chaotic motion beyond 113 bits, with its claimed validity."""
    trial = _long("chaos", 1e-9)

    def judge(answer: Answer) -> Result:
        expected, growth = stored_references.stored("chaos")
        if answer.trajectory is None:
            return near(lambda _: expected, growth)(answer)
        claimed = answer.trajectory.holds_until
        must = float(expected.t[growth * _ROUNDINGS_OF_113_BITS <= answer.accuracy].max())
        if claimed < must:
            return Result(
                math.inf, said=f"claimed valid until {claimed:.6g} s; {must:g} s is possible"
            )
        known = expected.t <= claimed
        parts = replace(answer, t=answer.t[known], q=answer.q[:, known], u=answer.u[:, known])
        return near(
            lambda _: ReferenceStates(expected.t[known], expected.q[:, known], expected.u[:, known])
        )(parts)

    return replace(trial, judges=(judge, keeps_energy(1e4)), _found={})


# A thousand of them.
_ROUNDINGS_OF_113_BITS = 1e-31


def _creeping() -> TrajectoryTrial:
    """Return the trial of joints with large damping: the chain creeps, damping balances Q."""
    c, (q1, q2) = 1e8, (0.3, -0.4)
    Q1, Q2 = 9.81 * 1.5 * math.cos(q1), 9.81 * 0.5 * math.cos(q2)
    u1 = (Q1 + Q2) / c
    u = np.array([[u1], [u1 + Q2 / c]])

    def expected(times: Array) -> ReferenceStates:
        return ReferenceStates(times, np.array([[q1], [q2]]) + u * times, u * (times > 0))

    effects = (_DOWN, JointDamping((c, c)))
    scene = Scene(_BARS, (q1, q2), (0.0, 0.0), 100.0, effects, 1e-9, method="Radau")
    return TrajectoryTrial(scene, (near(expected),))


def _soft() -> TrajectoryTrial:
    """Return the trial of a straight chain at rest with an elbow torque t³, an exact spline."""
    times = (0.0, 1.0, 2.0, 3.0, 4.0)
    torque = SampledTorque(times, (0.0,) * 5, tuple(t**3 for t in times), "cubic")
    scene = Scene(_BARS, (0.0, 0.0), (0.0, 0.0), 4.0, (torque,), 1e-3)
    growth = 1e3
    reference = ReferenceMotion(_BARS, scene.q, scene.u, 4.0, gravity=(0.0, 0.0), cubic=(0.0, 1.0))
    return TrajectoryTrial(scene, (near_run(reference, growth),), 5, accuracies=(1e-3, 1e-6, 1e-9))


def _sampled(interpolation: str) -> TrajectoryTrial:
    """Return the trial of torque samples, five per second, held or interpolated linearly."""
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
    reference = ReferenceMotion(_BARS, scene.q, scene.u, 1.0, torques=tuple(rows))
    return TrajectoryTrial(scene, (near_run(reference),), 21)


# Link 2 is a light pendulum on a heavy one of the same length: the frequencies differ by 1 %.
_BEATING = ReferenceMotion(
    Chain((1.0, 1e-4), (1.0, 1.0), ((1.0, 0.0), (1.0, 0.0)), (0.0, 0.0)),
    (math.pi / 2 + 1e-3, math.pi / 2),
    (0.0, 0.0),
    200.0,
)

_UPRIGHT = ReferenceMotion(_BARS, (-math.pi / 2, -math.pi / 2), (0.0, 0.0), 5.0)
_NEARLY = replace(_UPRIGHT, q=(-math.pi / 2 + 1e-12, -math.pi / 2 + 1e-12), duration=4.0, _made={})
_SEPARATRIX = ReferenceMotion(
    _PENDULUM, (0.0, 0.0), (2 * math.sqrt(9.81), 0.0), 20.0, gravity=(9.81, 0.0)
)
_DAMPED = ReferenceMotion(_BARS, (0.3, -0.4), (1.0, -1.0), 1e-6, damping=(1e8, 1e8))

# The rate at which the faster of two modes leaves the upright pose of equal bars (1/s), squared the
# larger root of 7/36 s² − 7/6 g s + 3/4 g² = 0.
_LEAVES = math.sqrt(9.81 * (7 / 6 + math.sqrt(49 / 36 - 7 / 12)) / (7 / 18))

CASES = (
    _case(
        "natural-start",
        "the initial state of zeros: only every fourth term of a series in t is non-zero, and an "
        "order whose last two terms vanish has no limit on the step",
        TrajectoryTrial(
            _NATURAL_SCENE,
            (near(lambda times: _natural_states(tuple(times.tolist())), _NATURAL_GROWTH),),
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
        "unstable equilibrium up to the rounding of π/2: q cannot resolve the start of the fall",
        _of_reference(_UPRIGHT, 1e-9, math.exp(5.0 * _LEAVES), 11),
        "it falls from 6e-17 rad, visibly after 5 s",
    ),
    _case(
        "upright-by-a-picoradian",
        "released 1e-12 rad from upright: an error of 1e-16 changes the motion's fourth digit",
        _of_reference(_NEARLY, 1e-9, math.exp(4.0 * _LEAVES), 11),
        "it falls to the side of the offset, by more than half a turn after 4 s",
    ),
    _case(
        "chaos-100-s",
        "an error of the start grows by 5e31 in 100 s: float64 has no digit left after 60 s, and "
        "113 bits after 100 s",
        _chaotic(),
        "the motion to 1e-9 for at least 70 s, the energy for 100 s, and a statement of the time "
        "until which the motion is valid",
        _KEPT,
        _BOUND
        + "; it applies while the growth × 1e-31, a thousand roundings of 113 bits, is below it, "
        "and no validity may be claimed beyond",
    ),
    _case(
        "small-oscillation-1e6-s",
        "half a million swings in six million steps: errors of steps accumulate in the phase",
        TrajectoryTrial(
            Scene(_PENDULUM, (0.1, 0.0), (0.0, 0.0), 1e6, (_ALONG_X,), 1e-5),
            (_swinging(0.1), keeps_energy(1e4)),
        ),
        "a pendulum's swings by Jacobi's elliptic functions, with link 2 not turning",
        "closed form, to a hundred digits, computed in the run",
    ),
    _case(
        "separatrix",
        "started below with the speed that just reaches the top: the side it falls to depends on "
        "the rounding of this float64 speed",
        TrajectoryTrial(
            Scene(_PENDULUM, _SEPARATRIX.q, _SEPARATRIX.u, _SEPARATRIX.duration, (_ALONG_X,), 1e-9),
            (near_run(_SEPARATRIX, 1e16),),
            21,
        ),
        "it stays near the top for seconds, and leaves it to the side given by the exact sum",
    ),
    _case(
        "spin-1e5",
        "link 2 spins at 1e5 rad/s while both fall: ten thousand radians in a tenth of a second",
        _long("spin", 1e-4),
        "the fast motion in phase, and the slow one",
        _KEPT,
    ),
    _case(
        "beats",
        "two pendulums whose frequencies differ by 1 %: the energy moves slowly to the light one "
        "and back",
        TrajectoryTrial(
            Scene(_BEATING.chain, _BEATING.q, _BEATING.u, _BEATING.duration, (_DOWN,), 1e-9),
            (near_run(_BEATING, 1e3), keeps_energy(1e4)),
        ),
        "beats of 200 s at the correct times",
    ),
    _case(
        "zero-gravity-1e5-s",
        "free motion for 1e5 s: any drift is an error of the method",
        _long(
            "zero-gravity",
            1e-4,
            keeps_energy(1e4),
            keeps("angular momentum", momentum, momentum, 1e4),
        ),
        "the motion, with the initial energy and angular momentum",
        _KEPT,
        # Four times the time that Kane's equations take on an idle machine.
        seconds=150.0,
    ),
    _case(
        "stiff-spring-1e10",
        "a spring of 1e10 N m/rad in the elbow: it oscillates at 4e5 rad/s with 1e-9 rad while the "
        "chain falls like one bar",
        _long("stiff-spring", 1e-6),
        "the fall, and the oscillation in phase",
        _KEPT,
    ),
    _case(
        "strong-damping-creep",
        "dampers of 1e8 N m s/rad for 100 s: creep at 1e-7 rad/s, fast decay in 1e-9 s",
        _creeping(),
        "it creeps with u of C u = Q",
        "closed form: the first term in 1/c; the next is 1e-16",
    ),
    _case(
        "strong-damping-at-once",
        "the same dampers on a moving chain: simulated for a microsecond, with 3000 time "
        "constants in it",
        TrajectoryTrial(
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
        "u falls from 1 to 1e-7 rad/s, followed by creep",
    ),
    _case(
        "soft-torque",
        "a torque t³ on a chain at rest: q starts with t⁵ and continues with t¹⁵; orders up to 13 "
        "have no limit on the step, and two orders agree on a wrong result",
        _soft(),
        "the motion, also at low accuracy",
    ),
    _case(
        "discontinuous-torque",
        "motor torques with five jumps: a step across a jump loses its order",
        _sampled("hold"),
        "the motion from jump to jump",
    ),
    _case(
        "coarsely-sampled-torque",
        "five samples per second with linear interpolation: kinks that an integrator smooths",
        _sampled("linear"),
        "the motion from kink to kink",
    ),
)
