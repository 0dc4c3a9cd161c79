"""What an integration by Taylor series leaves behind, with events or without."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from twolink.scene import Scene
from twolink.simulation.hybrid.mode import Event, Impact


@dataclass(frozen=True, kw_only=True)
class MotionRun(ABC):
    """A motion by Taylor series, at the times that were asked for.

    `q` (rad) and `u` (rad/s) have shape (2, n), in the numbers of the precision. `steps` of the
    given order, none longer than `longest_step` (s), were taken, with `operations` for a term of
    the series; `compile_seconds` were spent on compiling (none, if a like scene was compiled
    before) and `run_seconds` on running.
    """

    scene: Scene
    formulation: str
    precision: str
    longest_step: float
    q: Any
    u: Any
    steps: int
    order: int
    operations: int
    compile_seconds: float
    run_seconds: float

    @property
    def events(self) -> tuple[Event, ...]:
        """The beginnings of modes: none in a motion without."""
        return ()

    @property
    def log(self) -> tuple[Impact, ...]:
        """The impacts: none in a motion without."""
        return ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What must be said of the motion, in sentences."""
        return ()

    @abstractmethod
    def dense(self) -> Callable[..., tuple[Any, Any]]:
        """Return q and u as functions of time (s): the very polynomials of this run's steps.

        At a jump they take a second argument, the `side` of it: "left" or "right".
        """
