"""mypy refuses calls that confuse the functions of a formulation, or formulations."""

import re
import subprocess
import sys

import pytest

PROGRAM = """\
from twolink import kane
from twolink.arithmetic import Matrix, Pair
from twolink.chain import Chain, Point
from twolink.formulations import FORMULATIONS, EquationsOfMotion, Formulation
from twolink.loads import Loads
from twolink.scene import Scene
from twolink.simulation import simulate


class Incomplete:
    def mass_matrix(self, chain: Chain, q: Pair) -> Matrix:
        return kane.mass_matrix(chain, q)


def run(
    scene: Scene, chain: Chain, q: Pair, u: Pair, loads: Loads, equations: EquationsOfMotion
) -> None:
    kane.mass_matrix(chain, q)
    kane.forward_dynamics(chain, (0.1, 0.2), u, loads)
    Formulation("Kane", kane, kane.partial_velocities)
    simulate(scene, formulation="kane")
    kane.mass_matrix(chain, q, u, loads)  # wrong
    kane.forward_dynamics(chain, q)  # wrong
    equations.mass_matrix(chain, q, u, loads)  # wrong
    equations.forward_dynamics(chain, q)  # wrong
    equations.forward_dynamics(chain, q, u, kane.mass_matrix(chain, q))  # wrong
    equations.mass_matix(chain, q)  # wrong
    Formulation("Kane", kane.partial_velocities, kane)  # wrong
    Formulation("Kane", Incomplete(), kane.partial_velocities)  # wrong
    FORMULATIONS["kanes"]  # wrong
    simulate(scene, formulation="kanes")  # wrong
    kane.partial_velocities(chain, q, u)  # wrong
    kane.generalized_active_force(chain, loads, q)  # wrong
"""


@pytest.mark.slow
def test_mypy_refuses_confused_functions_and_formulations(tmp_path):
    file = tmp_path / "caller.py"
    file.write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, "-m", "mypy", str(file)],
        capture_output=True,
        text=True,
        check=False,
    )
    refused = {int(line) for line in re.findall(r"caller\.py:(\d+): error:", done.stdout)}
    lines = enumerate(PROGRAM.splitlines(), start=1)
    assert refused == {number for number, line in lines if "# wrong" in line}, done.stdout
