"""Import of optional packages and of packages with side effects."""

from __future__ import annotations

import importlib
import sys
from threading import Lock
from typing import Any

from twolink.errors import SimulationError

# Without the lock a second thread would see a partly initialised module.
_ONE_AT_A_TIME = Lock()


def heyoka() -> Any:
    """Return the module heyoka.

    If SymPy is installed, heyoka imports it, which takes seconds and is not needed here: SymPy is
    hidden during the import. heyoka's disk cache in the user's home is disabled: it grows to 20 GB,
    takes seconds to open, and distorts measured compile times. If heyoka has been imported before,
    its settings are unchanged. Raises `SimulationError` if heyoka is not installed.
    """
    with _ONE_AT_A_TIME:
        return sys.modules.get("heyoka") or _imported_heyoka()


def _imported_heyoka() -> Any:
    hidden = "sympy" not in sys.modules
    if hidden:
        sys.modules["sympy"] = None  # type: ignore[assignment]
    try:
        import heyoka
    except ImportError as error:
        raise SimulationError(
            "heyoka is not installed; install version 7.10 or later (pip install heyoka), or use "
            "method DOP853"
        ) from error
    finally:
        if hidden:
            del sys.modules["sympy"]
    heyoka.llvm_state.set_diskcache_enabled(False)
    # Its warnings go to the standard output, which is for results.
    heyoka.set_logger_level_critical()
    return heyoka


def flint() -> Any:
    """Return the module flint of python-flint.

    Raises `SimulationError` if it is not installed.
    """
    try:
        import flint
    except ImportError as error:
        raise SimulationError(
            "python-flint is not installed; install version 0.7 or later (pip install "
            '"twolink[rigour]")'
        ) from error
    return flint


def pandas() -> Any:
    """Return the module pandas. Raises `SimulationError` if it is not installed."""
    return _extra("pandas", "pandas", "frames")


def xarray() -> Any:
    """Return the module xarray. Raises `SimulationError` if it is not installed."""
    return _extra("xarray", "xarray", "frames")


def zarr() -> Any:
    """Return the module zarr. Raises `SimulationError` if it is not installed."""
    return _extra("zarr", "zarr", "sweeps")


def distributed() -> Any:
    """Return the module distributed, of Dask. Raises `SimulationError` if it is not installed."""
    return _extra("distributed", "Dask", "cluster")


def display() -> Any:
    """Return the module that draws, films and shows results.

    It stands above the modules whose results it shows, and is imported when it is called.
    """
    return importlib.import_module("twolink.viz.display")


def drawing(thing: Any) -> str:
    """Return a drawing (SVG) of a scene or chain."""
    return str(display().drawing(thing))


def _extra(module: str, package: str, extra: str) -> Any:
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not module.startswith(error.name):
            raise
        raise SimulationError(
            f'{package} is not installed; install it with pip install "twolink[{extra}]"'
        ) from error
