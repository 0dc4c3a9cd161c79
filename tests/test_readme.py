"""The README's commands, outputs, code and paths are correct."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.test_layers import LAYERS
from twolink.cli import app

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONSOLE = re.findall(r"```console\n\$ (.*?)\n(.*?)```", README, re.DOTALL)
PYTHON = re.findall(r"```python\n(.*?)```", README, re.DOTALL)


def masked(text: str) -> list[str]:
    """Return lines without their numbers and spacing, which may differ between machines."""
    numberless = re.sub(r"<?\d+(\.\d+)*(/\d+)?%?", "#", text)
    return [" ".join(line.split()) for line in numberless.splitlines() if line.split()]


def test_both_commands_are_present():
    assert [command for command, _ in CONSOLE] == [
        "pip install uv && uv run twolink report",
        "pip install uv && uv run pytest",
        "uv run twolink verify",
    ]


def test_ci_runs_both_commands():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    for command, _ in CONSOLE:
        assert command.removeprefix("pip install uv && ") in script


def test_the_output_of_verify_is_correct():
    result = CliRunner().invoke(app, ["verify"])
    assert result.exit_code == 0
    printed, shown = masked(result.stdout), masked(CONSOLE[2][1])
    # Which quantity comes closest to its tolerance may differ between machines.
    assert shown[-1].partition("(")[0] == printed[-1].partition("(")[0]
    head, tail = shown[: shown.index("…")], shown[shown.index("…") + 1 : -1]
    assert head == printed[: len(head)]
    assert tail == printed[-1 - len(tail) : -1]
    assert len(head) > 15


@pytest.mark.parametrize("code", PYTHON)
def test_the_code_runs(code):
    exec(compile(code, "README.md", "exec"), {})


def test_every_named_file_exists():
    for name in re.findall(r"`((?:twolink|tests|models|docs|benchmarks)/[\w./]*)`", README):
        assert (ROOT / name).exists(), name
    assert (ROOT / "docs" / "twolink.svg").exists()


def test_the_map_shows_every_layer():
    inside = README.partition("## Contents")[2]
    for layer in LAYERS:
        module = layer.partition(".")[2] or layer
        if module not in (
            "errors",
            "text",
            "tables",
            "files",
            "validation",
            "values",
            "inputs",
            "limits",
            "interruptible",
            "data",
            "environment",
            "__main__",
        ):
            assert module in inside, module
