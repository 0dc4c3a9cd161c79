"""Settings of all tests: every run draws the same examples, and says from which seed."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, settings

SEED = 20261121

# The tests start many interpreters. Where bytecode must not be written beside the sources, it goes
# into pytest's cache, or each interpreter would compile every package that it imports.
if sys.dont_write_bytecode:
    sys.dont_write_bytecode = False
    sys.pycache_prefix = str(Path(__file__).parent.parent / ".pytest_cache" / "bytecode")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix

# A background process of a shell ignores Ctrl-C, and all commands that the tests start and
# interrupt would inherit this.
signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile(
    "twolink",
    derandomize=True,
    deadline=None,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
# For a long look, with other examples each time: pytest --hypothesis-profile thorough.
settings.register_profile(
    "thorough", settings.get_profile("twolink"), derandomize=False, max_examples=2000
)
# For a night: pytest tests/hardcases/test_fuzz.py --hypothesis-profile nightly.
settings.register_profile(
    "nightly", settings.get_profile("thorough"), max_examples=50_000, database=None
)
settings.load_profile("twolink")


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Run all tests on all cores; run those that are named on the command line in one process.

    `-n` overrides this, and `--pdb` and `-p no:xdist` keep every run in one process.
    """
    option = config.option
    # xdist's own processes call this too, and must not start further ones.
    if hasattr(config, "workerinput"):
        return
    everything = config.args_source is not pytest.Config.ArgsSource.ARGS
    if everything and config.pluginmanager.hasplugin("xdist") and option.numprocesses is None:
        option.numprocesses = "auto"
        # Tests of one module share fixtures, so a process begins with whole modules.
        option.dist = "worksteal"


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with long tests: one that begins last would leave the other processes idle."""
    items.sort(key=lambda item: item.get_closest_marker("long") is None)


@pytest.hookimpl(trylast=True)
def pytest_itemcollected(item: pytest.Item) -> None:
    """Mark later cases of a test that is slow but for the first, and the first test of a module.

    The former are slow. The latter is quick, unless it is slow or needs an engine.
    """
    if item.get_closest_marker("slow_but_first") and _is_later_case(item):
        item.add_marker("slow")
    marked = item.get_closest_marker("slow") or item.get_closest_marker("engines")
    module = item.getparent(pytest.Module)
    if module is not None and not marked and not module.stash.get(_HAS_QUICK, False):
        module.stash[_HAS_QUICK] = True
        item.add_marker("quick")


_HAS_QUICK = pytest.StashKey[bool]()


def _is_later_case(item: pytest.Item) -> bool:
    """Return whether a test was collected before with other parameters."""
    assert item.parent is not None
    seen = item.parent.stash.setdefault(_SEEN, set())
    name = getattr(item, "originalname", item.name)
    later = name in seen
    seen.add(name)
    return later


_SEEN = pytest.StashKey[set[str]]()


def pytest_report_header() -> str:
    return f"twolink: random states from seed {SEED}; hypothesis draws the same examples each time"


@pytest.fixture
def random() -> np.random.Generator:
    """Random numbers, the same in every run of a test."""
    return np.random.default_rng(SEED)
