"""The contributor's guide and the architecture page name existing files and commands."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = ["CONTRIBUTING.md", "docs/architecture.md", "docs/derivation.md"]
GUIDE = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", PAGES)
def test_files_named_on_the_pages_exist(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for name in re.findall(r"`((?:twolink|tests|docs|models)/[\w./]*)`", text):
        if not re.search(r"/a/(test_)?b\.py$", name):
            assert (ROOT / name).exists(), name
    for link in re.findall(r"\]\(([\w./]+)\)", text):
        assert ((ROOT / page).parent / link).exists(), link


@pytest.mark.parametrize(
    ("file", "names"),
    [
        ("twolink/effects/__init__.py", ["EFFECTS", "__all__"]),
        ("twolink/contact/impact_laws.py", ["LAWS", "rough_impulse", "guided_impulse"]),
        ("twolink/effects/compliant_surface.py", ["_LAWS", "_law"]),
        ("twolink/formulations.py", ["FORMULATIONS"]),
        ("twolink/names.py", ["FormulationName"]),
        ("twolink/integration/methods.py", ["NUMERIC_METHODS", "NumericName"]),
        ("twolink/engines/registry.py", ["ENGINES"]),
        ("twolink/cli/plot.py", ["OF_MOTION"]),
        ("twolink/viz/plots/kinds.py", ["OF_ONE", "OF_SEVERAL"]),
        ("twolink/conformance/model_mistakes.py", ["MODEL_MISTAKES"]),
        ("twolink/conformance/answer_mistakes.py", ["ANSWER_MISTAKES"]),
        ("twolink/conformance/suites/__init__.py", ["_SUITES"]),
        ("twolink/hardcases/friction.py", ["CASES"]),
    ],
)
def test_the_guide_uses_names_that_exist_in_the_code(file, names):
    text = (ROOT / file).read_text(encoding="utf-8")
    for name in names:
        assert f"`{name}`" in GUIDE
        assert re.search(rf"^\s*(def )?{name}\b", text, re.MULTILINE), name


def test_there_are_five_commands():
    console = re.search(r"```console\n(.*?)```", GUIDE, re.DOTALL)
    assert console is not None
    assert len(console[1].splitlines()) == len(re.findall(r"^\d\. ", GUIDE, re.MULTILINE)) == 5


def test_hooks_are_local():
    hooks = (ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8")
    assert re.findall(r"repo: (\S+)", hooks) == ["local"]
    assert set(re.findall(r"language: (\S+)", hooks)) == {"system"}


def test_the_license_is_the_same_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert project["license"] == "BSD-2-Clause"
    assert "urls" not in project
    assert (ROOT / "LICENSE").read_text(encoding="utf-8").startswith("BSD 2-Clause License")
    assert f"license: {project['license']}\n" in citation
    assert f"version: {project['version']}\n" in citation
