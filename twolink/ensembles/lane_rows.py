"""The rows and the parameters of runs in lanes, whose steps carry the region of their error."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from twolink.ensembles.deviations import INDICES

# The numbers of rows of the parts that have several.
_LENGTHS = (4, 4, len(INDICES), 4, 4, 4, 2)


class Rows(NamedTuple):
    """The rows of a lane at the start of a step.

    `state` is (q, p), and `low` the rest of its sum, below its rounding. `centre` and `shape` are
    those of the region of the error, without the truncation error of the last step. `rates` are the
    derivatives of the last polynomials at the end of the last step, of the length `last` (s), and
    `tail` the sizes of the last terms of these there. `paths` bound how far both angles have turned
    in total (rad). `left` is the time to the end (s), NaN for a run that is lost, `spread` and
    `shift` are the largest sizes so far of the region and of its centre (rad, rad/s), `frequency`
    is that of `linear_flow`, and `steps` is the number of steps.
    """

    state: Any
    centre: Any
    shape: Any
    rates: Any
    tail: Any
    low: Any
    paths: Any
    last: Any
    left: Any
    spread: Any
    shift: Any
    frequency: Any
    steps: Any

    @classmethod
    def of(cls, rows: Any) -> Rows:
        """Return the parts of a list or an array of all rows."""
        ends = np.cumsum(_LENGTHS)
        parts = [rows[end - n : end] for n, end in zip(_LENGTHS, ends, strict=True)]
        return cls(*parts, *rows[ends[-1] : ROWS])


class Settings(NamedTuple):
    """The last parameters of a lane: the tolerance of steps (rad/s) and their longest length (s).

    The others are the round-off of generalized forces (N m), as from `round_off_of_loads`.
    """

    tolerance: Any
    cap: Any
    shared1: Any
    shared2: Any
    independent1: Any
    independent2: Any


ROWS = sum(_LENGTHS) + len(Rows._fields) - len(_LENGTHS)
"""The number of all rows."""

_FIRST_OF_SINGLE = ROWS - len(Rows._fields)

LAST, LEFT, FREQUENCY, STEPS = (
    _FIRST_OF_SINGLE + Rows._fields.index(name) for name in ("last", "left", "frequency", "steps")
)
"""The places of some of them."""
