"""What a notebook shows of an object: HTML in which every text stays text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from html import escape
from typing import Any

from forcelab.errors import InputError


def html_table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; the texts of its cells cannot become markup."""

    def line(cells: Sequence[object], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(str(cell))}</{tag}>" for cell in cells) + "</tr>"

    above = f"<thead>{line(head, 'th')}</thead>" if head else ""
    return f"<table>{above}<tbody>{''.join(line(row, 'td') for row in rows)}</tbody></table>"


def html_title(title: str, more: str = "") -> str:
    """A title, and what else stands in its line; one of the two may be empty."""
    bold = f"<strong>{escape(title)}</strong> " if title else ""
    return f"<p>{bold}{escape(more)}</p>"


def html_picture(plot: Callable[[], Any]) -> str:
    """The drawing that `plot` gives, or the sentence that says why it cannot be drawn here."""
    try:
        return f"<div>{plot()._repr_svg_()}</div>"
    except InputError as error:
        return f"<p>{escape(str(error))}</p>"
