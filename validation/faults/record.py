"""A run that logs what it writes, so that the file of a killed run can be compared with its commits.

``python -m validation.faults.record LOG ARGUMENTS...`` is the command ``tiengine ARGUMENTS...`` with a line in LOG for
every block of samples written, and one for every commit, after it. The lines survive the process.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tiengine.result_files import writer

__all__ = ["Record", "read", "recorded"]

REAL = 4  # bytes of a channel's value: output.precision is "single"


@dataclass(frozen=True)
class Record:
    """Log of a run.

    Attributes:
        loop: Whether the run had begun to write samples.
        commits: Number of commits.
        rows: Rows of every group of every train at its last commit.
        lost_samples: Samples of wheels written since then.
        lost_bytes: Bytes of all samples written since then.
    """

    loop: bool
    commits: int
    rows: dict[str, dict[str, int]]
    lost_samples: int
    lost_bytes: int


def recorded(log: Path, event: int = 0) -> None:
    """Let the writer of this process log its blocks and commits.

    Args:
        log: File to append to.
        event: Event at which the process stands still, the first is 1; 0 for none. Events are a block written, a commit
            about to begin, and a commit made.
    """
    file = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    written = {"samples": 0, "bytes": 0}
    events = 0
    write, commit = writer.Writer.write, writer.Writer.commit

    def note(**facts: Any) -> None:
        os.write(file, f"{json.dumps(facts)}\n".encode())

    def happened() -> None:
        nonlocal events
        events += 1
        if events == event:
            os.kill(os.getpid(), signal.SIGSTOP)

    def noted_write(self: Any, train: int, blocks: Mapping[str, Any]) -> None:
        write(self, train, blocks)
        written["samples"] += len(blocks["wheel"].along) if "wheel" in blocks else 0
        for block in blocks.values():
            written["bytes"] += sum(values.size for values in block.channels.values()) * REAL + 16 * len(block.along)
        note(**written)
        happened()

    def noted_commit(self: Any) -> None:
        happened()
        commit(self)
        known = sorted({train for train, _ in self._columns})
        note(rows={str(train): self.rows(train) for train in known}, **written)
        happened()

    writer.Writer.write, writer.Writer.commit = noted_write, noted_commit  # type: ignore[method-assign]


def read(log: Path) -> Record:
    """Read the log of a run."""
    lines = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    commits = [line for line in lines if "rows" in line]
    last: dict[str, Any] = commits[-1] if commits else {"rows": {}, "samples": 0, "bytes": 0}
    end = lines[-1] if lines else last
    lost = end["samples"] - last["samples"], end["bytes"] - last["bytes"]
    return Record(any(line["samples"] for line in lines), len(commits), last["rows"], *lost)


if __name__ == "__main__":
    from tiengine.cli.commands import main

    recorded(Path(sys.argv[1]))
    main(sys.argv[2:], prog_name="tiengine")
