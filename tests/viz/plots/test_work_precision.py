import json

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.viz.plots.svg import as_svg, without_ids
from twolink.accuracy.study import study
from twolink.cli import app
from twolink.data import data_path
from twolink.scene import Scene
from twolink.viz.plots.style import save, svg_into
from twolink.viz.plots.work_precision import work_precision_plot

pytestmark = pytest.mark.slow

SCENE = data_path("scenes") / "general.toml"


@pytest.fixture(scope="module")
def found():
    return study(Scene.load(SCENE), methods=("taylor", "DOP853"), budget=3.0)


@pytest.mark.slow
def test_a_light_plot_with_replaced_colours_is_the_dark_plot(found):
    light, dark = (as_svg(work_precision_plot(found, theme)) for theme in ("light", "dark"))
    assert without_ids(svg_into(light, "light", "dark")) == without_ids(dark)


@pytest.mark.slow
def test_every_configuration_is_a_line_with_its_name(found):
    axes = work_precision_plot(found).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    names = {text.get_text() for text in axes.texts}
    assert "taylor on momenta" in names
    for configuration in {point.configuration for point in found.points}:
        seen = [
            p
            for p in found.points
            if p.configuration == configuration and not p.failed and p.error < 1
        ]
        if not seen:
            # On a busy machine the budget may end before a method has a digit.
            assert configuration not in names
            continue
        assert np.array_equal(lines[configuration].get_xdata(), [p.error for p in seen])
        assert np.array_equal(lines[configuration].get_ydata(), [p.seconds for p in seen])
        assert configuration in names


def test_the_axes_carry_units_and_accuracy_grows_to_the_right(found):
    axes = work_precision_plot(found).axes[0]
    assert axes.get_xlabel() == "error at the end (rad, rad/s)"
    assert axes.get_ylabel() == "time to run (s), median"
    assert axes.xaxis_inverted()
    assert axes.get_xscale() == axes.get_yscale() == "log"


def test_the_mark_of_round_off_is_beside_its_line(found):
    figure = work_precision_plot(found)
    figure.canvas.draw()
    axes = figure.axes[0]
    (line,) = (each for each in axes.lines if each.get_label() == "_floor")
    (words,) = (each for each in axes.texts if "round-off" in each.get_text())
    # A browser ignores spaces at the ends of a text.
    assert words.get_text() == words.get_text().strip()
    place, _ = axes.transData.transform((line.get_xdata()[0], 1e-3))
    assert words.get_window_extent().x0 > place + 2


def test_names_do_not_overlap(found):
    figure = work_precision_plot(found)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in figure.axes[0].texts if text.get_text().strip()]
    assert len(boxes) > 5
    for index, box in enumerate(boxes):
        assert not any(box.shrunk(0.98, 0.9).overlaps(other) for other in boxes[index + 1 :])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_same_figure_is_the_same_file(found, tmp_path, kind):
    files = [tmp_path / f"{name}.{kind}" for name in "ab"]
    for file in files:
        save(work_precision_plot(found), file)
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.slow
def test_the_command_writes_all_four_files(tmp_path):
    folder = tmp_path / "new" / "folder"
    arguments = ["accuracy", str(SCENE), "--methods", "taylor", "--budget", "2"]
    result = CliRunner().invoke(app, [*arguments, "--out", str(folder)])
    assert result.exit_code == 0, result.output
    assert "Recommended: taylor on" in result.output
    names = {file.name for file in folder.iterdir()}
    assert names == {"accuracy.json", "accuracy.csv", "accuracy.svg", "accuracy.png"}
    document = json.loads((folder / "accuracy.json").read_text())
    assert document["recommendation"].startswith("Recommended: taylor")
    rows = (folder / "accuracy.csv").read_text().splitlines()
    assert len(rows) == len(document["points"]) + 1
