"""The golden vectors as files: groups, schemas, a checksum file, and a page on every field."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from twolink.conformance.bounds import REASON
from twolink.conformance.flags import FLAGS
from twolink.conformance.quantities import QUANTITIES
from twolink.conformance.suites import ABOUT, SUITES, suite
from twolink.conformance.vectors import (
    DIGITS,
    ERRATA,
    RELEASE,
    Flag,
    Frame,
    Group,
    Motion,
    Vector,
    VectorFile,
)
from twolink.engines.messages import PROTOCOL, Message, schemas
from twolink.files import atomic_write, new_folder

CHECKSUMS = "SHA256SUMS"
PAGE = "README.md"


def golden_files(suites: Iterable[str] | None = None) -> dict[str, bytes]:
    """Return the content of every file of the vectors, by its path. The same in every run."""
    files = {}
    for name in SUITES if suites is None else dict.fromkeys(suites):
        groups = suite(name)
        for group in groups:
            path = f"{name}/{group.id.removeprefix(f'{name}/')}.json"
            files[path] = _bytes(group_document(name, group))
    files["schema/vectors.json"] = _bytes(VectorFile.model_json_schema())
    for name, schema in schemas().items():
        files[f"schema/message-{name}.json"] = _bytes(schema)
    files[PAGE] = page().encode()
    files[CHECKSUMS] = _checksums(files)
    return files


def write_golden(folder: Path, suites: Iterable[str] | None = None) -> int:
    """Write the vectors into a folder, and return the number of files.

    Files of the folder that the vectors do not have are left alone. Raises `FileError`.
    """
    files = golden_files(suites)
    with new_folder(folder):
        for path, content in files.items():
            target = folder / path
            with new_folder(target.parent), atomic_write(target) as temporary:
                temporary.write_bytes(content)
    return len(files)


def group_document(suite: str, group: Group) -> dict[str, Any]:
    """Return the content of the file of a group."""
    flags = dict.fromkeys([*group.flags, *(flag for test in group.tests for flag in test.flags)])
    found = VectorFile(
        schema="../schema/vectors.json",
        suite=suite,
        about=ABOUT[suite],
        notes={flag: FLAGS[flag] for flag in flags},
        bound_reason=REASON,
        group=group,
    )
    return found.model_dump(exclude_none=True, by_alias=True)


def read_group(content: bytes) -> VectorFile:
    """Return a file of vectors, checked against its schema. Raises pydantic's error."""
    return VectorFile.model_validate_json(content)


def page() -> str:
    """Return the page that defines every field, in Markdown."""
    parts = [
        f"# Vectors of twolink, release {RELEASE}",
        f"Written by `twolink golden`. Values have {DIGITS} certified digits: they are sums over"
        " bodies in space, computed with 120 and with 60 decimal digits, and the tests of the"
        " library compare them with two planar derivations at 50 digits. The inputs are the float64"
        " numbers that the texts parse to. Ids are never reused; a changed value is an erratum.",
        "Errata: " + ("; ".join(ERRATA) or "none") + ".",
        *(part for title, kind in _PARTS for part in (f"## Fields of {title}", _fields(kind))),
        "## Quantities",
        "States are rows of two numbers, in joint angles: θ1 from the x-axis, θ2 from link 1, or"
        " as the URDF's joints define them. For a model from URDF, an answer that is a vector has"
        " three components in the root link's frame; the values have its components along x and y"
        " of `frame`, from its origin for a position. A potential counts from that of the first"
        " state.",
        _quantities(),
        "## Bound",
        f"{REASON} A value passes if its error is at most its bound. LRE, the number of correct"
        " digits, is −log10 of the largest error of a state over its largest value.",
        "## Flags",
        _flags(),
        f"## Messages\n\n`schema/message-*.json` are the JSON schemas of protocol {PROTOCOL}.",
    ]
    return "\n\n".join(parts) + "\n"


_PARTS: tuple[tuple[str, type[Message]], ...] = (
    ("a file", VectorFile),
    ("`group`", Group),
    ("a test", Vector),
    ("a motion", Motion),
    ("a flag in `notes`", Flag),
    ("`frame`", Frame),
)


def _quantities() -> str:
    rows = "\n".join(
        f"| `{each.name}` | {', '.join(each.inputs)} | {_shape(each.shape)} | {each.unit} |"
        f" {each.meaning} |"
        for each in QUANTITIES.values()
    )
    return "| name | inputs | shape in a state | unit | meaning |\n|---|---|---|---|---|\n" + rows


def _flags() -> str:
    rows = "\n".join(
        f"| {name} | {flag.kind} | {flag.description} | {flag.effect} |"
        f" {', '.join(flag.first_seen) or '–'} |"
        for name, flag in FLAGS.items()
    )
    return (
        "| flag | kind | about | effect of the mistake | reported |\n|---|---|---|---|---|\n" + rows
    )


_MEANINGS: Mapping[str, str] = {
    "schema": "path of the JSON schema of this file",
    "version": "release of the vectors: year and month",
    "suite": "name of the suite",
    "about": "subject of the suite",
    "notes": "the flags that occur in this file, with their notes",
    "bound_reason": "derivation of the bounds",
    "group": "the model and its tests",
    "id": "immutable name: suite/model for a group, suite/model/quantity for a test",
    "comment": "special features, in words",
    "flags": "subjects of the group or test; see Flags",
    "level": "difficulty: lower, average, higher",
    "expect": "value: must be read; refuse: must be rejected; either: standards differ",
    "reason": "words of the reason for which twolink rejects it",
    "urdf": "the text of the URDF file",
    "gravity": "vector of gravity in the root link's frame, m/s²",
    "frame": "the chain's frame in the root link's frame",
    "parameters": "the same model by its planar parameters, SI units",
    "understood": "the model as a right reader has it: of each link its mass (kg), the distance"
    " of its mass centre from its joint's axis (m) and its inertia about the mass centre (kg m²);"
    " of each joint its damping, friction, armature and limits",
    "tests": "the tests of the model",
    "motions": "the motions of the model",
    "angles": "joint angles at the start, rad",
    "speeds": "joint speeds at the start, rad/s",
    "times": "times, the first of which is that of the start, s",
    "quantity": "name of the quantity; see Quantities",
    "unit": "unit of the values",
    "needs": "effects that the engine must have, or the test is not for it",
    "states": "inputs, a row for each state: angles (rad), speeds (rad/s), accelerations (rad/s²),"
    " torques (N m)",
    "digits": "correct digits of the values; decimal places for a motion with events",
    "values": "certified values as decimal strings: an entry for each state of a test; θ1, θ2 (rad)"
    " and their speeds (rad/s) at each time but the first of a motion",
    "bound": "largest error of a right binary64 engine, in the shape of the values",
    "kind": "kind of mistake: import, dynamics, input, numbers",
    "description": "special features",
    "effect": "effect of the mistake",
    "first_seen": "reports of the mistake in released engines",
    "origin": "A in the root link's frame, m",
    "x": "unit vector to the right",
    "y": "unit vector downwards, along gravity where it is in the plane",
}


def _fields(kind: type[Message]) -> str:
    rows = []
    for name, field in kind.model_fields.items():
        own = field.alias or name
        required = "yes" if field.is_required() else "no"
        rows.append(f"| `{own}` | {required} | {_MEANINGS[own]} |")
    return "| field | required | meaning |\n|---|---|---|\n" + "\n".join(rows)


def _shape(shape: tuple[int, ...]) -> str:
    return " × ".join(map(str, shape)) or "a number"


def _bytes(content: Any) -> bytes:
    assert not isinstance(content, BaseModel)
    return (json.dumps(content, ensure_ascii=False, indent=1) + "\n").encode()


def _checksums(files: Mapping[str, bytes]) -> bytes:
    """Return a file that `sha256sum --check` reads."""
    lines = (f"{hashlib.sha256(files[path]).hexdigest()}  {path}\n" for path in sorted(files))
    return "".join(lines).encode()
