"""The environment of a result: versions of packages, and the machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path


def package_versions(*packages: str) -> dict[str, str]:
    """Return the versions of Python, twolink and the named packages."""
    named = {name: importlib.metadata.version(name) for name in ("twolink", *packages)}
    return {"python": platform.python_version(), **named}


def this_machine() -> dict[str, str | int | None]:
    """Return the operating system, the processor and the number of cores."""
    return {
        "system": platform.system(),
        "machine": platform.machine(),
        "processor": _processor(),
        "cores": os.cpu_count(),
    }


def this_commit() -> str:
    """Return the commit of the checkout that contains this library, or an empty string."""
    root = Path(__file__).resolve().parent.parent
    if not (root / ".git").exists():
        return ""
    asked = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        return subprocess.run(
            asked, capture_output=True, text=True, check=True, timeout=10
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def _processor() -> str:
    """Return the name of the processor, where the system says it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor())
