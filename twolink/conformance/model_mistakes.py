"""Mistakes in the model: gravity, inertias, frames and joints that a reader gets wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from twolink.arithmetic import Pair
from twolink.conformance.mistakes import Mistake, of_models, with_bodies
from twolink.conformance.spatial import HOME, Body, Joint, SpatialModel, turned_tensor
from twolink.urdf.spatial import Matrix3, Pose, Vector3, cross, dot, norm, scale, subtract

Models = Iterator[SpatialModel]

_STANDARD, _FEET, _CENTIMETRES = 9.80665, 1 / 0.3048, 100.0

_LINKS = (1, 2), (1,), (2,)

# Relative difference below which a size of gravity is the standard one of these vectors.
_SAME = 1e-12


def _gravity_sign(model: SpatialModel) -> Models:
    yield replace(model, gravity=scale(-1.0, model.gravity))


def _no_gravity(model: SpatialModel) -> Models:
    yield replace(model, gravity=(0.0, 0.0, 0.0))


def _gravity_of_earth(model: SpatialModel) -> Models:
    """Yield gravity of 9.81 and 9.80665 m/s² where it is another."""
    size = norm(model.gravity)
    _, y = model.plane
    for wanted in (9.81, _STANDARD):
        if abs(size - wanted) > _SAME * wanted:
            # Where there is none, downwards is along y.
            direction = scale(1 / size, model.gravity) if size else y
            yield replace(model, gravity=scale(wanted, direction))


def _gravity_units(model: SpatialModel) -> Models:
    size = norm(model.gravity)
    for factor in (_CENTIMETRES, _FEET, 1000.0, 1 / size) if size else ():
        yield replace(model, gravity=scale(factor, model.gravity))


def _steiner(body: Body, factor: float) -> Body:
    """Return a body with m (c² 1 − c cᵀ) times a factor added to its inertia."""
    if not body.own or not body.mass:
        return body
    c = body.centre
    square = dot(c, c)
    moved = np.array(body.inertia, dtype=float) + factor * body.mass * (
        square * np.eye(3) - np.outer(c, c)
    )
    return _with_inertia(body, moved)


def _with_inertia(body: Body, tensor: Any) -> Body:
    """Return a body with an inertia along the axes of the moving link."""
    position = body.centre
    return replace(
        body, placement=HOME, inertial=Pose(position, HOME.rotation), tensor=_matrix(tensor)
    )


def _matrix(tensor: Any) -> Matrix3:
    first, second, third = ((float(x), float(y), float(z)) for x, y, z in np.asarray(tensor))
    return first, second, third


def _steiner_twice(model: SpatialModel) -> Models:
    yield from _of_links(model, lambda body: _steiner(body, 1.0))


def _no_steiner(model: SpatialModel) -> Models:
    yield from _of_links(model, lambda body: _steiner(body, -1.0))


def _of_links(model: SpatialModel, change: Callable[[Body], Body]) -> Models:
    """Yield models in which the bodies of both links are changed, and those of one of them."""
    for links in _LINKS:

        def changed(body: Body, links: tuple[int, ...] = links) -> Body:
            return change(body) if body.link in links else body

        yield with_bodies(model, changed)


def _no_inertia(model: SpatialModel) -> Models:
    yield with_bodies(model, lambda body: replace(body, tensor=_matrix(np.zeros((3, 3)))))


def _box_inertia(model: SpatialModel) -> Models:
    def changed(body: Body) -> Body:
        if body.box is None:
            return body
        x, y, z = (length * length for length in body.box)
        return replace(body, tensor=_matrix(np.diag([y + z, x + z, x + y]) * body.mass / 12))

    yield with_bodies(model, changed)


def _no_mass(model: SpatialModel) -> Models:
    """Yield models whose links weigh nothing, with and without their own inertia."""
    nothing = _matrix(np.zeros((3, 3)))
    for links in ((1,), (2,), (1, 2)):

        def changed(body: Body, links: tuple[int, ...] = links) -> Body:
            return replace(body, mass=0.0) if body.own and body.link in links else body

        def left_out(body: Body, links: tuple[int, ...] = links) -> Body:
            lost = body.own and body.link in links
            return replace(body, mass=0.0, tensor=nothing) if lost else body

        yield with_bodies(model, changed)
        yield with_bodies(model, left_out)


def _dropped(model: SpatialModel) -> Models:
    yield with_bodies(model, lambda body: body if body.own else None)


def _unplaced(model: SpatialModel) -> Models:
    def changed(body: Body) -> Body:
        position = body.placement.position
        moved = Pose(HOME.position, body.placement.rotation)
        return body if body.own or not any(position) else replace(body, placement=moved)

    yield with_bodies(model, changed)


def _lumps(model: SpatialModel) -> Iterator[tuple[int, list[Body], float, Vector3]]:
    """Yield each link of several bodies: its number, bodies, mass, and mass centre."""
    for link in (1, 2):
        bodies = [body for body in model.bodies if body.link == link and body.mass]
        mass = sum(body.mass for body in bodies)
        centre = sum(body.mass * np.array(body.centre, dtype=float) for body in bodies) / mass
        x, y, z = (float(entry) for entry in centre)
        yield link, bodies, mass, (x, y, z)


def _lumped(model: SpatialModel, steiner: Any) -> SpatialModel:
    """Return a model with a body for each link, with a wrong term of the parallel axes.

    `steiner` returns the point from which each body's distance is taken, given the link's bodies,
    or None for no term.
    """
    found = []
    for link, bodies, mass, centre in _lumps(model):
        total = np.zeros((3, 3))
        origin = steiner(bodies)
        for body in bodies:
            total += np.array(body.inertia, dtype=float)
            if len(bodies) == 1 or origin is None:
                continue
            away = np.array(subtract(body.centre, origin), dtype=float)
            total += body.mass * (away @ away * np.eye(3) - np.outer(away, away))
        found.append(Body(link, mass, Pose(centre, HOME.rotation), _matrix(total)))
    return replace(model, bodies=tuple(found))


def _lumped_without(model: SpatialModel) -> Models:
    if _has_fixed(model):
        yield _lumped(model, lambda bodies: None)


def _lumped_at_old_centre(model: SpatialModel) -> Models:
    if _has_fixed(model):
        yield _lumped(model, lambda bodies: bodies[0].centre)


def _has_fixed(model: SpatialModel) -> bool:
    return any(not body.own and body.mass for body in model.bodies)


def _fixed_rotation(model: SpatialModel, times: int) -> SpatialModel:
    def changed(body: Body) -> Body:
        if body.own:
            return body
        tensor = turned_tensor(body.inertial.rotation, body.tensor)
        for _ in range(times):
            tensor = turned_tensor(body.placement.rotation, tensor)
        return _with_inertia(body, tensor)

    return with_bodies(model, changed)


def _unturned(model: SpatialModel) -> Models:
    yield _fixed_rotation(model, 0)


def _turned_twice(model: SpatialModel) -> Models:
    yield _fixed_rotation(model, 2)


def _inertial_rpy(model: SpatialModel) -> Models:
    yield with_bodies(
        model,
        lambda body: replace(body, inertial=Pose(body.inertial.position, HOME.rotation)),
    )


def _products(model: SpatialModel) -> Models:
    for factor in (0.0, -1.0):
        kept = factor + (1 - factor) * np.eye(3)

        def changed(body: Body, kept: Any = kept) -> Body:
            return replace(body, tensor=_matrix(np.array(body.tensor, dtype=float) * kept))

        yield with_bodies(model, changed)


def _weighty_frames(model: SpatialModel) -> Models:
    unit = _matrix(np.eye(3))
    yield with_bodies(
        model,
        lambda body: body if body.declared else replace(body, mass=1.0, tensor=unit),
    )


def _axis_signs(model: SpatialModel) -> Models:
    for which in ((0,), (1,), (0, 1)):
        joints = list(model.joints)
        for index in which:
            joints[index] = replace(joints[index], axis=scale(-1.0, joints[index].axis))
        if any(_points_back(model.joints[index]) for index in which):
            yield replace(model, joints=(joints[0], joints[1]))


def _points_back(joint: Joint) -> bool:
    return sum(joint.axis) < 0


def _joint_rotation(model: SpatialModel) -> Models:
    for which in ((0,), (1,), (0, 1)):
        joints = list(model.joints)
        for index in which:
            placement = joints[index].placement
            joints[index] = replace(
                joints[index], placement=Pose(placement.position, HOME.rotation)
            )
        yield replace(model, joints=(joints[0], joints[1]))


def _base(model: SpatialModel) -> Models:
    first, second = model.joints
    unplaced = replace(first, placement=Pose(HOME.position, first.placement.rotation))
    yield replace(model, joints=(unplaced, second))


def _end_at_centre(model: SpatialModel) -> Models:
    for link, _, _, centre in _lumps(model):
        if link == 2:
            yield replace(model, tip=centre)


def _no_armature(model: SpatialModel) -> Models:
    yield replace(model, armature=(0.0, 0.0))


def _no_damping(model: SpatialModel) -> Models:
    yield replace(model, damping=(0.0, 0.0))


def _driving_damping(model: SpatialModel) -> Models:
    first, second = model.damping
    yield replace(model, damping=(-first, -second))


def _exchanged_damping(model: SpatialModel) -> Models:
    for damping in _with_the_other(model.damping):
        yield replace(model, damping=damping)


def _exchanged_friction(model: SpatialModel) -> Models:
    for friction in _with_the_other(model.friction):
        yield replace(model, friction=friction)


def _with_the_other(numbers: Pair) -> Iterator[Pair]:
    """Yield pairs in which one number, or each, is the other one."""
    first, second = numbers
    yield from ((second, first), (first, first), (second, second))


def _no_friction(model: SpatialModel) -> Models:
    yield replace(model, friction=(0.0, 0.0))


def _driving_friction(model: SpatialModel) -> Models:
    first, second = model.friction
    yield replace(model, friction=(-first, -second))


def _other_side(model: SpatialModel) -> Models:
    """Yield models whose mass centres are across from the line to the next joint, or to D."""
    ends = model.joints[1].placement.position, model.tip

    def changed(body: Body) -> Body:
        across = cross(model.joints[body.link - 1].axis, ends[body.link - 1])
        square = dot(across, across)
        if not square:
            return body
        away = scale(2 * dot(body.centre, across) / square, across)
        inertial = Pose(subtract(body.centre, away), HOME.rotation)
        return replace(body, placement=HOME, inertial=inertial, tensor=body.inertia)

    yield from _of_links(model, changed)


def _lengths(model: SpatialModel) -> Models:
    """Yield models in which a link, or each, has the length of the other one."""
    first, second = model.joints
    elbow = second.placement.position
    lengths = norm(elbow), norm(model.tip)
    if not all(lengths):
        return
    for one, other in _with_the_other(lengths):
        moved = Pose(scale(one / lengths[0], elbow), second.placement.rotation)
        tip = scale(other / lengths[1], model.tip)
        yield replace(model, joints=(first, replace(second, placement=moved)), tip=tip)


def _exchanged_links(model: SpatialModel) -> Models:
    yield with_bodies(model, lambda body: replace(body, link=3 - body.link))


_IN_SPACE = ("position", "velocity", "acceleration", "jacobian")

MODEL_MISTAKES: tuple[Mistake, ...] = (
    of_models("gravity-sign", "gravity acts in the opposite direction", _gravity_sign),
    of_models("gravity-missing", "gravity does not act", _no_gravity),
    of_models("gravity-default", "gravity is 9.81 or 9.80665, not the model's", _gravity_of_earth),
    of_models("gravity-units", "gravity is in other units than m/s²", _gravity_units),
    of_models(
        "armature-ignored", "the armature of the joints is missing in the inertia", _no_armature
    ),
    of_models("damping-dropped", "the damping of the joints does not act", _no_damping),
    of_models("damping-sign", "the damping of the joints drives them", _driving_damping),
    of_models("friction-dropped", "the dry friction of the joints does not act", _no_friction),
    of_models("friction-sign", "the dry friction of the joints drives them", _driving_friction),
    of_models(
        "links-exchanged", "the masses and inertias of the links are exchanged", _exchanged_links
    ),
    of_models("mass-dropped", "the mass of a link is left out", _no_mass),
    of_models("fixed-link-dropped", "a link that is fixed to another one is left out", _dropped),
    of_models(
        "fixed-link-unplaced", "the offset of a fixed joint is ignored in lumping", _unplaced
    ),
    of_models(
        "lumped-without-steiner",
        "inertias of fixed links are added without the parallel-axis term",
        _lumped_without,
    ),
    of_models(
        "lumped-at-old-centre",
        "fixed links are lumped about the link's old mass centre, not the new one",
        _lumped_at_old_centre,
    ),
    of_models(
        "fixed-rotation-ignored",
        "the inertia of a fixed link is not turned by its joint",
        _unturned,
    ),
    of_models("fixed-rotation-twice", "the inertia of a fixed link is turned twice", _turned_twice),
    of_models(
        "inertial-rpy-ignored", "the rotation of the inertial frame is ignored", _inertial_rpy
    ),
    of_models(
        "products-of-inertia", "products of inertia are ignored, or have the wrong sign", _products
    ),
    of_models("weighty-frames", "a link without an inertial weighs 1 kg", _weighty_frames),
    of_models("box-inertia", "inertia is that of the collision box, not the file's", _box_inertia),
    of_models("axis-sign", "the direction of a joint's axis is lost", _axis_signs),
    of_models(
        "joint-rotation-ignored", "the rotation of a joint's frame is ignored", _joint_rotation
    ),
    of_models("base-ignored", "the place of the first joint is ignored", _base, "position"),
    of_models(
        "inertia-about-joint",
        "inertia about the mass centre is moved to the joint twice",
        _steiner_twice,
    ),
    of_models(
        "inertia-not-moved",
        "inertia about the mass centre is used as that about the joint",
        _no_steiner,
    ),
    of_models("inertia-missing", "links are point masses: their inertia is missing", _no_inertia),
    of_models(
        "end-at-centre", "D is the mass centre of link 2, not its end", _end_at_centre, *_IN_SPACE
    ),
    of_models("damping-exchanged", "a joint has the damping of the other one", _exchanged_damping),
    of_models(
        "friction-exchanged", "a joint has the dry friction of the other one", _exchanged_friction
    ),
    of_models("length-of-other", "a link has the length of the other one", _lengths),
    of_models(
        "centre-on-other-side",
        "a mass centre is on the other side of the line between the joints",
        _other_side,
    ),
)
