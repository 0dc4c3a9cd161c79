"""Names of methods, progress and result files of the commands that measure methods."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from twolink.cli.progress import progress_bar
from twolink.cli.terminal import refuse, write_json
from twolink.files import atomic_write, new_folder
from twolink.suffixes import RESULTS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Study(Protocol):
    """A result that can be written down."""

    def document(self) -> dict[str, Any]:
        """Return it as plain data."""

    def csv(self) -> str:
        """Return it as comma-separated values."""


def check_budget(budget: float) -> None:
    """Refuse a budget that is no positive number of seconds."""
    if not 0 < budget < math.inf:
        refuse(f"--budget must be a positive number of seconds; got {budget:g}")


def names_in(words: str) -> tuple[str, ...]:
    """Return the names between commas, without empty ones."""
    return tuple(name.strip() for name in words.split(",") if name.strip())


@contextmanager
def bar_of(doing: str) -> Iterator[Callable[[str, float], None]]:
    """Show a progress bar; yield a callback that takes a stage and its completed share."""
    with progress_bar() as bar:
        task = bar.add_task(doing, total=1.0)
        yield lambda stage, share: bar.update(
            task, description=f"{doing}: {stage}", completed=share
        )


def files_of_study(name: str) -> tuple[str, ...]:
    """Return the names of the files that `write_study` writes."""
    return tuple(f"{name}{suffix}" for suffix in (*RESULTS, ".svg", ".png"))


def write_study(folder: Path, name: str, found: Study, figure: Figure) -> None:
    """Write a result into a folder: as JSON, as CSV, and its picture as SVG and PNG."""
    from twolink.viz.plots.style import save

    document, numbers, *pictures = (folder / file for file in files_of_study(name))
    with new_folder(folder):
        write_json(document, found.document())
        with atomic_write(numbers) as file:
            file.write_text(found.csv(), encoding="utf-8")
        for picture in pictures:
            save(figure, picture)
