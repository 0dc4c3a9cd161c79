"""The page of all keys of scene files, from the JSON schema and the effects."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from extensions.files import write_if_new
from twolink.effects import EFFECTS, effect_class
from twolink.scene import scene_model

_HEAD = """# Scene keys

This page is generated from the model that reads scene files. `twolink scenes --schema` prints the
same as a JSON schema ([scene.schema.json](scene.schema.json)), with which editors complete and
check keys. Numbers are in SI units and radians. A key that is not listed is refused.

## Top level

| key | type | meaning |
|---|---|---|
| `title` | text | the name of the scene |
| `shows` | text | one line on the purpose of the scene |
| `[chain]` | table | the parameters |
| `[start]` | table | the initial state |
| `[run]` | table | duration, accuracy and method |
| `[effects.NAME]` | table, or several `[[effects.NAME]]` | the effects that act |
| `effects.order` | list of names | all effects by name in the order in which they act |
"""

_TABLES = {"chain": "Chain", "start": "Start", "run": "Run"}


def scene_keys_page(folder: Path) -> str:
    """Return the page, and write the JSON schema into `folder`."""
    schema = scene_model().model_json_schema()
    write_if_new(folder / "scene.schema.json", json.dumps(schema, indent=2))
    definitions: Mapping[str, Any] = schema["$defs"]
    parts = [_HEAD]
    for name, definition in _TABLES.items():
        keys = _table("key", "type", "default", "meaning", rows=_keys(definitions[definition]))
        parts.append(f"\n## `[{name}]`\n\n{keys}")
    parts += ["\n## Effects\n", *map(_effect, EFFECTS)]
    return "".join(parts)


def _table(*columns: str, rows: Iterator[tuple[str, ...]]) -> str:
    lines = [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
    return "\n".join([*lines, *(f"| {' | '.join(row)} |" for row in rows)]) + "\n"


def _keys(definition: Mapping[str, Any]) -> Iterator[tuple[str, ...]]:
    required = definition.get("required", ())
    for name, entry in definition["properties"].items():
        default = "required" if name in required else _shown(entry.get("default"))
        yield f"`{name}`", _kind(entry), default, str(entry.get("description", ""))


def _kind(entry: Mapping[str, Any]) -> str:
    """Return a type of the JSON schema in words."""
    if "anyOf" in entry:
        kinds = [_kind(each) for each in entry["anyOf"] if each.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if "enum" in entry:
        return " or ".join(f"`{json.dumps(each)}`" for each in entry["enum"])
    if entry.get("type") == "array":
        items = entry.get("prefixItems")
        if items:
            return f"{len(items)} × {_kind(items[0])}"
        return f"list of {_kind(entry['items'])}"
    return {"string": "text", "number": "number", "integer": "whole number"}.get(
        str(entry.get("type")), "table"
    )


def _shown(value: object) -> str:
    return "" if value is None else f"`{json.dumps(value, default=str)}`"


def _effect(name: str) -> str:
    """Return a section: the docstring of an effect and the keys of its table."""
    effect = effect_class(name)
    text = inspect.cleandoc(effect.__doc__ or "").replace("\\|", "|")
    keys = _table("key", "type", "default", rows=_fields(effect, name))
    return f"\n### {name}\n\n{text}\n\n{keys}"


def _fields(effect: Any, name: str) -> Iterator[tuple[str, ...]]:
    schema = scene_model((name,)).model_json_schema()["$defs"][f"{name}_table"]
    defaults = {field.name: field.default for field in fields(effect)}
    for key, entry in schema["properties"].items():
        default = "required" if defaults[key] is MISSING else _shown(defaults[key])
        yield f"`{key}`", _kind(entry), default
