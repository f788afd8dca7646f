"""Tables on the terminal, styled once."""

import math
from collections.abc import Collection
from typing import Any
from unicodedata import category

from rich.box import SIMPLE
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.table import Column, Table
from rich.text import Text

NONE = "n/a"
"""Stands where there is no figure to give."""


def number(value: float | None) -> str:
    """A figure without a unit."""
    return NONE if value is None or math.isnan(value) else f"{value:.3f}"


def counted(value: object) -> str:
    """A number of things, or anything else, where it is known."""
    return NONE if value is None else str(value)


def plural(count: int, word: str) -> str:
    """A count and its word, in the plural where it needs one."""
    return f"{count} {word}" if count == 1 else f"{count} {word}{'es' if word.endswith(('s', 'ch')) else 's'}"


def with_unknown(cell: str, unknown: int) -> str:
    """A figure's cell, and beside it the number of values that it leaves out as nobody knows them, where there are."""
    return f"{cell} ({unknown} unknown)" if unknown else cell


class TextTable(Table):
    """A table of names and figures, shown as they are written: a name may hold what rich takes for markup.

    A column is told by its heading, with ``>`` before it where cells stand to the right. Cells are broken into lines
    only under the headings that are listed in ``wraps``, and only between words: in a window that is too narrow for
    the rest the table is wider than it.
    """

    def __init__(self, *headings: str, title: str = "", wraps: Collection[str] = ()) -> None:
        super().__init__(
            *(_column(heading, wraps) for heading in headings),
            title=Text(printable(title)) if title else None,
            title_justify="left",
            title_style="bold",
            box=SIMPLE,
            padding=(0, 1, 0, 0),
        )

    def add_row(self, *cells: RenderableType | None, **look: Any) -> None:
        """Add a row; a string is shown as it is written, anything else as rich renders it."""
        shown = [Text(printable(cell)) if isinstance(cell, str) else cell for cell in cells]
        super().add_row(*shown, **look)
        for column, cell in zip(self.columns, shown, strict=False):
            if isinstance(cell, Text):
                column.min_width = max(column.min_width or 0, _least_width(cell, column))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """See rich: as wide as there is room, or as the least widths of all columns ask."""
        between, ends = 2 * len(self.columns) - 1, 2  # a space behind each column, and one of the box
        least = sum(column.min_width or 0 for column in self.columns) + between + ends
        return super().__rich_console__(console, options.update(max_width=max(options.max_width, least)))


def _column(heading: str, wraps: Collection[str]) -> Column:
    name = heading.removeprefix(">")
    shown, justify = Text(name), "left" if name == heading else "right"
    column = Column(shown, justify=justify, no_wrap=name not in wraps, overflow="fold")  # type: ignore[arg-type]
    column.min_width = _least_width(shown, column)
    return column


def _least_width(cell: Text, column: Column) -> int:
    """The width under which something of a cell would be cut off or broken [characters]."""
    lines = cell.plain.split("\n") if column.no_wrap else cell.plain.split()
    return max(map(cell_len, lines), default=0)


def print_whole(console: Console, table: RenderableType) -> None:
    """Print a table as wide as it has to be: in a file or a narrow window no figure may be cut off."""
    console.print(table, crop=False)


def printable(text: str) -> str:
    """Text that a terminal shows and does not obey: control characters are escaped, those of direction among them."""
    if text.isprintable():
        return text
    return "".join(_escaped(one) if category(one) in _OBEYED else one for one in text)


_OBEYED = {"Cc", "Cf", "Cs", "Zl", "Zp"}
"""Unicode's categories of characters that are not shown: control, format, halves of pairs, ends of lines."""


def _escaped(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode()


def say(console: Console, line: str) -> None:
    """Print one line as it is: a file's name may be long, and may hold what rich takes for markup."""
    console.print(printable(line.replace("\n", " ")), highlight=False, markup=False, emoji=False, soft_wrap=True)
