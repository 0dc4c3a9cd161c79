"""The registry of plots: every kind draws, and others are refused."""

import pytest

from tests.viz.plots.svg import as_svg, without_ids
from twolink.errors import PictureError
from twolink.viz.plots.kinds import KINDS, OF_SEVERAL, plot_of
from twolink.viz.plots.style import svg_into


@pytest.mark.slow_but_first
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_draws(run, kind):
    trajectory = run("painleve")
    others = {"again": trajectory} if kind in OF_SEVERAL else {}
    made = plot_of(kind, trajectory, "dark", others)
    made.draw_without_rendering()
    assert all(axes.lines or axes.collections for axes in made.axes)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_light_plot_with_replaced_colours_is_the_dark_plot(run, kind):
    trajectory = run("painleve")
    others = {"again": trajectory} if kind in OF_SEVERAL else {}
    light, dark = (as_svg(plot_of(kind, trajectory, theme, others)) for theme in ("light", "dark"))
    assert without_ids(light) != without_ids(dark)
    assert without_ids(svg_into(light, "light", "dark")) == without_ids(dark)


def test_an_unknown_kind_and_too_many_motions_are_refused(run):
    trajectory = run("painleve")
    with pytest.raises(PictureError, match="kind must be one of angles, "):
        plot_of("angle", trajectory, "light", {})
    with pytest.raises(PictureError, match="contact must be that of 1 motion; got 2"):
        plot_of("contact", trajectory, "light", {"again": trajectory})
