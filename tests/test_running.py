"""How the tests run: on all cores, named files in one process, and a quick part of them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

# Each test starts pytest several times.
pytestmark = pytest.mark.slow

ROOT = Path(__file__).parent.parent
PASSING = "import pytest\n\n\ndef test_one():\n    pass\n\n\ndef test_two():\n    pass\n"


@pytest.fixture
def project(tmp_path):
    """A project with our settings, our conftest.py, and two modules of two tests."""
    (tmp_path / "pyproject.toml").write_text((ROOT / "pyproject.toml").read_text())
    tests = tmp_path / "tests"
    tests.mkdir()
    (tests / "conftest.py").write_text((ROOT / "tests" / "conftest.py").read_text())
    for name in ("a", "b"):
        (tests / f"test_{name}.py").write_text(PASSING)
    slow = PASSING.replace("def test_one", "@pytest.mark.slow\ndef test_one")
    (tests / "test_c.py").write_text(slow)
    return tmp_path


def run_in(project, *arguments):
    """Return the output of pytest; as a user starts it, also where this test is one of xdist's."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")}
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments],
        capture_output=True, text=True, check=False, cwd=project, timeout=60,
        stdin=subprocess.DEVNULL, env={**environment, "PYTEST_XDIST_AUTO_NUM_WORKERS": "2"},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_all_tests_run_on_all_cores_and_named_files_in_one_process(project):
    whole = run_in(project)
    assert "5 passed" in whole
    assert "2/2 workers" in whole
    named = run_in(project, "tests/test_a.py")
    assert "2 passed" in named
    assert "worker" not in named


@pytest.mark.parametrize(
    "arguments", [["-p", "no:xdist"], ["--pdb"], ["-x", "-n", "0"]], ids=" ".join
)
def test_options_select_one_process(project, arguments):
    output = run_in(project, *arguments)
    assert "5 passed" in output
    assert "worker" not in output


def test_marks_select(project):
    assert "1 passed" in run_in(project, "-m", "slow", "-n", "0")
    quick = run_in(project, "-m", "quick", "-v", "-n", "0")
    assert [line.split()[0] for line in quick.splitlines() if "PASSED" in line] == [
        "tests/test_a.py::test_one",
        "tests/test_b.py::test_one",
        "tests/test_c.py::test_two",
    ]
