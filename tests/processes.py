"""The work of another process."""

from __future__ import annotations

import os


def computed(process: int) -> float:
    """Return the seconds that a process has computed."""
    with open(f"/proc/{process}/stat", encoding="utf-8") as stream:
        fields = stream.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
