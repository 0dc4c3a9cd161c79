"""The registry of integration methods."""

import re
import subprocess
import sys
from typing import get_args

import pytest

from twolink.errors import SimulationError
from twolink.integration.methods import METHODS, NUMERIC_METHODS, NumericName, method_named


def test_every_name_has_a_method():
    assert set(get_args(NumericName)) == set(NUMERIC_METHODS)
    assert [*METHODS] == ["taylor", *NUMERIC_METHODS]


def test_only_taylor_series_locate_events():
    assert [name for name, method in METHODS.items() if method.locates_events] == ["taylor"]


def test_a_misspelt_name_is_refused_with_the_nearest_one():
    assert method_named("rk4") == "rk4"
    with pytest.raises(SimulationError, match=re.escape("(did you mean 'DOP853'?)")):
        method_named("DOP835")


@pytest.mark.slow_but_first
@pytest.mark.parametrize(
    ("name", "library"), [("taylor", "heyoka"), ("DOP853", "scipy.integrate"), ("rk4", None)]
)
def test_a_method_imports_its_own_libraries(name, library):
    program = (
        "import sys\n"
        "from twolink.integration.methods import METHODS\n"
        "libraries = ('heyoka', 'scipy.integrate')\n"
        "print(*(name for name in libraries if name in sys.modules))\n"
        f"METHODS[{name!r}].import_libraries()\n"
        "print(*(name for name in libraries if name in sys.modules))\n"
    )
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout == f"\n{library or ''}\n"


def test_taylor_series_need_no_heyoka_until_they_run(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    METHODS["taylor"].import_libraries()


@pytest.mark.slow
def test_mypy_refuses_a_misspelt_name(tmp_path):
    file = tmp_path / "caller.py"
    file.write_text(
        "from twolink.scene import Scene\n"
        "from twolink.simulation import simulate\n"
        "def run(scene: Scene) -> None:\n"
        '    simulate(scene, method="DOP853")\n'
        '    simulate(scene, method="DOP835")\n'
        '    simulate(scene, formulation="kanes")\n'
    )
    run = subprocess.run(
        [sys.executable, "-m", "mypy", str(file)],
        capture_output=True,
        text=True,
        check=False,
    )
    wrong = re.findall(r"caller\.py:(\d+): error: Argument \"(\w+)\"", run.stdout)
    assert wrong == [("5", "method"), ("6", "formulation")], run.stdout
