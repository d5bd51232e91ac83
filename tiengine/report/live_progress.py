"""Progress of a run or a study that is shown where Python runs: as a bar in a notebook, as a line elsewhere."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Self

__all__ = ["LiveProgress"]

EVERY = 0.3  # s between two updates


class LiveProgress:
    """Callable for ``progress=`` of ``tiengine.run``, ``resume`` and ``study``; use as a context manager.

    ::

        with tiengine.LiveProgress() as progress:
            result = tiengine.run(scenario, progress=progress)
    """

    def __init__(self, label: str = "") -> None:
        """Show nothing yet.

        Args:
            label: Text before the numbers.
        """
        self._label, self._began, self._last = label, 0.0, 0.0
        self._values = (0.0, 0.0)
        self._shown: Any = None

    def __enter__(self) -> Self:
        """Begin to measure time."""
        self._began = time.monotonic()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Show the end."""
        self._show()
        if self._shown is None and self._last:
            print(file=sys.stderr)

    def __call__(self, done: float, whole: float) -> None:
        """Show how far it is.

        Args:
            done: Simulated time [s], or trains.
            whole: The same at the end.
        """
        self._values = done, whole
        if time.monotonic() - self._last >= EVERY:
            self._show()

    @property
    def words(self) -> str:
        """Numbers and times as text."""
        done, whole = self._values
        spent = time.monotonic() - self._began
        left = spent * (whole - done) / done if done > 0.0 else float("nan")
        remaining = f", {left:.0f} s left" if left == left and done < whole else ""
        return f"{self._label} {done:.4g} of {whole:.4g}, {spent:.0f} s{remaining}".strip()

    def _show(self) -> None:
        """Show the words, in a notebook with a bar."""
        self._last = time.monotonic()
        if not _in_notebook():
            print(f"\r{self.words:<70}", end="", file=sys.stderr, flush=True)
            return
        from IPython.display import HTML, display

        done, whole = self._values
        bar = HTML(f"<progress value='{done:.6g}' max='{max(whole, 1e-9):.6g}'></progress> {self.words}")
        if self._shown is None:
            self._shown = display(bar, display_id=True)
        else:
            self._shown.update(bar)


def _in_notebook() -> bool:
    """Whether this process is the kernel of a notebook, without importing IPython elsewhere."""
    shell = sys.modules.get("IPython")
    return shell is not None and type(shell.get_ipython()).__name__ == "ZMQInteractiveShell"
