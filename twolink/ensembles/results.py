"""The results of a sweep: arrays with units, read from their store."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from twolink.ensembles.axes import FixedValues
from twolink.ensembles.file import axes_of
from twolink.ensembles.store import attributes, group_of
from twolink.inputs import as_choice, as_path
from twolink.optional import xarray
from twolink.tables import Table, table

# Reasons that a summary lists.
_MOST_REASONS = 5

# Runs of which only first times are kept are as accurate as those require.
_OF_TIMES = "as first times require, each of which has its own bound"


@dataclass(frozen=True)
class Results:
    """The results of a sweep in a folder, which may be written to still."""

    path: Path

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Results:
        """Return the results in a folder. Raises `FileError` where there are none."""
        folder = as_path("path", path)
        attributes(folder)
        return cls(folder)

    @property
    def attributes(self) -> dict[str, Any]:
        """The sweep, its axes and shape, and the versions and the machine that made it."""
        return attributes(self.path)

    def array(self, name: str) -> Any:
        """Return an array by its name, with an entry for each run: shape (runs, …).

        Raises `ParameterError` for the name of no array, and `FileError` where there are no
        results.
        """
        group = group_of(self.path)
        return group[as_choice("the name of an array", name, sorted(group.array_keys()))][:]

    @property
    def runs_done(self) -> Any:
        """Whether each run is written, shape (runs,)."""
        chunk, count = int(self.attributes["chunk"]), int(np.prod(self.attributes["shape"]))
        return np.repeat(self.array("done"), chunk)[:count]

    def dataset(self) -> Any:
        """Return an xarray dataset, read lazily, with the runs along one dimension `run`."""
        names = self.attributes["axes"]
        found = xarray().open_zarr(self.path, consolidated=False, chunks=None)
        return found.drop_vars("done").set_coords(names)

    def grid(self) -> Any:
        """Return an xarray dataset with a dimension for each fixed axis, and `draw` for draws.

        Random axes are variables along `draw`.
        """
        about, flat = self.attributes, self.dataset().reset_coords()
        axes = axes_of(about["sweep"])
        fixed = {
            axis.name: (axis.name, axis.values.numbers, flat[axis.name].attrs)
            for axis in axes
            if isinstance(axis.values, FixedValues)
        }
        names = [*fixed, "draw"]
        shape = tuple(about["shape"])
        found = {}
        for name, variable in flat.data_vars.items():
            if name in names:
                continue
            values = variable.values.reshape(*shape, *variable.shape[1:])
            found[name] = ((*names, *variable.dims[1:]), values, variable.attrs)
        made = xarray().Dataset(found, fixed, about)
        return made.isel(draw=0) if shape[-1] == 1 else made

    @property
    def accuracy(self) -> float:
        """The accuracy that was asked for (rad, rad/s)."""
        return float(self.attributes["sweep"]["scene"]["run"]["accuracy"])

    @property
    def missed(self) -> int:
        """How many runs that are done and did not fail have a larger error than that."""
        kept = self.runs_done & (self.array("reason") == "")
        return int((~(self.array("error")[kept] <= self.accuracy)).sum())

    def summary(self) -> Table:
        """Return a table of the runs: how many, their errors and verdicts, and why some failed."""
        done = self.runs_done
        reasons = self.array("reason")[done]
        failed = reasons != ""
        errors = self.array("error")[done][~failed]
        rows: list[tuple[str, str]] = [("runs", f"{int(done.sum())} of {len(done)}")]
        if failed.any():
            rows.append(("failed", str(int(failed.sum()))))
        if len(errors):
            median, unknown = float(np.median(errors)), int(np.isinf(errors).sum())
            words = f"{median:.1e} median, measured" if np.isfinite(median) else "measured"
            lost = f"; too large to be known at the end of {unknown} runs" if unknown else ""
            rows.append(("global error", f"{words}{lost}"))
            asked = f"{self.accuracy:.1e} met by {len(errors) - self.missed} of {len(errors)}"
            rows.append(("accuracy", asked if self.keeps_states else _OF_TIMES))
        rows += [*self._verdicts(done), *self._notes(done)]
        common = Counter(reasons[failed].tolist()).most_common(_MOST_REASONS)
        rows += [(f"{count} failed", str(reason)) for reason, count in common]
        return table(str(self.attributes["title"]), ("", ""), rows)

    def _notes(self, done: Any) -> list[tuple[str, str]]:
        """Return the number of runs with notes, and the first; and the notes on all of them."""
        about = self.attributes
        found = [("note", note) for note in about.get("notes", ())]
        if "notes" not in about:
            # Results of an older version.
            return found
        own = [str(text) for text in self.array("notes")[done] if text]
        if own:
            first, *_ = own[0].splitlines()
            found.append(("notes", f"{len(own)} of the runs; the first: {first}"))
        return found

    @property
    def keeps_states(self) -> bool:
        """Whether values are kept that an error of the state changes."""
        keep = self.attributes["sweep"]["keep"]
        return not keep["first"] or any(keep[key] for key in keep if key != "first")

    def _verdicts(self, done: Any) -> list[tuple[str, str]]:
        """Return the counts of each verdict."""
        group = group_of(self.path)
        found = []
        for name in sorted(group.array_keys()):
            if not name.endswith("_verdict"):
                continue
            words = group[name].attrs["flag_meanings"].split()
            counts = np.bincount(group[name][:][done], minlength=len(words))
            text = ", ".join(f"{n} {word}" for n, word in zip(counts, words, strict=True))
            found.append((name.removesuffix("_verdict"), text))
        return found
