"""Results in a real Jupyter kernel: players, tables, drawings, figures, data frames."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

CELLS = (
    "import twolink\nscene = twolink.Scene.load('drop')\nscene",
    "trajectory = twolink.simulate(scene, samples=51)\ntrajectory",
    "trajectory.show()",
    "trajectory.plot('energy')",
    "trajectory.to_pandas().tail(1)",
    "twolink.verify(states=20)",
    "scene.chain",
)

# In a process of its own: the client's warnings are not this library's.
PROGRAM = """
import json, sys
from nbclient import NotebookClient
from nbformat.v4 import new_code_cell, new_notebook

notebook = new_notebook(cells=[new_code_cell(cell) for cell in json.load(sys.stdin)])
NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
print(json.dumps([[output for output in cell.outputs] for cell in notebook.cells]))
"""


@pytest.fixture(scope="module")
def outputs():
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=json.dumps(CELLS),
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout)


@pytest.mark.slow
def test_each_result_has_its_page_and_its_text(outputs):
    scene, trajectory, shown, figure, frame, verdict, chain = (cell[-1]["data"] for cell in outputs)
    assert "<svg" in scene["text/html"]
    assert scene["text/plain"].startswith("<Scene 'The drop onto a floor'")
    assert '<iframe title="Motion: The drop onto a floor"' in trajectory["text/html"]
    assert trajectory["text/plain"].startswith("<Trajectory of 'The drop onto a floor'")
    assert shown["text/html"].startswith("<div><iframe")
    assert "image/png" in figure or "Figure" in figure["text/plain"]
    assert "q1_rad" in frame["text/html"]
    assert "comparisons agree at 20 states" in verdict["text/html"]
    assert "mass (kg)" in chain["text/html"]


@pytest.mark.slow
def test_no_cell_prints_a_warning(outputs):
    for cell in outputs:
        assert not [output for output in cell if output["output_type"] == "stream"]
