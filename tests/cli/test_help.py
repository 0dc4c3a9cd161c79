"""The one-line descriptions of commands fit a terminal of 80 columns."""

import pytest
import typer
from typer.testing import CliRunner

from twolink.cli import app


@pytest.mark.parametrize("words", [[], ["urdf"]], ids=["twolink", "twolink urdf"])
def test_no_line_is_cut(words):
    result = CliRunner().invoke(app, [*words, "--help"], terminal_width=80)
    assert result.exit_code == 0
    assert "..." not in result.stdout.partition("Commands:")[2]
    assert max(map(len, result.stdout.splitlines())) <= 80


def test_every_command_has_a_line():
    group = typer.main.get_command(app)
    for name, command in group.commands.items():
        assert command.get_short_help_str(63), name
