"""References that take minutes to compute, stored in `references.json`.

    python -m twolink.hardcases.stored_references NAME …

recomputes the named references, or all of them. Each is a motion in 113 bits or more
(`twolink.hardcases.reference_integrator`) at eleven times, with the growth of an initial error.
"""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from twolink.chain import Chain
from twolink.files import atomic_write
from twolink.hardcases.reference_integrator import ReferenceMotion, ReferenceStates
from twolink.verification.states import Array

FILE = Path(__file__).with_name("references.json")

SAMPLES = 11

_BARS = Chain.uniform_bars()

REFERENCES: dict[str, ReferenceMotion] = {
    "chaos": ReferenceMotion(_BARS, (0.3, 0.3), (0.0, 0.0), 100.0, bits=320),
    "zero-gravity": ReferenceMotion(
        _BARS, (0.3, -0.4), (0.5, -0.3), 1e5, gravity=(0.0, 0.0), cap=1.0
    ),
    "spin": ReferenceMotion(_BARS, (0.3, -0.4), (0.0, 1e5), 0.1),
    "stiff-spring": ReferenceMotion(
        _BARS, (0.3, -0.4), (0.0, 0.0), 0.1, stiffness=(0.0, 1e10), rest=(0.0, -0.7)
    ),
}


def times(name: str) -> Array:
    """Return the times (s) of a reference."""
    return np.linspace(0.0, REFERENCES[name].duration, SAMPLES)


def computed(name: str, count: int = SAMPLES) -> dict[str, Any]:
    """Compute a reference, or its first few entries."""
    reference, wanted = REFERENCES[name], times(name)[:count]
    expected = reference.states(wanted)
    # A perturbation far above the reference's rounding that stays in the linear range.
    nudge = 1e-20 if reference.bits == 113 else 1e-75
    growth = reference.growth(wanted, nudge)
    return {
        "t": expected.t.tolist(),
        "q": expected.q.tolist(),
        "u": expected.u.tolist(),
        "growth": growth.tolist(),
    }


@cache
def stored(name: str) -> tuple[ReferenceStates, Array]:
    """Return a reference from the file, with the growth of errors."""
    table = json.loads(FILE.read_text(encoding="utf-8"))[name]
    t, q, u, growth = (np.array(table[key]) for key in ("t", "q", "u", "growth"))
    return ReferenceStates(t, q, u), growth


def recompute(names: list[str]) -> None:
    """Recompute some references and write them to the file with the others."""
    table = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for name in names:
        table[name] = computed(name)
        with atomic_write(FILE) as file:
            file.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    recompute(sys.argv[1:] or list(REFERENCES))
