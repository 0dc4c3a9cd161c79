"""The command `twolink scenes`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer


def scenes(
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of scene files, for editors.")
    ] = False,
) -> None:
    """List the scenes that come along, or print the schema."""
    from twolink.scene import Scene, scene_model
    from twolink.shipped import shipped

    if schema:
        typer.echo(json.dumps(scene_model().model_json_schema(), indent=2))
        return
    for file in sorted(shipped("scenes").rglob("*.toml")):
        typer.echo(f"{file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file}")
        scene = Scene.load(file)
        typer.echo(f"    {scene.title}: {scene.shows}")
