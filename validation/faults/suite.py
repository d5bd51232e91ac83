"""Parts of the suite, which run in parallel, each in a process of its own."""

from __future__ import annotations

import multiprocessing
import os
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

__all__ = ["PARTS", "perform"]

Found = dict[str, Any]
STARTS = {"copy": "copies of a process that has compiled", "command": "the command itself"}


@dataclass(frozen=True)
class Part:
    """A part of the suite.

    Attributes:
        words: Description.
        call: Function of a folder and the share of the whole effort.
        alone: Whether no other part may run at the same time.
    """

    words: str
    call: Callable[[Path, float], Found]
    alone: bool = False


def _kills(run: str, start: str, folder: Path, share: float) -> Found:
    """Random kills of a run with one kind of start."""
    from validation.faults.kills import Yard
    from validation.faults.plan import RUNS, kills

    yard = Yard(folder, RUNS[run])
    outcomes = []
    for kill in [each for each in kills(run, share) if each.start == start]:
        outcomes.append(yard.perform(kill))
        _tell(f"{run}, {start}: {len(outcomes)} kills, {sum(each.survived for each in outcomes)} survived")
    rows = [asdict(each) | {"survived": each.survived} for each in outcomes]
    words = f"{yard.run.words}, {STARTS[start]}"
    return {"words": words, "kills": rows, "summary": _summary(rows), "instants": yard.instants}


def _summary(rows: Sequence[Found]) -> Found:
    """Counts of all kills of a run."""
    lost = [row["lost_bytes"] for row in rows if row["phase"] in ("loop", "commit", "set-up")]
    samples = [row["lost_samples"] for row in rows if row["phase"] in ("loop", "commit", "set-up")]
    return {
        "kills": len(rows),
        "survived": sum(row["survived"] for row in rows),
        "opened": sum(row["opens"] for row in rows),
        "mended": sum(row["mended"] for row in rows),
        "kept": sum(row["kept"] for row in rows),
        "second_kills": sum(row["resumed"] > 1 for row in rows),
        "phases": dict(Counter(row["phase"] for row in rows)),
        "lost_bytes_largest": max(lost, default=0),
        "lost_bytes_mean": sum(lost) / max(len(lost), 1),
        "lost_samples_largest": max(samples, default=0),
    }


def _boundaries(folder: Path, share: float) -> Found:
    from validation.faults.boundaries import boundaries

    return asdict(boundaries(max(round(1.0 / share), 1)))


def _power(folder: Path, share: float) -> Found:
    from validation.faults.power import power_cuts

    return asdict(power_cuts(4, max(round(2.0 / share), 1)))


def _disk(folder: Path, share: float) -> Found:
    """Full and read-only disks."""
    from validation.faults import space
    from validation.faults.kills import Yard
    from validation.faults.plan import RUNS

    yard = Yard(folder, RUNS["one"])
    checks = [space.refused_at_the_start(yard)]
    checks += [space.disk_full(yard, left) for left in space.LEFT[:: max(round(1.0 / share), 1)]]
    return {"checks": [*checks, *space.read_only(yard)]}


def _sizes(folder: Path, share: float) -> Found:
    from validation.faults.space import estimates

    return {"checks": estimates(folder)}


def _disturbances(folder: Path, share: float) -> Found:
    import tiengine
    from validation.faults.disturbances import clock_readers, disturbances
    from validation.faults.kills import Yard
    from validation.faults.plan import RUNS

    places = clock_readers(Path(str(tiengine.__file__)).parent)
    source = {"words": "places in the source that read the time of day", "good": not places, "wrong": places}
    return {"checks": [source, *disturbances(Yard(folder, RUNS["one"]))]}


def _batch_disturbances(folder: Path, share: float) -> Found:
    from validation.faults.disturbances import batch_disturbances
    from validation.faults.kills import Yard
    from validation.faults.plan import RUNS

    return {"checks": batch_disturbances(Yard(folder, RUNS["batch"]))}


def _physics(folder: Path, share: float) -> Found:
    from validation.faults.physics import physics

    return {"checks": physics(folder, max(round(3 * share), 1))}


def _overhead(folder: Path, share: float) -> Found:
    from validation.faults.overhead import overhead

    repeats = max(round(20 * share), 4)
    return {"overhead": [asdict(overhead(folder, trains, repeats)) for trains in (1, 16)]}


PARTS = {
    "one": Part("kill -9, one train", partial(_kills, "one", "copy")),
    "one_command": Part("kill -9, one train, the command itself", partial(_kills, "one", "command")),
    "batch": Part("kill -9, batch", partial(_kills, "batch", "copy")),
    "batch_command": Part("kill -9, batch, the command itself", partial(_kills, "batch", "command")),
    "boundaries": Part("death between any two system calls", _boundaries),
    "power": Part("power cuts, constructed", _power),
    "disk": Part("disk full, read-only", _disk),
    "sizes": Part("estimated sizes", _sizes),
    "signals": Part("signals, two runs, readers, clock", _disturbances),
    "batch_signals": Part("signals to a batch, workers killed twice", _batch_disturbances),
    "physics": Part("physics that goes wrong", _physics),
    "overhead": Part("cost of checkpoints", _overhead, alone=True),
}


def perform(names: Sequence[str], share: float, jobs: int, keep: Callable[[str, Found], None]) -> None:
    """Run parts.

    Args:
        names: Names of the parts.
        share: Share of the whole effort.
        jobs: Number of processes at a time.
        keep: Function called with name and findings of each part as it ends.
    """
    together = [name for name in names if not PARTS[name].alone]
    apart = [name for name in names if PARTS[name].alone]
    for group, processes in ((together, jobs), (apart, 1)):
        with ProcessPoolExecutor(
            processes, mp_context=multiprocessing.get_context("spawn"), max_tasks_per_child=1, initializer=_quiet
        ) as pool:
            waiting = {pool.submit(_in_folder, name, share): name for name in group}
            for done in as_completed(waiting):
                keep(waiting[done], done.result())


def _in_folder(name: str, share: float) -> Found:
    with TemporaryDirectory(prefix=f"tiengine-{name}-", ignore_cleanup_errors=True) as folder:
        try:
            return PARTS[name].call(Path(folder), share)
        except Exception as error:  # the other parts continue; the page shows it
            import traceback

            traceback.print_exc()
            words = f"{name}: the part itself"
            return {"checks": [{"words": words, "good": False, "wrong": [f"{type(error).__name__}: {error}"]}]}


def _tell(words: str) -> None:
    print(words, flush=True)


def _quiet() -> None:
    os.environ["ENABLE_TAICHI_HEADER_PRINT"] = "False"
