"""Sweep files: TOML in, an ensemble out, by the reader of scene files.

```toml
title = "Which starts flip"
scene = "free_fall"

[[axes]]
parameter = "start.q.0"
grid = {first = -3.0, last = 3.0, count = 60}

[keep]
final = true
first = [{name = "flip", of = "q2"}]
```
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from twolink.ensembles.axes import KINDS, Axis, Distribution, Runs, Values
from twolink.ensembles.ensemble import Ensemble
from twolink.ensembles.family import Family
from twolink.ensembles.parameters import JOINT
from twolink.ensembles.quantities import QUANTITIES
from twolink.errors import ParameterError, SceneError, TwolinkError
from twolink.inputs import as_duration, as_path
from twolink.scene import Scene, scene_file
from twolink.scene.model import checked, list_of_tables, scene_model, table_model
from twolink.scene.scene import checked_tables
from twolink.scene.text import check_tables, read_text, tables
from twolink.text import either, quoted

if TYPE_CHECKING:
    from pydantic import BaseModel

# More runs than these are no ensemble but a mistake of a count.
_MOST_RUNS = 1_000_000_000

# Bytes of the name of a folder, which each array of the results has.
_LONGEST_NAME = 255


def load(path: str | PathLike[str]) -> Ensemble:
    """Return the ensemble in a sweep file.

    Raises `SceneError`, in one sentence with the file, the key, the requirement and the received
    value.
    """
    file = as_path("the path of a sweep file", path)
    return ensemble_of(tables(read_text(file), str(file), "sweep"), str(file), file.parent)


def ensemble_of(table: Any, source: str, folder: Path) -> Ensemble:
    """Return the ensemble of the tables of a sweep file; `source` begins messages."""
    check_tables(table, source, "sweep")
    own = isinstance(table.get("scene"), (dict, Scene))
    given = checked(sweep_model(), {**table, "scene": ""} if own else table, source)
    try:
        of_scene, home = scene_tables(table["scene"], folder)
        return _ensemble(given, of_scene, home)
    except SceneError:
        raise
    except TwolinkError as error:
        raise SceneError(f"{source}: {error}") from error


def is_described(ensemble: Ensemble) -> bool:
    """Return whether an ensemble is that of its own document, as results say that it is.

    A copy with another accuracy, duration or family keeps the document of the first.
    """
    about = ensemble.document
    try:
        return _ensemble(about, about["scene"], ensemble.family.folder) == ensemble
    except (KeyError, TwolinkError):
        return False


def sweep_schema() -> dict[str, Any]:
    """Return the JSON schema of sweep files, in which a scene may be a table of its own."""
    return sweep_model(str | scene_model()).model_json_schema()


@lru_cache(maxsize=2)
def sweep_model(scene: Any = str) -> type[BaseModel]:
    """Return the pydantic model of a sweep file; by default its scene is one more scene file."""
    from pydantic import Field

    positive = Annotated[float, Field(gt=0)]
    counted = Annotated[int, Field(ge=1)]
    runs = table_model(
        "Runs",
        draws=(counted | None, Field(None, description="draws of all random axes together")),
        seed=(Annotated[int, Field(ge=0, lt=2**63)], Field(0, description="of the draws")),
        accuracy=(positive | None, Field(None, description="default: that of the scene")),
        duration=(positive | None, Field(None, description="s; default: that of the scene")),
        refine=(bool, Field(False, description="repeat undecided runs in longer precision")),
    )
    return table_model(
        "Sweep",
        title=(str, "untitled"),
        scene=(scene, Field(description="a scene: its name, its file, or a table of its own")),
        axes=(list_of_tables(_axis_table()), Field(default_factory=list)),
        runs=(runs, Field(default_factory=dict, validate_default=True)),
        keep=(_keep_table(), Field(default_factory=dict, validate_default=True)),
    )


def _axis_table() -> type[BaseModel]:
    from pydantic import Field

    return table_model(
        "Axes",
        parameter=(
            str,
            Field(description="the keys of a number in the scene, such as start.q.0, or q1"),
        ),
        name=(str | None, Field(None, description="its name in the results; default: its keys")),
        grid=(_kind_table("grid") | None, Field(None, description="evenly spaced values")),
        values=(tuple[float, ...] | None, Field(None, description="a list of values")),
        uniform=(_kind_table("uniform") | None, Field(None, description="a distribution")),
        normal=(_kind_table("normal") | None, Field(None, description="a distribution")),
    )


def _kind_table(kind: str) -> Any:
    """Return the model of the table of a kind of values."""
    from dataclasses import fields
    from typing import get_type_hints

    made = KINDS[kind]
    hints = get_type_hints(made)
    return table_model(f"{kind} table", **{f.name: (hints[f.name], ...) for f in fields(made)})


def _keep_table() -> type[BaseModel]:
    from pydantic import Field

    entries: dict[str, Any] = {}
    for key, kept in QUANTITIES.items():
        kind = kept.kind
        if kept.table is not None:
            kind = list_of_tables(table_model(f"{key} table", **kept.entries()))
        entries[key] = (kind | None, Field(None, description=kept.description))
    return table_model("Keep", **entries)


def scene_tables(scene: Any, folder: Path) -> tuple[dict[str, Any], Path]:
    """Return the checked tables of a scene, and the folder to which its files are relative.

    The scene may be a `Scene`, tables, a file in the folder, or the name of a shipped scene. Raises
    `SceneError` if it is none.
    """
    if isinstance(scene, Scene):
        return checked_tables(tables(scene.to_toml(), "the scene"), "the scene"), folder
    if isinstance(scene, dict):
        return checked_tables(scene, "scene"), folder
    beside = folder / scene
    file = beside if beside.is_file() else scene_file(scene)
    return checked_tables(tables(read_text(file), str(file)), str(file)), file.parent


def _ensemble(given: dict[str, Any], of_scene: dict[str, Any], home: Path) -> Ensemble:
    """Return the ensemble of checked tables."""
    axes = axes_of(given)
    runs = given["runs"]
    run = {key: runs[key] for key in ("accuracy", "duration") if runs[key] is not None}
    of_scene = {**of_scene, "run": {**of_scene["run"], **run}}
    if of_scene["run"]["method"] != "taylor":
        raise ParameterError(
            "the method of the scene must be taylor, which measures the error of each run; got"
            f" {quoted(of_scene['run']['method'])}"
        )
    family = Family(of_scene, home, tuple(axis.keys for axis in axes))
    kept = tuple(
        quantity
        for key, value in given["keep"].items()
        if value is not None
        for quantity in QUANTITIES[key].make(value)
    )
    _check_lengths([*(axis.name for axis in axes), *(v.name for q in kept for v in q.variables)])
    return Ensemble(
        family=family,
        runs=_runs(axes, runs["draws"], runs["seed"]),
        kept=kept,
        accuracy=of_scene["run"]["accuracy"],
        duration=as_duration("run: duration", of_scene["run"]["duration"]),
        refine=runs["refine"],
        title=given["title"],
        document={**given, "scene": of_scene},
    )


def _check_lengths(names: list[str]) -> None:
    """Raise `ParameterError` for a name of which no file system makes a folder."""
    longest = max(names, key=_bytes, default="")
    if _bytes(longest) > _LONGEST_NAME:
        raise ParameterError(
            f"the names of axes and kept quantities must have {_LONGEST_NAME} bytes or fewer; got"
            f" {quoted(longest)} of {_bytes(longest)}"
        )


def _bytes(name: str) -> int:
    return len(name.encode())


def axes_of(given: dict[str, Any]) -> tuple[Axis, ...]:
    """Return the axes of checked tables."""
    return tuple(_axis(number, table) for number, table in enumerate(given["axes"]))


def _axis(number: int, table: dict[str, Any]) -> Axis:
    """Return an axis of its table."""
    where = f"axes.{number}"
    kinds = [kind for kind in KINDS if table[kind] is not None]
    if len(kinds) != 1:
        raise ParameterError(
            f"{where} must have one of {either(list(KINDS))}; got"
            f" {' and '.join(kinds) if kinds else 'none'}"
        )
    (kind,) = kinds
    value = table[kind]
    made: Callable[..., Values] = KINDS[kind]
    try:
        values = made(value) if kind == "values" else made(**value)
    except ParameterError as error:
        raise ParameterError(f"{where}: {error}") from error
    name = table["name"] or table["parameter"].replace(JOINT, "_")
    if not name.isidentifier():
        raise ParameterError(
            f"{where}.name must be letters, digits and underscores, with no digit first;"
            f" got {quoted(name)}"
        )
    return Axis(table["parameter"], values, name)


def _runs(axes: tuple[Axis, ...], draws: int | None, seed: int) -> Runs:
    """Return the runs of axes; draws must be given if, and only if, an axis is random."""
    random = any(isinstance(axis.values, Distribution) for axis in axes)
    if random and draws is None:
        raise ParameterError("runs.draws must be given where an axis is random; got none")
    if draws is not None and not random:
        raise ParameterError(
            f"runs.draws must be of a sweep with a uniform or normal axis; got {draws} without one"
        )
    found = Runs(axes, draws or 1, seed)
    if found.count > _MOST_RUNS:
        raise ParameterError(f"a sweep must have {_MOST_RUNS} runs or fewer; got {found.count}")
    return found
