"""Trajectories in files: written whole or not at all, and read back to the last bit.

A .npz file has the arrays t, q and u, and `about`, what else is known, as JSON. A .parquet file has
the columns below, and `about` among the metadata of its schema. A .csv file begins with `about`, an
entry a line after `# `; the names of the columns follow, and a line for each sample.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import Enum
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from twolink.errors import SceneError, SimulationError
from twolink.files import written_whole
from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact
from twolink.simulation.trajectory import Array, Statistics, Trajectory

COLUMNS = ("t_s", "q1_rad", "q2_rad", "u1_rad_per_s", "u2_rad_per_s")

_COMMENT = "# "


@dataclass(frozen=True)
class About:
    """What a file says of a trajectory beside its `samples`, by the names that `Trajectory` has.

    `scene` is a scene file in TOML, or None where there can be none for the reason `no_scene`.
    """

    title: str
    effects: tuple[str, ...]
    samples: int
    accuracy: float
    error: float
    holds_until: float
    method: str
    formulation: str
    precision: str
    statistics: Statistics
    notes: tuple[str, ...]
    events: tuple[Event, ...]
    impacts: tuple[Impact, ...]
    failure: str
    scene: str | None
    no_scene: str | None


class _Stored(NamedTuple):
    """What is in a file: t of shape (n,), q and u of shape (2, n), and `About` as JSON has it."""

    t: Array
    q: Array
    u: Array
    about: Any


def check_kind(file: Path) -> None:
    """Raise `SimulationError` if trajectories are not kept in files of this kind, or not here."""
    if file.suffix not in _KINDS:
        raise SimulationError(
            f"{file}: the suffix is '{file.suffix}'; allowed are {', '.join(_KINDS)}"
        )
    if file.suffix == ".parquet":
        _pyarrow(file)


def save(trajectory: Trajectory, file: Path) -> None:
    """Write a trajectory to a file, of the kind that its suffix says.

    Raises `SimulationError` for other kinds, and where the file cannot be written; it is then as it
    was before.
    """
    check_kind(file)
    about = json.loads(json.dumps(asdict(_about(trajectory)), default=_in_json))
    stored = _Stored(trajectory.t, trajectory.q, trajectory.u, about)
    write, _ = _KINDS[file.suffix]
    try:
        with written_whole(file) as temporary:
            write(temporary, stored)
    except OSError as error:
        raise SimulationError(
            f"{file}: cannot be written ({error}); allowed is a file in a folder that can be "
            "written to"
        ) from error


def load(file: Path) -> Trajectory:
    """Return the trajectory that `save` wrote to a file; it has no dense output.

    Raises `SimulationError` for any other file, and where the scene could not be written along.
    """
    check_kind(file)
    _, read = _KINDS[file.suffix]
    with _in_one_sentence(file):
        t, q, u, received = read(file)
        about = _checked(received)
        _check_arrays(t, q, u, about.samples)
        return Trajectory(
            scene=_scene(about),
            t=t,
            q=q,
            u=u,
            accuracy=about.accuracy,
            error=about.error,
            holds_until=about.holds_until,
            method=about.method,
            formulation=about.formulation,
            precision=about.precision,
            statistics=about.statistics,
            notes=about.notes,
            events=about.events,
            impacts=about.impacts,
            failure=about.failure,
        )


def _about(trajectory: Trajectory) -> About:
    scene, no_scene = _written(trajectory.scene)
    return About(
        title=trajectory.scene.title,
        effects=trajectory.effects,
        samples=len(trajectory.t),
        accuracy=float(trajectory.accuracy),
        error=trajectory.error,
        holds_until=trajectory.holds_until,
        method=trajectory.method,
        formulation=trajectory.formulation,
        precision=trajectory.precision,
        statistics=trajectory.statistics,
        notes=trajectory.notes,
        events=trajectory.events,
        impacts=trajectory.impacts,
        failure=trajectory.failure,
        scene=scene,
        no_scene=no_scene,
    )


def _written(scene: Scene) -> tuple[str | None, str | None]:
    """Return a scene in TOML, or else why it cannot be written."""
    try:
        return scene.to_toml(), None
    except SceneError as error:
        return None, str(error)


def _scene(about: About) -> Scene:
    """Return the scene that a file tells of."""
    if about.scene is None:
        raise SimulationError(
            f"its scene could not be written along ({about.no_scene}); allowed is a trajectory of "
            "a scene that `Scene.to_toml` can write"
        )
    return Scene.parse(about.scene, source="its scene")


def _in_json(value: Any) -> Any:
    """Return what JSON does not know: a state in words, a NumPy number as Python's."""
    return value.value if isinstance(value, Enum) else value.item()


def _checked(received: Any) -> About:
    """Return what a file says of a trajectory, all of the right type."""
    from pydantic import TypeAdapter, ValidationError

    try:
        return TypeAdapter(About).validate_python(received)
    except ValidationError as error:
        fault = error.errors(include_input=False)[0]
        key = ".".join(str(part) for part in fault["loc"]) or "the trajectory"
        raise SimulationError(
            f"what it says of {key} is wrong ({fault['msg']}); allowed is what `Trajectory.save` "
            "writes"
        ) from error


def _check_arrays(t: Array, q: Array, u: Array, samples: int) -> None:
    """Refuse arrays of another type or shape, and less than was saved."""
    for name, array, rows in (("t", t, ()), ("q", q, (2,)), ("u", u, (2,))):
        if array.dtype != np.float64 or array.ndim == 0 or array.shape[:-1] != rows:
            raise SimulationError(
                f"{name} is of {array.dtype} and shape {array.shape}; allowed is float64 and shape "
                f"{(*rows, samples)}"
            )
        if array.shape[-1] != samples:
            raise SimulationError(
                f"{name} has {array.shape[-1]} samples; allowed are the {samples} that were saved"
            )


@contextmanager
def _in_one_sentence(file: Path) -> Iterator[None]:
    """Raise `SimulationError` for whatever goes wrong in reading a file."""
    try:
        yield
    except (SimulationError, SceneError) as error:
        raise SimulationError(f"{file}: {error}") from error
    except FileNotFoundError as error:
        raise SimulationError(
            f"{file}: there is no file of this name; allowed is the path of a trajectory"
        ) from error
    # A file may hold anything, and for what is damaged the readers raise errors of every kind.
    except Exception as error:
        what = " ".join(str(error).split()).rstrip(".") or type(error).__name__
        raise SimulationError(
            f"{file}: cannot be read ({what}); allowed is a file that `Trajectory.save` wrote"
        ) from error


def _write_npz(file: Path, stored: _Stored) -> None:
    with file.open("wb") as stream:
        np.savez(stream, t=stored.t, q=stored.q, u=stored.u, about=json.dumps(stored.about))


def _read_npz(file: Path) -> _Stored:
    with file.open("rb") as stream:
        archive = np.load(stream, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise SimulationError("it is a single array; allowed is an archive of arrays")
        missing = [name for name in _Stored._fields if name not in archive]
        if missing:
            raise SimulationError(
                f"it has no {' and no '.join(missing)}; allowed are {', '.join(_Stored._fields)}"
            )
        about = json.loads(str(archive["about"]))
        return _Stored(archive["t"], archive["q"], archive["u"], about)


def _write_csv(file: Path, stored: _Stored) -> None:
    import csv

    with file.open("w", newline="", encoding="utf-8") as stream:
        for key, value in stored.about.items():
            stream.write(f"{_COMMENT}{key}: {json.dumps(value)}\n")
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        # As Python's floats: how NumPy's are written can be set.
        columns = stored.t.tolist(), *stored.q.tolist(), *stored.u.tolist()
        writer.writerows(zip(*columns, strict=True))


def _read_csv(file: Path) -> _Stored:
    about = {}
    with file.open(encoding="utf-8") as stream:
        line = stream.readline()
        while line.startswith(_COMMENT):
            key, _, value = line.removeprefix(_COMMENT).partition(": ")
            about[key] = json.loads(value)
            line = stream.readline()
        _check_columns(line.rstrip("\n").split(","))
        body = stream.read()
    # Of a line that was cut off, the last number may have been longer.
    whole = body[: body.rfind("\n") + 1]
    if not whole.strip():
        return _from_columns(np.empty((len(COLUMNS), 0)), about)
    rows = np.loadtxt(StringIO(whole), delimiter=",", comments=None, ndmin=2)
    if rows.shape[1] != len(COLUMNS):
        raise SimulationError(
            f"its lines have {rows.shape[1]} numbers; allowed are {len(COLUMNS)} in each"
        )
    return _from_columns(rows.T, about)


def _write_parquet(file: Path, stored: _Stored) -> None:
    pyarrow = _pyarrow(file)
    columns = [stored.t, *stored.q, *stored.u]
    table = pyarrow.table(dict(zip(COLUMNS, columns, strict=True)))
    table = table.replace_schema_metadata({"about": json.dumps(stored.about)})
    pyarrow.parquet.write_table(table, file, write_page_checksum=True)


def _read_parquet(file: Path) -> _Stored:
    pyarrow = _pyarrow(file)
    with file.open("rb") as stream:
        table = pyarrow.parquet.ParquetFile(stream, page_checksum_verification=True).read()
    _check_columns(table.column_names)
    for column in table.itercolumns():
        if column.type != pyarrow.float64() or column.null_count:
            raise SimulationError(
                f"a column is of {column.type} with {column.null_count} gaps; allowed is float64 "
                "without gaps"
            )
    metadata = table.schema.metadata or {}
    if b"about" not in metadata:
        raise SimulationError("its schema has no metadata `about`; allowed is one with it")
    columns = np.array([column.to_numpy() for column in table.itercolumns()])
    return _from_columns(columns, json.loads(metadata[b"about"]))


def _pyarrow(file: Path) -> Any:
    """Return the package that reads and writes .parquet files, or say how to install it."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise SimulationError(
            f"{file}: pyarrow, which .parquet needs, is not installed; allowed are .npz, .csv, or "
            'pip install "twolink[parquet]"'
        ) from error
    return pyarrow


def _check_columns(names: list[str]) -> None:
    if names != list(COLUMNS):
        raise SimulationError(
            f"its columns are {', '.join(names)}; allowed are {', '.join(COLUMNS)}"
        )


def _from_columns(columns: Array, about: Any) -> _Stored:
    """Return what columns of shape (5, n) hold; their memory lies as in a simulation's arrays."""
    t, q, u = (np.ascontiguousarray(part) for part in (columns[0], columns[1:3], columns[3:]))
    return _Stored(t, q, u, about)


_KINDS: dict[str, tuple[Callable[[Path, _Stored], None], Callable[[Path], _Stored]]] = {
    ".npz": (_write_npz, _read_npz),
    ".csv": (_write_csv, _read_csv),
    ".parquet": (_write_parquet, _read_parquet),
}
