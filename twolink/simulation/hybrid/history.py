"""The hybrid simulation loop: flow and jump in turn, in any precision."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from twolink.effects import contact_elements, discontinuities, is_built_in, pieces_at
from twolink.errors import IntegrationError
from twolink.formulations import FORMULATIONS
from twolink.integration.precisions import PRECISIONS, PrecisionName
from twolink.limits import LIFTED, Limits
from twolink.names import FormulationName
from twolink.scene import Scene
from twolink.simulation.hybrid import tolerances
from twolink.simulation.hybrid.arc import Arc
from twolink.simulation.hybrid.compile import Compilation, Compiler, compiled_kind, safe_order
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.doubts import undecided_at
from twolink.simulation.hybrid.doubts_of_jump import of_flat_event
from twolink.simulation.hybrid.doubts_of_start import doubts_of_start
from twolink.simulation.hybrid.doubts_of_zeros import leaving_later, of_arc
from twolink.simulation.hybrid.edge_of_dent import doubts_with_rise
from twolink.simulation.hybrid.effort import Effort, Work
from twolink.simulation.hybrid.event_order import doubts_on_order
from twolink.simulation.hybrid.flow import flow
from twolink.simulation.hybrid.impact import Strike
from twolink.simulation.hybrid.jump import Jump, jump, settle
from twolink.simulation.hybrid.mode import Doubt, Remark
from twolink.simulation.hybrid.no_motion import sentence_on_endless
from twolink.simulation.hybrid.recovery import next_recovery, recovered
from twolink.simulation.hybrid.replayed_order import Switch
from twolink.simulation.hybrid.start import start_state, through_start
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.unseen import Unseen, passed_change
from twolink.simulation.hybrid.zeno import Past

# Number of last impacts that suffices to detect too many within the Zeno time.
_RECENT = 200

# Number of steps after which the end of an arc is reported, as a report takes as long as a step.
_UNREPORTED = 64


class History:
    """A run in progress: the state, the arcs so far, and the logs."""

    def __init__(
        self,
        scene: Scene,
        formulation: FormulationName,
        precision: PrecisionName,
        order: int | None,
        cap: float,
        end: float,
        effort: Effort,
        limits: Limits,
        judges: bool = False,
        compiled: Compilation = compiled_kind,
    ) -> None:
        """Initialize at the start of a scene, to be integrated to an end (s)."""
        number = PRECISIONS[precision].number
        self.scene, self.formulation, self.end = scene, formulation, number(end)
        self.system = _system_of(scene, formulation, precision, order, cap)
        self.system.check()
        if judges:
            self.system = through_start(self.system, scene)
        self._judges = judges
        self._breaks = [number(t) for t in discontinuities(scene.effects) if 0 < t < end]
        self._coming: Switch | None = None
        self._compiler = Compiler(formulation, compiled)
        self.arcs: list[Arc] = []
        self.since: list[float] = []
        self.strikes: list[Strike] = []
        self.notes: list[Remark] = []
        self._bounces: dict[int, int] = {}
        self._tired: frozenset[int] = frozenset()
        self._last: dict[int, float] = {}
        self._last_arcs: dict[CompiledMode, Arc] = {}
        self._patience = effort.patience
        self._work = Work(effort, limits, precision, cap, scene.duration)
        self.compile_seconds = 0.0
        self.exhausted = False
        # Loads of effects that are not built in may change unseen.
        self._watches = not all(is_built_in(effect) for effect in scene.effects)
        self.unseen: Unseen | None = None
        self.state: HybridState = start_state(self.system, scene)
        self.start = self.state.q, self.state.u
        self.doubts: list[Doubt] = doubts_of_start(self.system, scene, self.state)
        self.undecided: list[Doubt] = []

    @property
    def work(self) -> float:
        """The work so far, in steps."""
        return self._work.in_steps

    def follow(self, progress: Callable[[float], None]) -> None:
        """Integrate the motion to its end: flow and jump in turn."""
        at_once = reported = 0

        def reached(t: float, size: int) -> None:
            self._work.check_memory(t / float(self.end), size)
            progress(t / self.scene.duration)

        following, share = settle(self.system, self.state, {}), 0.0
        self._keep(following)
        while self.state.t < self.end:
            until = self._breaks[0] if self._breaks else self.end
            if any(self.state.compliant):
                until = min(until, next_recovery(self.system, self.state, self.end))
            arc = flow(
                self.system, self.state, following.mode, until, self._compiler,
                reached, self._last_arcs, following.orders,
                self._work.is_worth_optimising(following.mode.states, share),
            )  # fmt: skip
            advanced = arc.end.t > self.state.t
            self.state, share = arc.end, float(arc.end.t) / float(self.end)
            undecided = self._add(arc, following)
            at_once = 0 if advanced else at_once + 1
            if at_once > tolerances.MOST_JUMPS_AT_ONCE:
                modes = f"{arc.mode}, then {_event_of(arc)}"
                raise IntegrationError(sentence_on_endless(self.system, arc.end, modes))
            self._work.add(arc, following.tried, self.system.expanded.take())
            if self._work.steps - reported >= _UNREPORTED or arc.end.t >= self.end:
                reported = self._work.steps
                reached(float(arc.end.t), 0)
            self._check_effort(arc, share)
            if self.state.t < self.end and (doubts := self._doubts_at_end(arc, undecided)):
                self._doubt(doubts)
            following = self._jump(arc, until)
            self._keep(following)

    def _add(self, arc: Arc, following: Jump) -> Sequence[Doubt]:
        """Add the arc that follows a jump, and its doubts.

        Those are returned that last until its end.
        """
        self.arcs.append(arc)
        self._last_arcs[arc.compiled] = arc
        self.compile_seconds += arc.compile_seconds
        self.since.append(float(arc.start.t) + following.delay)
        if self._watches and self.unseen is None:
            self.unseen = passed_change(self.system, arc)
        self._go_on(arc, following)
        self.doubts += of_arc(self.system, arc, following.orders)
        if not arc.doubts:
            return ()
        doubts = doubts_with_rise(self.system, arc)
        before, undecided = undecided_at(doubts, float(arc.end.t))
        self._doubt(before)
        return undecided

    def _go_on(self, arc: Arc, following: Jump) -> None:
        """Let the motion by accelerations that were left out go on along an arc."""
        if not any(doubt.rate for doubt in self.doubts):
            return
        later = leaving_later(self.system, arc, following.orders)
        if later is not None:
            self.doubts = [doubt.since(float(arc.start.t), later) for doubt in self.doubts]

    def _doubt(self, doubts: Sequence[Doubt]) -> None:
        """Keep doubts on events."""
        self.doubts += doubts
        self.undecided += doubts

    def _doubts_at_end(self, arc: Arc, undecided: Sequence[Doubt]) -> Sequence[Doubt]:
        """Return what is left open by events at the end of an arc, until which doubts last."""
        if arc.event is None and not self._at_break():
            return undecided
        return doubts_on_order(self.system, arc, self._switch(), undecided, judges=self._judges)

    def _switch(self) -> Switch | None:
        """Return the next discontinuity of the effects, if there is one."""
        if self._coming is None and self._breaks:
            effects = pieces_at(self.scene.effects, float(self._breaks[0]))
            self._coming = Switch(self._breaks[0], self.system.with_effects(effects))
        return self._coming

    def _check_effort(self, arc: Arc, share: float) -> None:
        """Raise `IntegrationError` if a run has taken more than its effort by the end of an arc.

        `share` is the part of the time that has passed.
        """
        if arc.end.t >= self.end:
            return
        if self._work.is_too_much(share):
            why = f" within the limit of work{LIFTED}"
        elif coming := self._modes_of_an_endless_run():
            many = f"about {coming:.2g} more modes" if coming < math.inf else "endlessly many modes"
            why = f", as {many} would follow at this pace"
        else:
            return
        self.exhausted = True
        modes = f"{len(self.arcs)} modes" if len(self.arcs) > 1 else "1 mode"
        raise IntegrationError(
            f"the motion has {modes} by {float(arc.end.t):.6g} s, and is not followed further"
            f"{why}: {arc.mode}, then {_event_of(arc)}"
        )

    def _modes_of_an_endless_run(self) -> float:
        """Return how many modes would follow where the run would not end, and otherwise 0.

        There modes change ever more often, without impacts.
        """
        count = tolerances.MANY_JUMPS
        if len(self.arcs) % count:
            return 0.0
        since = float(self.arcs[-count].start.t)
        now = float(self.state.t)
        struck = bool(self.strikes) and self.strikes[-1].time >= since
        left, passed = float(self.end) - now, now - since
        if struck or left <= count * passed:
            return 0.0
        return count * left / passed if passed else math.inf

    def _jump(self, arc: Arc, until: Any) -> Jump:
        """Return the jump at the end of an arc."""
        state = arc.end
        if arc.event is not None:
            recent = self._strikes_since(float(state.t) - self.system.scales.zeno_time)
            past = Past(recent, self._last, self._tired, float(self.end - state.t))
            found = jump(self.system, state, arc.mode, arc.event, past)
            if not arc.spread:
                return found
            doubt = of_flat_event(self.system, arc, found.state, found.mode)
            return found._replace(doubts=(*found.doubts, doubt))
        switch = self._switch()
        if switch is not None and self._at_break():
            self._breaks.pop(0)
            self._coming, self.system = None, switch.system
            return jump(self.system, state, arc.mode, None)
        return Jump(state, arc.mode)

    def _at_break(self) -> bool:
        """Return whether the effects have a discontinuity now."""
        return bool(self._breaks) and bool(self.state.t >= self._breaks[0])

    def _strikes_since(self, begins: float) -> list[Strike]:
        """Return the last impacts from a time on (s), in their order."""
        strikes, first = self.strikes, len(self.strikes)
        least = max(0, first - _RECENT)
        while first > least and strikes[first - 1].time >= begins:
            first -= 1
        return strikes[first:]

    def _keep(self, following: Jump) -> None:
        self.state = recovered(self.system, following.state)
        self.strikes += following.strikes
        for strike in following.strikes:
            number = strike.number
            count = self._bounces[number] = self._bounces.get(number, 0) + 1
            if count >= self._patience:
                self._tired |= {number}
            self._last[number] = strike.time
        self.doubts += following.doubts
        self.exhausted = self.exhausted or following.endless
        self.notes += following.notes


def _system_of(
    scene: Scene,
    formulation: FormulationName,
    precision: PrecisionName,
    order: int | None,
    cap: float,
) -> HybridSystem:
    """Return the system of a scene at its start, with a longest step `cap` (s)."""
    number, rounding = PRECISIONS[precision].number, PRECISIONS[precision].rounding
    chain, effects = scene.moving_chain, pieces_at(scene.effects, 0.0)
    own = chain.convert(number)
    elements = contact_elements(effects, own)
    return HybridSystem(
        chain, own, FORMULATIONS[formulation].equations, effects, elements, precision,
        safe_order(elements, order), number, rounding, cap,
    )  # fmt: skip


def _event_of(arc: Arc) -> str:
    """Return the description of the event that ended an arc."""
    if arc.event is None:
        return "nothing"
    return f"{arc.event.kind.value} ({arc.mode.names[arc.event.index]})"
