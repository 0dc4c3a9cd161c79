"""An arc: the motion in one mode between two jumps."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from twolink.simulation.hybrid.block import Block
from twolink.simulation.hybrid.compiled import CompiledMode
from twolink.simulation.hybrid.mode import Doubt, Mode, Trigger
from twolink.simulation.hybrid.state import HybridState

_NOTHING: Mapping[Trigger, float] = MappingProxyType({})


class Arc(NamedTuple):
    """The motion in one mode between two jumps: its ends, its steps, and the event that ended it.

    `event` is None if the arc ends at the requested time. Round-off may move a flat event by the
    time `spread` (s). The last step is truncated at the end of the arc. Forces (N or N m) that are
    zero within round-off since the start are not below their `lowest` values.
    """

    mode: Mode
    start: HybridState
    end: HybridState
    blocks: tuple[Block, ...]
    event: Trigger | None
    doubts: tuple[Doubt, ...]
    compiled: CompiledMode
    compile_seconds: float
    spread: float = 0.0
    lowest: Mapping[Trigger, float] = _NOTHING

    @property
    def step_count(self) -> int:
        """The number of its steps."""
        count = 0
        for block in self.blocks:
            count += len(block.lengths)
        return count


NO_ARCS: Mapping[CompiledMode, Arc] = MappingProxyType({})
