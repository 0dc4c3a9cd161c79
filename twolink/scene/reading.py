"""Reading of the tables of a scene file: chain, start and effects."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.coordinates import JointConvention
from twolink.effects import Effect, effect_class
from twolink.errors import SceneError
from twolink.scene.chain_table import DescribedChain


def chain_of(table: dict[str, Any], folder: Path) -> DescribedChain:
    """Return the chain of a [chain] table, with further properties of its URDF."""
    given = {key: value for key, value in table.items() if value is not None}
    asked = given.pop("effects", None)
    if "urdf" in given:
        if len(given) > 1:
            others = ", ".join(sorted(set(given) - {"urdf"}))
            raise SceneError(f"chain must have urdf or {others}, not both; got both")
        from twolink.urdf import read_planar_urdf

        read = read_planar_urdf(folder / given["urdf"])
        return DescribedChain(Chain.from_links(read.links), read.joints, asked or (), read)
    if asked is not None:
        raise SceneError(
            f"chain.effects must be given with chain.urdf; got {asked!r} and no chain.urdf"
        )
    sign, offset = given.pop("joint_sign", None), given.pop("joint_offset", None)
    if (sign is None) != (offset is None):
        raise SceneError(
            "chain must have both of joint_sign and joint_offset, or neither; got one of them"
        )
    joints = None if sign is None else JointConvention(sign, offset)
    return DescribedChain(_chain_of_numbers(given), joints)


def start_of(table: dict[str, Any], joints: JointConvention | None) -> tuple[Pair, Pair]:
    """Return q (rad) and u (rad/s) of a [start] table, which may give joint angles instead.

    Raises `SceneError` if it gives both or neither of q and theta, or both of u and omega, or joint
    angles of a chain whose joints are unknown.
    """
    given = {key: value for key, value in table.items() if value is not None}
    for absolute, of_joints in (("q", "theta"), ("u", "omega")):
        if absolute in given and of_joints in given:
            raise SceneError(f"start must have one of {absolute} and {of_joints}; got both")
        if of_joints in given and joints is None:
            raise SceneError(
                f"start.{of_joints} needs chain.urdf, or chain.joint_sign and chain.joint_offset;"
                f" got neither, so the start must be given by {absolute}"
            )
    if "q" not in given and "theta" not in given:
        raise SceneError(
            "key 'start.q' is missing; it must be the two starting angles in rad (or theta, the "
            "joint angles)"
        )
    joints = joints or JointConvention()
    q = joints.absolute_angles(given["theta"]) if "theta" in given else given["q"]
    u = joints.absolute_speeds(given["omega"]) if "omega" in given else given.get("u", (0.0, 0.0))
    return q, u


def _chain_of_numbers(given: dict[str, Any]) -> Chain:
    """Return the chain of the given parameters."""
    for key in ("mass", "length"):
        if key not in given:
            raise SceneError(f"chain.{key} is missing; it must be a pair of numbers, or urdf given")
    if ("centre" in given) != ("inertia" in given):
        raise SceneError("chain must have both of centre and inertia, or neither; got one of them")
    return Chain(**given) if "centre" in given else Chain.uniform_bars(**given)


def effects_of(tables: dict[str, Any]) -> list[Effect]:
    """Return the named effects, in the order of the file or the requested one."""
    order = tables.get("order")
    found = []
    for name, value in tables.items():
        if name == "order":
            continue
        for table in value if isinstance(value, list) else [value]:
            if table is not None:
                found.append((name, effect_class(name)(**table)))
    return [effect for _, effect in (found if order is None else _ordered(found, order))]


def _ordered(found: list[tuple[str, Effect]], order: tuple[str, ...]) -> list[tuple[str, Effect]]:
    """Return named effects in an order of their names; those of one name stay as they are."""
    if Counter(order) != Counter(name for name, _ in found):
        raise SceneError(
            f"effects.order must name each effect as often as it is given; got {order!r}"
        )
    waiting = {name: iter([pair for pair in found if pair[0] == name]) for name in order}
    return [next(waiting[name]) for name in order]
