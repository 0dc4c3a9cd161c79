"""Shipped scenes by name: the stems of their files."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from twolink.data import data_path
from twolink.errors import SceneError
from twolink.inputs import as_path
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
