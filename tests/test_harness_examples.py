"""The harness skeletons in C, C++, JavaScript and Octave: compiled, run, and in agreement.

A tool that is not installed is reported as a skipped test; with TWOLINK_REQUIRE_TOOLS=1, which the
full build sets, it is a failure.
"""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from twolink.conformance.harness_check import check_harness
from twolink.conformance.runner import conform
from twolink.conformance.suites import suite
from twolink.engines.attach import attach

FOLDER = Path(__file__).parent.parent / "examples" / "harness"
LONGEST = 150

# Language: the tool, the command that compiles, and the command that runs.
HARNESSES = {
    "c": ("cc", "cc -Wall -Wextra -Werror -O2 -o engine engine.c -lm", "cmd: ./engine"),
    "cpp": (
        "c++",
        "c++ -std=c++17 -Wall -Wextra -Werror -O2 -o engine engine.cpp",
        "cmd: ./engine",
    ),
    "js": ("node", None, "cmd: node engine.js"),
    "m": ("octave-cli", None, "cmd: octave-cli --no-init-file --quiet --no-line-editing engine.m"),
}


@pytest.fixture(params=HARNESSES)
def harness(request, tmp_path, monkeypatch):
    """The engine of a language, built in an empty folder; its command."""
    tool, build, command = HARNESSES[request.param]
    if shutil.which(tool) is None:
        reason = f"{tool} is not installed: examples/harness/engine.{request.param} is not checked"
        assert not os.environ.get("TWOLINK_REQUIRE_TOOLS"), reason
        pytest.skip(reason)
    shutil.copy(FOLDER / f"engine.{request.param}", tmp_path)
    monkeypatch.chdir(tmp_path)
    if build is not None:
        subprocess.run(shlex.split(build), check=True, timeout=120)
    return command


@pytest.mark.slow
def test_an_example_keeps_to_the_protocol(harness):
    checks = check_harness(attach(harness), 30.0)
    assert [(check.name, check.said) for check in checks if not check.passed] == []


@pytest.mark.slow
def test_an_example_agrees_with_the_vectors(harness):
    found = conform(harness, attach(harness), {"evaluation": suite("evaluation")}, seconds=30.0)
    assert found.agrees, [(result.id, result.said) for result in found.failed]
    assert len(found.compared) == 130


@pytest.mark.parametrize("language", HARNESSES)
def test_an_example_is_short_and_has_its_build_command(language):
    text = (FOLDER / f"engine.{language}").read_text()
    assert len(text.splitlines()) <= LONGEST
    _, build, command = HARNESSES[language]
    assert f"twolink conform '{command}'" in text
    if build is not None:
        assert build.replace("-Wall -Wextra -Werror ", "") in text
