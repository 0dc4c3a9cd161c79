"""Truths that take minutes: made once, kept in `references.json`, and made again by this file.

    python -m twolink.hardcases.long_truths NAME …

makes those of the names anew, and all of them without names. Each is a motion in 113 bits or more
(`twolink.hardcases.quadruple`) at eleven times, with how much an error of the start has grown.
"""

from __future__ import annotations

import json
import math
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.files import written_whole
from twolink.hardcases.quadruple import Reference, Truth
from twolink.verification.states import Array

FILE = Path(__file__).with_name("references.json")

SAMPLES = 11

_BARS = Chain.uniform_bars()

REFERENCES: dict[str, Reference] = {
    "chaos": Reference(_BARS, (0.3, 0.3), (0.0, 0.0), 100.0, bits=320),
    "zero-gravity": Reference(_BARS, (0.3, -0.4), (0.5, -0.3), 1e5, gravity=(0.0, 0.0), cap=1.0),
    "spin": Reference(_BARS, (0.3, -0.4), (0.0, 1e5), 0.1),
    "stiff-spring": Reference(
        _BARS, (0.3, -0.4), (0.0, 0.0), 0.1, stiffness=(0.0, 1e10), rest=(0.0, -0.7)
    ),
}


def times(name: str) -> Array:
    """Return the times (s) of a reference."""
    return np.linspace(0.0, REFERENCES[name].duration, SAMPLES)


def made(name: str, count: int = SAMPLES) -> dict[str, Any]:
    """Return the first few entries of a reference, made anew."""
    reference, wanted = REFERENCES[name], times(name)[:count]
    truth = reference.truth(wanted)
    # A nudge far above the reference's rounding, that yet has not grown out of proportion.
    nudge = 1e-20 if reference.bits == 113 else 1e-75
    growth = reference.growth(wanted, nudge)
    return {
        "t": truth.t.tolist(),
        "q": truth.q.tolist(),
        "u": truth.u.tolist(),
        "growth": growth.tolist(),
    }


@cache
def kept(name: str) -> tuple[Truth, Array]:
    """Return a reference as it is in the file, and the growth of errors."""
    table = json.loads(FILE.read_text(encoding="utf-8"))[name]
    t, q, u, growth = (np.array(table[key]) for key in ("t", "q", "u", "growth"))
    return Truth(t, q, u), growth


def remake(names: list[str]) -> None:
    """Make some references anew and write them down beside the others."""
    table = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for name in names:
        table[name] = made(name)
        with written_whole(FILE) as file:
            file.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


def largest_growth(name: str) -> float:
    """Return by how much an error of the start grows at most."""
    return float(max(kept(name)[1], default=math.nan))


if __name__ == "__main__":
    remake(sys.argv[1:] or list(REFERENCES))
