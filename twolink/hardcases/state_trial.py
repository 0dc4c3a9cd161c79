"""A trial at a state: one evaluation of forward dynamics against a hundred digits.

An external engine's bound is the library's tolerance (`twolink.verification.tolerance`): N
roundings on the longest path, with Bauer and Skeel's condition of M u̇ = r, N ε |M⁻¹| (R + M̄
|u̇|). It covers a solution with rounded entries of M. This library promises more: by Cramer's rule
u̇ is adj(M) r / det M, and its det M is a sum of positive terms with a relative error of N ε. Its
bound is N ε (|M⁻¹| R + |u̇|) plus the effect of the rounding of the elbow's angle on det M, without
cancellation in det M. Below float64's smallest normal number the error of an operation is absolute,
the smallest positive number; each term of the bounds includes it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.engines.contract import Engine
from twolink.engines.joint_model import JOINTS
from twolink.engines.marks import Result
from twolink.engines.messages import Model, Parameters
from twolink.engines.remote_engine import RemoteEngine
from twolink.formulations import FORMULATIONS
from twolink.hardcases import exact
from twolink.names import EquationsName
from twolink.simulation.smooth.equations import MomentumEquations
from twolink.verification.states import Array, States
from twolink.verification.tolerance import Problem, Scale, tolerance

Numbers = tuple[float, float]

# The smallest positive number of float64, the error of an operation that underflows.
_LEAST = 5e-324

# Upper bound on the operations of a spatial recursion over two joints: transforms, products, sums.
_ROUNDINGS_OF_ENGINE = 500


@dataclass(frozen=True)
class StateTrial:
    """A chain in a state (rad, rad/s) under gravity g (m/s², along y) and motor torques (N m).

    The momenta (kg m²/s) are those of u, unless `p` is given.
    """

    chain: Chain
    q: Numbers
    u: Numbers = (0.1, -0.2)
    g: float = 9.81
    torque: Numbers = (0.3, -0.7)
    p: Numbers | None = None

    def ours(self, formulation: EquationsName, check: Callable[[], None]) -> Result:
        """Return the error of one of the formulations."""
        if formulation == "momenta":
            return self._by_momenta()
        text = FORMULATIONS[formulation].equations

        def forward(q: Pair, u: Pair) -> Pair:
            return text.forward_dynamics(self.chain, q, u, self._loads(q, u))

        return self._compared(forward(self.q, self.u), self._bound(Compiled(forward).depth))

    def unsupported(self, engine: Engine) -> str | None:
        """Return why an engine cannot be tried, or None if it can."""
        return without_accelerations(engine)

    def call(self, engine: Engine) -> str:
        """Return the question to an engine."""
        return (
            f"{engine.name}: forward_dynamics({self.chain!r}, q={self.q!r}, u={self.u!r}, "
            f"gravity={(0.0, self.g)!r}, torque={self.torque!r})"
        )

    def external(self, engine: RemoteEngine) -> Result:
        """Return the error of an engine's forward dynamics."""
        found = accelerations(engine, self.chain, self.q, self.u, self.g, self.torque)
        return self._compared(found, self._bound_of_engine(), warned=bool(engine.captured_warnings))

    def _loads(self, q: Pair, u: Pair) -> Any:
        chain = self.chain
        return (
            *Gravity(self.g).loads(chain, q, u),
            *JointTorque(self.torque).loads(chain, q, u),
        )

    @cached_property
    def _truth(self) -> tuple[Decimal, Decimal]:
        return exact.accelerations(self.chain, self.q, self.u, (0.0, self.g), self.torque)

    def _compared(self, found: Pair, bound: Pair, *, warned: bool = False) -> Result:
        return compared(found, self._truth, bound, "du", "rad/s²", warned=warned)

    def _states(self, accelerations: Pair) -> States:
        # The reaction of the motor at B acts on link 1 as well.
        tau1, tau2 = (abs(x) for x in self.torque)
        return States(
            # Sines of large angles are accurate to float64; the only sum is
            # that of the elbow angle.
            angles=_column((0.0, self.q[1] - self.q[0])),
            speeds=_column(self.u),
            accelerations=_column(accelerations),
            torques=_column((tau1 + 2 * tau2, tau2)),
            end_force=np.zeros((2, 1)),
        )

    def _problem(self, roundings: int, *, joint: bool = False) -> Problem:
        du1, du2 = (float(x) for x in self._truth)
        scale = Scale.of(self.chain, joint=joint, gravity=self.g)
        found = (du1, du2 - du1) if joint else (du1, du2)
        states = self._states(found)
        if joint:
            states = replace(states, speeds=_column((self.u[0], self.u[1] - self.u[0])))
        return Problem(self.chain, scale, states, roundings, found=states.accelerations)

    def _bound(self, roundings: int) -> Numbers:
        """Return the error bound (rad/s²) of du1 and du2 by Cramer's rule, det M being accurate."""
        problem = self._problem(roundings)
        loads = problem.scale.weight + problem.states.torques
        right = tolerance("velocity terms", problem) + problem.units * loads
        return _by_cramer(problem, right, self._truth, roundings)

    def _bound_of_engine(self) -> Numbers:
        """Return the bound for an external engine: the larger of those in both kinds of angles."""
        N = _ROUNDINGS_OF_ENGINE
        absolute = _with_underflow(self._problem(N), N)
        first, second = _with_underflow(self._problem(N, joint=True), N)
        return max(absolute[0], first), max(absolute[1], first + second)

    def _by_momenta(self) -> Result:
        """Return the bound for the equations in momenta: u of given momenta, and their rates."""
        equations, chain = MomentumEquations(), self.chain
        p1, p2 = self.p or equations.from_speeds(chain, self.q, self.u)
        p = float(p1), float(p2)

        def rates(q: Pair, momenta: Pair) -> tuple[Any, ...]:
            effects = (Gravity(self.g), JointTorque(self.torque))
            first, second = equations.rates(chain, effects, q, momenta, 0.0)
            return (*first, *second)

        expected = exact.momentum_rates(chain, self.q, p, (0.0, self.g), self.torque)
        u = float(expected[0]), float(expected[1])
        N = Compiled(rates).depth
        problem = self._problem(N)
        units = float(problem.units[0])
        off = _by_cramer(problem, units * np.abs(_column(p)), expected, N)
        scale = problem.scale
        # The rates are Q ± slope u1 u2, and the slope does not exceed the coupling.
        products = units * abs(u[0] * u[1]) + off[0] * abs(u[1]) + off[1] * abs(u[0])
        forces = units * (scale.weight + problem.states.torques)[:, 0]
        bound = (*off, *(forces + scale.coupling * products + N * _LEAST))
        found = rates(self.q, p)
        speeds = compared(found[:2], expected[:2], bound[:2], "u of p", "rad/s")
        forces_found = compared(found[2:], expected[2:], bound[2:], "dp/dt", "N m")
        return max(speeds, forces_found, key=lambda result: _worst(result.factor))


def without_accelerations(engine: Engine) -> str | None:
    """Return why an engine cannot be asked for `accelerations`, or None if it can."""
    if "parameters" in engine.reads and "forward_dynamics" in engine.answers:
        return None
    return "the engine has no forward dynamics of parameters"


def accelerations(
    engine: Engine, chain: Chain, q: Numbers, u: Numbers, g: float, torque: Numbers
) -> Numbers:
    """Return an engine's du (rad/s²) under gravity along y (m/s²) and motor torques (N m)."""
    mass, length, centre, inertia = chain.mass, chain.length, chain.centre, chain.inertia
    given = Parameters(mass=mass, length=length, centre=centre, inertia=inertia, gravity=g)
    engine.load(Model(id="state", parameters=given))
    states = {
        "angles": np.array([JOINTS.joint_angles(q)]),
        "speeds": np.array([JOINTS.joint_speeds(u)]),
        "torques": np.array([torque]),
    }
    ((first, second),) = engine.evaluate("forward_dynamics", states).tolist()
    return JOINTS.absolute_speeds((first, second))


def compared(
    found: Any, expected: Any, bound: Any, name: str, unit: str, *, warned: bool = False
) -> Result:
    """Return the result on a computed pair, given the reference and the bound of each entry."""
    numbers = [float(x) for x in found]
    said = f"{name} is {numbers[0]!r}, {numbers[1]!r} {unit}"
    if not all(map(math.isfinite, numbers)):
        return Result(math.inf, warned, said, finite=False)
    with exact.digits():
        errors = [abs(Decimal(x) - Decimal(y)) for x, y in zip(numbers, expected, strict=True)]
        shares = [
            float(error / Decimal(float(limit))) if limit > 0 else (math.inf if error else 0.0)
            for error, limit in zip(errors, bound, strict=True)
        ]
    size = float(max(errors))
    limits = [float(limit) for limit in bound]
    true = ", ".join(f"{float(x)!r}" for x in expected)
    said += f"; expected {true}; off by {size:.2g}, tolerance {limits[0]:.2g}, {limits[1]:.2g}"
    return Result(max(shares), warned, said)


def _by_cramer(problem: Problem, right: Array, expected: Any, roundings: int) -> Numbers:
    """Return |M⁻¹| right + N ε |expected|: terms of adj(M) r, and only roundings of det M."""
    size = np.array([abs(float(expected[0])), abs(float(expected[1]))])
    det = float(problem.scale.determinant(problem.chain, problem.elbow, 0.0)[0])
    underflow = roundings * _LEAST
    terms = problem.inverse[:, :, 0] @ (right[:, 0] + underflow)
    share = float(problem.units[0]) + (underflow + _by_the_angle(problem)) / det
    first, second = terms + share * size + underflow
    return float(first), float(second)


def _by_the_angle(problem: Problem) -> float:
    """Return the effect of the elbow angle's rounding on (m2 L1 h)², a part of det M."""
    scale, elbow = problem.scale, float(problem.elbow[0])
    a, b = problem.chain.centre[1]
    h, eta = abs(a * math.sin(elbow) + b * math.cos(elbow)), float(problem.uncertainty[0])
    moved = scale.radius[1] * eta
    return float((scale.mass[1] * scale.length) ** 2 * (2 * h * moved + moved * moved))


def _with_underflow(problem: Problem, roundings: int) -> Numbers:
    """Return the tolerance of du (rad/s²) with the contribution of underflow."""
    least = np.full((2, 1, 1), roundings * _LEAST)
    size = np.abs(problem.states.accelerations).max()
    lost = problem.inverse[:, :, 0] @ (least[:, 0, 0] * (1 + size))
    det = float(problem.scale.determinant(problem.chain, problem.elbow, 0.0)[0])
    share = 1 + roundings * _LEAST / det
    normal = tolerance("forward dynamics", problem)[:, 0]
    total = share * (normal + lost) + (share - 1) * size
    return float(total[0]), float(total[1])


def _worst(factor: float) -> float:
    return math.inf if math.isnan(factor) else factor


def _column(pair: Pair) -> Array:
    return np.array([[float(pair[0])], [float(pair[1])]])
