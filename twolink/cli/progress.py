"""The progress bar of every command, drawn on a terminal at once or after some seconds.

`rich.progress` is imported when the bar is drawn: not without a terminal, and not for short work.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from time import monotonic
from typing import TYPE_CHECKING, Any

from twolink.cli.terminal import error_page, styled

if TYPE_CHECKING:
    from rich.progress import Progress
    from rich.text import Text


@dataclass
class _Task:
    """A line of the bar: its description, its completed part, the whole, and its start (s)."""

    description: str
    completed: float
    total: float
    begun: float


@contextmanager
def progress_bar(patience: float = 0.0) -> Iterator[ProgressBar]:
    """Show a bar on the terminal, if there is one, and leave nothing of it behind.

    It is drawn by the first call that is `patience` seconds after the beginning, or later.
    """
    with ExitStack() as context:
        yield ProgressBar(context, patience)


class ProgressBar:
    """Tasks in progress, of which `context` ends the drawing."""

    def __init__(self, context: ExitStack, patience: float) -> None:
        """Begin without tasks."""
        self._context, self._patience, self._begun = context, patience, monotonic()
        self._tasks: list[_Task] = []
        self._drawn: Progress | None = None
        self._undecided = True
        self._draw()

    def add_task(self, description: str, total: float) -> int:
        """Add a task, of which nothing is completed; return its number."""
        self._tasks.append(_Task(description, 0.0, total, monotonic()))
        drawn = self._drawn
        self._draw()
        if drawn is not None:
            drawn.add_task(description, total=total)
        return len(self._tasks) - 1

    def update(self, task: int, *, completed: float, description: str | None = None) -> None:
        """Set the completed part of a task, and its description."""
        own = self._tasks[task]
        own.completed = completed
        own.description = own.description if description is None else description
        self._draw()
        if self._drawn is not None:
            self._drawn.update(
                self._drawn.task_ids[task], completed=completed, description=own.description
            )

    def advance(self, task: int, by: float = 1.0) -> None:
        """Add to the completed part of a task."""
        self.update(task, completed=self._tasks[task].completed + by)

    def _draw(self) -> None:
        """Draw the bar if it is time, and if there is a terminal."""
        if not self._undecided or monotonic() - self._begun < self._patience:
            return
        self._undecided = False
        page = error_page()
        # Without a terminal an empty line would be left.
        if not page.is_terminal:
            return
        self._drawn = self._context.enter_context(_bar_on(page))
        for task in self._tasks:
            number = self._drawn.add_task(task.description, total=task.total)
            self._drawn.update(number, completed=task.completed)
            own = self._drawn.tasks[self._drawn.task_ids.index(number)]
            own.start_time = (own.start_time or 0.0) - (monotonic() - task.begun)


def _bar_on(page: Any) -> Progress:
    """Return the bar of the library, on a console."""
    from rich.progress import BarColumn, Progress, Task, TextColumn, TimeElapsedColumn

    class Description(TextColumn):
        """The description of the current task, as text."""

        def render(self, task: Task) -> Text:
            return styled(task.description)

    columns = (Description(""), BarColumn(), TimeElapsedColumn())
    return Progress(*columns, console=page, transient=True)
