"""The plugin for pytest, in processes of their own in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
WRONG = "from tests.conformance.wrong import NoHalf as Wrong\n"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "mine.py").write_text(f"from tests.conformance.arm import Arm\n{WRONG}")
    return tmp_path


def run(folder, *arguments):
    """Run pytest with the plugin, as its entry point registers it."""
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--color=no"]
    if not installed():
        command += ["-p", "twolink.conformance.pytest_plugin"]
    return subprocess.run(
        [*command, *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{folder}", "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        check=False,
    )


def installed():
    """Return whether the entry point is registered: not in an older editable installation."""
    from importlib.metadata import entry_points

    return any(entry.name == "twolink" for entry in entry_points(group="pytest11"))


def counts(output):
    return {kind: int(n) for n, kind in re.findall(r"(\d+) (\w+)", output.splitlines()[-1])}


@pytest.mark.slow
def test_a_right_engine_has_a_test_for_each_vector(folder):
    done = run(folder, "--twolink-engine", "mine:Arm", "--twolink-suite", "evaluation")
    assert done.returncode == 0, done.stdout + done.stderr
    assert counts(done.stdout)["passed"] == 130


@pytest.mark.slow
def test_vectors_fail_for_a_wrong_engine(folder):
    arguments = ("--twolink-engine", "mine:Wrong", "--twolink-suite", "evaluation", "-k", "kinetic")
    done = run(folder, *arguments)
    assert done.returncode == 1
    found = counts(done.stdout)
    assert (found["failed"], found["deselected"]) == (11, 119)
    assert "silently wrong: the answer is twice the right one" in done.stdout
    assert "Traceback" not in done.stdout


@pytest.mark.slow
def test_known_failures_and_models_that_are_not_read(folder):
    (folder / "expect.toml").write_text('[[expect]]\ntest = "*/kinetic-energy"\nreason = "known"\n')
    (folder / "planar.py").write_text(f"{WRONG}class Planar(Wrong):\n    reads = ('parameters',)\n")
    done = run(folder, "--twolink-engine", "planar:Planar", "--twolink-expect", "expect.toml")
    assert done.returncode == 0, done.stdout
    found = counts(done.stdout)
    assert (found["passed"], found["xfailed"]) == (119, 11)
    assert found["skipped"] > 500


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--twolink-engine", "pinnochio"), "did you mean 'Pinocchio'"),
        (("--twolink-engine", "mine:Arm", "--twolink-suite", "x"), "suite must be one of"),
    ],
)
def test_wrong_options_are_a_usage_error(folder, arguments, words):
    done = run(folder, *arguments)
    assert done.returncode == 4
    assert words in done.stderr


@pytest.mark.slow
def test_an_engine_that_does_not_start(folder):
    done = run(folder, "--twolink-engine", "mine:Leg", "-k", "bars/read")
    assert done.returncode == 1
    assert "the engine does not start" in done.stdout


@pytest.mark.slow
def test_without_the_option_the_plugin_adds_no_tests(folder):
    (folder / "test_nothing.py").write_text("def test_it():\n    pass\n")
    done = run(folder)
    assert counts(done.stdout) == {"passed": 1}


@pytest.mark.slow
def test_motions(folder):
    """A motion has one test, for all methods of the engine; two have damping."""
    (folder / "moving.py").write_text("from tests.conformance.mover import Undamped\n")
    done = run(folder, "--twolink-engine", "moving:Undamped", "--twolink-suite", "motion")
    assert done.returncode == 1
    found = counts(done.stdout)
    assert (found["failed"], found["passed"]) == (2, 6)
    for damped in ("modelica-double-pendulum", "dampers"):
        assert re.search(rf"FAILED .*{damped}", done.stdout)
    assert "converges to another model" in done.stdout


@pytest.mark.slow
def test_a_suite_without_vectors(folder):
    """A quantity at random states is one test, for all formulations."""
    done = run(folder, "--twolink-engine", "pinocchio", "--twolink-suite", "verify")
    assert done.returncode == 0, done.stdout + done.stderr
    assert counts(done.stdout)["passed"] == 11
    wrong = run(folder, "--twolink-engine", "mine:Wrong", "--twolink-suite", "verify")
    assert counts(wrong.stdout)["failed"] == 1
    assert "it differs from Kane" in wrong.stdout
