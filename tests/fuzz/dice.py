"""Sources of inputs: a seed, good values, and bad ones."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

TEXTS = (
    "", " ", "[/nope]", "[bold]x", "\x1b[31mred\x1b[0m", "a\nb", "-", "--", "'\"`$(id)", "%s%n{0}",
    "<script>", "θ̇ 摆", "\u202egnp", "\udcff\udcfe", "x" * 300, "y" * 5000, ":smile:", "$\\frac$",
    "../../..", "/", ".", "~",
)  # fmt: skip
"""Words that are no number, no name and mostly no file."""

NUMBERS = (
    "nan", "inf", "-inf", "1e999", "-1", "0x10", "1,5", "ten", "", "--", "9" * 5000,
    "1e", "\x00"[:0] + "\x1b[2J",
)  # fmt: skip
"""Words that are not positive numbers, neither whole nor fractional."""


@dataclass
class Input:
    """A command line, its environment, and whether it must be refused.

    A `call` of the Python API takes the place of the command; it returns an exit code, and its
    words describe it. `shut` names streams that are closed or full. `out` are files that may be
    there in the end.
    """

    words: list[str]
    refused: bool | None = None
    environment: dict[str, str] = field(default_factory=dict)
    shut: str = ""
    out: tuple[Path, ...] = ()
    interrupted: float | None = None
    call: Callable[[], int] | None = None


class Dice(random.Random):
    """Random choices for one input: the same for the same seed and number."""

    def __init__(self, seed: int, number: int) -> None:
        """Seed them."""
        super().__init__(f"{seed} {number}")

    def happens(self, share: float) -> bool:
        """Return whether something happens that does so in this share of all inputs."""
        return self.random() < share

    def text(self) -> str:
        """Return a hostile word, or a random one."""
        if self.happens(0.7):
            return self.choice(TEXTS)
        letters = "".join(chr(self.choice((self.randrange(1, 0x250), self.randrange(1, 0xD800))))
                          for _ in range(self.randrange(1, 40)))  # fmt: skip
        return letters
