import subprocess
import sys
from pathlib import Path

import pytest

from tests.verification.chains import GENERAL
from twolink.viz.schematic import schematic

ROOT = Path(__file__).parent.parent.parent


def test_the_drawing_has_the_symbols_of_the_equations():
    axes = schematic().axes[0]
    names = {text.get_text() for text in axes.texts}
    assert {"$A$", "$B$", "$D$", "$C_1$", "$C_2$", "$q_1$", "$q_2$", "$x$", "$y$"} <= names
    assert axes.yaxis_inverted()


def test_the_drawing_has_the_points_of_any_chain():
    axes = schematic(GENERAL, (0.0, 0.0)).axes[0]
    ends = {
        tuple(round(float(v), 9) for v in (line.get_xdata()[-1], line.get_ydata()[-1]))
        for line in axes.lines
        if line.get_linewidth() > 10
    }
    assert ends == {(0.9, 0.0), (0.9 + 1.4, 0.0)}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["svg", "png"])
def test_the_module_writes_the_drawing(tmp_path, kind):
    file = tmp_path / f"chain.{kind}"
    subprocess.run([sys.executable, "-m", "twolink.viz.schematic", str(file)], check=True, cwd=ROOT)
    assert file.stat().st_size > 5000
