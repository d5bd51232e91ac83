"""Rows of numbers in a text: separators, decimal commas, Fortran exponents, words behind the numbers.

Columns are separated by semicolons, blanks, tabs or commas. Commas are decimal where every row has two or more columns
without them and no number has a point: ``-69,9; 11,54`` or ``-69,9 11,54``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from tiengine.parameters.input_files import numbers_of

__all__ = ["has_decimal_commas", "leading_numbers", "split_row", "unquoted"]

NUMBER = re.compile(r"[+-]?(\d[\d.,]*|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf)", flags=re.ASCII | re.IGNORECASE)
QUOTED_ROW = re.compile(r'\s*"[^"]*"(\s*[;,\t ]\s*"[^"]*")*\s*[;,]?\s*')
DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eEdD][+-]?\d+)?", flags=re.ASCII)
FORTRAN_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[+-]?\d)")


def has_decimal_commas(texts: Sequence[str]) -> bool:
    """Whether the commas of the rows of numbers in a text are decimal ones.

    Args:
        texts: Rows without comments; rows with other words or with a single number are ignored.
    """
    rows = [_tokens(text) for text in texts]
    tokens = [token for row in rows if len(row) > 1 and all(map(NUMBER.fullmatch, row)) for token in row]
    single = [row[0] for row in rows if len(row) == 1 and NUMBER.fullmatch(row[0])]
    with_comma = [token for token in tokens if "," in token]
    return (
        bool(with_comma)
        and all(DECIMAL_COMMA.fullmatch(token) for token in with_comma)
        and not any("." in token for token in tokens)
        and not any("," in token for token in single)
    )


def unquoted(text: str) -> str:
    """A row without the quotation marks of its cells, which may hold commas that do not separate.

    Args:
        text: Row without comments.
    """
    if QUOTED_ROW.fullmatch(text):
        return "; ".join(re.findall(r'"([^"]*)"', text))
    return text.replace('"', "")


def split_row(text: str, decimal_commas: bool) -> list[str]:
    """Columns of a row.

    Args:
        text: Row without comments.
        decimal_commas: Whether commas are decimal rather than separators.
    """
    if decimal_commas:
        return [token.replace(",", ".") for token in _tokens(text)]
    return [token for token in re.split(r"[,;\s]+", text) if token]


def leading_numbers(fields: Sequence[str]) -> list[float]:
    """Numbers at the beginning of a row, up to the first word.

    Args:
        fields: Columns; ``1.5D+02`` is a number.
    """
    found: list[float] = []
    for field in fields:
        values = numbers_of([FORTRAN_EXPONENT.sub("e", field)])
        if values is None:
            break
        found += values
    return found


def _tokens(text: str) -> list[str]:
    """Columns separated by semicolons or blanks."""
    return [token for token in re.split(r"[;\s]+", text) if token]
