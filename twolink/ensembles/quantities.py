"""The quantities that can be kept, in one registry.

A new quantity is its own file and an entry in `QUANTITIES`: its key in the table [keep] of a sweep
file, with the type of its value and the quantities that a value stands for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, get_type_hints

from twolink.ensembles.extreme_speeds import ExtremeSpeeds
from twolink.ensembles.extremes import Extremes
from twolink.ensembles.first_time import FirstTime
from twolink.ensembles.impact_counts import ImpactCounts
from twolink.ensembles.quantity import Quantity
from twolink.ensembles.states import Energy, Final, Samples


@dataclass(frozen=True)
class Kept:
    """A key of [keep]: the quantities that its value stands for, and a description.

    `table` is the class whose fields are the keys of its tables; without it, `kind` is the type of
    its value.
    """

    make: Callable[[Any], tuple[Quantity, ...]]
    description: str
    kind: Any = bool
    table: Any = None

    def entries(self) -> dict[str, Any]:
        """Return the keys of its tables, with types and defaults."""
        hints = get_type_hints(self.table)
        return {
            field.name: (hints[field.name], ... if field.default is MISSING else field.default)
            for field in fields(self.table)
        }


def _if_true(quantity: Quantity) -> Callable[[Any], tuple[Quantity, ...]]:
    return lambda value: (quantity,) if value else ()


QUANTITIES: Mapping[str, Kept] = {
    "final": Kept(_if_true(Final()), "q and u at the end"),
    "energy": Kept(_if_true(Energy()), "T + V at the start and at the end"),
    "extremes": Kept(_if_true(Extremes()), "the smallest and largest angles"),
    "extreme_speeds": Kept(
        _if_true(ExtremeSpeeds()), "the smallest and largest speeds, and their times"
    ),
    "impacts": Kept(_if_true(ImpactCounts()), "the number of impacts"),
    "samples": Kept(
        lambda count: (Samples(count),), "the number of samples of q, evenly spaced", int
    ),
    "first": Kept(
        lambda tables: tuple(FirstTime(**table) for table in tables),
        "first times: of flips, or of angles at a level",
        table=FirstTime,
    ),
}
"""The quantities that can be kept, by their keys in [keep]."""
