"""The scenes of an ensemble: one scene file, and the numbers in it that are replaced.

A run is the scene that the file describes with its values in place of those of the axes. It is
built by the reader of scene files, table by table, so that a value is refused as it would be in a
file; tables in which nothing is replaced, or the same again, are read once.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import Effect, with_rotors
from twolink.ensembles.parameters import SYMBOLS
from twolink.errors import ParameterError
from twolink.scene import Scene
from twolink.scene.chain_table import DescribedChain
from twolink.scene.reading import chain_of, effects_of, start_of
from twolink.text import choice, quoted

Array = NDArray[np.float64]
Keys = tuple[str, ...]
Numbers = Sequence[float] | Array

_TABLES = ("chain", "start", "effects")

# Number of cached parts of scenes: the values of a grid's axis recur.
_KEPT = 4096


class Parts(NamedTuple):
    """The parts of a run's scene: the chain with rotors, the effects, and the start."""

    chain: Chain
    effects: tuple[Effect, ...]
    q: Pair
    u: Pair


@dataclass(frozen=True)
class Family:
    """The checked tables of a scene, its folder, and the keys of the numbers that are replaced.

    `named` begins messages about keys, with their place.
    """

    tables: dict[str, Any]
    folder: Path
    keys: tuple[Keys, ...]
    named: str = "axes.{}.parameter"
    _readers: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Require keys that lead to numbers, each once."""
        object.__setattr__(self, "tables", _with_speeds(self.tables))
        for number, keys in enumerate(self.keys):
            where = self.named.format(number)
            _number_at(self.tables, keys, where)
            if keys in self.keys[:number]:
                name = quoted(".".join(keys))
                raise ParameterError(f"{where} must be of no other axis; got {name}")
        object.__setattr__(self, "_readers", _Readers(self))

    def __reduce__(self) -> tuple[Any, ...]:
        return Family, (self.tables, self.folder, self.keys, self.named)

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers that the scene has itself."""
        return tuple(_number_at(self.tables, keys, "") for keys in self.keys)

    def changes(self, table: str) -> bool:
        """Return whether a number of a table, such as "chain", is replaced."""
        return any(keys[0] == table for keys in self.keys)

    @property
    def lengths(self) -> tuple[float, float]:
        """L1 and L2 (m) of the scene itself."""
        chain = self._readers.described.chain
        return float(chain.L1), float(chain.L2)

    @property
    def urdf(self) -> str:
        """The text of the URDF that describes the chain, empty without one."""
        read = self._readers.described.read if self.tables["chain"]["urdf"] else None
        return "" if read is None else str(read.xml)

    def scene(self, values: Numbers) -> Scene:
        """Return the scene of a run. Raises `TwolinkError` where a value is refused."""
        return Scene.from_checked(self.given(values), self.folder)

    def parts(self, values: Numbers) -> Parts:
        """Return the chain, the effects and the start of a run; the same as those of its scene."""
        found: Parts = self._readers.parts(tuple(map(float, values)))
        return found

    def starts(self, values: Array) -> tuple[Array, Array]:
        """Return q and u, shape (2, n), of runs whose values, shape (n, axes), change no joints."""
        start = self.tables["start"]
        for keys, column in zip(self.keys, values.T, strict=True):
            if keys[0] == "start":
                start = _replaced(start, keys[1:], column)
        q, u = start_of(start, self._readers.described.joints)
        shape = (2, len(values))
        return _rows(q, shape), _rows(u, shape)

    def given(self, values: Numbers, only: str = "") -> dict[str, Any]:
        """Return the tables of a run, in one of which alone numbers may be replaced."""
        found = dict(self.tables)
        for keys, value in zip(self.keys, values, strict=True):
            if keys[0] == only or not only:
                found[keys[0]] = _replaced(found[keys[0]], keys[1:], float(value))
        return found


class _Readers:
    """Readers of the chain, the effects and the start, which remember the last values."""

    def __init__(self, family: Family) -> None:
        self._family = family
        self._columns = {
            table: [k for k, keys in enumerate(family.keys) if keys[0] == table]
            for table in _TABLES
        }
        self._chain = functools.lru_cache(_KEPT)(self._read_chain)
        self._effects = functools.lru_cache(_KEPT)(self._read_effects)
        self._moving = functools.lru_cache(_KEPT)(self._read_moving)

    @property
    def described(self) -> DescribedChain:
        """The chain of the scene as it is in the file."""
        values = self._family.values
        return self._chain(tuple(values[k] for k in self._columns["chain"]))

    def parts(self, values: tuple[float, ...]) -> Parts:
        of_chain, of_effects = (
            tuple(values[k] for k in self._columns[table]) for table in ("chain", "effects")
        )
        chain, effects = self._moving(of_chain, of_effects)
        joints = self._chain(of_chain).joints
        start = self._family.given(values, "start")["start"]
        q, u = start_of(start, joints)
        return Parts(chain, effects, q, u)

    def _read_moving(
        self, of_chain: tuple[float, ...], of_effects: tuple[float, ...]
    ) -> tuple[Chain, tuple[Effect, ...]]:
        described = self._chain(of_chain)
        effects = described.effects(list(self._effects(of_effects)))
        return with_rotors(effects, described.chain), effects

    def _read_chain(self, numbers: tuple[float, ...]) -> DescribedChain:
        return chain_of(self._with("chain", numbers), self._family.folder)

    def _read_effects(self, numbers: tuple[float, ...]) -> tuple[Effect, ...]:
        return tuple(effects_of(self._with("effects", numbers)))

    def _with(self, table: str, numbers: tuple[float, ...]) -> dict[str, Any]:
        found: dict[str, Any] = self._family.tables[table]
        for column, number in zip(self._columns[table], numbers, strict=True):
            found = _replaced(found, self._family.keys[column][1:], number)
        return found


def _with_speeds(tables: dict[str, Any]) -> dict[str, Any]:
    """Return tables whose start has speeds: the default of 0, where none are given."""
    start = tables["start"]
    if start["u"] is None and start["omega"] is None:
        speeds = "u" if start["theta"] is None else "omega"
        return {**tables, "start": {**start, speeds: (0.0, 0.0)}}
    return tables


def _number_at(tables: dict[str, Any], keys: Keys, name: str) -> float:
    """Return the number to which keys lead, or raise `ParameterError`."""
    inside: Any = {table: tables[table] for table in _TABLES}
    for depth, key in enumerate(keys):
        known = _keys_of(inside)
        if key not in known:
            known += SYMBOLS if len(keys) == 1 else ()
            where = ".".join(keys[:depth]) or "the scene"
            if not known:
                break
            raise ParameterError(f"{name}: {choice(f'the key in {where}', key, known)}")
        inside = inside[key] if isinstance(inside, dict) else inside[int(key)]
    else:
        if isinstance(inside, float):
            return inside
    raise ParameterError(
        f"{name} must lead to one number of the chain, the start or an effect, such as"
        f" start.q.0; got {quoted('.'.join(keys))}"
    )


def _keys_of(value: Any) -> list[str]:
    """Return the keys of a table that has values, or the places of a list."""
    if isinstance(value, dict):
        return [key for key, entry in value.items() if entry is not None]
    return [str(k) for k in range(len(value))] if isinstance(value, (tuple, list)) else []


def _rows(pair: Any, shape: tuple[int, int]) -> Array:
    """Return a pair of numbers or arrays as an array of two rows."""
    found = np.empty(shape)
    found[0], found[1] = pair
    return found


def _replaced(value: Any, keys: Keys, number: Any) -> Any:
    """Return nested tables and lists with another number at keys; the rest is shared."""
    if not keys:
        return number
    if isinstance(value, dict):
        return {**value, keys[0]: _replaced(value[keys[0]], keys[1:], number)}
    place = int(keys[0])
    entries = list(value)
    entries[place] = _replaced(entries[place], keys[1:], number)
    return tuple(entries) if isinstance(value, tuple) else entries
