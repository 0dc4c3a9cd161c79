"""The page docs/check_your_engine.md, followed word for word in an empty folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from twolink.conformance.diagnosis import SENTENCES
from twolink.conformance.quantities import QUANTITIES

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "check_your_engine.md").read_text(encoding="utf-8")


def transcript():
    """Return the page's commands, each with the output that the page shows."""
    blocks = re.findall(r"```console\n(.*?)```", PAGE, re.DOTALL)
    found = []
    for line in "".join(blocks).splitlines():
        if line.startswith("$ "):
            found.append((line.removeprefix("$ "), []))
        else:
            found[-1][1].append(line)
    return found


@pytest.mark.slow
def test_the_page_word_for_word(tmp_path):
    if shutil.which("cc") is None:
        assert not os.environ.get("TWOLINK_REQUIRE_TOOLS"), "cc is not installed"
        pytest.skip("cc is not installed: docs/check_your_engine.md is not followed")
    folder = Path(sys.executable).parent
    environment = {
        **os.environ,
        "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
    }
    assert list(tmp_path.iterdir()) == []
    for command, shown in transcript():
        done = subprocess.run(
            command,
            shell=True,
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.stderr == "", command
        lines = done.stdout.splitlines()
        start, _, end = "\n".join(shown).partition("…\n")
        if end:
            assert lines[: len(start.splitlines())] == start.splitlines()
            assert lines[-len(end.splitlines()) :] == end.splitlines()
        else:
            assert lines == shown


def test_the_page_has_all_quantities_and_counts():
    for name in QUANTITIES:
        assert f"| `{name}` |" in PAGE
    assert f"{len(SENTENCES)} mistakes are" in PAGE.replace("\n", " ")


def test_the_python_engine_of_the_page_agrees(tmp_path, monkeypatch):
    from twolink.conformance.runner import conform
    from twolink.conformance.suites import suite
    from twolink.engines.attach import attach

    (code,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "my_module.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    start = attach("my_module:MyEngine", in_process=True)
    found = conform("mine", start, {"evaluation": suite("evaluation")})
    assert found.agrees
    assert len(found.compared) == 22
