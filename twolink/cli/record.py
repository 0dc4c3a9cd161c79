"""The command `twolink record`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from twolink.cli.limits import Force
from twolink.cli.options import check_unused
from twolink.cli.progress import progress_bar
from twolink.cli.showing import (
    BYTES_OF_A_FRAME,
    Ghosts,
    Motion,
    Nearby,
    OwnGeometry,
    Speed,
    Surroundings,
    film_of,
)
from twolink.cli.terminal import check_target, refuse, say
from twolink.cli.trajectories import print_notes
from twolink.suffixes import RECORDINGS
from twolink.text import either, quoted

_Out = Annotated[Path, typer.Option(help=f"The {either(RECORDINGS)} file to write.")]
_Fps = Annotated[
    float | None, typer.Option(help="Frames per second. Default: 30, and 25 in a .gif.")
]
_Size = Annotated[str, typer.Option(help="Width and height in pixels; a .html fills its window.")]
_At = Annotated[float | None, typer.Option(help="The time of a .png (s). Default: the end.")]


def record(
    context: typer.Context,
    motion: Motion,
    out: _Out,
    fps: _Fps = None,
    size: _Size = "1280x720",
    speed: Speed = 1.0,
    theme: Surroundings = None,
    ghost: Ghosts = None,
    nearby: Nearby = None,
    urdf: OwnGeometry = None,
    at: _At = None,
    force: Force = False,
) -> None:
    """Record a motion to a film, a picture, or a web page.

    Every frame is drawn once, at its exact time, by a headless Chromium or Chrome; a .html needs
    none. A film is decoded again and checked. Exit code 0: the file was written. 1: browser or
    encoder failed. 2: the input was refused.
    """
    check_target("--out", out, RECORDINGS, inputs=[motion, urdf, *map(Path, ghost or [])])
    from twolink.viz.recording import STAGES, check_recording
    from twolink.viz.recording import record as recorded

    if out.suffix == ".html":
        check_unused(context, "a .html file, which fills its window", "size")
    rate = (25.0 if out.suffix == ".gif" else 30.0) if fps is None else fps
    pixels = _size(size)
    # Missing programs and invalid options are reported before anything is simulated.
    check_recording(out, pixels, rate, at)
    film = film_of(
        motion, ghosts=ghost or [], nearby=nearby, urdf=urdf, fps=rate, speed=speed,
        theme=theme, force=force, frame_bytes=BYTES_OF_A_FRAME,
    )  # fmt: skip
    with _bar(STAGES) as progress:
        recorded(film, out, size=pixels, at=at, follows=theme is None, progress=progress)
    frames = "" if out.suffix == ".png" else f"{len(film.times)} frames, "
    say(f"{out}: {frames}{out.stat().st_size / 1e6:.2g} MB")
    print_notes(run.trajectory for run in film.runs)


@contextmanager
def _bar(stages: Sequence[str]) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar; yield a callback that takes a stage and its completed share."""
    with progress_bar() as bar:
        task = bar.add_task("recording", total=float(len(stages)))

        def progress(stage: str, share: float) -> None:
            # A bar that is full between two stages would stop its clock.
            done = stages.index(stage) + share
            bar.update(task, description=f"recording, {stage}", completed=done)

        yield progress


def _size(text: str) -> tuple[int, int]:
    """Return width and height, or refuse the text."""
    width, times, height = text.lower().partition("x")
    if not (
        times and width.isascii() and height.isascii() and width.isdigit() and height.isdigit()
    ):
        refuse(f"--size must be width x height in pixels, such as 1280x720; got {quoted(text)}")
    return int(width), int(height)
