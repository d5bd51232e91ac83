"""Shared parts of the fuzz tests: a deadline, mutations of texts and bytes, a property run on many examples.

Every property counts refused inputs; a mutation that leaves the input valid must be read correctly, and is not
counted. ``EXAMPLES`` is quick in the usual suite; ``pytest -m slow`` requires at least ``BAD`` refused inputs.
"""

from __future__ import annotations

import re
import signal
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tiengine.parameters.errors import InputError

BAD = 1000
"""Refused inputs of each kind in the slow suite."""

EXAMPLES = pytest.mark.parametrize(
    "examples", [pytest.param(50, id="quick"), pytest.param(6 * BAD, id="many", marks=pytest.mark.slow)]
)
DEADLINE = 60.0  # s: an input that takes longer hangs; most take a few ms
ODD = (
    *("", " ", "-", "0", "-1", "1e400", "-1e-400", "nan", "-inf", "inf", "true", "1_000", "0x10", "٣", "1,5", "1.2.3"),
    *("é", "\0", "\x1b[2J", "\u2028", "\ud7ff", "[[", "]]", "{", "}", '"', "'''", '"""', "#", "!", "=", ".", ",", ";"),
    *("\n", "\r", "\t", "9" * 5000, "[" * 3000, "a." * 3000, "x" * 20_000, "1 " * 6000, "__import__('os')", "../../x"),
    *("1e308", "1e-308", "9223372036854775808", "1979-05-27", "/dev/zero", "~nobody/x.toml"),
)
"""Tokens that readers may mishandle."""


class HangError(Exception):
    """An input took longer than the deadline."""


@contextmanager
def deadline(seconds: float = DEADLINE) -> Iterator[None]:
    """Fail an action that does not end in time."""

    def late(number: int, frame: Any) -> None:
        raise HangError(f"longer than {seconds} s")

    previous = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


def refused(action: Callable[[], object]) -> str | None:
    """Message with which an input was refused, None if it was accepted; anything else fails the test."""
    with deadline():
        try:
            action()
        except InputError as error:
            message = str(error)
            assert message.strip()
            assert len(message) < 5000, message[:200]  # a sentence, not the input
            return message
    return None


def on_many(examples: int, strategy: st.SearchStrategy[Any], check: Callable[[Any], bool]) -> None:
    """Run a check on many inputs; it returns whether its input was refused.

    Args:
        examples: Inputs to try.
        strategy: Source of the inputs, derandomised so that failures are reproducible.
        check: Function that raises if a rule is broken.
    """
    seen: Counter[bool] = Counter()

    @settings(
        max_examples=examples,
        derandomize=True,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def property_(value: Any) -> None:
        if examples < BAD or seen[True] < BAD:  # enough refused inputs
            seen[check(value)] += 1

    property_()
    assert seen[True] >= (BAD if examples >= BAD else 1), seen


@st.composite
def mutated_texts(draw: st.DrawFn, text: str) -> str:
    """A text with one to four places changed: tokens, characters, lines, its end."""
    for _ in range(draw(st.integers(1, 4))):
        lines = text.split("\n")
        kind = draw(st.sampled_from(("token", "token", "token", "insert", "delete", "line", "swap", "repeat", "cut")))
        i, j = (draw(st.integers(0, len(lines) - 1)) for _ in range(2))
        at = draw(st.integers(0, max(len(text) - 1, 0)))
        match kind:
            case "token":
                words = list(re.finditer(r"[\w.+-]+", lines[i]))
                if words:
                    word = words[draw(st.integers(0, len(words) - 1))]
                    lines[i] = lines[i][: word.start()] + draw(st.sampled_from(ODD)) + lines[i][word.end() :]
                text = "\n".join(lines)
            case "insert":
                text = text[:at] + draw(st.one_of(st.sampled_from(ODD), st.text(max_size=5))) + text[at:]
            case "delete":
                text = text[:at] + text[at + draw(st.integers(1, 20)) :]
            case "line":
                text = "\n".join(lines[:i] + lines[i + 1 :])
            case "swap":
                lines[i], lines[j] = lines[j], lines[i]
                text = "\n".join(lines)
            case "repeat":
                text = "\n".join([*lines[:i], lines[i], *lines[i:]])
            case "cut":
                text = text[:at]
    return text


@dataclass(frozen=True)
class Damage:
    """Changes of bytes; hypothesis keeps every example, hence it generates changes and not whole files.

    Attributes:
        cut: Share of the content that remains.
        edits: Positions as shares of the content, and new bytes there.
    """

    cut: float
    edits: tuple[tuple[float, bytes], ...]

    def of(self, content: bytes, hot: int = 0) -> bytes:
        """Damaged content; every other edit is within the first ``hot`` bytes, which hold a file's structure."""
        found = bytearray(content)
        for i, (share, piece) in enumerate(self.edits):
            at = int(share * (hot if hot and i % 2 == 0 else len(found)))
            found[at : at + len(piece)] = piece
        return bytes(found[: int(self.cut * len(content))])


PIECES = st.one_of(st.binary(min_size=1, max_size=8), st.sampled_from((b"\0" * 8, b"\xff" * 8, b"\x7f" * 4)))
SHARES = st.floats(0.0, 1.0, exclude_max=True)
DAMAGES = st.one_of(
    *[st.builds(Damage, st.just(1.0), st.lists(st.tuples(SHARES, PIECES), min_size=1, max_size=8).map(tuple))] * 4,
    st.builds(Damage, SHARES, st.just(())),
)
