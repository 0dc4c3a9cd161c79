"""From the tables of a scene file to a chain and its effects."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

from twolink.chain import Chain
from twolink.effects import Effect, effect_class
from twolink.errors import SceneError
from twolink.urdf import read_planar_urdf


def chain_of(table: dict[str, Any], folder: Path) -> tuple[Chain, tuple[Effect, ...]]:
    """Return the chain that a [chain] table describes, and the effects it asks of its URDF."""
    given = {key: value for key, value in table.items() if value is not None}
    asked = given.pop("effects", None)
    if "urdf" in given:
        if len(given) > 1:
            others = ", ".join(sorted(set(given) - {"urdf"}))
            raise SceneError(f"chain has both urdf and {others}; allowed is one of them")
        return _of_urdf(folder / given["urdf"], asked or ())
    if asked is not None:
        raise SceneError(
            f"chain.effects is {asked!r} and there is no chain.urdf; allowed are effects of a URDF"
        )
    return _chain_of_numbers(given), ()


def _of_urdf(file: Path, asked: tuple[str, ...]) -> tuple[Chain, tuple[Effect, ...]]:
    """Return the chain that a URDF file describes, and what is asked for of its joints."""
    read = read_planar_urdf(file)
    chain = Chain.from_links(read.links)
    if not asked:
        return chain, ()
    from twolink.effects import of_urdf

    return chain, of_urdf.effects_of(read, asked)


def _chain_of_numbers(given: dict[str, Any]) -> Chain:
    """Return the chain of the parameters that are given."""
    for key in ("mass", "length"):
        if key not in given:
            raise SceneError(f"chain.{key} is missing; allowed is a pair of numbers, or urdf")
    if ("centre" in given) != ("inertia" in given):
        raise SceneError("chain has only one of centre and inertia; allowed are both, or neither")
    return Chain(**given) if "centre" in given else Chain.uniform_bars(**given)


def effects_of(tables: dict[str, Any]) -> list[Effect]:
    """Return the effects that are named, in the file's order or the one that it asks for."""
    order = tables.pop("order", None)
    found = []
    for name, value in tables.items():
        for table in value if isinstance(value, list) else [value]:
            if table is not None:
                found.append((name, effect_class(name)(**table)))
    return [effect for _, effect in (found if order is None else _ordered(found, order))]


def _ordered(found: list[tuple[str, Effect]], order: tuple[str, ...]) -> list[tuple[str, Effect]]:
    """Return named effects in an order of their names; those of one name stay as they are."""
    if Counter(order) != Counter(name for name, _ in found):
        raise SceneError(
            f"effects.order is {order!r}; allowed is each effect's name as often as it is given"
        )
    waiting = {name: iter([pair for pair in found if pair[0] == name]) for name in order}
    return [next(waiting[name]) for name in order]
