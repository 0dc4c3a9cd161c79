"""Encode pictures to a film with ffmpeg, and check the decoded film."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import IO

from twolink.errors import BrowserError, PictureError

_VIDEO = {
    ".mp4": (
        *("-c:v", "libx264", "-crf", "18", "-preset", "medium", "-pix_fmt", "yuv420p"),
        # Metadata first, so that playback can start before the whole file is loaded.
        *("-movflags", "+faststart", "-f", "mp4"),
    ),
    ".webm": (
        *("-c:v", "libvpx-vp9", "-crf", "28", "-b:v", "0", "-row-mt", "1", "-cpu-used", "4"),
        *("-pix_fmt", "yuv420p", "-f", "webm"),
    ),
    ".gif": (
        *("-vf", "split[a][b];[a]palettegen=stats_mode=full[p];[b][p]paletteuse=dither=none"),
        *("-loop", "0", "-f", "gif"),
    ),
}
# sRGB's primaries and gamma and the HD matrix, both converted and declared.
_COLOURS = (
    *("-vf", "scale=out_color_matrix=bt709:out_range=tv"),
    *("-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1"),
)
# The file's unit of time (s), the largest deviation of a frame from its exact time.
_CLOCK = {".mp4": Fraction(0), ".webm": Fraction(1, 1000), ".gif": Fraction(1, 100)}


def ffmpeg() -> str:
    """Return the path of ffmpeg. Raises `PictureError` if imageio-ffmpeg is missing."""
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise PictureError(
            "imageio-ffmpeg, which films need, is not installed; use .html or .png, or "
            'pip install "twolink[record]"'
        ) from error
    return str(imageio_ffmpeg.get_ffmpeg_exe())


def check_film(suffix: str, width: int, height: int, fps: float) -> None:
    """Raise `PictureError` for sizes and rates that a film format does not support."""
    if suffix in (".mp4", ".webm") and (width % 2 or height % 2):
        raise PictureError(
            f"the size must be even numbers of pixels for a {suffix} file; got {width}x{height}"
        )
    # Viewers show frames of one hundredth of a second for ten.
    if suffix == ".gif" and (fps > 50 or (100 / fps) % 1):
        raise PictureError(
            "fps must be at most 50 and divide 100, as 25 and 20 do, for a .gif file, which counts "
            f"time in hundredths of a second; got {fps:g}"
        )


@contextmanager
def encoder(file: Path, suffix: str, fps: float) -> Iterator[IO[bytes]]:
    """Yield a function that takes pictures (PNG) in order and encodes them to a file.

    Raises `BrowserError` if ffmpeg fails; the process is always ended.
    """
    rate = str(Fraction(fps).limit_denominator(1001))
    colours = () if suffix == ".gif" else _COLOURS
    command = (
        *(ffmpeg(), "-hide_banner", "-loglevel", "error", "-y"),
        *("-f", "image2pipe", "-c:v", "png", "-framerate", rate, "-i", "pipe:0", "-an"),
        *("-fps_mode", "passthrough", *colours, *_VIDEO[suffix], str(file)),
    )
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        # ffmpeg must not receive Ctrl-C itself: this process ends it.
        start_new_session=True,
    )
    assert process.stdin is not None
    assert process.stderr is not None
    try:
        try:
            yield process.stdin
            process.stdin.close()
        except BrokenPipeError:
            with suppress(BrokenPipeError):
                process.stdin.close()
        said = process.stderr.read().decode(errors="replace")
        if process.wait() != 0:
            raise BrowserError(f"ffmpeg failed ({' '.join(said.split())[:300]})")
    finally:
        process.kill()
        process.wait()
        process.stderr.close()
        with suppress(BrokenPipeError):
            process.stdin.close()


@dataclass(frozen=True)
class Decoded:
    """A decoded film: size in pixels, times of frames (s), and their pictures.

    `lasting` is the duration of the last frame (s); `pictures` are hashes.
    """

    width: int
    height: int
    times: tuple[Fraction, ...]
    lasting: Fraction
    pictures: tuple[str, ...]

    @property
    def duration(self) -> Fraction:
        """The duration of the film (s)."""
        return self.times[-1] + self.lasting - self.times[0]


def decoded(file: Path) -> Decoded:
    """Return a decoded film. Raises `BrowserError` if decoding fails."""
    command = (
        *(ffmpeg(), "-hide_banner", "-loglevel", "error", "-i", str(file)),
        *("-map", "0:v:0", "-fps_mode", "passthrough", "-f", "framemd5", "pipe:1"),
    )
    run = subprocess.run(command, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    if run.returncode != 0:
        said = " ".join(run.stderr.decode(errors="replace").split())
        raise BrowserError(f"the written film cannot be decoded ({said[:300]})")
    text = run.stdout.decode()
    unit = re.search(r"^#tb 0: (\d+/\d+)", text, re.MULTILINE)
    size = re.search(r"^#dimensions 0: (\d+)x(\d+)", text, re.MULTILINE)
    rows = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")]
    if unit is None or size is None or not rows:
        raise BrowserError("the written film has no frames")
    clock = Fraction(unit[1])
    return Decoded(
        width=int(size[1]),
        height=int(size[2]),
        times=tuple(int(row[2]) * clock for row in rows),
        lasting=int(rows[-1][3]) * clock,
        pictures=tuple(row[5].strip() for row in rows),
    )


def check_decoded(
    found: Decoded, suffix: str, size: tuple[int, int], fps: float, count: int
) -> None:
    """Raise `BrowserError` unless a film has the right size, frames and times."""
    rate = Fraction(fps).limit_denominator(1001)
    late = max(
        abs(time - found.times[0] - number / rate) for number, time in enumerate(found.times)
    )
    faults = []
    if (found.width, found.height) != size:
        faults.append(f"it is {found.width}x{found.height} pixels and not {size[0]}x{size[1]}")
    if len(found.times) != count:
        faults.append(f"it has {len(found.times)} frames and not {count}")
    if late > _CLOCK[suffix]:
        faults.append(f"a frame is {float(late):.3g} s off its time")
    if abs(found.duration - count / rate) > 2 * _CLOCK[suffix]:
        faults.append(f"it lasts {float(found.duration):.6g} s and not {float(count / rate):.6g} s")
    if faults:
        raise BrowserError(f"the written film is wrong: {', and '.join(faults)}")
