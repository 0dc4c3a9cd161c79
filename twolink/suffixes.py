"""The suffixes of files that are written, in one place; cheap to import.

`twolink.simulation.formats` has the format of each trajectory file.
"""

from __future__ import annotations

from typing import Literal, get_args

TrajectorySuffix = Literal[".npz", ".csv", ".parquet"]
TRAJECTORIES: tuple[TrajectorySuffix, ...] = get_args(TrajectorySuffix)

PlotSuffix = Literal[".svg", ".png", ".pdf"]
PLOTS: tuple[PlotSuffix, ...] = get_args(PlotSuffix)

FilmSuffix = Literal[".mp4", ".webm", ".gif"]
FILMS: tuple[FilmSuffix, ...] = get_args(FilmSuffix)

RECORDINGS = (*FILMS, ".png", ".html")
"""Films, a picture of one moment, and a page that plays the motion."""

RESULTS = (".json", ".csv")
"""Tables of numbers."""

MAPS = (*PLOTS, ".html")
"""Pictures of a sweep; the page has the motions of a map's runs."""
