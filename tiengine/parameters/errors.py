"""Errors of one line: input that breaks a rule, runs that end early."""

from __future__ import annotations

import difflib

LONGEST_MESSAGE = 1500  # characters


class InputError(ValueError):
    """Input that breaks a rule; the message is one line naming object, value and rule, and not the whole input."""

    def __init__(self, message: str) -> None:
        """Shorten what quotes too much.

        Args:
            message: The sentence.
        """
        head, tail = message[: LONGEST_MESSAGE // 2], message[-LONGEST_MESSAGE // 2 :]
        super().__init__(message if len(message) <= LONGEST_MESSAGE else f"{head} ... {tail}")


def nearest(name: str, known: list[str] | tuple[str, ...]) -> str:
    """Tail of an error message: the nearest known name, or all of them.

    Args:
        name: What was asked for.
        known: What there is.

    Returns:
        ``"; did you mean 'CHN60'?"``, ``"; known: CHN60, 60E1"`` or an empty text where nothing is known.
    """
    folded = {k.casefold(): k for k in known}
    close = difflib.get_close_matches(name.casefold(), list(folded), n=1)
    if close:
        return f"; did you mean {folded[close[0]]!r}?"
    return f"; known: {', '.join(known)}" if known else ""


class RunFailedError(RuntimeError):
    """A run that ended early: the message says where, when and why."""


class RunStoppedError(RuntimeError):
    """A run that was asked to stop and can be resumed: the message says how far it came."""
