"""Warnings on the numbers of a planar two-link URDF that are possible, and probably not meant."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twolink.text import quoted
from twolink.urdf.inertia import principal_moments, violates_triangle
from twolink.urdf.link_parameters import LinkParameters
from twolink.urdf.lumping import RigidBody
from twolink.urdf.planar import PlanarUrdf
from twolink.urdf.reading import Limits, Tree

# Links longer or shorter than these (m) are of millimetres or kilometres by mistake, or toys.
_LONG, _SHORT = 20.0, 0.005

# A link's radius of gyration about its mass centre, as a multiple of its size.
_WIDE_GYRATION = 1.5

# Up to this excess over a thin rod's inertia, it is that of a box or cylinder of like length.
_NEARLY_A_ROD = 0.25


def warnings_of(
    tree: Tree, bodies: tuple[RigidBody, RigidBody], read: PlanarUrdf
) -> tuple[str, ...]:
    """Return a sentence for each suspicious number of a URDF that is a planar two-link chain."""
    found: list[str] = []
    for index, body in enumerate(bodies):
        for name in body.frames:
            found += _of_inertia(tree, name)
        found += _of_parameters(body, read.links[index])
        found += _of_limits(body.joint.name, read.limits[index])
    return tuple(found)


def _of_inertia(tree: Tree, name: str) -> Iterator[str]:
    """Yield warnings on the inertia of one link of the file."""
    inertial = tree.links[name].inertial
    if inertial is None or inertial.mass == 0:
        return
    moments = principal_moments(inertial.inertia)
    shown = ", ".join(f"{moment:.6g}" for moment in moments)
    where = f"Link {quoted(name)}: the principal moments of inertia are {shown} kg m²"
    if min(moments) < 0:
        yield f"{where}; no rigid body has a negative one, and MuJoCo and Drake refuse it."
    elif violates_triangle(moments):
        yield (
            f"{where}; the largest exceeds the sum of the others, as for no rigid body, and MuJoCo"
            " and Drake refuse it."
        )
    if inertial.inertia == ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        yield f"Link {quoted(name)}: the inertia is the identity, 1 kg m², probably a placeholder."


def _of_parameters(body: RigidBody, link: LinkParameters) -> Iterator[str]:
    """Yield warnings on the parameters of a lumped link."""
    where = f"Link {quoted(body.joint.child)}"
    size = max(link.length, math.hypot(*link.centre))
    if size > _LONG:
        yield f"{where} is {size:.4g} m long; a URDF's lengths are in m, not mm."
    elif 0 < size < _SHORT:
        yield f"{where} is {size:.4g} m long; a URDF's lengths are in m."
    along, across = link.centre
    if link.length > 0 and not (0 <= along <= link.length and abs(across) <= link.length / 2):
        yield (
            f"{where}: the mass centre, {along:.6g} m along and {across:.6g} m across, is outside"
            f" of the link, which is {link.length:.6g} m long."
        )
    gyration = math.sqrt(link.inertia / link.mass)
    if size > 0 and gyration > _WIDE_GYRATION * size:
        yield (
            f"{where}: the radius of gyration, {gyration:.4g} m, exceeds the size of the link,"
            f" {size:.4g} m; an inertia is in kg m², not in g cm² or kg mm²."
        )
    yield from _of_rod(where, link)


def _of_rod(where: str, link: LinkParameters) -> Iterator[str]:
    """Yield a warning if the inertia is that of a box or cylinder, and nearly that of a rod."""
    rod = link.mass * link.length * link.length / 12
    middle = link.length > 0 and abs(link.centre[0] / link.length - 0.5) < 1e-6
    excess = link.inertia / rod - 1 if rod > 0 else math.inf
    if middle and 1e-9 < excess < _NEARLY_A_ROD:
        width = link.length * math.sqrt(excess)
        yield (
            f"{where}: the inertia is {100 * excess:.3g}% above m L²/12 of a thin rod; it is that"
            f" of a box {width:.4g} m wide."
        )


def _of_limits(joint: str, limits: Limits | None) -> Iterator[str]:
    """Yield warnings on the limits of a revolute joint."""
    if limits is None:
        return
    lower, upper = limits
    if lower == upper == 0:
        yield (
            f"Joint {quoted(joint)}: the limits are 0 to 0, which lock it in engines that enforce"
            " them; a joint that turns freely is continuous."
        )
    elif lower >= upper:
        yield f"Joint {quoted(joint)}: the limits {lower:g} to {upper:g} rad leave it no room."
    elif max(abs(lower), abs(upper)) > 6 * math.pi:
        yield f"Joint {quoted(joint)}: the limits {lower:g} to {upper:g} are in rad, not degrees."
