"""Contacts in poses in which no finite force enforces them.

In stretched and folded poses a point moves along one line only, and two contacts may close as the
chain moves along both.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from twolink.contact.coordinates import ConstraintCoordinate, PointCoordinate
from twolink.contact.elements import ContactElement
from twolink.simulation.hybrid.constraint import parallel
from twolink.simulation.hybrid.noise import size_of, vanishes
from twolink.simulation.hybrid.pose import Pose
from twolink.simulation.hybrid.state import HybridState
from twolink.simulation.hybrid.system import HybridSystem
from twolink.simulation.hybrid.tolerances import UNDECIDED

# The speed of joint B is u2 - u1.
_ROW_OF_B = -1.0, 1.0


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


def turned_about(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return the elements that act on a point of link 2 that coincides with A.

    Every force on it acts like a torque in joint B, so that the laws do not determine how these
    share a load.
    """
    return [
        index
        for index, element in enumerate(system.elements)
        if (element.normal is None or index in state.touching)
        and _is_at_base(pose, element.principal)
    ]


def _is_at_base(pose: Pose, coordinate: ConstraintCoordinate) -> bool:
    """Return whether a point moves with joint B alone, whatever the direction."""
    if not isinstance(coordinate, PointCoordinate) or coordinate.of(pose.chain).link != 2:
        return False
    ways = (PointCoordinate(coordinate.point, way) for way in ((1.0, 0.0), (0.0, 1.0)))
    return all(parallel(pose.row(way), _ROW_OF_B, pose.lever) for way in ways)


def wedged_between(system: HybridSystem, state: HybridState, pose: Pose) -> Sequence[int]:
    """Return two rigid contacts that no forces can both satisfy, or none.

    Their gaps change in opposite proportions in this pose. The sum of the gaps in these proportions
    does not depend on the accelerations of the links, and the motion along both contacts bends it
    below zero.
    """
    elements = system.elements
    solid = [i for i in sorted(state.touching) if elements[i].rigid]
    for pair in itertools.combinations(solid, 2):
        normals = [elements[index].normal for index in pair]
        first, second = (pose.row(normal) for normal in normals)  # type: ignore[arg-type]
        if vanishes(system, first) or vanishes(system, second):
            continue
        opposite = first[0] * second[0] + first[1] * second[1] < 0
        if not opposite or not parallel(first, second, pose.lever):
            continue
        bends = [
            float(normal.bias(pose.chain, pose.q, state.u)) / size_of(row)  # type: ignore[union-attr]
            for normal, row in zip(normals, (first, second), strict=True)
        ]
        if sum(bends) < -UNDECIDED * system.rounding * sum(map(abs, bends)):
            return pair
    return ()


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
