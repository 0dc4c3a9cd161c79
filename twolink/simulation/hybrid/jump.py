"""Jumps: the state and the mode that follow an event.

Each kind of event has one reaction, in a table. A reaction changes the state and may restrict the
states of some elements. Then impacts are resolved, bounces that end within round-off are omitted
(Zeno), and the next mode is selected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from twolink.arithmetic import Pair
from twolink.contact.impact_laws import Regime
from twolink.contact.states import ContactState, EventKind
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.breakaway_order import remarks_on_order
from twolink.simulation.hybrid.collision import (
    Collision,
    collide,
    still_sliding,
    surfaces_after,
)
from twolink.simulation.hybrid.complementarity import NO_ORDERS, Orders, States
from twolink.simulation.hybrid.doubts_of_jump import (
    of_early_mode,
    of_slides_at_start,
    of_zeroed_speeds,
)
from twolink.simulation.hybrid.doubts_of_zeros import of_selection
from twolink.simulation.hybrid.dynamics import is_fixed
from twolink.simulation.hybrid.impact import Strike, largest, speed_along
from twolink.simulation.hybrid.mode import Doubt, Mode, Remark, Trigger
from twolink.simulation.hybrid.noise import Zero
from twolink.simulation.hybrid.painleve import jammed, strike_without_collision
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.reactions import REACTIONS
from twolink.simulation.hybrid.select import Selection, select
from twolink.simulation.hybrid.singular_pose import pinned
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import (
    LEFT_OVER,
    MOST_IMPACTS_OF_A_BURST,
    MOST_STOPPED,
)
from twolink.simulation.hybrid.zeno import NO_PAST, LeftOut, Past, accumulated, left_out

# Largest number of impacts without collision and Zeno limits at one instant before failure: a burst
# of impacts ends before.
_MOST_ROUNDS = 2 * MOST_IMPACTS_OF_A_BURST


class Jump(NamedTuple):
    """The state and mode after a jump, its impacts, and sentences on choices that the laws leave.

    `delay` (s) is the duration of omitted bounces. `orders` has the numbers of leading coefficients
    of event functions that are zero by the selection. It is `endless` if bounces without an end
    were omitted. The selection has `tried` so many modes.
    """

    state: HybridState
    mode: Mode
    strikes: tuple[Strike, ...] = ()
    notes: tuple[Remark, ...] = ()
    delay: float = 0.0
    orders: Orders = NO_ORDERS
    doubts: tuple[Doubt, ...] = ()
    endless: bool = False
    tried: int = 0


def jump(
    system: HybridSystem,
    state: HybridState,
    mode: Mode,
    trigger: Trigger | None,
    past: Past = NO_PAST,
) -> Jump:
    """Return the jump at an event, or at a discontinuity of the effects (None).

    `past` has the most recent impacts, for the Zeno limit. Raises `IntegrationError` if the laws
    admit no motion.
    """
    if trigger is None:
        return settle(system, state, {}, past)
    after, known, strikes = REACTIONS[trigger.kind](system, state, mode, trigger)
    found = settle(system, after, known, past, strikes)
    remarks = remarks_on_order(system, state, mode, trigger)
    doubts = () if strikes else of_zeroed_speeds(system, state, after, trigger)
    if not remarks and not doubts:
        return found
    return found._replace(notes=remarks + found.notes, doubts=doubts + found.doubts)


class _SoFar(NamedTuple):
    """The impacts of a jump so far, the last of them, and what is to be said of it."""

    strikes: tuple[Strike, ...] = ()
    struck: tuple[Strike, ...] = ()
    notes: tuple[Remark, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    delay: float = 0.0
    endless: bool = False

    def after(self, found: Collision) -> _SoFar:
        """Return the jump after impacts."""
        _, _, more, doubts, notes = found
        if not (more or doubts or notes):
            return self
        return _SoFar(
            self.strikes + more, self.struck + more, self.notes + notes, self.doubts + doubts,
            self.delay, self.endless,
        )  # fmt: skip

    def ended_by(self, last: LeftOut, struck: tuple[Strike, ...]) -> _SoFar:
        """Return the jump after the end of bounces or of a jammed slide; `struck` count on."""
        return _SoFar(
            (*self.strikes, *last.strikes), struck, self.notes + last.notes,
            self.doubts + last.doubts, max(self.delay, last.delay),
            self.endless or any(doubt.change == math.inf for doubt in last.doubts),
        )  # fmt: skip


_NOTHING = _SoFar()


def settle(
    system: HybridSystem,
    state: HybridState,
    known: Mapping[int, States],
    past: Past = NO_PAST,
    before: tuple[Strike, ...] = (),
) -> Jump:
    """Return the jump to the next mode of a state, after resolution of its impacts.

    `before` are impacts of the same jump that have changed the state already.
    """
    so_far = _NOTHING
    fastest = before[0].u[0] if before else state.u
    if before:
        state = surfaces_after(system, state, system.pose(state.q))
    for _ in range(_MOST_ROUNDS):
        collided = collide(system, state, system.pose(state.q))
        state, pose, so_far = collided.state, collided.pose, so_far.after(collided)
        selection = _selected(system, state, pose, {} if so_far.strikes else known)
        if selection is None:
            ended = _without_mode(system, state, pose, past, so_far.strikes, fastest)
            so_far = so_far.ended_by(ended, tuple(ended.strikes))
        else:
            mode = system.mode(selection.states, _dents(state))
            rest = None
            if so_far.struck:
                rest = left_out(system, state, pose, mode, so_far.struck, past, so_far.strikes)
            if rest is None:
                return _settled(system, state, pose, mode, selection, so_far, fastest, before)
            ended, so_far = rest, so_far.ended_by(rest, ())
        state = surfaces_after(system, ended.state, pose)
    raise IntegrationError(
        f"at {float(state.t):.9g} s the laws of impact and friction lead from one impact to the "
        f"next without end; the impacts are on: {_names(system, so_far.strikes)}"
    )


def _settled(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    mode: Mode,
    selection: Selection,
    so_far: _SoFar,
    fastest: Pair,
    before: tuple[Strike, ...],
) -> Jump:
    """Return the jump to the mode of a selection, which the laws admit at a state."""
    _check_held(system, state, pose, mode)
    notes = so_far.notes
    if selection.others or not selection.confirmed:
        notes += (_note(system, state, mode, selection),)
    tidied = _tidied(system, state, mode, selection.orders)
    doubts = so_far.doubts + of_early_mode(state, selection)
    if selection.orders:
        doubts += of_selection(system, state, selection)
    if so_far.strikes:
        doubts += of_slides_at_start(system, state, pose, fastest, selection)
    return Jump(
        tidied, mode, before + so_far.strikes, notes, so_far.delay, selection.orders, doubts,
        so_far.endless, selection.tried,
    )  # fmt: skip


def _check_held(system: HybridSystem, state: HybridState, pose: Pose, mode: Mode) -> None:
    """Raise `IntegrationError` if a mode holds an element that moves by more than round-off."""
    most = MOST_STOPPED / system.longest_step
    for coordinate in system.held(mode.states):
        speed = abs(float(speed_along(pose.row(coordinate), state.u)))
        if speed > most * coordinate.size(system.scene_chain):
            states = zip(system.elements, mode.states, strict=True)
            name = next(element.name for element, own in states if coordinate in element.holds(own))
            raise IntegrationError(
                f"at {float(state.t):.9g} s the motion cannot be followed: in the mode '{mode}' "
                f"{name} is held, but moves at {speed:.3g} m/s or rad/s"
            )


def _names(system: HybridSystem, strikes: Sequence[Strike]) -> str:
    """Return the names of the contacts of impacts, for a message."""
    return ", ".join(system.names[i] for i in sorted({strike.number for strike in strikes}))


def _selected(
    system: HybridSystem, state: HybridState, pose: Pose, known: Mapping[int, States]
) -> Selection | None:
    """Return the next mode; the states that are `known` of elements hold if they admit one.

    If no mode is confirmed, slides whose speed is still zero count as rest: a contact that is made
    along their line ends them as they begin.
    """
    selection = select(system, state, pose, known)
    if selection is None and known:
        selection = select(system, state, pose, {})
    if selection is not None and selection.confirmed:
        return selection
    sliding = still_sliding(system, state, pose)
    if sliding == state.sliding:
        return selection
    at_rest = select(system, state._replace(sliding=sliding), pose, {})
    return at_rest if at_rest is not None and at_rest.confirmed else selection or at_rest


def _without_mode(
    system: HybridSystem,
    state: HybridState,
    pose: Pose,
    past: Past,
    strikes: Sequence[Strike],
    fastest: Pair,
) -> LeftOut:
    """Return the state after the impacts that end a state from which the laws admit no motion.

    They are those of a jammed slide, or the last ones of a burst. Impacts without collision and
    other impacts may answer each other, ever more weakly: in the limit, from speeds on that are
    round-off of those before the jump, `fastest` (rad/s), all contacts rest.
    """
    if 0 < largest(state.u) <= LEFT_OVER * system.rounding * largest(fastest):
        rest = accumulated(system, state, pose, past, strikes)
        if rest is not None and not any(rest.state.u):
            return rest
    if not jammed(system, state, pose):
        at_rest = strikes and strikes[-1].impulse.regime is Regime.BOUNCES_DIE_AWAY
        rest = None if at_rest else accumulated(system, state, pose, past, strikes)
        if rest is not None:
            return rest
    after, strike = strike_without_collision(system, state, pose)
    return LeftOut(after, [strike], 0.0)


def _dents(state: HybridState) -> tuple[Any, ...]:
    if not any(state.compliant):
        return ()
    dents = tuple(own.plastic if own is not None else None for own in state.compliant)
    return dents if any(dents) else ()


def _note(system: HybridSystem, state: HybridState, mode: Mode, selection: Selection) -> Remark:
    """Return a remark: the laws admit several motions, or round-off leaves the choice open."""
    now = float(state.t)
    if not selection.confirmed:
        fixed = pinned(system, state, system.pose(state.q))
        undecided = "rounding does not let the laws of contact decide"
        if fixed:
            undecided = (
                f"the laws of contact do not determine the force of {system.names[fixed[0]]}"
            )
        return Remark(undecided, now, f"At {now:.9g} s {undecided}: {mode} is taken.")
    others = "; or ".join(
        dict.fromkeys(str(replace(mode, states=states)) for states in selection.others)
    )
    choice = "the laws of contact leave a choice"
    return Remark(choice, now, f"At {now:.9g} s {choice}: {mode} is taken; or {others}.")


def _tidied(system: HybridSystem, state: HybridState, mode: Mode, orders: Orders) -> HybridState:
    """Return the state in which contacts that open in a mode are no longer touching.

    A touching contact that carries no force, and does not open by any derivative, stays touching.
    """
    if not state.touching:
        return state
    held = system.held(mode.states)
    leaving = set()
    for index in state.touching:
        normal = system.elements[index].normal
        if mode.states[index] is not ContactState.OPEN or normal is None:
            continue
        if isinstance(orders.get(Trigger(EventKind.HITS, index)), Zero):
            continue
        if not is_fixed(normal, held, system.scene_chain):
            leaving.add(index)
    return state._replace(touching=state.touching - leaving) if leaving else state
