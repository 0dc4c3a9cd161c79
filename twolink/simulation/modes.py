"""Modes of friction in the joints: which of them turns which way, and which of them sticks.

In a mode the motion is smooth: a joint that turns is resisted by a constant torque, one that
sticks is locked. A mode ends when a turning joint comes to rest, or when a stuck one needs more
torque than friction can give. What follows is the one mode that is consistent with the laws of
friction: a stuck joint is held by less than the static torque, a starting one starts against its
friction.
"""

from __future__ import annotations

from itertools import product

from twolink import lagrange
from twolink.arithmetic import Pair, Scalar
from twolink.chain import Chain
from twolink.effects import Effect
from twolink.effects.joint_friction import JointFriction
from twolink.errors import SimulationError
from twolink.loads import Loads
from twolink.simulation.equations import loads_of
from twolink.simulation.mode import Mode


class FrictionModes:
    """The modes of a chain under smooth effects and friction in its joints."""

    def __init__(self, chain: Chain, effects: tuple[Effect, ...], friction: JointFriction) -> None:
        """Take the chain, the effects without friction, and the friction."""
        self.chain = chain
        self.effects = effects
        self.friction = friction

    def loads(self, mode: Mode, q: Pair, u: Pair, t: Scalar) -> Loads:
        """Return what acts in a mode, but for the torques that hold stuck joints."""
        directions = (mode.A or 0, mode.B or 0)
        return (
            *loads_of(self.effects, self.chain, q, u, t),
            *self.friction.sliding_loads(directions),
        )

    def accelerations(self, mode: Mode, q: Pair, u: Pair, t: Scalar) -> Pair:
        """Return du/dt (rad/s²) in a mode, with its stuck joints locked."""
        loads = self.loads(mode, q, u, t)
        Q1, Q2 = lagrange.generalized_active_force(self.chain, q, loads)
        Cu1, Cu2 = lagrange.velocity_terms(self.chain, q, u)
        (M11, M12), (_, M22) = lagrange.mass_matrix(self.chain, q)
        r1, r2 = Q1 - Cu1, Q2 - Cu2
        if mode.A == 0 and mode.B == 0:
            return 0 * r1, 0 * r2
        if mode.A == 0:
            return 0 * r1, r2 / M22
        if mode.B == 0:
            together = (r1 + r2) / (M11 + 2 * M12 + M22)
            return together, together
        det = lagrange.determinant(self.chain, q)
        return (M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det

    def holding_torques(self, mode: Mode, q: Pair, u: Pair, t: Scalar) -> Pair:
        """Return the torques (N m) that hold the stuck joints, and 0 at the others."""
        du = self.accelerations(mode, q, u, t)
        loads = self.loads(mode, q, u, t)
        G1, G2 = lagrange.inverse_dynamics(self.chain, q, u, du, loads)
        return G1 + G2, G2

    def mode_at(self, q: Pair, u: Pair, t: Scalar, starting: dict[int, int] | None = None) -> Mode:
        """Return the mode that a state goes on in.

        `starting` has the directions of joints that have just broken loose (0 for A, 1 for B),
        though still at rest.
        """
        speeds = (float(u[0]), float(u[1] - u[0]))
        choices: list[tuple[int | None, ...]] = []
        for joint, speed in enumerate(speeds):
            if self.friction.holding[joint] == 0:
                choices.append((None,))
            elif starting is not None and joint in starting:
                choices.append((starting[joint],))
            elif speed != 0:
                choices.append((1 if speed > 0 else -1,))
            else:
                choices.append((0, 1, -1))
        # Of the candidates at most one is consistent, but for rounding: the least wrong is it.
        candidates = [Mode(*directions) for directions in product(*choices)]
        loose = starting or {}
        known = (speeds[0] != 0 or 0 in loose, speeds[1] != 0 or 1 in loose)
        return min(candidates, key=lambda mode: self._fault(mode, known, q, u, t))

    def _fault(self, mode: Mode, known: Pair, q: Pair, u: Pair, t: Scalar) -> float:
        """Return by how much torque (N m) a mode offends the laws of friction; 0 if not at all.

        A joint whose direction is known turns, or has just broken loose: it may start slowly.
        """
        du1, du2 = self.accelerations(mode, q, u, t)
        rates = (float(du1), float(du2 - du1))
        torques = self.holding_torques(mode, q, u, t)
        fault = 0.0
        for joint, direction in enumerate(mode):
            if direction == 0:
                excess = abs(float(torques[joint])) - self.friction.holding[joint]
                fault = max(fault, excess)
            elif direction is not None and not known[joint] and rates[joint] * direction <= 0:
                # It would start the wrong way: worse than any rounding of a holding torque.
                fault = max(fault, self.friction.holding[joint])
        return fault


def split_friction(effects: tuple[Effect, ...]) -> tuple[tuple[Effect, ...], JointFriction | None]:
    """Return the effects that are smooth, and the friction in the joints, if there is any."""
    smooth = tuple(effect for effect in effects if not isinstance(effect, JointFriction))
    found = [effect for effect in effects if isinstance(effect, JointFriction)]
    if len(found) > 1:
        raise SimulationError("joint friction is there twice; allowed is one for both joints")
    return smooth, found[0] if found else None
