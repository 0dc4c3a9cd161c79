"""Packages that may be missing, or that are to be imported with care."""

from __future__ import annotations

import sys
from threading import Lock
from typing import Any

from twolink.errors import SimulationError

# Of two threads the second would find a module that is not whole yet.
_ONE_AT_A_TIME = Lock()


def heyoka() -> Any:
    """Return the module heyoka.

    Where SymPy is installed, heyoka imports it, which takes seconds and is of no use here: it is
    kept out of the way. Nor does heyoka keep what it compiles in the user's home: by default it
    would fill that with up to 20 GB, which take seconds to open, and compiling would seem to cost
    less than it does. Who imported heyoka before keeps what was set. Raises `SimulationError` where
    heyoka is not installed.
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
            "heyoka is not installed; allowed is version 7.10 or later (pip install heyoka), or "
            "method DOP853"
        ) from error
    finally:
        if hidden:
            del sys.modules["sympy"]
    heyoka.llvm_state.set_diskcache_enabled(False)
    return heyoka


def flint() -> Any:
    """Return the module flint, of python-flint.

    Raises `SimulationError` where it is not installed.
    """
    try:
        import flint
    except ImportError as error:
        raise SimulationError(
            "python-flint is not installed; allowed is version 0.7 or later (pip install "
            '"twolink[rigour]")'
        ) from error
    return flint
