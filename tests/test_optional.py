"""Optional packages: side effects of their import."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SIMULATED = """
from twolink.scene import Scene
from twolink.simulation import simulate

simulate(Scene.load("models/scenes/drop.toml"))
"""


def python(code: str, home: Path) -> str:
    """Return the output of a program whose user has an empty home."""
    places = {name: str(home) for name in ("HOME", "XDG_CACHE_HOME", "TMPDIR")}
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **places},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def files_in(home: Path) -> list[Path]:
    return [path for path in home.rglob("*") if path.is_file()]


@pytest.mark.slow
def test_a_simulation_leaves_nothing_in_the_home(tmp_path):
    """And prints nothing."""
    assert python(SIMULATED, tmp_path) == ""
    assert files_in(tmp_path) == []


@pytest.mark.slow
def test_heyoka_would_cache_compiled_code(tmp_path):
    """The test above would see a cache: heyoka alone writes one."""
    python("import heyoka" + SIMULATED, tmp_path)
    assert [path.name for path in files_in(tmp_path)] == ["cache.db"]


@pytest.mark.slow
@pytest.mark.parametrize("chosen", [True, False])
def test_settings_of_an_imported_heyoka_are_unchanged(tmp_path, chosen):
    output = python(
        f"import heyoka; heyoka.llvm_state.set_diskcache_enabled({chosen})"
        f"{SIMULATED}\nprint(heyoka.llvm_state.get_diskcache_enabled())",
        tmp_path,
    )
    assert output.strip() == str(chosen)


def test_threads_may_import_it_at_once(tmp_path):
    output = python(
        """
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from twolink.optional import heyoka

ready = Barrier(8)

def imported(number):
    ready.wait()
    state = heyoka().llvm_state
    return hasattr(heyoka(), "real"), state.get_diskcache_enabled()

with ThreadPoolExecutor(8) as threads:
    print(set(threads.map(imported, range(8))))
""",
        tmp_path,
    )
    assert output.strip() == "{(True, False)}"


@pytest.mark.slow
def test_sympy_is_not_imported(tmp_path):
    assert python(f"{SIMULATED}\nimport sys; print('sympy' in sys.modules)", tmp_path) == "False\n"
