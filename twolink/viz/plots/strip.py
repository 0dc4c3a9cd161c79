"""A motion as a strip of stills: for print, and where no film can be shown."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from twolink import kinematics
from twolink.effects.compliant_surface import CompliantSurface
from twolink.effects.surface import Surface
from twolink.simulation import Trajectory
from twolink.viz.plots.moments import time_limits
from twolink.viz.plots.path import View, draw_chain, draw_surface, path_moments
from twolink.viz.plots.style import figure, palette_of

_STILLS = 5
_WIDTH = 9.0


def strip(trajectory: Trajectory, theme: str = "light") -> Figure:
    """Return the chain at five times, each with the path of D up to then."""
    palette = palette_of(theme)
    shown, chain = path_moments(trajectory), trajectory.chain
    D = np.array(kinematics.position(chain, tuple(shown.q), chain.D))
    B = np.array(kinematics.position(chain, tuple(shown.q), chain.B))
    view = View.around(np.column_stack([D, B, [0.0, 0.0]]))
    share = (view.bottom - view.top) / (view.right - view.left)
    made, axes = figure(
        palette, columns=_STILLS, size=(_WIDTH, _WIDTH / _STILLS * share + 0.45), sharey=True
    )
    _, end = time_limits(trajectory)
    times = np.linspace(float(trajectory.t[0]), min(end, float(trajectory.t[-1])), _STILLS)
    for each, time in zip(axes, times, strict=True):
        each.set_aspect("equal")
        each.set_axis_off()
        each.set_xlim(view.left, view.right)
        each.set_ylim(view.bottom, view.top)
        index = int(np.searchsorted(shown.t, time).clip(0, len(shown.t) - 1))
        for effect in trajectory.scene.effects:
            if isinstance(effect, Surface | CompliantSurface):
                draw_surface(each, palette, view, effect, named=False)
        path = D[:, : index + 1]
        each.plot(*path, color=palette.lines[2], linewidth=0.9, label="_path")
        draw_chain(each, palette, trajectory, shown.q[:, index], 1.0, width=3)
        each.set_title(f"t = {shown.t[index]:.3g} s", color=palette.ink, fontsize=9)
    return made
