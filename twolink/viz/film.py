"""Films: motions as frames of commands for meshcat's viewer at exact times.

A film has set-up commands and frames. A frame is self-contained: its commands do not depend on
previous frames, so that a film can be searched, recorded and streamed.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from twolink.errors import PictureError
from twolink.text import distinct, distinct_names, printable
from twolink.times import merged
from twolink.viz.commands import (
    background,
    background_parts,
    frontal_camera,
    visible,
)
from twolink.viz.contacts import contact_marks, contact_setup, joint_labels, mode_at
from twolink.viz.framing import Box, Framing, box_of, grid_spacing
from twolink.viz.grid import grid
from twolink.viz.impacts import Impacts
from twolink.viz.labels import Label, Mark
from twolink.viz.links import Pen, poses
from twolink.viz.run import Moments, Run
from twolink.viz.shapes import Array
from twolink.viz.surfaces import (
    elbow_marks,
    surface_marks,
    surface_names,
    surfaces,
)
from twolink.viz.themes import LIGHT, Theme


@dataclass(frozen=True)
class Frame:
    """A moment of a film: time (s), commands of meshcat's viewer, and texts for the page."""

    time: float
    commands: tuple[bytes, ...]
    words: dict[str, Any]


def check_rates(fps: float, speed: float) -> None:
    """Raise `PictureError` for frames per second or a speed out of range."""
    for name, value, least, most in (("fps", fps, 0.01, 240.0), ("speed", speed, 1e-6, 1e6)):
        if not least <= value <= most:
            raise PictureError(f"{name} must be {least:g} to {most:g}; got {value!r}")


@dataclass(frozen=True)
class Film:
    """Runs of a chain as frames: the first in full, the others as ghosts.

    The film is as long as the shortest run; frame k is at k · `speed` / `fps` seconds of the
    motion. `bodies` are commands that attach a URDF's geometry to the first run. A film for a
    `still` has a frame at exactly this time (s), too. Raises `PictureError` for invalid rates, and
    for a still outside of the motion.
    """

    runs: tuple[Run, ...]
    fps: float = 30.0
    speed: float = 1.0
    theme: Theme = LIGHT
    title: str = ""
    bodies: tuple[bytes, ...] = field(default=(), repr=False)
    still: float | None = None

    def __post_init__(self) -> None:
        """Raise `PictureError` for films without runs and rates out of range."""
        if not self.runs:
            raise PictureError("a film must have at least one run; got none")
        check_rates(self.fps, self.speed)
        if self.still is not None and not self.start <= self.still <= self.start + self.duration:
            start, end, still = map(distinct, (self.start, self.start + self.duration, self.still))
            raise PictureError(f"at must be {start} to {end} s; got {still} s")

    @property
    def duration(self) -> float:
        """The duration of the shown motion (s)."""
        return min(run.duration for run in self.runs)

    @property
    def start(self) -> float:
        """The time of the first frame (s)."""
        return float(self.runs[0].trajectory.t[0])

    @cached_property
    def times(self) -> Array:
        """The times of all frames (s)."""
        count = int(np.floor(self.duration * self.fps / self.speed + 1e-9)) + 1
        grid = self.start + np.minimum(np.arange(count) * self.speed / self.fps, self.duration)
        return grid if self.still is None else merged(grid, [self.still])

    @cached_property
    def moments(self) -> tuple[Moments, ...]:
        """Each run at the times of frames and some in between."""
        return tuple(run.moments(self.times, self.fps) for run in self.runs)

    @property
    def reach(self) -> float:
        """The largest possible distance of D from A in the first run (m)."""
        return self.runs[0].reach

    @cached_property
    def box(self) -> Box:
        """The part of the plane that contains all runs."""
        points = [moments.point(name) for moments in self.moments for name in ("A", "B", "D")]
        return box_of(np.concatenate(points), self.reach)

    @property
    def names(self) -> tuple[str, ...]:
        """The names of runs if there are several, all different."""
        if len(self.runs) == 1:
            return ()
        return tuple(distinct_names(printable(run.name) for run in self.runs))

    def framing(self, width: int, height: int) -> Framing:
        """Return the mapping of the film's points to a window of this size (pixels)."""
        return Framing(self.box, width, height, rows=len(self.names))

    @cached_property
    def setup(self) -> tuple[bytes, ...]:
        """The set-up commands before any frame."""
        first = self.runs[0]
        found = [
            *background(self.theme.background),
            visible("/Grid", False),
            visible("/Axes", False),
            *frontal_camera(50 * self.reach),
            *grid(self.box, self.theme),
            *surfaces(first, self.box, self._hatch, self.theme),
        ]
        for number, run in enumerate(self.runs):
            found += self._pen(number).links(run, self._hatch, behind=bool(self.bodies))
        return (*found, *contact_setup(first, self._width / 2, self.theme), *self.bodies)

    @cached_property
    def about(self) -> dict[str, Any]:
        """Data for the page besides the commands; angles in rad, lengths in m."""
        now = self.moments[0]
        total = now.kinetic_energy + now.potential_energy
        lowest = self._lowest
        most = float(total.max()) - lowest
        least = float(total.min()) - lowest
        # Missing energy was dissipated if the energy never exceeded its initial value.
        loses = total[0] - lowest >= (1 - 1e-9) * most and most - least > 1e-6 * most
        return {
            "title": printable(self.title or self.runs[0].trajectory.scene.title),
            "fps": self.fps,
            "speed": self.speed,
            "start": self.start,
            "duration": self.duration,
            "count": len(self.times),
            "box": [self.box.left, self.box.right, self.box.top, self.box.bottom],
            "framing": Framing.rule(),
            "grid": f"grid {metres(grid_spacing(self.box))}",
            "reach": self.reach,
            **({} if self.still is None else {"still": self.still}),
            "names": list(self.names),
            "notes": self.notes,
            "energy": {"most": most, "loses": bool(loses)},
            "surfaces": surface_names(self.runs[0], self.box),
            "marks": _fine_marks(surface_marks(self.runs[0], self.box, self._hatch)),
            "hatch": self._hatch,
            "width": self._width,
            **self.colours,
        }

    @property
    def notes(self) -> list[str]:
        """The notes on all runs, each once."""
        every = (note for run in self.runs for note in run.trajectory.notes)
        return list(dict.fromkeys(map(printable, every)))

    @property
    def colours(self) -> dict[str, Any]:
        """The colours of the theme for the page."""
        theme = self.theme
        ghosts = (theme.ghost(k) for k in range(1, len(self.runs)))
        return {
            "theme": asdict(theme),
            "background": background_parts(theme.background),
            "swatches": [theme.end, *ghosts],
        }

    def frame(self, number: int) -> Frame:
        """Return a frame by number, from 0."""
        return self.at(float(self.times[number]))

    def at(self, time: float) -> Frame:
        """Return the frame at a time (s) within the film."""
        now = [moments.at(time) for moments in self.moments]
        commands: list[bytes] = []
        for number, (moment, moments) in enumerate(zip(now, self.moments, strict=True)):
            commands += poses(number, moment)
            commands.append(self._pen(number).trail(moment, moments, self.speed))
        contacts = contact_marks(now[0], self.speed, self._width / 2)
        impacts = self._impacts.marks(now[0], self.speed, self._width / 2, self.theme)
        labels = [*joint_labels(now[0]).values(), *contacts.labels, *impacts.labels]
        stops = elbow_marks(self.runs[0], self._hatch, now[0].point("B")[0], float(now[0].q[0, 0]))
        words = {
            "t": round(time, 9),
            "T": float(f"{now[0].kinetic_energy[0]:.6g}"),
            "V": float(f"{now[0].potential_energy[0] - self._lowest:.6g}"),
            "mode": str(mode_at(self.runs[0], time) or ""),
            "labels": [_rounded(label) for label in labels],
            "marks": _fine_marks([*contacts.marks, *impacts.marks, *stops]),
            "apart": [_apart(now[0], ghost) for ghost in now[1:]],
        }
        return Frame(time, (*commands, *contacts.commands, *impacts.commands), words)

    @cached_property
    def _lowest(self) -> float:
        """The least V of the first run (J), above which V is shown, whatever frames there are."""
        run, end = self.runs[0], self.start + self.duration
        count = int(np.searchsorted(run.trajectory.t, end, side="right"))
        sampled = run.trajectory.q[:, :count], run.trajectory.u[:, :count]
        samples = Moments(run, run.trajectory.t[:count], *sampled)
        both = samples.potential_energy.min(), self.moments[0].potential_energy.min()
        return float(min(both))

    @cached_property
    def _impacts(self) -> Impacts:
        return Impacts(self.runs[0], self._length)

    @property
    def _length(self) -> float:
        """The length (m) that scales widths, smaller for a small part of the plane."""
        return min(self.reach, 0.75 * self.box.size)

    @property
    def _width(self) -> float:
        """The width of a bar (m)."""
        return self._pen(0).width

    def _pen(self, number: int) -> Pen:
        return Pen(number, self._length, self.theme)

    @property
    def _hatch(self) -> float:
        return 0.045 * self.box.size


def _apart(now: Moments, ghost: Moments) -> str:
    """Return the distance of a ghost's D from that of the first run, in words."""
    distance = float(np.hypot(*(ghost.end - now.end)[0]))
    time = float(now.times[0])
    known = now.run.resolution(time) + ghost.run.resolution(time)
    if distance < known:
        return f"D is within {metres(known)} (limited by the ghost's sampling)"
    return f"D is {metres(distance)} away"


def metres(distance: float) -> str:
    """Return a distance (m) as text, to two digits."""
    if distance == 0 or 1e-3 <= distance < 1e3:
        return f"{float(f'{distance:.2g}'):g} m"
    digits, power = f"{distance:.1e}".split("e")
    raised = str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{digits} · 10{raised} m"


def _fine_marks(marks: list[Mark]) -> list[Mark]:
    """Return marks with numbers rounded below the resolution of a screen."""
    return [[float(f"{number:.4g}") for number in mark] for mark in marks]


def _rounded(label: Label) -> Label:
    """Return a label with coordinates rounded below the resolution of a screen."""
    text, x, y, dx, dy, *rest = label
    return [text, float(f"{x:.5g}"), float(f"{y:.5g}"), round(dx, 2), round(dy, 2), *rest]
