"""The plots of a motion by the names of their kinds."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from twolink.errors import PictureError
from twolink.inputs import as_word
from twolink.simulation import Trajectory
from twolink.text import choice
from twolink.viz.plots.angles import angles
from twolink.viz.plots.contact import contact
from twolink.viz.plots.curves import Others
from twolink.viz.plots.difference import difference
from twolink.viz.plots.energy import energy
from twolink.viz.plots.path import path
from twolink.viz.plots.phase import phase
from twolink.viz.plots.reactions import reactions

OF_ONE: Mapping[str, Callable[[Trajectory, str], Figure]] = {"contact": contact}
"""Plots of one motion: from a trajectory and the name of a theme."""

OF_SEVERAL: Mapping[str, Callable[[Trajectory, str, Others], Figure]] = {
    "angles": angles,
    "phase": phase,
    "path": path,
    "energy": energy,
    "reactions": reactions,
    "difference": difference,
}
"""Plots of one motion or several: they take further trajectories by name, too."""

KINDS = (*OF_SEVERAL, *OF_ONE)


def plot_of(kind: str, trajectory: Trajectory, theme: str, others: Others) -> Figure:
    """Return a plot of a kind. Raises `PictureError` for an unknown kind."""
    if as_word("kind", kind) in OF_SEVERAL:
        return OF_SEVERAL[kind](trajectory, theme, others)
    if kind not in OF_ONE:
        raise PictureError(choice("kind", kind, KINDS))
    if others:
        raise PictureError(f"a plot of {kind} must be that of 1 motion; got {len(others) + 1}")
    return OF_ONE[kind](trajectory, theme)
