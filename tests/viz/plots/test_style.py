"""The style of all plots: labels at lines, themes, reproducible files."""

import colorsys
import re

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from tests.viz.plots.svg import as_svg
from twolink.errors import ParameterError, PictureError
from twolink.viz.plots.style import (
    PALETTES,
    figure,
    label_lines,
    overlaps,
    palette_of,
    save,
    spread,
    stroke,
    svg_into,
)
from twolink.viz.themes import DARK, LIGHT

palettes = pytest.mark.parametrize("palette", PALETTES.values(), ids=list(PALETTES))


def drawn(palette, ends=(0.0, 0.01, 0.02, 1.0, 1.0, 1.0)):
    made, (axes,) = figure(palette, "Six lines", rows=1)
    for number, end in enumerate(ends):
        axes.plot([0, 1], [0.5, end], label=f"line {number} (m)", **stroke(palette, number))
    axes.set_xlim(0, 1)
    return made, axes


@palettes
def test_overlapping_labels_are_moved_apart(palette):
    made, axes = drawn(palette)
    words = label_lines(axes)
    assert [word.get_text() for word in words] == [f"line {k} (m)" for k in range(6)]
    made.draw_without_rendering()
    assert not overlaps(words)
    boxes = [word.get_window_extent() for word in words]
    assert all(box.x0 > axes.bbox.x1 for box in boxes)
    assert all(box.x1 < made.bbox.x1 for box in boxes), "the layout leaves room for the words"
    # They stand in the order of the lines' ends.
    heights = [box.y0 for box in boxes]
    assert heights[:3] == sorted(heights[:3])
    assert max(heights[:3]) < min(heights[3:])


def test_overlaps_are_found():
    made, axes = drawn(PALETTES["light"])
    words = label_lines(axes)
    words[0].xy = words[1].xy
    made.draw_without_rendering()
    assert overlaps(words)


def test_a_single_label_is_at_the_end_of_its_line():
    _made, axes = drawn(PALETTES["light"], ends=(0.3, 0.9))
    axes.set_ylim(0, 1)
    for word, end in zip(label_lines(axes), (0.3, 0.9), strict=True):
        assert word.xy[1] == pytest.approx(end)


def test_lines_without_a_label_have_no_text():
    _made, (axes,) = figure(PALETTES["light"])
    axes.plot([0, 1], [0, 1])
    assert label_lines(axes) == []


@pytest.mark.parametrize("seed", range(20))
def test_spread_keeps_labels_apart_inside_and_in_order(seed):
    random = np.random.default_rng(seed)
    wanted = list(random.random(int(random.integers(1, 9))))
    height = 0.1
    places = spread(wanted, height)
    ordered = [places[k] for k in np.argsort(wanted)]
    assert np.all(np.diff(ordered) >= height * (1 - 1e-12))
    assert min(places) >= height / 2 - 1e-12
    assert max(places) <= 1 - height / 2 + 1e-12
    if np.all(np.diff(sorted(wanted)) > height) and min(wanted) > 0.05 and max(wanted) < 0.95:
        assert places == pytest.approx(wanted)


def luminance(colour):
    channels = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return 0.2126 * channels[0] + 0.7152 * channels[1] + 0.0722 * channels[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@palettes
def test_words_and_the_first_lines_stand_out(palette):
    """WCAG 2: 4.5 for text, 3 for graphics; text is read on shaded bands, too."""
    for ground in (palette.paper, *palette.bands):
        assert contrast(palette.ink, ground) > 4.5
    for colour in palette.lines[:3]:
        assert contrast(colour, palette.paper) > 3


@palettes
def test_lines_differ_without_colour(palette):
    strokes = [str(stroke(palette, k)["linestyle"]) for k in range(len(palette.lines))]
    assert len(set(strokes)) == len(strokes)
    hues = {tuple(round(x, 3) for x in colorsys.rgb_to_hls(*to_rgb(c))) for c in palette.lines}
    assert len(hues) == len(palette.lines)


@pytest.mark.slow_but_first
@palettes
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_a_file_is_the_same_each_time(tmp_path, palette, kind):
    for name in ("one", "two"):
        made, axes = drawn(palette)
        label_lines(axes)
        save(made, tmp_path / f"{name}.{kind}")
    one = (tmp_path / f"one.{kind}").read_bytes()
    assert one == (tmp_path / f"two.{kind}").read_bytes()
    assert len(one) > 3000
    if kind == "svg":
        assert not re.search(rb"<dc:date>", one)


def test_invalid_arguments_are_rejected(tmp_path):
    made, _ = figure(PALETTES["light"])
    with pytest.raises(
        ParameterError, match=r"plot\.eps: the suffix must be \.svg or \.png or \.pdf"
    ):
        save(made, tmp_path / "plot.eps")
    with pytest.raises(PictureError, match="theme must be one of light, dark; got 'sepia'"):
        palette_of("sepia")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_text_in_svg_is_text_and_a_pdf_is_a_pdf(tmp_path):
    made, (axes,) = figure(PALETTES["light"], "A title to find")
    axes.set_xlabel("time (s)")
    for suffix in ("svg", "pdf"):
        save(made, tmp_path / f"plot.{suffix}")
    drawing = (tmp_path / "plot.svg").read_text()
    assert ">A title to find</text>" in drawing
    assert ">time (s)</text>" in drawing
    assert (tmp_path / "plot.pdf").read_bytes().startswith(b"%PDF-")


def test_links_have_the_colours_of_the_films():
    assert PALETTES["light"].lines[:2] == LIGHT.links
    assert PALETTES["dark"].lines[:2] == DARK.links


def test_only_the_colours_of_a_picture_are_replaced_and_not_its_words():
    made, (axes,) = figure(palette_of("light"), "Painted #ffffff")
    axes.plot([0, 1], [0, 1], **stroke(palette_of("light"), 0))
    svg = svg_into(as_svg(made), "light", "dark")
    assert "Painted #ffffff" in svg
    assert LIGHT.links[0] not in svg
    assert DARK.links[0] in svg
    assert "fill: #14171c" in svg
