"""Shipped scenes by name, the stems of their files; and the files that a scene names."""

from __future__ import annotations

import os
from os import PathLike
from pathlib import Path
from typing import Any

from twolink.data import data_path
from twolink.errors import SceneError
from twolink.inputs import as_path
from twolink.scene.text import read_text, tables
from twolink.text import nearest


def scene_names() -> dict[str, Path]:
    """Return the files of the shipped scenes, by name, in alphabetical order of their paths."""
    return {file.stem: file for file in sorted(data_path("scenes").rglob("*.toml"))}


def scene_file(scene: str | PathLike[str]) -> Path:
    """Return the file of a scene: a path as it is, the name of a shipped scene as its file.

    A file of that name in the working folder comes first. Raises `SceneError` with the nearest
    names for a name that is neither; a path without a file is returned as it is.
    """
    path = as_path("the path of a scene", scene)
    if path.name != str(path) or path.suffix not in ("", ".toml"):
        return path
    try:
        if path.exists() and not path.is_dir():
            return path
    except OSError:
        return path
    names = scene_names()
    if not path.suffix and path.name in names:
        return names[path.name]
    # A file that does not exist yet has a similar name more often than an option does.
    near = nearest(path.stem, names, cutoff=0.7)
    if near:
        raise SceneError(
            f"{path}: there is no scene and no file of this name; did you mean {' or '.join(near)}?"
        )
    return path


def files_named_in(file: Path) -> tuple[Path, ...]:
    """Return the files that a scene or sweep file names; nothing else in it is checked.

    Raises `TwolinkError` for a file that cannot be read, or is no TOML.
    """
    table, folder = tables(read_text(file), str(file)), file.parent
    scene = table.get("scene")
    if isinstance(scene, dict):
        return (*_urdf_of(table, folder), *_urdf_of(scene, folder))
    if not isinstance(scene, str) or not os.path.isfile(folder / scene):
        return _urdf_of(table, folder)
    beside = folder / scene
    return (beside, *_urdf_of(tables(read_text(beside), str(beside)), beside.parent))


def _urdf_of(scene: dict[str, Any], folder: Path) -> tuple[Path, ...]:
    """Return the URDF that the tables of a scene name, if they do."""
    chain = scene.get("chain")
    urdf = chain.get("urdf") if isinstance(chain, dict) else None
    return (folder / urdf,) if isinstance(urdf, str) else ()
