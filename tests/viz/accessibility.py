"""axe-core, the accessibility checker, run in a page of the tests' browser.

It is not installed with the project: uv fetches a Python package that carries it, once, into a
cache folder. Without uv or a network the tests are skipped with the reason; with
TWOLINK_REQUIRE_TOOLS=1, which the full build sets, they fail.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

from twolink.files import atomic_write
from twolink.viz.browser import Page

AXE = "4.12.1"
PACKAGE = "axe-playwright-python==0.1.8"
REQUIRED = "TWOLINK_REQUIRE_TOOLS"


def need_axe() -> str:
    """Return axe-core's script; skip or fail the test where it cannot be had."""
    try:
        return _script()
    except OSError as error:
        reason = f"axe-core {AXE} is missing ({error}): accessibility is not checked"
        if os.environ.get(REQUIRED) == "1":
            pytest.fail(reason)
        pytest.skip(reason)


@cache
def _script() -> str:
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "twolink-tests"
    file = folder / f"axe-{AXE}.min.js"
    if not file.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with atomic_write(file) as temporary:
            temporary.write_bytes(_packed())
    return file.read_text(encoding="utf-8")


def _packed() -> bytes:
    """Return the script, from a Python package that carries it."""
    uv = shutil.which("uv")
    if uv is None:
        raise OSError("uv is not installed")
    with tempfile.TemporaryDirectory(prefix="twolink-") as folder:
        command = (uv, "pip", "install", "--quiet", "--no-deps", "--target", folder, PACKAGE)
        try:
            done = subprocess.run(command, check=False, capture_output=True, timeout=120)
        except subprocess.TimeoutExpired as error:
            raise OSError("uv gave no answer for 120 s") from error
        if done.returncode:
            raise OSError(f"uv: {done.stderr.decode(errors='replace').strip()[-200:]}")
        return (Path(folder) / "axe_playwright_python" / "axe.min.js").read_bytes()


def violations(page: Page) -> list[str]:
    """Return the rules that the shown page violates, each with the first element that does."""
    page.value(f"{need_axe()};1")
    found = page.value(
        "axe.run().then(({ violations, passes }) => ({ checked: passes.length, violations:"
        "violations.map(({ id, help, nodes }) => `${id}: ${help}: ${nodes[0].html.slice(0, 160)}`)"
        "}))"
    )
    # A page that is not there violates nothing.
    assert found["checked"] > 10
    return list(found["violations"])
