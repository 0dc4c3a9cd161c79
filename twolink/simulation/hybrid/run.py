"""A hybrid run: the arcs of a motion with events, and the motion as a function of time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from time import perf_counter
from typing import Any, Literal

import numpy as np

from twolink.arithmetic import Pair
from twolink.contact.impact_laws import Regime
from twolink.errors import IntegrationError
from twolink.integration.operations import Extent, Operations, total
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import DEFAULT_LIMITS, Limits
from twolink.names import EquationsName
from twolink.scene import Scene
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.compile import Compilation, compiled_kind
from twolink.simulation.hybrid.dense import Polynomials, polynomials_of
from twolink.simulation.hybrid.doubts import remarks_of
from twolink.simulation.hybrid.effort import ANY_EFFORT, DEFAULT_EFFORT, Effort
from twolink.simulation.hybrid.history import History
from twolink.simulation.hybrid.impact import Strike
from twolink.simulation.hybrid.impact_log import impact_log
from twolink.simulation.hybrid.mode import Doubt, Event, Impact, sentences
from twolink.simulation.hybrid.unseen import Unseen
from twolink.simulation.run import MotionRun
from twolink.simulation.shortened import SHORTER_TO_RESOLVE
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.simulation.smooth.longest_step import default_longest_step


@dataclass(frozen=True, kw_only=True)
class HybridRun(MotionRun):
    """A motion with events: arcs in one mode each, and the jumps between them.

    `start` has q (rad) and u (rad/s) before an impact at the start, which are not in `polynomials`.
    `since` has the time (s) at which the mode of each arc begins: where bounces are left out, the
    time at which they would have ended, slightly later than the start of the arc. `failure` is the
    reason why the run ends early, at `reached` (s), or empty; q and u then have only the times up
    to there. `exhausted` says that the limit of work has ended the run, or has omitted bounces; its
    `work` is counted in steps (`effort`). `unseen` is the first step that passed a change of the
    loads of an effect of a user, or None.
    `undecided` are those of the doubts that are on events, and are noted.
    """

    arcs: tuple[Arc, ...]
    polynomials: Polynomials
    start: tuple[Pair, Pair]
    since: tuple[float, ...]
    strikes: tuple[Strike, ...]
    remarks: tuple[str, ...]
    doubts: tuple[Doubt, ...]
    reached: float
    failure: str = ""
    exhausted: bool = False
    work: float = 0.0
    unseen: Unseen | None = None
    undecided: tuple[Doubt, ...] = ()

    @property
    def longest_resolving_step(self) -> float:
        """The longest step (s) that would resolve a change; infinite if none was passed.

        Steps on pressed surfaces may be longer than the longest step.
        """
        if self.unseen is None:
            return math.inf
        return SHORTER_TO_RESOLVE * min(self.unseen.length, self.longest_step)

    @property
    def arithmetic(self) -> Operations:
        """The floating-point operations of the steps; without those of events, a lower bound."""
        parts = (arc.compiled.step_operations.times(arc.step_count) for arc in self.arcs)
        return total(parts, Extent.AT_LEAST)

    @property
    def events(self) -> tuple[Event, ...]:
        """The starts of modes of non-zero duration, the first at 0 s; empty without elements."""
        if not self.arcs or not self.arcs[0].mode.names:
            return ()
        lasting = [
            (arc, since)
            for arc, since in zip(self.arcs, self.since, strict=True)
            if arc.end.t > arc.start.t
        ]
        found: list[Event] = []
        for mode, group in groupby(lasting, lambda each: each[0].mode.in_floats):
            own = list(group)
            (first, since), (last, _) = own[0], own[-1]
            start = float(first.start.t)
            # Bounces die away later than the mode after them is entered, which may end before.
            found.append(Event(min(max(since, start), float(last.end.t)), mode, start))
        return tuple(found)

    @property
    def omits_bounces(self) -> bool:
        """Whether bounces that accumulate were omitted, from a speed on that is round-off."""
        return any(s.impulse.regime is Regime.BOUNCES_DIE_AWAY for s in self.strikes)

    @cached_property
    def impacts(self) -> tuple[Impact, ...]:
        """The impacts with their energies, in the order of time."""
        chain = self.scene.moving_chain.convert(PRECISIONS[self.precision].number)
        return impact_log(chain, self.strikes, self.precision)

    @property
    def log(self) -> tuple[Impact, ...]:
        """The impacts, in the order of time."""
        return self.impacts

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on choices that the laws of contact, or the error of the run, leave open."""
        if not self.undecided:
            return self.remarks
        names = self.arcs[0].mode.names
        return (*sentences(remarks_of(self.undecided, names)), *self.remarks)

    def decided(self, times: Any, errors: Any) -> HybridRun:
        """Return the run without notes on events that its judge has decided.

        `errors` (rad, rad/s) are those of the run up to each time (s): they are known where another
        choice would change the motion by an unknown amount.
        """
        known = times[: len(errors)][np.isfinite(errors)]
        until = float(known[-1]) if len(known) else 0.0
        left = tuple(d for d in self.undecided if d.change < math.inf or d.time > until)
        return self if left == self.undecided else replace(self, undecided=left)

    def step_times(self) -> Any:
        """Return the times (s) between which its steps are, in float64 or long double."""
        return PRECISIONS[self.precision].mixable(self.polynomials.starts)

    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the very polynomials of this run's steps."""

        def at(times: Any, side: Literal["left", "right"] = "right") -> tuple[Any, Any]:
            q, u = self.polynomials.at(times, side)
            if side == "left":
                # A run may begin with an impact.
                at_start = np.atleast_1d(times) <= 0
                q[:, at_start], u[:, at_start] = ([[x] for x in pair] for pair in self.start)
            return q, u

        return at

    def until(self, times: Any, end: float) -> HybridRun:
        """Return the run up to an earlier end (s) > 0, before a jump there.

        `times` (s) are those of its samples.
        """
        polynomials = self.polynomials.until(end)
        q, u = polynomials.at(times[times <= end])
        arcs = tuple(arc for arc in self.arcs if arc.start.t < end)
        return replace(
            self,
            q=q,
            u=u,
            arcs=arcs,
            polynomials=polynomials,
            since=self.since[: len(arcs)],
            strikes=tuple(strike for strike in self.strikes if strike.time < end),
            doubts=tuple(doubt for doubt in self.doubts if doubt.time < end),
            undecided=tuple(doubt for doubt in self.undecided if doubt.time < end),
            reached=end,
        )


def hybrid_run(
    scene: Scene,
    times: Any,
    *,
    formulation: EquationsName = "lagrange",
    precision: PrecisionName = "double",
    order: int | None = None,
    longest_step: float | None = None,
    progress: Callable[[float], None] | None = None,
    partial: bool = False,
    effort: Effort | None = None,
    limits: Limits = DEFAULT_LIMITS,
    judges: bool = False,
    compiled: Compilation = compiled_kind,
) -> HybridRun:
    """Return the hybrid motion of a scene at increasing times (s), the first of them 0.

    `progress` receives the completed share. Raises `IntegrationError` if the motion cannot be
    integrated to the last time, unless a `partial` run is accepted, or if that takes more than an
    `effort`, by default that of the `limits`, and `TooMuchError` where its steps would take more
    memory than these allow.
    A run that `judges` another one starts from the pose as it is given, and has doubts that the
    error of that run decides. `compiled` returns the integrators of the modes.
    """
    # Modes are formulated in speeds, not in momenta.
    own = EQUATIONS[formulation].in_speeds
    cap = longest_step or default_longest_step(scene)
    most = effort or (ANY_EFFORT if limits.are_lifted else DEFAULT_EFFORT)
    begun, end = perf_counter(), min(float(times[-1]), most.until)
    history = History(scene, own, precision, order, cap, end, most, limits, judges, compiled)
    failure = ""
    try:
        history.follow(progress or (lambda share: None))
    except IntegrationError as error:
        if not partial or not history.arcs:
            raise
        failure = str(error)
    return _run_of(history, np.asarray(times, dtype=float), failure, begun)


def _run_of(history: History, asked: Any, failure: str, begun: float) -> HybridRun:
    """Return the run that a history has followed, at the times (s) that it has reached.

    `begun` is the time of `perf_counter` (s) at its start.
    """
    precision = history.system.precision
    reached = float(history.state.t if failure else history.end)
    polynomials = polynomials_of(history.arcs, history.state, precision)
    q, u = polynomials.at(asked[asked <= reached])
    return HybridRun(
        scene=history.scene,
        formulation=history.formulation,
        precision=precision,
        longest_step=history.system.longest_step,
        q=q,
        u=u,
        steps=len(polynomials.starts) - 1,
        order=polynomials.coefficients.shape[2] - 1,
        operations=max((arc.compiled.operations for arc in history.arcs), default=0),
        compile_seconds=history.compile_seconds,
        run_seconds=perf_counter() - begun - history.compile_seconds,
        arcs=tuple(history.arcs),
        polynomials=polynomials,
        start=history.start,
        since=tuple(history.since),
        strikes=tuple(history.strikes),
        remarks=sentences(history.notes),
        doubts=tuple(history.doubts),
        reached=reached,
        failure=failure,
        exhausted=history.exhausted,
        work=history.work,
        unseen=history.unseen,
        undecided=tuple(history.undecided),
    )
