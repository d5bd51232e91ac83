"""Watch of the leader of a study: progress, sentences, a request to stop; and the problems that tasks had."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from tiengine.parameters.errors import RunFailedError, RunStoppedError
from tiengine.study.folder import Folder

__all__ = ["Watch"]


def _never() -> bool:
    return False


@dataclass(eq=False)
class Watch:
    """Progress of a study, kept by its leader.

    Attributes:
        folder: Folder of the study.
        progress: Called with trains done (running ones in part) and all trains.
        notify: Called with a sentence for everything that the user should know.
        stop: If true, running trains are saved and the study ends.
        problems: Reasons why tasks could not be completed, by their number.
    """

    folder: Folder
    progress: Callable[[float, float], None] = lambda done, whole: None
    notify: Callable[[str], None] = lambda words: None
    stop: Callable[[], bool] = _never
    problems: dict[int, str] = field(default_factory=dict)
    _done: float = 0.0
    _whole: float = 0.0
    _parts: dict[int, float] = field(default_factory=dict)

    def begin(self) -> None:
        """Count what is complete."""
        sizes = [len(task) for task in self.folder.design.tasks]
        left = set(self.folder.left())
        self._whole = float(sum(sizes))
        self._done = float(sum(size for task, size in enumerate(sizes) if task not in left))
        self._tell()

    def advanced(self, task: int, now: float, whole: float) -> None:
        """Take note of a running task.

        Args:
            task: Its number.
            now: Simulated time so far [s], of all its trains together.
            whole: Simulated time at its end [s].
        """
        self._parts[task] = len(self.folder.design.tasks[task]) * now / max(whole, now, 1e-12)
        self._tell()

    def done(self, task: int, record: Mapping[str, Any]) -> None:
        """Take note of a complete task.

        Args:
            task: Its number.
            record: Its record.
        """
        self._parts.pop(task, None)
        self._done += len(record["trains"])
        for train in record["trains"]:
            if train["status"] != "complete":
                self.notify(f"train {train['member']} failed: {train['status']}")
        self._tell()

    def failed(self, task: int, why: str) -> None:
        """Take note of a task that could not be completed.

        Args:
            task: Its number.
            why: Reason.
        """
        self._parts.pop(task, None)
        self.problems[task] = why
        self.folder.log(f"task {task}: not completed: {why}")

    def end(self) -> None:
        """Report tasks that are not complete.

        Raises:
            RunStoppedError: The study was stopped.
            RunFailedError: Tasks could not be completed.
        """
        if self.problems:
            task, why = min(self.problems.items())
            others = f" (and {len(self.problems) - 1} more tasks)" if len(self.problems) > 1 else ""
            raise RunFailedError(f"task {task}: {why}{others}")
        if self.stop():
            raise RunStoppedError(f"stopped after {self._done:.0f} of {self._whole:.0f} trains")

    def _tell(self) -> None:
        self.progress(self._done + sum(self._parts.values()), self._whole)
