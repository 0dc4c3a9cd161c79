"""A trajectory as text, tables, pictures and data frames."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Any

from twolink import optional
from twolink.errors import TwolinkError
from twolink.scene import Scene
from twolink.simulation.run import Array, Recipe, Statistics
from twolink.tables import Table, table

# A row of the table of a notebook's log: more are not read.
_LOG_LINES = 40


if TYPE_CHECKING:
    from twolink.simulation.hybrid.mode import Event, Impact
    from twolink.simulation.log import LogEntry

    class _Motion:
        """The data of a trajectory that are shown."""

        @property
        def scene(self) -> Scene: ...
        @property
        def t(self) -> Array: ...
        @property
        def q(self) -> Array: ...
        @property
        def u(self) -> Array: ...
        @property
        def theta(self) -> Array | None: ...
        @property
        def omega(self) -> Array | None: ...
        @property
        def energy(self) -> Array: ...
        @property
        def kinetic_energy(self) -> Array: ...
        @property
        def potential_energy(self) -> Array: ...
        @property
        def accuracy(self) -> float: ...
        @property
        def error(self) -> float: ...
        @property
        def method(self) -> str: ...
        @property
        def formulation(self) -> str: ...
        @property
        def precision(self) -> str: ...
        @property
        def recipe(self) -> Recipe | None: ...
        @property
        def effects(self) -> tuple[str, ...]: ...
        @property
        def statistics(self) -> Statistics: ...
        @property
        def events(self) -> tuple[Event, ...]: ...
        @property
        def impacts(self) -> tuple[Impact, ...]: ...
        @property
        def notes(self) -> tuple[str, ...]: ...

else:
    _Motion = object


class Views(_Motion):
    """The representations of a trajectory; `twolink.simulation.trajectory` has its data."""

    @property
    def facts(self) -> dict[str, str]:
        """The simulated motion, its cost and its accuracy, as names and texts."""
        scene, statistics, energy = self.scene, self.statistics, self.energy
        recipe = self.recipe
        corrected = "" if recipe is None or recipe.evaluated_in is None else ", corrected"
        runs = "1 run" if statistics.runs == 1 else f"{statistics.runs} runs"
        found = {
            "simulated": f"{scene.duration:g} s with {', '.join(self.effects) or 'no effects'}",
            "method": f"{self.method} on {self.formulation}, {self.precision}{corrected}",
            "global error": f"{self.error:.1e} measured, {self.accuracy:.1e} allowed",
            "steps": f"{statistics.steps} kept, in {runs}",
            "time": f"{statistics.run_seconds * 1e3:.1f} ms to run, "
            f"{statistics.compile_seconds * 1e3:.0f} ms to compile",
            "energy T + V": f"{energy[0]:.9g} J at the start, {energy[-1]:.9g} J at the end",
        }
        # As many decimals as are correct.
        known = 0 < self.error < math.inf
        decimals = max(0, min(15, int(-math.log10(self.error)))) if known else 6
        pairs = (
            ("q", self.q, "rad"),
            ("u", self.u, "rad/s"),
            ("θ", self.theta, "rad"),
            ("ω", self.omega, "rad/s"),
        )
        for name, pair, unit in pairs:
            if pair is not None:
                one, two = (f"{x + 0.0:.{decimals}f}" for x in pair[:, -1])
                found[f"{name} at the end"] = f"{one}, {two} {unit}"
        return found

    @property
    def log(self) -> tuple[LogEntry, ...]:
        """The modes and impacts in order of time; sequences of bounces are one entry."""
        if not (self.impacts or self.events):
            return ()
        from twolink.simulation.log import log_of

        return log_of(self.scene, self.impacts, self.events)

    def summary(self) -> Table:
        """Return the facts as a table."""
        return table(self.scene.title, ("", ""), self.facts.items())

    def __repr__(self) -> str:
        """Return the facts and the notes as lines of text."""
        facts = self.facts
        widest = max(map(len, facts))
        lines = [f"  {name:<{widest}}  {text}" for name, text in facts.items()]
        lines += [f"  {note}" for note in self.notes]
        count = f"{len(self.t)} samples, {len(self.events)} events, {len(self.impacts)} impacts"
        return "\n".join([f"<Trajectory of '{self.scene.title}': {count}", *lines]) + ">"

    def _repr_html_(self) -> str:
        """Return the player of the film, the facts and the log, for notebooks."""
        try:
            player = optional.display().player(self)
        except TwolinkError as error:
            # A motion that cannot be filmed still has its facts.
            player = f"<p>{html.escape(str(error))}</p>"
        log = table(
            "Modes and impacts",
            ("t (s)", ""),
            ((f"{entry.time:.9g}", entry.words) for entry in self.log[:_LOG_LINES]),
        )
        notes = "".join(f"<p>{html.escape(note)}</p>" for note in self.notes)
        return "\n".join([player, self.summary().html(), log.html() if log.rows else "", notes])

    def show(self) -> None:
        """Show the film: in a notebook's cell, or else in the browser as a page.

        Raises `PictureError` if its samples are too far apart.
        """
        optional.display().show(self)

    def record(self, path: str | PathLike[str], **options: Any) -> None:
        """Record the film to a .mp4, .webm, .gif, .png or .html file.

        `options` are those of `twolink.viz.display.record`, such as `at`, `size`, `fps`, `speed`
        and `theme`. Raises `PictureError` for options out of range.
        """
        optional.display().record(self, path, **options)

    def plot(self, kind: str = "angles", *others: Any, **options: Any) -> Any:
        """Return a plot of this motion, and of `others` with it, as a matplotlib figure.

        `kind` is "angles", "phase", "path", "energy", "contact", "reactions" or "difference";
        `options` are those of `twolink.viz.display.plot`. Raises `PictureError` for an unknown
        kind.
        """
        return optional.display().plot(kind, (self, *others), **options)

    def columns(self) -> Mapping[str, Array]:
        """Return the samples and energies as columns of shape (n,), named with their units."""
        found = {"t_s": self.t}
        for name, pair, unit in (
            ("q", self.q, "rad"),
            ("u", self.u, "rad_per_s"),
            ("theta", self.theta, "rad"),
            ("omega", self.omega, "rad_per_s"),
        ):
            if pair is not None:
                found |= {f"{name}{link}_{unit}": pair[link - 1] for link in (1, 2)}
        return found | {"T_J": self.kinetic_energy, "V_J": self.potential_energy}

    def to_pandas(self) -> Any:
        """Return the columns as a pandas DataFrame with the time as its index.

        Raises `SimulationError` if pandas is not installed.
        """
        frame = optional.pandas().DataFrame(dict(self.columns())).set_index("t_s")
        frame.attrs.update(self.facts)
        return frame

    def to_xarray(self) -> Any:
        """Return the samples as an xarray Dataset with the dimensions `t` and `link`.

        Raises `SimulationError` if xarray is not installed.
        """
        xarray = optional.xarray()
        pairs = {
            "q": (self.q, "rad"),
            "u": (self.u, "rad/s"),
            "theta": (self.theta, "rad"),
            "omega": (self.omega, "rad/s"),
        }
        variables = {
            name: (("link", "t"), pair, {"units": unit})
            for name, (pair, unit) in pairs.items()
            if pair is not None
        }
        energies = {"T": self.kinetic_energy, "V": self.potential_energy}
        return xarray.Dataset(
            {**variables, **{name: ("t", e, {"units": "J"}) for name, e in energies.items()}},
            coords={"t": ("t", self.t, {"units": "s"}), "link": [1, 2]},
            attrs={"title": self.scene.title, **self.facts},
        )
