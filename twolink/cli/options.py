"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SceneName = Annotated[
    Path, typer.Argument(metavar="SCENE", help="A scene: its name, or a TOML file.")
]
Samples = Annotated[int, typer.Option(help="How many evenly spaced samples to keep.")]
Methods = Annotated[
    str, typer.Option(help="These methods alone, separated by commas. Default: all.")
]
