"""Arguments and options that several commands have, and those that do not go together."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twolink.errors import ParameterError
from twolink.text import quoted


def check_unused(context: typer.Context, beside: str, *names: str) -> None:
    """Raise `ParameterError` for an option that a command line has, but not beside another."""
    for option in context.command.params:
        if option.name in names and _is_given(context, option.name):
            raise ParameterError(f"{option.opts[0]} must be left out with {beside}; got both")


def _is_given(context: typer.Context, name: str) -> bool:
    """Return whether a command line has an option; its value may be the default one."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def _listed(context: typer.Context, option: typer.CallbackParam, words: str) -> str:
    """Return a list of names; raise `ParameterError` for one that is given without any."""
    if _is_given(context, str(option.name)) and not words.replace(",", " ").split():
        raise ParameterError(
            f"{option.opts[0]} must be one name or more, separated by commas; got {quoted(words)}"
        )
    return words


SceneName = Annotated[
    Path, typer.Argument(metavar="SCENE", help="A scene: its name, or a TOML file.")
]
Samples = Annotated[int, typer.Option(help="How many evenly spaced samples to keep.")]
Methods = Annotated[
    str,
    typer.Option(callback=_listed, help="These methods alone, separated by commas. Default: all."),
]
