import json
import math
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from twolink.accuracy import drift as drift_module
from twolink.accuracy.drift import energy_drift
from twolink.cli import app
from twolink.data import data_path
from twolink.scene import Scene
from twolink.viz.plots.drift import drift_plot
from twolink.viz.plots.style import save

pytestmark = pytest.mark.slow

SCENE = data_path("scenes") / "small_swings.toml"


@pytest.fixture(scope="module")
def found():
    return energy_drift(Scene.load(SCENE), seconds=200.0)


@pytest.mark.slow
def test_every_method_is_a_line_with_its_power_beside_it(found):
    axes = drift_plot(found).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    texts = {text.get_text() for text in axes.texts}
    for drift in found.drifts:
        label = f"{drift.method.name} ∝ $t^{{{drift.growth.exponent:.2f}}}$"
        label = label.replace("-0.00", "0.00")
        assert np.array_equal(lines[label].get_xdata(), drift.times)
        assert np.array_equal(lines[label].get_ydata(), drift.errors)
        assert label in texts


def test_the_guides_have_the_slopes_they_name(found):
    axes = drift_plot(found).axes[0]
    guides = [line for line in axes.lines if str(line.get_label()).startswith("_guide")]
    for line, power in zip(guides, (1.0, 0.5, 0.0), strict=True):
        (x0, x1), (y0, y1) = line.get_xdata(), line.get_ydata()
        assert math.log(y1 / y0) / math.log(x1 / x0) == pytest.approx(power, abs=1e-12)
        # They lie below all errors, and inside.
        assert max(y0, y1) < min(drift.errors.min() for drift in found.drifts)
        assert axes.get_ylim()[0] < y0
        assert axes.get_xlim()[0] < x0 < x1 < axes.get_xlim()[1]


def test_the_axes_carry_units(found):
    axes = drift_plot(found).axes[0]
    assert axes.get_xlabel() == "time (s)"
    assert axes.get_ylabel() == "energy error / greatest kinetic energy (1), RMS of starts"
    assert axes.get_xscale() == axes.get_yscale() == "log"


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_labels_do_not_overlap(found, theme):
    figure = drift_plot(found, theme)
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text().strip()]
    assert len(boxes) == len(found.drifts) + 3
    for index, box in enumerate(boxes):
        assert not any(box.shrunk(0.98, 0.9).overlaps(other) for other in boxes[index + 1 :])
        assert box.x1 <= figure.bbox.x1


def test_kinds_are_distinguishable_without_colour(found):
    axes = drift_plot(found).axes[0]
    dashes = {line.get_label().split()[0]: line.get_linestyle() for line in axes.lines}
    assert len({dashes[name] for name in ("rk4", "gauss-legendre-4", "taylor-21")}) == 3


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_figure_is_the_same_file(found, tmp_path, kind):
    files = [tmp_path / f"{name}.{kind}" for name in "ab"]
    for file in files:
        save(drift_plot(found), file)
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.slow
def test_the_command_prints_a_table_and_writes_all_four_files(tmp_path):
    folder = tmp_path / "new" / "folder"
    arguments = ["drift", str(SCENE), "--seconds", "300", "--methods", "rk4,gauss-legendre-4"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(folder)])
    assert result.exit_code == 0, result.output
    for words in ("rk4", "gauss-legendre-4", "The motion is regular", "has the expected drift"):
        assert words in result.output
    assert {file.name for file in folder.iterdir()} == {
        f"drift.{kind}" for kind in ("json", "csv", "svg", "png")
    }
    document = json.loads((folder / "drift.json").read_text())
    assert [one["method"] for one in document["methods"]] == ["rk4", "gauss-legendre-4"]
    rows = (folder / "drift.csv").read_text().splitlines()
    assert len(rows) == 1 + sum(len(one["times_s"]) for one in document["methods"])


@pytest.mark.slow
def test_uncertain_exponents_are_reported(tmp_path):
    fall = str(data_path("scenes") / "free_fall.toml")
    arguments = ["drift", fall, "--seconds", "100", "--methods", "gauss-legendre-6"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(tmp_path)])
    assert result.exit_code == 0, result.output
    assert "The motion is chaotic" in result.output
    assert "gauss-legendre-6: a power of 0 is expected; " in result.output
    assert "too uncertain to tell the powers 0, 0.5 and 1 apart" in result.output


def test_a_study_in_which_all_methods_fail_is_drawn_and_printed(tmp_path, monkeypatch):
    long = tuple(
        replace(method, share=4.0) for method in drift_module.LONG_METHODS if method.order == 2
    )
    monkeypatch.setattr(drift_module, "LONG_METHODS", long)
    arguments = ["drift", str(SCENE), "--seconds", "100", "--out", str(tmp_path)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert "implicit-midpoint: an implicit step of 1.2 s does not converge" in result.output
    assert (tmp_path / "drift.png").stat().st_size > 1000


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--seconds", "5"], "the time must be 100 s to 1e+12 s; got 5 s"),
        (["--methods", "rk5"], "method must be one of"),
    ],
)
def test_bad_input_is_refused_and_nothing_written(tmp_path, arguments, sentence):
    result = CliRunner().invoke(app, ["drift", str(SCENE), *arguments, "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert sentence in result.output
    assert list(tmp_path.iterdir()) == []
