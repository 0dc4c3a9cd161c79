"""Options of several commands, and those that do not go together."""

import pytest
from typer.testing import CliRunner

from twolink.cli import app


def run(*words):
    return CliRunner().invoke(app, list(map(str, words)))


@pytest.mark.parametrize("value", [7, 501])
def test_an_option_without_effect_is_refused_with_any_value(value):
    """Also with the default one, which the user has typed."""
    result = run("simulate", "general", "--effects-cost", "--samples", value)
    assert result.exit_code == 2
    assert result.stderr == ("twolink: --samples must be left out with --effects-cost; got both\n")
    assert result.stdout == ""


@pytest.mark.parametrize("command", ["accuracy", "drift"])
@pytest.mark.parametrize("words", ["", " ", ", ,"])
def test_an_empty_list_of_methods_is_refused(command, words, tmp_path):
    result = run(command, "free_fall", "--methods", words, "--out", tmp_path / "a")
    assert result.exit_code == 2
    assert result.stderr == (
        f"twolink: --methods must be one name or more, separated by commas; got {words!r}\n"
    )
    assert list(tmp_path.iterdir()) == []
