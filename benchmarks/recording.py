"""The cost of a recorded frame: `uv run python -m benchmarks.recording`.

The scene "drop" is drawn by meshcat's viewer in a headless browser, frame by frame, and encoded
with H.264 as in `twolink record`. Drawing and the computation of commands are also measured
separately. The target is 0.1 s per frame at 1280 x 720 on two cores.
"""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from twolink.data import data_path
from twolink.errors import PictureError
from twolink.scene import Scene
from twolink.simulation import simulate
from twolink.viz.film import Film
from twolink.viz.recording import record
from twolink.viz.run import Run

AIM = 0.1
SIZES = ((640, 480), (1280, 720), (1920, 1080))


def seconds_by_stage(film: Film, size: tuple[int, int], suffix: str) -> dict[str, float]:
    """Return the time of each stage of a recording (s)."""
    ends: dict[str, tuple[float, float]] = {}

    def report(stage: str, share: float) -> None:
        now = time.perf_counter()
        first, _ = ends.get(stage, (now, now))
        ends[stage] = first, now

    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        record(film, Path(folder, f"film{suffix}"), size=size, progress=report)
        whole = time.perf_counter() - start
    return {"whole": whole, **{stage: last - first for stage, (first, last) in ends.items()}}


def main() -> None:
    """Print the cost of a frame by size."""
    film = Film((Run("drop", simulate(Scene.load(data_path("scenes") / "drop.toml"))),))
    count = len(film.times)
    table = Table(title=f"Seconds a frame, {count} frames, {os.cpu_count()} cores")
    for column in ("size", "drawn and encoded", "its commands", "checked", "all, with the browser"):
        table.add_column(column, justify="right")
    for size in SIZES:
        took = seconds_by_stage(film, size, ".mp4")
        # The first frame includes the browser's start, so the interval contains one frame less.
        drawn = took["pictures"] / (count - 1)
        table.add_row(
            f"{size[0]}x{size[1]}",
            f"{drawn:.3f}",
            f"{took['frames'] / count:.4f}",
            f"{took['checking'] / count:.4f}",
            f"{took['whole'] / count:.3f}",
        )
        if size == (1280, 720):
            verdict = "met" if drawn <= AIM else f"missed by {drawn - AIM:.3f} s"
    console = Console()
    console.print(table)
    console.print(f"The aim of {AIM} s a frame at 1280x720 is {verdict}.")


if __name__ == "__main__":
    try:
        main()
    except PictureError as error:
        Console().print(f"Not measured: {error}.")
