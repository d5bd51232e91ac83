"""Exceptions with one-line messages: input that breaks a rule, runs that end early."""

from __future__ import annotations

import difflib

LONGEST_MESSAGE = 1500  # characters


class InputError(ValueError):
    """Input that breaks a rule; the message is one line that names object, value and rule."""

    def __init__(self, message: str) -> None:
        """Shorten a message that quotes too much of the input.

        Args:
            message: Object, value and rule.
        """
        head, tail = message[: LONGEST_MESSAGE // 2], message[-LONGEST_MESSAGE // 2 :]
        super().__init__(message if len(message) <= LONGEST_MESSAGE else f"{head} ... {tail}")


def nearest(name: str, known: list[str] | tuple[str, ...]) -> str:
    """End of an error message: the nearest known name, or all of them.

    Args:
        name: The unknown name.
        known: Names that exist.

    Returns:
        ``"; did you mean 'CHN60'?"``, ``"; known: CHN60, 60E1"`` or an empty text if there are none.
    """
    folded = {k.casefold(): k for k in known}
    close = difflib.get_close_matches(name.casefold(), list(folded), n=1)
    close = close or [k for k in folded if k.startswith(name.casefold())]
    if close:
        return f"; did you mean {folded[close[0]]!r}?"
    return f"; known: {', '.join(known)}" if known else ""


class InputNote(UserWarning):
    """A remark on input that was accepted; the message is one line that names object, value and interpretation."""


class RunFailedError(RuntimeError):
    """A run that failed; the message says where, when and why."""


class RunStoppedError(RuntimeError):
    """A run that was stopped on request and can be resumed; the message says how far it got."""
