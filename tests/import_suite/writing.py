"""The files of the import suite and their index, from their descriptions."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tests.import_suite.invalid import INVALID, Invalid
from tests.import_suite.valid import VALID, Valid

FOLDER = Path(__file__).parent.parent.parent / "models" / "import"

ABOUT = (
    "URDF files of planar two-link chains: one feature or fault each. A valid file has the planar"
    " parameters it was built from (SI units; plane: x, y, z of the derivation's frame in the root"
    " link's frame; q1 = s1 theta1 + phi1, q2 = q1 + s2 theta2 + phi2); an invalid one has words of"
    " the reason for which it is refused, and whether a repair is possible. Ids are never reused."
    " Written by `python -m tests.import_suite`."
)


def suite() -> dict[str, bytes]:
    """Return the content of every file of the suite, by its path in the folder."""
    files: dict[str, bytes] = {}
    index: list[dict[str, Any]] = []

    def add(folder: str, name: str, case: Valid | Invalid, **expectation: Any) -> None:
        path = f"{folder}/{name}.urdf"
        files[path] = _bytes(case.content)
        entry = {"id": f"import/{name}", "file": path}
        entry |= {"flags": list(case.flags), "comment": case.comment}
        index.append({**entry, **expectation})

    for name, make in VALID.items():
        valid = make()
        add("valid", name, valid, expect="value", parameters=valid.expect)
    for name, make_invalid in INVALID.items():
        invalid = make_invalid()
        reason, repairable = list(invalid.reason), invalid.repairable
        add("invalid", name, invalid, expect="refuse", reason=reason, repairable=repairable)
    document = {"version": 1, "about": ABOUT, "tests": index}
    files["index.json"] = (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()
    return files


def write_suite(folder: Path) -> None:
    """Write the suite, and remove files that it does not have."""
    files = suite()
    for path, content in files.items():
        file = folder / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    for file in folder.rglob("*.*"):
        if file.relative_to(folder).as_posix() not in files:
            file.unlink()


def _bytes(content: str | bytes) -> bytes:
    return content if isinstance(content, bytes) else content.encode("utf-8")
