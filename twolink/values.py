"""Values: immutable objects that are equal if their contents are equal."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from decimal import Decimal
from enum import Enum
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

_PLAIN = (bool, int, str, bytes, type(None))
_BY_TEXT = (float, complex, Fraction, Decimal)


class NotAValueError(Exception):
    """An object is mutable, or its content is unknown."""


def content(value: Any) -> Any:
    """Return a hashable key that two values share only if they are indistinguishable.

    Values are numbers, strings, enumerations, tuples, frozen sets and frozen data classes of
    values. Keys differ between kinds of number, and between 0.0 and -0.0. Raises `NotAValueError`
    for anything else, such as an object whose attributes can be set.
    """
    kind = type(value)
    if kind in _PLAIN:
        return kind, value
    if kind in _BY_TEXT or isinstance(value, np.generic):
        return kind, repr(value)
    if isinstance(value, Enum):
        return kind, value.name
    if isinstance(value, tuple):
        return (kind, *map(content, value))
    if kind is frozenset:
        return kind, frozenset(map(content, value))
    if _is_frozen(value):
        return value._content if isinstance(value, Kept) else _content_of_fields(value)
    raise NotAValueError(f"{kind.__name__} is no value")


def _content_of_fields(value: Any) -> Any:
    """Return the key of a frozen data class."""
    # Fields that are not arguments of the class follow from the arguments.
    return (type(value), *(content(getattr(value, f.name)) for f in fields(value) if f.init))


class Kept:
    """A frozen data class of values whose key is computed once."""

    @cached_property
    def _content(self) -> Any:
        return _content_of_fields(self)


def is_value(value: Any) -> bool:
    """Return whether an object is a value."""
    try:
        content(value)
    except NotAValueError:
        return False
    return True


def _is_frozen(value: Any) -> bool:
    """Return whether an object is of a frozen data class that sets its fields from arguments.

    An object of a class that is only derived from one may have other attributes, and is none then.
    """
    if not is_dataclass(value) or isinstance(value, type):
        return False
    parameters: Any = value.__dataclass_params__  # type: ignore[attr-defined]
    if not (parameters.frozen and parameters.init):
        return False
    is_own = "__dataclass_params__" in type(value).__dict__
    return is_own or vars(value).keys() <= {f.name for f in fields(value)}


class Own:
    """Keys of objects that are no values: one for each object, as long as this is used."""

    def __init__(self) -> None:
        """Begin without keys."""
        self._known: dict[int, tuple[Any, object]] = {}

    def key(self, thing: Any) -> object:
        """Return the key of an object; the object is kept, so that its `id` stays unique."""
        return self._known.setdefault(id(thing), (thing, object()))[1]


class Content:
    """A key of a cache that stands for objects, by their content.

    An object that is no value has a key of its own for each `Own`: results computed from it are
    found within one run, and not by a later one, before which it may have changed.
    """

    __slots__ = ("_hash", "_key", "objects")

    def __init__(self, objects: tuple[Any, ...], own: Own | None = None) -> None:
        """Take the content that objects have now."""
        own = own or Own()
        self.objects = objects
        self._key = tuple(_content_or_own(thing, own) for thing in objects)
        self._hash = hash(self._key)

    @property
    def is_value(self) -> bool:
        """Whether all objects are values: equal ones have an equal key, whatever `own` is."""
        return not any(type(key) is object for key in self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Content) and self._key == other._key

    def __hash__(self) -> int:
        return self._hash


def _content_or_own(thing: Any, own: Own) -> Any:
    try:
        return content(thing)
    except NotAValueError:
        return own.key(thing)
