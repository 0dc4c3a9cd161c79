"""Results in a Zarr 3 store: an array for each variable, in shards of one chunk of runs each.

Workers write whole shards, of which each belongs to one chunk, so that they need no locks. The
array `done` has an entry, in a file of its own, for each chunk; it is set when all other arrays of
the chunk are written. A store is made whole or not at all, and each file is replaced at once.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twolink.ensembles.chunk import Rows
from twolink.ensembles.ensemble import TEXTS, Ensemble
from twolink.ensembles.parameters import unit_of
from twolink.ensembles.quantity import Variable
from twolink.environment import package_versions, this_machine
from twolink.errors import FileError, ParameterError, SimulationError
from twolink.files import locked, scratch_folder
from twolink.limits import Limits
from twolink.optional import zarr
from twolink.text import one_line

# Results of the older format have no notes, and cannot be continued.
_FORMAT, _OLDER = "twolink sweep 2", "twolink sweep 1"

# The parts of a shard that can be read alone.
_PARTS = 4

# Packages whose versions may change bits.
_PACKAGES = ("heyoka", "numpy", "scipy")


@dataclass(frozen=True)
class Store:
    """The results of an ensemble in a folder, in chunks of so many runs."""

    path: Path
    count: int
    chunk: int

    @property
    def chunks(self) -> int:
        """The number of chunks."""
        return -(-self.count // self.chunk)

    def runs(self, number: int) -> tuple[int, int]:
        """Return the first run of a chunk, and the one after its last."""
        return number * self.chunk, min((number + 1) * self.chunk, self.count)

    def done(self) -> Any:
        """Return which chunks are written, shape (chunks,)."""
        with _in_one_sentence(self.path):
            return zarr().open_group(self.path, mode="r")["done"][:]

    def reopened(self, limits: Limits) -> Any:
        """Return which chunks are written, shape (chunks,), without those to be made again.

        Those are the ones with runs that a smaller limit of work ended, or kept from the accuracy.
        """
        with _in_one_sentence(self.path):
            group = zarr().open_group(self.path, mode="r+")
            done = group["done"][:]
            limited = np.zeros(self.chunks * self.chunk, bool)
            limited[: self.count] = group["limit"][:] < limits.seconds
            again = done & limited.reshape(self.chunks, self.chunk).any(axis=1)
            for number in np.flatnonzero(again):
                group["done"][number] = False
            return done & ~again

    def write(self, number: int, rows: Rows) -> None:
        """Write the results of a chunk. Raises `FileError` where they cannot be written."""
        first, last = self.runs(number)
        with _in_one_sentence(self.path):
            group = zarr().open_group(self.path, mode="r+")
            for name, values in rows.arrays.items():
                group[name][first:last] = values
            for name, texts in rows.texts.items():
                group[name][first:last] = np.array(texts, dtype=object)
            # Zarr makes folders that are missing: the store must still be there.
            (self.path / "zarr.json").stat()
            group["done"][number] = True


def created(path: Path, ensemble: Ensemble, chunk: int) -> Store:
    """Return a new store, without results. Raises `FileError` where it cannot be made."""
    count = ensemble.runs.count
    parent = str(path.absolute().parent)
    with _in_one_sentence(path, new=True), scratch_folder("sweep", parent) as folder:
        made = folder / "store"
        group = zarr().create_group(made, zarr_format=3, attributes=_attributes(ensemble, chunk))
        for axis in ensemble.runs.axes:
            variable = Variable(axis.name, axis.parameter, unit_of(axis.parameter))
            _add(group, variable, count, chunk)
        for variable in ensemble.variables:
            _add(group, variable, count, chunk)
        for name, words in TEXTS.items():
            _add_array(group, name, (count,), ("run",), chunk, str, "", {"long_name": words})
        chunks = -(-count // chunk)
        group.create_array(
            "done", shape=(chunks,), chunks=(1,), dtype=bool, fill_value=False,
            dimension_names=("chunk",), attributes={"long_name": "chunks of runs written"},
        )  # fmt: skip
        os.rename(made, path)
    return Store(path, count, chunk)


def opened(path: Path, ensemble: Ensemble) -> Store:
    """Return the store of an ensemble that has been begun.

    Raises `ParameterError` for the store of another one, and `FileError` for anything else, and for
    results of other versions, whose bits may differ.
    """
    about = attributes(path)
    if about.get("fingerprint") != ensemble.fingerprint:
        raise ParameterError(
            f"{one_line(path, 300)}: must be the result of this sweep, or not exist; got that of"
            f" another: {one_line(about.get('title', 'untitled'), 100)}"
        )
    if about["format"] != _FORMAT:
        raise FileError(
            f"{one_line(path, 300)}: must be of this version of twolink to be continued; got the"
            " result of an older one, which has no notes"
        )
    own = package_versions(*_PACKAGES)
    other = {k: v for k, v in about["versions"].items() if own.get(k) != v and k != "python"}
    if other:
        name, version = next(iter(other.items()))
        raise FileError(
            f"{one_line(path, 300)}: must be continued with {name} {version}, whose bits it has;"
            f" got {name} {own.get(name)}"
        )
    return Store(path, ensemble.runs.count, int(about["chunk"]))


def attributes(path: Path) -> dict[str, Any]:
    """Return the attributes of a result. Raises `FileError` for any other folder or file."""
    return dict(group_of(path).attrs)


def group_of(path: Path) -> Any:
    """Return the Zarr group of a result, to be read.

    Raises `FileError` for any other folder or file.
    """
    with _in_one_sentence(path):
        try:
            found = zarr().open_group(path, mode="r")
            about = found.attrs.get("format")
        except (ValueError, KeyError, TypeError) as error:
            raise FileError(f"{one_line(path, 300)}: {_NOT_A_RESULT}") from error
    if about not in (_FORMAT, _OLDER):
        raise FileError(f"{one_line(path, 300)}: {_NOT_A_RESULT}")
    return found


_NOT_A_RESULT = "must be the result of a sweep; got another folder or file"


@contextmanager
def in_use(path: Path) -> Iterator[None]:
    """Lock a store against other sweeps. Raises `FileError` if another sweep has locked it.

    Temporary files that killed workers have left in it are removed.
    """
    with _in_one_sentence(path):
        handle = os.open(path / "zarr.json", os.O_RDONLY)
        try:
            if not locked(handle):
                raise FileError(
                    f"{one_line(path, 300)}: must not be in use; got one to which another sweep"
                    " writes"
                )
            for left in path.rglob("*.partial"):
                left.unlink(missing_ok=True)
            yield
        finally:
            os.close(handle)


def _attributes(ensemble: Ensemble, chunk: int) -> dict[str, Any]:
    return {
        "format": _FORMAT,
        "Conventions": "CF-1.11",
        "title": ensemble.title,
        "fingerprint": ensemble.fingerprint,
        "sweep": ensemble.document,
        # A URDF need not be there any more when results are read.
        "lengths": list(ensemble.family.lengths),
        "notes": list(ensemble.notes),
        "axes": [axis.name for axis in ensemble.runs.axes],
        "shape": list(ensemble.runs.shape),
        "chunk": chunk,
        "versions": package_versions(*_PACKAGES),
        "machine": this_machine(),
    }


def _add(group: Any, variable: Variable, count: int, chunk: int) -> None:
    """Add the array of a variable."""
    about: dict[str, Any] = {"long_name": variable.words}
    if variable.units:
        about["units"] = variable.units
    if variable.flags:
        about |= {
            "flag_values": list(range(len(variable.flags))),
            "flag_meanings": " ".join(word.replace(" ", "_") for word in variable.flags),
        }
    names, sizes = zip(*variable.dimensions, strict=True) if variable.dimensions else ((), ())
    shape = (count, *sizes)
    _add_array(
        group, variable.name, shape, ("run", *names), chunk, variable.dtype, variable.fill, about
    )


def _add_array(
    group: Any,
    name: str,
    shape: tuple[int, ...],
    dimensions: tuple[str, ...],
    chunk: int,
    dtype: Any,
    fill: Any,
    about: dict[str, Any],
) -> None:
    """Add an array whose shards are chunks of runs."""
    part = chunk // _PARTS if chunk % _PARTS == 0 else chunk
    group.create_array(
        name,
        shape=shape,
        chunks=(part, *shape[1:]),
        shards=(chunk, *shape[1:]),
        dtype=dtype,
        fill_value=fill,
        dimension_names=dimensions,
        attributes=about,
    )


@contextmanager
def _in_one_sentence(path: Path, *, new: bool = False) -> Iterator[None]:
    """Raise `FileError` for each refusal of the file system."""
    try:
        yield
    except SimulationError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        if isinstance(error, FileNotFoundError) and not new:
            reason = "there is no result of a sweep"
        done = "made" if new else "read or written"
        raise FileError(f"{one_line(path, 300)}: cannot be {done} ({reason})") from error
