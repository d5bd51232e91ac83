"""Two columns as HTML, for objects that a notebook shows."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

__all__ = ["html_rows"]

LONGEST = 300  # characters of a cell


def html_rows(rows: Sequence[tuple[str, str]]) -> str:
    """Table of names and values.

    Args:
        rows: Names and values as plain text.
    """
    left = "style='text-align:left'"
    pairs = [(escape(name), escape(_short(text))) for name, text in rows]
    cells = (f"<tr><th {left}>{name}</th><td {left}>{text}</td></tr>" for name, text in pairs)
    return f"<table>{''.join(cells)}</table>"


def _short(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
