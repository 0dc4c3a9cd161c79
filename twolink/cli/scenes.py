"""The command `twolink scenes`."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from twolink.cli.terminal import console, print_table, refuse, say, styled
from twolink.tables import table
from twolink.text import choice


def scenes(
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME", help="Scenes to describe. Default: list all by name."),
    ] = None,
    schema: Annotated[
        bool, typer.Option("--schema", help="Print the JSON schema of scene files, for editors.")
    ] = False,
) -> None:
    """List the built-in scenes, describe some, or print the schema."""
    from twolink.scene import Scene, scene_model, scene_names

    if schema:
        say(json.dumps(scene_model().model_json_schema(), indent=2))
        return
    files = scene_names()
    page = console()
    if not names:
        rows = ((name, Scene.load(file).title) for name, file in files.items())
        print_table(page, table("", ("scene", "title"), rows))
        page.print("`twolink scenes NAME` describes a scene, with its file.", soft_wrap=True)
        return
    unknown = next((name for name in names if name not in files), None)
    if unknown is not None:
        refuse(choice("NAME", unknown, files))
    for name in names:
        scene, file = Scene.load(files[name]), files[name]
        page.print(styled((name, "bold"), f": {scene.title}: {scene.shows}."), soft_wrap=True)
        say(f"    {file}")
