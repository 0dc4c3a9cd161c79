"""The command `twolink simulate`: options that do not go together."""

import pytest
from typer.testing import CliRunner

from twolink.cli import app


@pytest.mark.parametrize(
    ("option", "value"),
    [("--out", "a.npz"), ("--accuracy", "1e-3"), ("--samples", "7"), ("--method", "rk4")],
)
def test_the_cost_of_effects_goes_without_options_of_a_run(option, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["simulate", "general", "--effects-cost", option, value])
    assert result.exit_code == 2
    assert result.stderr == (f"twolink: {option} must be left out with --effects-cost; got both\n")
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_the_cost_of_effects_is_that_of_a_formulation():
    words = ["simulate", "general", "--effects-cost", "--formulation", "kane", "--force"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    assert "all effects" in result.stdout


@pytest.mark.slow
def test_any_error_may_be_allowed():
    result = CliRunner().invoke(app, ["simulate", "general", "--accuracy", "1e308"])
    assert result.exit_code == 0, result.output
