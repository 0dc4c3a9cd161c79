"""The commands `twolink urdf …`: URDF files shown, repaired, written and converted."""

from __future__ import annotations

import typer

from twolink.cli.urdf_convert import convert
from twolink.cli.urdf_repair import repair
from twolink.cli.urdf_show import show
from twolink.cli.urdf_write import write

app = typer.Typer(
    help="Show, repair, write and convert URDFs of two-link chains.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

for command in (show, repair, write, convert):
    app.command()(command)
