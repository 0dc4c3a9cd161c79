"""The command `twolink scenes`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from twolink.cli.terminal import say


def scenes(
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of scene files, for editors.")
    ] = False,
) -> None:
    """List the shipped scenes by name, or print the schema."""
    from twolink.scene import Scene, scene_model, scene_names

    if schema:
        say(json.dumps(scene_model().model_json_schema(), indent=2))
        return
    here = Path.cwd()
    for name, file in scene_names().items():
        scene = Scene.load(file)
        say(f"{name}: {scene.title}: {scene.shows}")
        say(f"    {file.relative_to(here) if file.is_relative_to(here) else file}")
