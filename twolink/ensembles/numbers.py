"""The numbers in a chain and its effects: taken out in a fixed order, and put back as others.

Numbers that differ between the runs of an ensemble become run-time parameters of one compiled
system, or arrays with an entry for each run. Their objects are made without their checks, which
those of every single run have passed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

Shape = tuple[Any, ...]


def numbers_in(thing: Any) -> tuple[list[float], Shape]:
    """Return the floats in nested tuples and data classes, and a key of all else in them.

    Two things of one key differ in their floats alone.
    """
    found: list[float] = []
    return found, _collect(thing, found)


def with_numbers(thing: Any, numbers: Iterator[Any]) -> Any:
    """Return a thing with other numbers, of any type, in the order of `numbers_in`."""
    if isinstance(thing, float):
        return next(numbers)
    if isinstance(thing, tuple):
        entries = [with_numbers(entry, numbers) for entry in thing]
        return type(thing)(*entries) if hasattr(thing, "_fields") else tuple(entries)
    if not is_dataclass(thing) or isinstance(thing, type):
        return thing
    made = object.__new__(type(thing))
    for field in fields(thing):
        value = getattr(thing, field.name)
        # Values derived from the old numbers, such as exact inertias, are dropped.
        kept = with_numbers(value, numbers) if not field.name.startswith("_") else None
        object.__setattr__(made, field.name, kept)
    return made


def _collect(thing: Any, found: list[float]) -> Shape:
    if isinstance(thing, float):
        found.append(thing)
        return (float,)
    if isinstance(thing, tuple):
        return (type(thing), *(_collect(entry, found) for entry in thing))
    if not is_dataclass(thing) or isinstance(thing, type):
        return (type(thing), thing)
    named = [field.name for field in fields(thing) if not field.name.startswith("_")]
    return (type(thing), *(_collect(getattr(thing, name), found) for name in named))
