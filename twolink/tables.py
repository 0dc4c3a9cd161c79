"""Tables, described once and rendered to terminals, to pages and in notebooks."""

from __future__ import annotations

import html
import re
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from twolink.text import printable

# Characters between two columns of a terminal, and the margins of a row.
_BETWEEN, _MARGINS = 2, 2

# Numbers that a browser may break after the sign of their exponent, as in 2.4e-08.
_WITH_EXPONENT = re.compile(r"[\d.]+e-\d+")


class Tone(StrEnum):
    """The emphasis of a cell; each has a style in terminals and a CSS class in pages."""

    PLAIN = ""
    GOOD = "good"
    BAD = "bad"
    WARN = "warn"
    SOFT = "soft"


@dataclass(frozen=True)
class Cell:
    """A text in a table, with its emphasis, and in pages with a link."""

    text: str
    tone: Tone = Tone.PLAIN
    link: str = ""


@dataclass(frozen=True)
class Column:
    """A column: its heading, and whether it has numbers, which are aligned and never broken.

    Where a table is too wide, the columns with the largest `spare` are omitted first; those with 0
    remain. Text continues in a second line only in columns narrower than `wraps` (characters).
    """

    name: str
    number: bool = False
    spare: int = 0
    wraps: int = 0


@dataclass(frozen=True)
class Table:
    """A title, columns, and rows with a cell for each column."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]

    @property
    def least_width(self) -> int:
        """The width (characters) if headings, and cells that may, continue in a second line."""
        return self.width_with(self._widths(self._pieces))

    def widths(self, most: int) -> tuple[int, ...]:
        """Return the width of each column (characters) in a table of at most this width.

        It is exceeded where the table is wider even with all line breaks.
        """
        found = list(self._widths(self._pieces))
        left = max(0, most - self.width_with(found))
        for column, wanted in enumerate(self._widths(self._texts)):
            more = min(left, wanted - found[column])
            found[column], left = found[column] + more, left - more
        return tuple(found)

    def within(self, width: int) -> Table:
        """Return the table without as many spare columns as are needed to fit a width."""
        found = self
        while found.least_width > width:
            spare = max(column.spare for column in found.columns)
            if spare == 0:
                return found
            last = max(n for n, column in enumerate(found.columns) if column.spare == spare)
            found = found.without({last})
        return found

    def parts(self, width: int) -> tuple[Table, ...]:
        """Return tables with the first column and as many others as fit a width each."""
        first, *others = range(len(self.columns))
        parts: list[list[int]] = [[first]]
        for index in others:
            wider = self.only([*parts[-1], index])
            if wider.least_width > width and len(parts[-1]) > 1:
                parts.append([first])
            parts[-1].append(index)
        return tuple(self.only(part) for part in parts)

    def without(self, omitted: Iterable[int]) -> Table:
        """Return the table without the columns of these indices."""
        gone = set(omitted)
        return self.only([n for n in range(len(self.columns)) if n not in gone])

    def only(self, indices: Sequence[int]) -> Table:
        """Return the table with the columns of these indices."""
        return replace(
            self,
            columns=tuple(self.columns[n] for n in indices),
            rows=tuple(tuple(row[n] for n in indices) for row in self.rows),
        )

    def html(self, kind: str = "") -> str:
        """Return the table as HTML, with an optional CSS class."""
        heads = "".join(
            f'<th scope="col"{_kinds(column)}>{_escaped(column.name)}</th>'
            # A heading without text is read as one that is missing.
            if column.name
            else "<td></td>"
            for column in self.columns
        )
        body = "\n".join(f"<tr>{self._row(row)}</tr>" for row in self.rows)
        named = any(column.name for column in self.columns)
        return (
            (f'<table class="{kind}">' if kind else "<table>")
            + (f"<caption>{_escaped(self.title)}</caption>" if self.title else "")
            + (f"<thead><tr>{heads}</tr></thead>" if named else "")
            + f"\n<tbody>{body}</tbody></table>"
        )

    def _row(self, row: tuple[Cell, ...]) -> str:
        cells = []
        for number, (column, cell) in enumerate(zip(self.columns, row, strict=True)):
            # The first cell names its row.
            tag = 'th scope="row"' if number == 0 else "td"
            content = _escaped(cell.text)
            if cell.tone:
                content = f'<span class="{cell.tone}">{content}</span>'
            if cell.link:
                content = f'<a href="{html.escape(cell.link)}">{content}</a>'
            cells.append(f"<{tag}{_kinds(column)}>{content}</{tag[:2]}>")
        return "".join(cells)

    def width_with(self, widths: Iterable[int]) -> int:
        """Return the width of the table (characters) whose columns have these widths."""
        return sum(widths) + _BETWEEN * (len(self.columns) - 1) + _MARGINS

    def _widths(self, parts: Callable[[int], list[str]]) -> tuple[int, ...]:
        """Return the width of the longest part of each column."""
        return tuple(
            max(
                (length(line) for text in parts(n) for line in printable(text).split("\n")),
                default=0,
            )
            for n in range(len(self.columns))
        )

    def _texts(self, column: int) -> list[str]:
        return [self.columns[column].name, *(row[column].text for row in self.rows)]

    def _pieces(self, column: int) -> list[str]:
        """Return the parts of a column's texts that a line break does not separate."""
        head, *texts = self._texts(column)
        wraps = self.columns[column].wraps
        pieces = head.split()
        for text in texts:
            pieces += [text[:wraps], *text.split()] if wraps else [text]
        return pieces


def _kinds(column: Column) -> str:
    """Return the CSS classes of a column's cells: narrow pages leave out spare ones."""
    kinds = [*(["number"] if column.number else []), *(["spare"] if column.spare else [])]
    return f' class="{" ".join(kinds)}"' if kinds else ""


def table(
    title: str, columns: Iterable[Column | str], rows: Iterable[Iterable[Cell | str]]
) -> Table:
    """Return a table; texts stand for plain columns and cells."""
    return Table(
        title,
        tuple(Column(each) if isinstance(each, str) else each for each in columns),
        tuple(tuple(Cell(each) if isinstance(each, str) else each for each in row) for row in rows),
    )


def length(line: str) -> int:
    """Return the number of a terminal's columns that a line takes."""
    return sum(
        0 if unicodedata.combining(letter) else 1 + (unicodedata.east_asian_width(letter) in "WF")
        for letter in line
    )


def as_html(words: object) -> str:
    """Return text escaped for HTML, in which no line break divides a number."""
    return _WITH_EXPONENT.sub(r'<span class="whole">\g<0></span>', html.escape(printable(words)))


def _escaped(words: str) -> str:
    return as_html(words).replace("\n", "<br>")
