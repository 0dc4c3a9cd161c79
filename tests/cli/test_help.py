"""The one-line descriptions of commands fit a terminal of 80 columns."""

import pytest
import typer
from typer.testing import CliRunner

from twolink.cli import app
from twolink.ensembles.parameters import SYMBOLS
from twolink.formulations import FORMULATIONS
from twolink.simulation.smooth.equations import EQUATIONS
from twolink.viz.encoding import _VIDEO
from twolink.viz.themes import THEMES


@pytest.mark.parametrize("words", [[], ["urdf"]], ids=["twolink", "twolink urdf"])
def test_no_line_is_cut(words):
    result = CliRunner().invoke(app, [*words, "--help"], terminal_width=80)
    assert result.exit_code == 0
    assert "..." not in result.stdout.partition("Commands:")[2]
    assert max(map(len, result.stdout.splitlines())) <= 80


def _commands(group):
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command)
        else:
            yield pytest.param(command, id=name)


@pytest.mark.parametrize("command", [*_commands(typer.main.get_command(app))])
def test_arguments_are_in_capitals_and_repeated_options_say_so(command):
    for each in command.params:
        if each.param_type_name == "argument":
            assert each.metavar is not None, each.name
            assert each.metavar == each.metavar.upper()
        elif each.multiple:
            # Without a name of its own, its type is printed as Python's.
            assert each.metavar is not None, each.name
            assert "May be repeated" in each.help


def test_every_command_has_a_line():
    group = typer.main.get_command(app)
    for name, command in group.commands.items():
        assert command.get_short_help_str(63), name


@pytest.mark.parametrize("words", ["simulate", "hardcases", "view", "record"])
def test_equations_are_named_as_options_take_them(words):
    shown = CliRunner().invoke(app, [words, "--help"], terminal_width=80).stdout
    assert ", ".join([*EQUATIONS][:2]) in " ".join(shown.split())
    for name in EQUATIONS:
        assert name in shown


def test_files_and_formulations_are_named_as_options_take_them():
    for words, names in (
        ("record", (*_VIDEO, ".png", ".html")),
        ("plot", THEMES),
        ("verify", FORMULATIONS),
        ("sensitivity", SYMBOLS),
    ):
        shown = CliRunner().invoke(app, [words, "--help"], terminal_width=80).stdout
        assert f"{', '.join([*names][:-1])} or {[*names][-1]}" in " ".join(shown.split())
