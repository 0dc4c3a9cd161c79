"""The environment of a result: versions of packages, and the machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform


def package_versions(*packages: str) -> dict[str, str]:
    """Return the versions of Python, twolink and the named packages."""
    named = {name: importlib.metadata.version(name) for name in ("twolink", *packages)}
    return {"python": platform.python_version(), **named}


def this_machine() -> dict[str, str | int | None]:
    """Return the operating system, the processor architecture and the number of cores."""
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
    }
