"""The glossary lists names that exist, each once."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
NAMES = re.findall(
    r"^\| `([\w.]+)` \|", (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8"), re.MULTILINE
)


def public_names(module: str) -> set[str]:
    """Return the public classes, functions and constants that a module's source defines."""
    path = ROOT.joinpath(*module.split("."))
    source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    found: set[str] = set()
    for node in ast.parse(source.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found.update(target.id for target in targets if isinstance(target, ast.Name))
    return {name for name in found if not name.startswith("_")}


@pytest.mark.parametrize("name", NAMES)
def test_each_name_exists(name):
    module, _, own = name.rpartition(".")
    assert own in public_names(module)


def test_each_name_is_listed_once():
    assert len(NAMES) > 50
    assert len(NAMES) == len(set(NAMES))


def test_a_name_that_does_not_exist_is_found():
    assert "Chian" not in public_names("twolink.chain")
    assert "_exact" not in public_names("twolink.chain")
