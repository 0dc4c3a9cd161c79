"""The import suite as it lies in models/import."""

from __future__ import annotations

import json
from typing import Any

from twolink.data import data_path

FOLDER = data_path("import")
INDEX: dict[str, Any] = json.loads((FOLDER / "index.json").read_text(encoding="utf-8"))
VALID = [test for test in INDEX["tests"] if test["expect"] == "value"]
INVALID = [test for test in INDEX["tests"] if test["expect"] == "refuse"]


def named(test: Any) -> str:
    return str(test["id"]).removeprefix("import/")
