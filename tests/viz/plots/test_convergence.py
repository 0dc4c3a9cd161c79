"""The plot of errors against settings: lines, labels, units, and omissions."""

import math
from dataclasses import replace

import pytest

from tests.viz.plots.svg import as_svg, without_ids
from twolink.conformance.convergence import Convergence, Curve, Limit
from twolink.conformance.curves import MethodCurve
from twolink.viz.plots.convergence import convergence_plot
from twolink.viz.plots.style import PALETTES, svg_into


def curve(name, number=0, parameter="step", errors=(1e-1, 5e-2, 2.5e-2)):
    settings = tuple(0.01 / 2**k for k in range(len(errors)))
    found = Curve(parameter, settings, Convergence(Limit.TRUTH, 1.0, errors, errors[-1]))
    return MethodCurve(name, "euler", number, 0, found)


CURVES = (curve("one"), curve("two", 1), curve("three", 2, "tolerance"))


def labelled(axes):
    return {str(line.get_label()): line for line in axes.lines}


def test_every_method_is_a_line_with_its_name():
    steps, tolerances = convergence_plot({"general": CURVES}).axes
    assert list(labelled(steps)) == ["one, euler", "two, euler"]
    assert list(labelled(tolerances)) == ["three, euler"]
    assert {"one, euler", "two, euler"} <= {text.get_text() for text in steps.texts}
    line = labelled(steps)["one, euler"]
    assert list(line.get_xdata()) == [0.01, 0.005, 0.0025]
    assert list(line.get_ydata()) == [1e-1, 5e-2, 2.5e-2]


@pytest.mark.slow
def test_a_light_plot_with_replaced_colours_is_the_dark_plot():
    light, dark = (
        as_svg(convergence_plot({"general": CURVES}, theme=theme)) for theme in ("light", "dark")
    )
    assert without_ids(svg_into(light, "light", "dark")) == without_ids(dark)


def test_the_axes_have_units_and_become_finer_to_the_right():
    steps, tolerances = convergence_plot({"general": CURVES}).axes
    assert steps.get_xlabel() == "step (s), finer to the right"
    assert tolerances.get_xlabel() == "tolerance (1), finer to the right"
    for axes in (steps, tolerances):
        assert axes.get_ylabel() == "largest error (rad, rad/s)"
        assert axes.get_xscale() == axes.get_yscale() == "log"
        assert axes.xaxis_inverted()


def test_engines_differ_in_colour_and_mark():
    one, two = labelled(convergence_plot({"general": CURVES}).axes[0]).values()
    assert one.get_color() != two.get_color()
    assert one.get_marker() != two.get_marker()


def test_seventeen_engines_have_as_many_styles():
    curves = [curve(f"engine {number}", number) for number in range(17)]
    lines = labelled(convergence_plot({"general": curves}).axes[0]).values()
    assert len({(line.get_color(), line.get_marker()) for line in lines}) == 17


@pytest.mark.slow_but_first
@pytest.mark.parametrize("error", [math.nan, math.inf, 0.0, 1e30])
def test_errors_outside_of_logarithmic_axes_are_omitted(error):
    (axes,) = convergence_plot({"general": [curve("one", errors=(1e-1, error, 1e-2))]}).axes
    assert list(labelled(axes)["one, euler"].get_ydata()) == [1e-1, 1e-2]
    (empty,) = convergence_plot({"general": [curve("one", errors=(error,) * 3)]}).axes
    assert labelled(empty) == {}


def test_several_scenes_have_axes_of_their_own_with_their_names():
    curves = {"general": CURVES[:1], "floor": CURVES}
    titles = [axes.get_title("left") for axes in convergence_plot(curves).axes]
    assert titles == [
        "general, fixed steps",
        "floor, fixed steps",
        "floor, variable steps",
    ]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_text_has_the_ink_of_the_theme(theme):
    (axes,) = convergence_plot({"general": CURVES[:1]}, "title", theme).axes
    assert axes._left_title.get_color() == PALETTES[theme].ink
    assert {text.get_color() for text in axes.texts if text.get_text()} == {PALETTES[theme].ink}


def test_names_do_not_overlap():
    curves = [replace(curve(f"engine {number}", number)) for number in range(30)]
    drawn = convergence_plot({"general": curves})
    drawn.canvas.draw()
    boxes = [text.get_window_extent() for text in drawn.axes[0].texts if text.get_text()]
    assert len(boxes) == 30
    for index, box in enumerate(boxes):
        assert not any(box.shrunk(0.98, 0.9).overlaps(other) for other in boxes[index + 1 :])
