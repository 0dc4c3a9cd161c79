"""The environment of a result: versions of packages, and the machine."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
from dataclasses import dataclass
from pathlib import Path

# Above this load for each core times are those of other programs.
_BUSY = 0.5


@dataclass(frozen=True)
class Load:
    """The load of the machine: processes that ran or waited, over the last minute."""

    average: float
    cores: int

    @property
    def most(self) -> float:
        """The largest load at which times are comparable."""
        return _BUSY * self.cores

    @property
    def busy(self) -> bool:
        """Whether times are those of a shared machine."""
        return self.average > self.most

    def __str__(self) -> str:
        """Return the load in words."""
        shared = ": busy, times are those of a shared machine" if self.busy else ""
        return f"{self.average:.2f} on {self.cores} cores{shared}"


def load_of_machine() -> Load | None:
    """Return the load of this machine, or None where the system does not report it."""
    if not hasattr(os, "getloadavg"):
        return None
    return Load(os.getloadavg()[0], os.cpu_count() or 1)


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
