"""Record films to files: a headless browser draws each frame once, at its exact time."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from twolink.errors import PictureError
from twolink.files import atomic_write, scratch_folder
from twolink.suffixes import FILMS, RECORDINGS
from twolink.text import choice, distinct
from twolink.viz.browser import Browser, Page, browser_program
from twolink.viz.encoding import check_decoded, check_film, decoded, encoder, ffmpeg
from twolink.viz.film import Film
from twolink.viz.page import player_page

_LEAST, _MOST = 160, 7680

# A picture is drawn so many times as large each way, and scaled down, which smooths its edges. It
# takes about twice the time.
_SMOOTH = 2

STAGES = ("frames", "pictures", "checking")
"""The stages of a recording, in order; a .html has only the first, and a .png the first two."""

# The stage, and its completed fraction.
Progress = Callable[[str, float], None]


def record(
    film: Film,
    file: Path,
    *,
    size: tuple[int, int] = (1280, 720),
    at: float | None = None,
    follows: bool = False,
    patience: float = 30.0,
    progress: Progress | None = None,
) -> None:
    """Write a film to a file in the format of its suffix.

    A .mp4, .webm or .gif is decoded again to check its frames, times and size (pixels). A .png is
    one picture at exactly the time `at` (s), by default the end; no other file has such a time. A
    .html plays the film in any browser, offline; with `follows` in the colours of its reader's
    scheme. The file is written atomically; `patience` (s) is the time limit of the browser's
    answers. Raises `PictureError` for invalid options, `BrowserError` if browser or encoder fail,
    and `FileError` if the file cannot be written.
    """
    # The end of a motion is between two frames in general.
    moment = film.start + film.duration if at is None else at
    if file.suffix == ".png":
        film = replace(film, still=moment)
    # Last, as it looks for programs: an invalid time is one also where they are missing.
    check_recording(file, size, film.fps, at)
    report = progress or (lambda stage, share: None)
    with atomic_write(file) as temporary:
        if file.suffix == ".html":
            page = player_page(film, dark=follows, progress=lambda share: report("frames", share))
            temporary.write_text(page, encoding="utf-8")
            return
        with _shown(film, size, patience, report) as player:
            if file.suffix == ".png":
                number = int(np.searchsorted(film.times, moment))
                temporary.write_bytes(_picture(player.value(_ask(number))))
                return
            _encode(player, temporary, file.suffix, film, report)
        report("checking", 0.0)
        found = decoded(temporary)
        check_decoded(found, file.suffix, size, film.fps, len(film.times))
        report("checking", 1.0)


def _encode(player: Page, file: Path, suffix: str, film: Film, report: Progress) -> None:
    """Write the pictures of a film to a file in the format of a suffix."""
    with encoder(file, suffix, film.fps) as pictures:
        for k, picture in enumerate(_pictures(player, len(film.times))):
            pictures.write(picture)
            report("pictures", (k + 1) / len(film.times))


def check_recording(file: Path, size: tuple[int, int], fps: float, at: float | None = None) -> None:
    """Raise `PictureError` for invalid formats, sizes and times, and for missing programs."""
    if file.suffix not in RECORDINGS:
        raise PictureError(f"{file}: {choice('the suffix', file.suffix, RECORDINGS)}")
    # A film's frames and a page's are on a grid of times: one more would be off it.
    if at is not None and file.suffix != ".png":
        raise PictureError(f"at must be left out with a {file.suffix} file; got {distinct(at)} s")
    if not all(_LEAST <= length <= _MOST for length in size):
        raise PictureError(
            f"the size must be {_LEAST} to {_MOST} pixels each way; got {size[0]}x{size[1]}"
        )
    if file.suffix in FILMS:
        check_film(file.suffix, *size, fps)
        ffmpeg()
    if file.suffix != ".html":
        browser_program()


@contextmanager
def _shown(film: Film, size: tuple[int, int], patience: float, report: Progress) -> Iterator[Page]:
    """Yield a page of a headless browser that shows the film in a given size (pixels)."""
    # The browser first: without one, all other work is useless.
    with (
        Browser(patience=patience) as browser,
        scratch_folder("page") as folder,
    ):
        file = folder / "film.html"
        page = player_page(film, bare=True, progress=lambda share: report("frames", share))
        file.write_text(page, encoding="utf-8")
        player = browser.page(*size, scale=_SMOOTH)
        player.open(file.as_uri())
        yield player


def _pictures(player: Page, count: int) -> Iterator[bytes]:
    """Yield each frame's picture (PNG); meanwhile the browser draws the next."""
    waiting = player.ask(_ask(0))
    for number in range(count):
        answer = player.result(waiting)
        if number + 1 < count:
            waiting = player.ask(_ask(number + 1))
        yield _picture(answer)


def _ask(number: int) -> str:
    """Return the JavaScript request for the picture of a frame."""
    return f"document.querySelector('.twolink-player').twolink.picture({number})"


def _picture(url: str) -> bytes:
    return base64.b64decode(url.partition(",")[2])
