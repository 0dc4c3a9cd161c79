"""The command `twolink hardcases`: the scoreboard, its explanations, its exit codes."""

import json

import pytest
from typer.testing import CliRunner

from twolink.cli import app
from twolink.engines.marks import Result
from twolink.hardcases import catalogue
from twolink.hardcases.record import Case


def run(*arguments: str):
    return CliRunner().invoke(app, ["hardcases", *arguments])


@pytest.mark.slow
def test_a_case_on_all_formulations(tmp_path):
    file = tmp_path / "board.json"
    result = run("--case", "zeno", "--case", "aligned", "--ours", "--json", str(file))
    assert result.exit_code == 0, result.output
    assert "Hard cases: contact" in result.output
    assert "Hard cases: evaluation" in result.output
    assert "kane: 2 pass" in result.output
    passes = "This library passes 2 hard cases of 2, with momenta, lagrange, kane."
    assert result.output.splitlines()[-1] == passes
    document = json.loads(file.read_text())
    assert document["versions"]["heyoka"]
    table = document["cases"]
    assert list(table) == ["zeno", "aligned"]
    assert {found["mark"] for found in table["zeno"]["outcomes"].values()} == {"pass"}


def test_a_failing_engine_is_reported_and_does_not_change_the_exit_code(tmp_path):
    file = tmp_path / "board.json"
    result = run("--case", "zeno", "--engine", "heyoka", "--json", str(file))
    assert result.exit_code == 0, result.output
    assert "heyoka: 1 cannot express" in result.output
    document = json.loads(file.read_text())
    assert "joint_stop" in document["cases"]["zeno"]["outcomes"]["heyoka"]["said"]


def test_a_failure_of_this_library_has_exit_code_1(monkeypatch):
    class Wrong:
        def ours(self, formulation, check):
            return Result(1e9, said="q is off by a turn")

    wrong = Case("wrong", "smooth", "it", "this", "here", "so", Wrong())
    monkeypatch.setattr(catalogue, "CASES", (wrong,))
    result = run("--ours")
    assert result.exit_code == 1
    assert "wrong, kane: silently wrong; q is off by a turn" in result.output
    assert "This library fails 1 of 1 hard case: wrong." in result.output


def test_explanations():
    result = run("--explain", "zeno")
    assert result.exit_code == 0
    assert result.output.startswith("# zeno\n\nGroup: contact.\n")
    every = run("--explain", "all").output
    assert every.count("**Difficulty.**") == len(catalogue.CASES)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--case", "xyz"], "case must be one of"),
        (["--explain", "xyz"], "case must be one of"),
        (["--engine", "ode"], "engine must be one of momenta, lagrange, kane, heyoka"),
        (["--ours", "--engine", "kane"], "both --ours and --engine are given"),
        (
            ["--json", "no/such/folder/x.json"],
            "--json: no/such/folder/x.json: its folder does not exist",
        ),
    ],
)
def test_invalid_options(arguments, words):
    result = run(*arguments)
    assert result.exit_code == 2
    assert words in result.output


@pytest.mark.parametrize("option", ["--case=zeno", "--engine=heyoka", "--ours", "--json=a.json"])
def test_an_explanation_has_no_other_options(option):
    result = run("--explain", "zeno", option)
    assert result.exit_code == 2
    name = option.partition("=")[0]
    assert result.stderr == f"twolink: {name} must be left out with --explain; got both\n"
