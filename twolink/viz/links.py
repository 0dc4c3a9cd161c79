"""The chain in a film: the links of each run with their joints, and the trail of D."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twolink.viz.commands import ROOT, flat_mesh, in_the_plane, transform, visible
from twolink.viz.run import Moments, Run
from twolink.viz.shapes import Shape, bar, disc, ribbon, ring
from twolink.viz.surfaces import stops_of_elbow
from twolink.viz.themes import Theme

# Widths relative to the length that scales them.
_BAR, _GHOST_BAR, _TRAIL, _GHOST_TRAIL = 0.042, 0.026, 0.03, 0.018

# Duration of D's trail on the screen (s).
TRAIL_SECONDS = 1.0

# Points of a trail are rounded to this part of the length: invisible, and films stay small.
_FINE = 2.0**-14

_TRAIL_ORDER, _GHOST_ORDER, _LINK_ORDER = 20, 30, 40


@dataclass(frozen=True)
class Pen:
    """How the run of a number is drawn: 0 in full, others as ghosts; `length` (m) scales widths."""

    number: int
    length: float
    theme: Theme

    @property
    def width(self) -> float:
        """The width of a bar (m)."""
        return (_GHOST_BAR if self.number else _BAR) * self.length

    def links(self, run: Run, hatch: float, *, behind: bool) -> list[bytes]:
        """Return the commands that draw a run's links in their frames, with joints and D.

        `hatch` is the length (m) of the hatching of stops; `behind` says that the bodies of a URDF
        are seen behind the links.
        """
        if self.number:
            return self._ghost(run)
        theme, path, width = self.theme, f"{ROOT}/run0", self.width
        found = []
        for link, below in ((1, 0), (2, 4)):
            order, place = _LINK_ORDER + below, f"{path}/link{link}"
            shape = bar(float(run.chain.length[link - 1]), 0.4 * width if behind else width)
            rim = ring((0, 0), 0.26 * width, 0.36 * width)
            found += [
                flat_mesh(f"{place}/bar", shape, theme.links[link - 1], order=order),
                flat_mesh(f"{place}/pin", disc((0, 0), 0.3 * width), theme.pin, order=order + 6),
                flat_mesh(f"{place}/rim", rim, theme.ink, order=order + 7),
            ]
        found += stops_of_elbow(run, hatch, theme, f"{path}/link1/stops")
        end = disc((float(run.chain.L2), 0), 0.62 * width)
        return [*found, flat_mesh(f"{path}/link2/end", end, theme.end, order=_LINK_ORDER + 14)]

    def _ghost(self, run: Run) -> list[bytes]:
        """Return the commands that draw the links of a ghost."""
        path, width, colour = f"{ROOT}/run{self.number}", self.width, self.theme.ghost(self.number)
        L1, L2 = (float(length) for length in run.chain.length)
        order = _GHOST_ORDER - self.number
        return [
            flat_mesh(f"{path}/link1/bar", bar(L1, width), colour, order=order, opacity=0.55),
            flat_mesh(f"{path}/link2/bar", bar(L2, width), colour, order=order, opacity=0.55),
            flat_mesh(f"{path}/link2/end", disc((L2, 0), 0.8 * width), colour, order=order),
        ]

    def trail(self, now: Moments, moments: Moments, speed: float) -> bytes:
        """Return the trail of D during the last moments, tapered and fading."""
        path = f"{ROOT}/trail{self.number}"
        time = float(now.times[0])
        seconds = TRAIL_SECONDS * speed
        past = moments.between(time - seconds, time)
        times = np.concatenate([past.times, now.times])
        if len(times) < 2:
            return visible(f"{path}/<object>", False)
        age = (time - times) / seconds
        width = (_GHOST_TRAIL if self.number else _TRAIL) * self.length
        shape = ribbon(np.concatenate([past.end, now.end]), width * (1 - age))
        fine = _FINE * self.length
        opacity = np.round(0.75 * (1 - age), 3)
        return flat_mesh(
            path,
            Shape(np.round(shape.corners / fine) * fine, shape.faces),
            self.theme.ghost(self.number) if self.number else self.theme.end,
            order=_TRAIL_ORDER - self.number,
            opacities=np.concatenate([opacity, opacity]),
        )


def poses(number: int, now: Moments) -> list[bytes]:
    """Return the commands that set the poses of the links of the run of a number."""
    q1, q2 = float(now.q[0, 0]), float(now.q[1, 0])
    path = f"{ROOT}/run{number}"
    return [
        transform(f"{path}/link1", in_the_plane((0.0, 0.0), q1)),
        transform(f"{path}/link2", in_the_plane(now.point("B")[0], q2)),
    ]
