"""The page of all commands, from the program itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer

from twolink.cli import app

_HEAD = """# Commands

This page is generated from the program. `twolink --help` and `twolink COMMAND --help` print the
same. [Interrupted, killed, out of disk](../interruptions.md) says how each command ends.
"""


def commands_page() -> str:
    """Return the page: a section for each command, with its arguments and options."""
    group: Any = typer.main.get_command(app)
    return _HEAD + "".join(_sections(group, "twolink"))


def _sections(group: Any, path: str) -> Iterator[str]:
    context = typer.Context(group, info_name=path)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if hasattr(command, "list_commands"):
            yield from _sections(command, f"{path} {name}")
        else:
            yield _section(command, f"{path} {name}")


def _section(command: Any, path: str) -> str:
    context = typer.Context(command, info_name=path)
    words = " ".join(command.get_usage(context).removeprefix("Usage: ").split())
    parts = [f"\n## {path}\n", f"```text\n{words}\n```\n", f"{_plain(command.help)}\n"]
    for kind in ("argument", "option"):
        parts += _table(
            context, kind, [each for each in command.params if each.param_type_name == kind]
        )
    return "\n".join(parts)


def _table(context: Any, kind: str, parameters: list[Any]) -> list[str]:
    if not parameters:
        return []
    records = [each.get_help_record(context) for each in parameters]
    rows = [f"| `{_cell(name)}` | {_cell(text)} |" for name, text in filter(None, records)]
    return ["\n".join([f"| {kind} | meaning |", "|---|---|", *rows]) + "\n"]


def _plain(text: str | None) -> str:
    """Return a help text with its paragraphs as lines of prose."""
    return "\n\n".join(" ".join(part.split()) for part in (text or "").strip().split("\n\n"))


def _cell(text: str | None) -> str:
    return _plain(text).replace("|", "\\|")
