"""The README's commands, outputs, code and paths are correct."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.test_layers import LAYERS
from twolink.cli import app
from twolink.hardcases.catalogue import CASES

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
CONSOLE = re.findall(r"```console\n\$ (.*?)\n(.*?)```", README, re.DOTALL)
VERIFICATION = (ROOT / "docs" / "verification.md").read_text(encoding="utf-8")
PYTHON = re.findall(r"```python\n(.*?)```", README + VERIFICATION, re.DOTALL)


def masked(text: str) -> list[str]:
    """Return lines without their numbers and spacing, which may differ between machines."""
    numberless = re.sub(r"<?\d+(\.\d+)*(/\d+)?%?", "#", text)
    return [" ".join(line.split()) for line in numberless.splitlines() if line.split()]


def test_the_readme_begins_with_two_commands():
    assert [command for command, _ in CONSOLE] == [
        "pip install uv && uv run twolink report",
        "uv run twolink simulate drop",
    ]


def test_ci_runs_both_commands():
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    for command, _ in CONSOLE:
        assert command.removeprefix("pip install uv && ") in script


def test_the_output_of_simulate_is_correct():
    result = CliRunner().invoke(app, ["simulate", "drop"])
    assert result.exit_code == 0
    assert masked(result.stdout) == masked(CONSOLE[1][1])
    # Of the digits, at least the first six are the same on each machine.
    angles = re.search(r"q at the end +([\d.]+), ([\d.]+) rad", CONSOLE[1][1])
    found = re.search(r"q at the end +([\d.]+), ([\d.]+) rad", result.stdout)
    for shown, printed in zip(angles.groups(), found.groups(), strict=True):
        assert float(shown) == pytest.approx(float(printed), rel=1e-6)


def test_the_output_of_verify_is_correct():
    result = CliRunner().invoke(app, ["verify"])
    assert result.exit_code == 0
    ((command, output),) = re.findall(r"```console\n\$ (.*?)\n(.*?)```", VERIFICATION, re.DOTALL)
    assert command == "uv run twolink verify"
    printed, shown = masked(result.stdout), masked(output)
    # Which quantity comes closest to its tolerance may differ between machines.
    assert shown[-1].partition("(")[0] == printed[-1].partition("(")[0]
    head, tail = shown[: shown.index("…")], shown[shown.index("…") + 1 : -1]
    assert head == printed[: len(head)]
    assert tail == printed[-1 - len(tail) : -1]
    assert len(head) > 15


def test_the_hard_cases_are_counted():
    (board,) = re.findall(r"```text\n( +pass.*?)```", README, re.DOTALL)
    rows = [[int(n) for n in re.findall(r"\b\d+\b", line)] for line in board.splitlines()[2:]]
    assert len(rows) == 8
    assert {sum(row) for row in rows} == {len(CASES)}
    assert f"runs {len(CASES)} cases" in README


@pytest.mark.parametrize("code", PYTHON)
def test_the_code_runs(code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})


def test_every_named_file_exists():
    for text in (README, VERIFICATION):
        for name in re.findall(r"`((?:twolink|tests|models|docs|benchmarks)/[\w./]*)`", text):
            assert (ROOT / name).exists(), name


def test_every_link_leads_to_a_file():
    for text, folder in ((README, ROOT), (VERIFICATION, ROOT / "docs")):
        links = re.findall(r"\]\(([^)#:]+)(?:#[\w-]*)?\)", text)
        assert len(links) > 2
        for link in links:
            assert (folder / link).exists(), link


def test_the_readme_is_one_page_with_the_animated_picture():
    assert len(README.splitlines()) < 150
    assert "](docs/drop.svg)" in README


def test_the_map_shows_every_layer():
    inside = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    for layer in LAYERS:
        module = layer.partition(".")[2] or layer
        if module not in (
            "errors",
            "text",
            "tables",
            "files",
            "toml",
            "validation",
            "values",
            "inputs",
            "limits",
            "interruptible",
            "data",
            "environment",
            "suffixes",
            "times",
            "__main__",
        ):
            assert module in inside, module
