from fractions import Fraction
from io import BytesIO

import pytest
from PIL import Image

from twolink.errors import BrowserError, PictureError
from twolink.viz.encoding import Decoded, check_decoded, check_film, decoded, encoder

COUNT = 7


def picture(shade, size=(64, 48)):
    stream = BytesIO()
    Image.new("RGB", size, (shade, 255 - shade, 128)).save(stream, "png")
    return stream.getvalue()


def written(file, fps=25.0, count=COUNT, size=(64, 48)):
    with encoder(file, file.suffix, fps) as pictures:
        for k in range(count):
            pictures.write(picture(30 * k, size))
    return decoded(file)


@pytest.mark.parametrize("suffix", [".mp4", ".webm", ".gif"])
def test_every_picture_is_a_frame_at_its_time(suffix, tmp_path):
    found = written(tmp_path / f"film{suffix}")
    assert (found.width, found.height) == (64, 48)
    assert len(found.times) == COUNT
    assert [float(t) for t in found.times] == pytest.approx(
        [k / 25 for k in range(COUNT)], abs=1e-9
    )
    assert len(set(found.pictures)) == COUNT
    check_decoded(found, suffix, (64, 48), 25.0, COUNT)


@pytest.mark.parametrize("fps", [30.0, 24.0, 60.0, 29.97, 12.5])
def test_rates_are_exact(fps, tmp_path):
    found = written(tmp_path / "film.mp4", fps)
    check_decoded(found, ".mp4", (64, 48), fps, COUNT)


def test_a_film_can_be_played_while_it_is_loaded(tmp_path):
    written(tmp_path / "film.mp4")
    data = (tmp_path / "film.mp4").read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"width": 66}, "66x48 pixels and not 64x48"),
        ({"times": tuple(Fraction(k, 25) for k in range(COUNT - 1))}, "6 frames and not 7"),
        (
            {"times": (*(Fraction(k, 25) for k in range(COUNT - 1)), Fraction(6, 24))},
            "off its time",
        ),
        ({"lasting": Fraction(1, 5)}, "lasts"),
    ],
)
def test_a_film_that_differs_from_the_request_is_an_error(change, words):
    good = {
        "width": 64, "height": 48, "times": tuple(Fraction(k, 25) for k in range(COUNT)),
        "lasting": Fraction(1, 25), "pictures": ("x",) * COUNT,
    }  # fmt: skip
    check_decoded(Decoded(**good), ".mp4", (64, 48), 25.0, COUNT)
    with pytest.raises(BrowserError, match=words):
        check_decoded(Decoded(**{**good, **change}), ".mp4", (64, 48), 25.0, COUNT)


def test_an_undecodable_film_is_an_error(tmp_path):
    (tmp_path / "film.mp4").write_bytes(b"no film")
    with pytest.raises(BrowserError, match="cannot be decoded"):
        decoded(tmp_path / "film.mp4")


def test_an_encoder_that_fails_is_an_error(tmp_path):
    with (
        pytest.raises(BrowserError, match="ffmpeg failed"),
        encoder(tmp_path / "film.mp4", ".mp4", 25.0) as pictures,
    ):
        pictures.write(b"no picture" * 100)


@pytest.mark.parametrize("fps", [30.0, 60.0, 24.0, 100.0])
def test_a_gif_counts_in_hundredths(fps):
    with pytest.raises(PictureError, match="hundredths of a second"):
        check_film(".gif", 640, 480, fps)


@pytest.mark.parametrize("fps", [50.0, 25.0, 12.5, 0.5])
def test_a_gif_has_frames_of_two_or_more_hundredths(fps):
    check_film(".gif", 641, 480, fps)


@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_odd_sizes_are_refused(suffix):
    with pytest.raises(PictureError, match="must be even numbers of pixels"):
        check_film(suffix, 641, 480, 30.0)
