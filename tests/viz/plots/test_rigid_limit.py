from fractions import Fraction

import numpy as np
import pytest

from twolink.viz.plots.rigid_limit import Limit, Restitution, contact_plot
from twolink.viz.plots.style import save

LIMITS = (
    Limit("Kelvin-Voigt", "N/m", (1e5, 1e7, 1e9), (1e-1, 1e-2, 1e-3), 0.5, Fraction(1, 2)),
    Limit("Hertz", "N/m$^{3/2}$", (1e5, 1e7, 1e9), (5e-1, 8e-2, 1.2e-2), 0.41, Fraction(2, 5)),
)
GIVEN_BACK = Restitution("1 kg", (1e-3, 1e-1, 1.0), (1.0, 0.5, 0.2), (1.0, 0.5, 0.2), 2e-3)


@pytest.fixture
def figure():
    return contact_plot(LIMITS, GIVEN_BACK)


@pytest.mark.slow
def test_lines_are_the_data_and_carry_their_measured_rates(figure):
    above, below = figure.axes
    lines = [line for line in above.lines if not line.get_label().startswith("_")]
    for limit, line in zip(LIMITS, lines, strict=True):
        assert np.array_equal(line.get_xdata(), limit.stiffness)
        assert np.array_equal(line.get_ydata(), limit.misses)
    words = " ".join(text.get_text() for text in above.texts)
    assert "slope −0.500,\nin theory −1/2" in words
    assert "slope −0.410,\nin theory −2/5" in words
    assert np.array_equal(below.lines[0].get_ydata(), GIVEN_BACK.computed)
    assert np.array_equal(below.lines[1].get_ydata(), GIVEN_BACK.measured)


@pytest.mark.slow
def test_the_theoretical_line_passes_through_the_stiffest_point(figure):
    for limit, line in zip(LIMITS, figure.axes[0].lines[::2], strict=True):
        x, y = line.get_data()
        assert y[-1] == limit.misses[-1]
        slope = np.diff(np.log(y)) / np.diff(np.log(x))
        assert slope == pytest.approx(-float(limit.expected))


@pytest.mark.slow
def test_axes_carry_units(figure):
    above, below = figure.axes
    assert "(m/s)" in above.get_ylabel()
    assert below.get_xlabel() == "approach speed (m/s)"


@pytest.mark.slow
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_labels_do_not_overlap(theme):
    figure = contact_plot(LIMITS, GIVEN_BACK, theme)
    figure.canvas.draw()
    for axes in figure.axes:
        boxes = [text.get_window_extent() for text in axes.texts if text.get_text().strip()]
        for index, box in enumerate(boxes):
            assert not any(box.overlaps(other) for other in boxes[index + 1 :])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_data_give_the_same_bytes(tmp_path, kind):
    for name in "ab":
        save(contact_plot(LIMITS, GIVEN_BACK), tmp_path / f"{name}.{kind}")
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()
