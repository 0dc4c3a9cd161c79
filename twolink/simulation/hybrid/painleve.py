"""Jammed slides (Painlevé), and the impact without collision that ends them.

With much friction the normal force on a sliding contact may accelerate the point into the surface.
Then neither sliding nor separation may be possible, although no contact is approached.
"""

from __future__ import annotations

from collections.abc import Sequence

from twolink.arithmetic import Pair
from twolink.contact.elements import Constraint
from twolink.errors import IntegrationError
from twolink.simulation.hybrid.collision import sliding_after
from twolink.simulation.hybrid.constraint import is_answered
from twolink.simulation.hybrid.impact import (
    Impacts,
    Strike,
    is_left_over,
    stopped,
)
from twolink.simulation.hybrid.no_motion import sentence_on
from twolink.simulation.hybrid.noise import known_at, vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState, put
from twolink.simulation.hybrid.system import HybridSystem


def jammed(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return the rigid contacts whose slide is jammed (Painlevé), the fastest slide first.

    There row · M⁻¹ (normal + friction) is negative, or zero within round-off: the contact force
    accelerates the point into the surface, or not at all. A contact whose force has no lever arm is
    wedged instead (`singular_pose`).
    """
    found: list[tuple[float, int]] = []
    for index in sorted(state.touching):
        element, direction = system.elements[index], state.sliding[index]
        if not element.rigid or element.tangent is None or not direction:
            continue
        assert element.normal is not None
        row, tangent = pose.row(element.normal), pose.row(element.tangent)
        if vanishes(system, row):
            continue
        speed = tangent[0] * state.u[0] + tangent[1] * state.u[1]
        s = -direction * element.limits(1)[0]
        force = row[0] + s * tangent[0], row[1] + s * tangent[1]
        answered = is_answered(pose.inertia[0], Constraint(row, 0, force), system.rounding)
        if not answered or pose.response(row, force) < 0:
            found.append((-abs(float(speed)), index))
    return [index for _, index in sorted(found)]


def strike_without_collision(
    system: HybridSystem, state: HybridState, pose: Pose
) -> tuple[HybridState, Strike]:
    """Return the state after the impact without collision of a jammed slide (Painlevé).

    Neither sliding nor separation is possible. Friction causes an impact, although the normal speed
    is zero, that lasts until the slide stops.
    """
    locked = jammed(system, state, pose)
    if not locked:
        raise IntegrationError(sentence_on(system, state, pose))
    index = locked[0]
    normal = system.elements[index].normal
    assert normal is not None
    impacts = Impacts(pose, system.elements, float(state.t), system.rounding)
    u = stopped(pose, [normal], state.u, system.rounding)
    strike = impacts.impact(index, u, without_collision=True)
    # By definition the normal speed before it is zero, which its row times u is within round-off.
    strike = strike._replace(speeds=(0 * u[0], strike.speeds[1]))
    touching = _touching_after(system, state, pose, strike.u[1])
    held = [system.elements[i].normal for i in sorted(touching) if system.elements[i].rigid]
    after = stopped(pose, held, strike.u[1], system.rounding)  # type: ignore[arg-type]
    sliding = sliding_after(system, pose, state.u, after, known_at(state.t, system.rounding))
    if strike.impulse.regime.ends_sticking:
        sliding = put(sliding, index, 0)
    state = state._replace(u=after, touching=touching, sliding=sliding)
    return state, strike


def _touching_after(
    system: HybridSystem, state: HybridState, pose: Pose, after: Pair
) -> frozenset[int]:
    """Return the contacts that still touch at the speeds `after` an impulse on one of them.

    The impulse may give others that touch a normal speed as well: they open, or are struck in turn.
    """
    found = set()
    for index in state.touching:
        element = system.elements[index]
        assert element.normal is not None
        row = pose.row(element.normal)
        if not element.rigid or is_left_over(row, after, state.u, system.rounding):
            found.add(index)
    return frozenset(found)
