"""Contacts in stretched and folded poses, where a point moves along one line only."""

from __future__ import annotations

from collections.abc import Sequence

from twolink.contact.elements import ContactElement
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.noise import size_of, vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem


def wedged(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return the rigid contacts that the chain drives along a line where no force has a lever arm.

    The point may be at rest while the links turn. Their rotation then accelerates it along the
    other line: if the surface or its friction prevents this, no finite force and no finite impulse
    stops the links.
    """
    return [
        index
        for index, element, normal_vanishes in _touching(system, state, pose)
        if normal_vanishes or (_is_singular(pose, element) and _is_carried_off(pose, element))
    ]


def pinned(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return the rough contacts that stay at rest while the links turn.

    Links of one length, folded, turn about a point at A. A force along the links has no lever arm
    in any of these poses, so that the force of sticking is not determined.
    """
    return [
        index
        for index, element, normal_vanishes in _touching(system, state, pose)
        if not normal_vanishes
        and _is_singular(pose, element)
        and not _is_carried_off(pose, element)
    ]


def _touching(
    system: HybridSystem, state: HybridState, pose: Pose
) -> list[tuple[int, ContactElement, bool]]:
    """Return the rigid contacts that do not slide, or whose normal row vanishes in this pose."""
    found = []
    for index in sorted(state.touching):
        element = system.elements[index]
        if not element.rigid:
            continue
        assert element.normal is not None
        normal_vanishes = vanishes(system, pose.row(element.normal))
        if normal_vanishes or not state.sliding[index]:
            found.append((index, element, normal_vanishes))
    return found


def _is_singular(pose: Pose, element: ContactElement) -> bool:
    """Return whether a rough contact moves along one line only."""
    if element.tangent is None:
        return False
    assert element.normal is not None
    return parallel(pose.row(element.normal), pose.row(element.tangent), pose.lever)


def _is_carried_off(pose: Pose, element: ContactElement) -> bool:
    """Return whether the rotation that leaves a point at rest accelerates it along another line."""
    assert element.normal is not None
    assert element.tangent is not None
    row, tangent = pose.row(element.normal), pose.row(element.tangent)
    # The longer row has the line with less round-off.
    longer = max((row, tangent), key=size_of)
    size = size_of(longer)
    u = longer[1] / size, -longer[0] / size
    gained = tuple(c.bias(pose.chain, pose.q, u) for c in (element.normal, element.tangent))
    place = max((0, 1), key=lambda link: abs(longer[link]))
    return not parallel((gained[0], gained[1]), (row[place], tangent[place]), pose.lever)
