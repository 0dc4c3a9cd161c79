"""A trial in a motion: a scene simulated, and judged at its samples.

This library promises a global error, so its bound is the accuracy that is asked for. A peer
promises at most a tolerance for each step. It is given its method of the highest order (an implicit
one where the scene asks for that), what is fine for it (a tolerance of 1e-12, of heyoka that of
rounding, which it takes by default; steps of a hundredth of the time in which the chain turns
through a radian), and as much time as this library. It is held to `PEERS_ACCURACY`, or to ours
where that is less, or to what a thousand of its tolerances have grown to, but never to more than
`NO_ANSWER`: beyond that an answer is none.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from twolink import lagrange
from twolink.engines.protocol import Array
from twolink.errors import IntegrationError
from twolink.hardcases.quadruple import Reference, Truth
from twolink.hardcases.record import Finding
from twolink.scene import Scene
from twolink.simulation import Trajectory, simulate
from twolink.simulation.motion import has_modes
from twolink.simulation.smooth.taylor import default_longest_step
from twolink.verification.tolerance import EPSILON

if TYPE_CHECKING:
    from twolink.engines.isolated import Outcome as Isolated
    from twolink.engines.peer import Peer, PeerMethod

PEERS_ACCURACY, NO_ANSWER = 1e-6, 1e-2

_TOLERANCE = 1e-12
# heyoka's is by default as fine as rounding; others do not go so far.
_TOLERANCES = {"heyoka": EPSILON}
_TOLERANCES_TOGETHER = 1e3
_LONGEST_STEP, _SHARE_OF_A_RADIAN = 1e-4, 1e-2


@dataclass(frozen=True)
class Answer:
    """A motion that somebody found: times (s), q (rad) and u (rad/s), shape (2, n).

    `accuracy` is the error (rad, rad/s) that is allowed, and `growth` by how much its causes may
    have grown. This library's answers come with their `trajectory`.
    """

    scene: Scene
    t: Array
    q: Array
    u: Array
    accuracy: float
    tolerance: float = 0.0
    trajectory: Trajectory | None = None

    @property
    def finite(self) -> bool:
        """Whether all of it are numbers, and all of the times are there."""
        whole = self.q.shape == self.u.shape == (2, len(self.t))
        return whole and bool(np.isfinite(self.q).all() and np.isfinite(self.u).all())

    def bound(self, growth: float | Array = 1.0) -> Array:
        """Return the error that is allowed at each time, shape (n,)."""
        together = _TOLERANCES_TOGETHER * self.tolerance
        grown = np.maximum(self.accuracy, np.asarray(growth) * together)
        most = max(NO_ANSWER, self.accuracy, together)
        return np.broadcast_to(np.minimum(grown, most), self.t.shape)


Judge = Callable[[Answer], Finding]
"""Compares an answer with the truth."""

Check = Callable[[], None]


@dataclass(frozen=True)
class InMotion:
    """A scene at evenly spaced samples, and what judges it.

    `accuracies` are asked of this library one after the other (none: the scene's), `tolerances` of
    peers (none: what is fine for them); `also` is tried with each formulation, and need not be
    simulated as a scene is.
    """

    scene: Scene
    judges: tuple[Judge, ...]
    samples: int = 11
    accuracies: tuple[float, ...] = ()
    tolerances: tuple[float, ...] = ()
    also: Callable[[str, Check], Iterable[Finding]] | None = None
    _found: dict[str, Finding] = field(default_factory=dict, repr=False, compare=False)

    def ours(self, formulation: str, check: Check) -> Finding:
        """Return the worst of what is found of one of the formulations.

        Modes are written with speeds: there the library itself takes Lagrange's equations in place
        of momenta, and what was found of them is not computed again.
        """
        modal = has_modes(self.scene)
        text = "lagrange" if modal and formulation == "momenta" else formulation
        if modal and text in self._found:
            return self._found[text]
        found: list[Finding] = []
        for accuracy in self.accuracies or (self.scene.accuracy,):
            trajectory = simulate(
                self.scene,
                accuracy=accuracy,
                formulation=formulation,
                samples=self.samples,
                progress=lambda *_: check(),
            )
            if trajectory.failure:
                raise IntegrationError(trajectory.failure)
            answer = Answer(
                self.scene,
                trajectory.t,
                trajectory.q,
                trajectory.u,
                accuracy,
                trajectory=trajectory,
            )
            found.append(self._judged(answer, _warned(trajectory.notes)))
        if self.also is not None:
            found += self.also(formulation, check)
        self._found[text] = worst(found)
        return self._found[text]

    def cannot(self, peer: Peer) -> str | None:
        """Return why a peer cannot express the scene; None if it can."""
        return peer.cannot(self.scene)

    def peers(self, peer: Peer, seconds: float) -> tuple[Finding | None, Isolated, str]:
        """Return the worst of what is found of a peer's own method and integrator."""
        from twolink.engines.isolated import run_isolated

        method = _method(peer, self.scene)
        fine = _TOLERANCES.get(peer.name, _TOLERANCE)
        knobs = (self.tolerances or (fine,)) if method.knob == "tolerance" else (self._step,)
        arguments = (peer.name, self.scene, method.name, knobs, self.samples)
        done = run_isolated(peer_motions, *arguments, seconds=seconds)
        knob_name = "tolerance" if method.knob == "tolerance" else "step"
        values = ", ".join(f"{knob:.3g}" for knob in knobs)
        call = f"{peer.name}, {method.name}: prepared(scene)({knob_name} {values})"
        if done.kind != "finished":
            return None, done, call
        found = []
        times = np.linspace(0.0, self.scene.duration, self.samples)
        for knob, (q, u, warnings) in zip(knobs, done.result, strict=True):
            tolerance = knob if method.knob == "tolerance" else 0.0
            accuracy = max(PEERS_ACCURACY, self.scene.accuracy)
            answer = Answer(self.scene, times, q, u, accuracy, tolerance)
            found.append(self._judged(answer, bool(warnings or done.warnings)))
        return worst(found), done, call

    @cached_property
    def _step(self) -> float:
        """The step (s) that a peer with fixed steps is given."""
        turning = default_longest_step(self.scene)
        return min(_LONGEST_STEP, _SHARE_OF_A_RADIAN * turning, self.scene.duration / 100)

    def _judged(self, answer: Answer, warned: bool) -> Finding:
        if not answer.finite:
            return Finding(math.inf, warned, "the answer is not finite, or not whole", finite=False)
        found = worst([judge(answer) for judge in self.judges])
        return Finding(found.factor, warned, found.said)


def peer_motions(
    name: str, scene: Scene, method: str, knobs: tuple[float, ...], samples: int
) -> list[tuple[Array, Array, tuple[str, ...]]]:
    """Return a peer's q, u and warnings for each knob; the task of a process of its own."""
    from twolink.engines.peers import peer_named

    run = peer_named(name).prepared(scene, method)
    times = np.linspace(0.0, scene.duration, samples)
    found = []
    for knob in knobs:
        motion = run(knob, times)
        found.append((np.asarray(motion.q), np.asarray(motion.u), motion.warnings))
    return found


# Peers' methods for what is stiff, in the order in which they are looked for.
_IMPLICIT = ("Radau", "Kvaerno5", "radau3", "radau1", "implicit_euler", "implicit")


def _method(peer: Peer, scene: Scene) -> PeerMethod:
    """Return a peer's method of highest order, or an implicit one where a scene asks for that."""
    implicit = [m for name in _IMPLICIT for m in peer.methods if m.name == name]
    if scene.method == "Radau" and implicit:
        return implicit[0]
    explicit = [m for m in peer.methods if m not in implicit]
    controlled = [m for m in explicit if m.knob == "tolerance"] or explicit
    varying = [m for m in controlled if m.order is None]
    return varying[0] if varying[:1] == controlled[:1] else max(controlled, key=_order)


def _order(method: PeerMethod) -> int:
    return method.order or 0


def _warned(notes: tuple[str, ...]) -> bool:
    return bool(notes)


def worst(findings: list[Finding]) -> Finding:
    """Return the finding with the largest factor."""
    return max(findings, key=lambda x: math.inf if math.isnan(x.factor) else x.factor)


def near(truth: Callable[[Array], Truth], growth: float | Array = 1.0) -> Judge:
    """Judge by the largest error of q and u, in units of the bound at its time."""

    def judge(answer: Answer) -> Finding:
        true = truth(answer.t)
        found = np.concatenate([answer.q, answer.u])
        right = np.concatenate([true.q, true.u])
        # Both are rounded to float64.
        error = np.maximum(np.abs(found - right) - np.spacing(np.abs(right)), 0.0).max(axis=0)
        bound = answer.bound(growth)
        place = int(np.argmax(error / bound))
        return Finding(
            float(error[place] / bound[place]),
            said=f"at {answer.t[place]:.6g} s q or u is off by {error[place]:.2g}, "
            f"allowed is {bound[place]:.2g}",
        )

    return judge


def near_run(reference: Reference, growth: float | Array = 1.0) -> Judge:
    """Judge by a run of 113 bits, made when it is first asked for."""
    kept: dict[tuple[float, ...], Truth] = {}

    def truth(times: Array) -> Truth:
        key = tuple(times.tolist())
        if key not in kept:
            kept[key] = reference.truth(times)
        return kept[key]

    return near(truth, growth)


def keeps(
    name: str,
    quantity: Callable[[Answer], Array],
    size: Callable[[Answer], Array],
    roundings: float,
) -> Judge:
    """Judge by a quantity that is conserved: it may move by so many roundings of a size.

    And by what the allowed error of u makes of it: twice its share of the fastest speed.
    """

    def judge(answer: Answer) -> Finding:
        values, largest = quantity(answer), float(np.abs(size(answer)).max())
        fast = float(np.abs(answer.u).max())
        share = roundings * EPSILON + 2 * answer.accuracy / max(fast, answer.accuracy)
        off, bound = float(np.abs(values - values[0]).max()), largest * share
        return Finding(off / bound, said=f"{name} moves by {off:.2g}, allowed is {bound:.2g}")

    return judge


def keeps_energy(roundings: float) -> Judge:
    """Judge by T + V, which may move by so many roundings of the largest T."""
    return keeps("energy", energy, kinetic_energy, roundings)


def kinetic_energy(answer: Answer) -> Array:
    """Return T (J) at the samples."""
    chain = answer.scene.equipped
    return np.asarray(lagrange.kinetic_energy(chain, tuple(answer.q), tuple(answer.u)))


def energy(answer: Answer) -> Array:
    """Return T + V (J) at the samples, of the effects that have a potential."""
    scene, q, total = answer.scene, tuple(answer.q), kinetic_energy(answer)
    for effect in scene.effects:
        if hasattr(effect, "potential_energy"):
            total = total + effect.potential_energy(scene.equipped, q)
    return total


def momentum(answer: Answer) -> Array:
    """Return the angular momentum about A (kg m²/s) at the samples."""
    p1, p2 = lagrange.momenta(answer.scene.equipped, tuple(answer.q), tuple(answer.u))
    return np.asarray(p1 + p2)
