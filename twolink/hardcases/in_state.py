"""A trial in a state: forward dynamics once, against a hundred digits.

A peer's bound is the library's one tolerance (`twolink.verification.tolerance`): N roundings on the
longest path, through Bauer and Skeel's condition of M u̇ = r, N ε |M⁻¹| (R + M̄ |u̇|). It allows for a
solution of an M whose entries are rounded. This library promises more: by Cramer's rule u̇ is
adj(M) r / det M, and its det M is a sum of positive terms, right to N ε of itself. So its bound is
N ε (|M⁻¹| R + |u̇|), and what the rounding of the elbow's angle makes of det M; what would cancel
in det M does not enter. Below float64's smallest normal
number an operation errs by the least of all numbers instead of by a share of its result; each term
of the bounds carries that too.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from twolink import kane, lagrange
from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.compilation import Compiled
from twolink.effects.gravity import Gravity
from twolink.effects.joint_torque import JointTorque
from twolink.hardcases import exact
from twolink.hardcases.record import Finding
from twolink.simulation.smooth.equations import MomentumEquations
from twolink.verification.states import Array, States
from twolink.verification.tolerance import Problem, Scale, tolerance

if TYPE_CHECKING:
    from twolink.engines.isolated import Outcome as Isolated
    from twolink.engines.peer import Peer

Numbers = tuple[float, float]

# The least number of float64, by which what underflows may be wrong.
_LEAST = 5e-324

# An upper count of a recursion over two joints in space: transforms, products, sums, and back.
_ROUNDINGS_OF_A_PEER = 500


@dataclass(frozen=True)
class InState:
    """A chain in a state (rad, rad/s) under gravity g (m/s², along y) and motor torques (N m).

    The momenta (kg m²/s) are those of u, unless `p` is given.
    """

    chain: Chain
    q: Numbers
    u: Numbers = (0.1, -0.2)
    g: float = 9.81
    torque: Numbers = (0.3, -0.7)
    p: Numbers | None = None

    def ours(self, formulation: str, check: Callable[[], None]) -> Finding:
        """Return how far one of the formulations is from the truth."""
        if formulation == "momenta":
            return self._by_momenta()
        text = kane if formulation == "kane" else lagrange

        def forward(q: Pair, u: Pair) -> Pair:
            return text.forward_dynamics(self.chain, q, u, self._loads(q, u))

        return self._compared(forward(self.q, self.u), self._bound(Compiled(forward).depth))

    def cannot(self, peer: Peer) -> str | None:
        """Return None: every peer has forward dynamics."""
        return None

    def peers(self, peer: Peer, seconds: float) -> tuple[Finding | None, Isolated, str]:
        """Return how far a peer's own forward dynamics are from the truth."""
        from twolink.engines.isolated import run_isolated

        arguments = (peer.name, self.chain, self.q, self.u, (0.0, self.g), self.torque)
        done = run_isolated(peer_accelerations, *arguments, seconds=seconds)
        call = (
            f"{peer.name}.accelerations({self.chain!r}, q={self.q!r}, u={self.u!r}, "
            f"gravity={(0.0, self.g)!r}, torque={self.torque!r})"
        )
        if done.kind != "finished":
            return None, done, call
        finding = self._compared(done.result, self._bound_of_a_peer(), warned=bool(done.warnings))
        return finding, done, call

    def _loads(self, q: Pair, u: Pair) -> Any:
        chain = self.chain
        return (
            *Gravity(self.g).loads(chain, q, u),
            *JointTorque(self.torque).loads(chain, q, u),
        )

    @cached_property
    def _truth(self) -> tuple[Decimal, Decimal]:
        return exact.accelerations(self.chain, self.q, self.u, (0.0, self.g), self.torque)

    def _compared(self, found: Pair, bound: Pair, *, warned: bool = False) -> Finding:
        return compared(found, self._truth, bound, "du", "rad/s²", warned=warned)

    def _states(self, accelerations: Pair) -> States:
        # The reaction of the motor at B doubles what acts on link 1.
        tau1, tau2 = (abs(x) for x in self.torque)
        return States(
            # Of the angles the sines are as good as float64 has them, however large they are; what
            # is added up is the elbow's alone.
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
        """Return the largest error (rad/s²) of du1 and du2 by Cramer's rule, det M being right."""
        problem = self._problem(roundings)
        loads = problem.scale.weight + problem.states.torques
        right = tolerance("velocity terms", problem) + problem.units * loads
        return _by_cramer(problem, right, self._truth, roundings)

    def _bound_of_a_peer(self) -> Numbers:
        """Return the same for an engine, in whichever angles it computes: the larger of both."""
        N = _ROUNDINGS_OF_A_PEER
        absolute = _with_underflow(self._problem(N), N)
        first, second = _with_underflow(self._problem(N, joint=True), N)
        return max(absolute[0], first), max(absolute[1], first + second)

    def _by_momenta(self) -> Finding:
        """Return the same for the momenta's equations: u of given momenta, and their rates."""
        equations, chain = MomentumEquations(), self.chain
        p1, p2 = self.p or equations.from_speeds(chain, self.q, self.u)
        p = float(p1), float(p2)

        def rates(q: Pair, momenta: Pair) -> tuple[Any, ...]:
            effects = (Gravity(self.g), JointTorque(self.torque))
            first, second = equations.rates(chain, effects, q, momenta, 0.0)
            return (*first, *second)

        truth = exact.momentum_rates(chain, self.q, p, (0.0, self.g), self.torque)
        u = float(truth[0]), float(truth[1])
        N = Compiled(rates).depth
        problem = self._problem(N)
        units = float(problem.units[0])
        off = _by_cramer(problem, units * np.abs(_column(p)), truth, N)
        scale = problem.scale
        # The rates are Q ± slope u1 u2, and slope is no more than the coupling.
        products = units * abs(u[0] * u[1]) + off[0] * abs(u[1]) + off[1] * abs(u[0])
        forces = units * (scale.weight + problem.states.torques)[:, 0]
        bound = (*off, *(forces + scale.coupling * products + N * _LEAST))
        found = rates(self.q, p)
        speeds = compared(found[:2], truth[:2], bound[:2], "u of p", "rad/s")
        forces_found = compared(found[2:], truth[2:], bound[2:], "dp/dt", "N m")
        return max(speeds, forces_found, key=lambda finding: _worst(finding.factor))


def peer_accelerations(
    name: str, chain: Chain, q: Numbers, u: Numbers, gravity: Numbers, torque: Numbers
) -> Numbers:
    """Return a peer's du (rad/s²); the task of a process of its own."""
    from twolink.engines.peers import peer_named

    du1, du2 = peer_named(name).accelerations(chain, q, u, gravity=gravity, torque=torque)
    return float(du1), float(du2)


def compared(
    found: Any, truth: Any, bound: Any, name: str, unit: str, *, warned: bool = False
) -> Finding:
    """Return the finding on a pair that was found, next to the true one and the bound of each."""
    numbers = [float(x) for x in found]
    said = f"{name} is {numbers[0]!r}, {numbers[1]!r} {unit}"
    if not all(map(math.isfinite, numbers)):
        return Finding(math.inf, warned, said, finite=False)
    with exact.digits():
        errors = [abs(Decimal(x) - Decimal(y)) for x, y in zip(numbers, truth, strict=True)]
        shares = [
            float(error / Decimal(float(limit))) if limit > 0 else (math.inf if error else 0.0)
            for error, limit in zip(errors, bound, strict=True)
        ]
    size = float(max(errors))
    limits = [float(limit) for limit in bound]
    true = ", ".join(f"{float(x)!r}" for x in truth)
    said += f"; true is {true}; off by {size:.2g}, allowed are {limits[0]:.2g}, {limits[1]:.2g}"
    return Finding(max(shares), warned, said)


def _by_cramer(problem: Problem, right: Array, truth: Any, roundings: int) -> Numbers:
    """Return |M⁻¹| right + N ε |truth|: of adj(M) r the terms, of det M nothing but roundings."""
    size = np.array([abs(float(truth[0])), abs(float(truth[1]))])
    det = float(problem.scale.determinant(problem.chain, problem.elbow, 0.0)[0])
    underflow = roundings * _LEAST
    terms = problem.inverse[:, :, 0] @ (right[:, 0] + underflow)
    share = float(problem.units[0]) + (underflow + _by_the_angle(problem)) / det
    first, second = terms + share * size + underflow
    return float(first), float(second)


def _by_the_angle(problem: Problem) -> float:
    """Return what the rounding of the elbow's angle makes of (m2 L1 h)², a part of det M."""
    scale, elbow = problem.scale, float(problem.elbow[0])
    a, b = problem.chain.centre[1]
    h, eta = abs(a * math.sin(elbow) + b * math.cos(elbow)), float(problem.uncertainty[0])
    moved = scale.radius[1] * eta
    return float((scale.mass[1] * scale.length) ** 2 * (2 * h * moved + moved * moved))


def _with_underflow(problem: Problem, roundings: int) -> Numbers:
    """Return the tolerance of du (rad/s²), and what underflow adds to it."""
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
