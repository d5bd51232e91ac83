"""Studies in Python: ``tiengine.study(plan, folder)`` runs one, :class:`Study` reads and continues it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from tiengine.parameters.errors import InputError
from tiengine.study.design import expand
from tiengine.study.estimate import check_space
from tiengine.study.folder import DESIGN, Folder, Status
from tiengine.study.plan import Plan, load_plan

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tiengine.study.extreme_values import ExtremeLaw
    from tiengine.study.percentiles import Percentile
    from tiengine.study.sensitivity import SobolIndex, Swing
    from tiengine.study.table import Table
    from tiengine.study.watch import Watch
    from tiengine.study.work import Evaluate, Work

__all__ = ["Place", "Study", "study"]

TOGETHER = 16
"""Most trains advanced together, as in an ensemble."""


class Place(Protocol):
    """Where the tasks of a study are computed."""

    def run(self, folder: Folder, tasks: Sequence[int], work: Work, watch: Watch) -> None:
        """Complete tasks.

        Args:
            folder: Folder of the study.
            tasks: Numbers of the tasks.
            work: Settings.
            watch: Is told what happens.
        """


def study(
    plan: str | Path | Mapping[str, Any] | Plan,
    folder: str | Path,
    *,
    start: str | Path | None = None,
    workers: int | None = None,
    place: Place | None = None,
    part: tuple[int, int] | None = None,
    evaluate: Evaluate | None = None,
    checkpoint: float = 60.0,
    progress: Callable[[float, float], None] | None = None,
    notify: Callable[[str], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Study:
    """Run a study: expand its plan, check every train, compute all of them.

    Args:
        plan: TOML file, tables, or a plan.
        folder: New folder for everything that the study writes.
        start: Folder where relative paths of the plan start; that of its file, or the working folder, if None.
        workers: Processes on this machine; None takes one per core.
        place: Computes the tasks elsewhere: :class:`tiengine.study.on_dask.Dask`,
            :class:`tiengine.study.on_slurm.Slurm`.
        part: ``(i, n)`` computes share i of n, counted from 1, beside other processes with the other shares.
        evaluate: Function of the factors that gives the figures of a train, in place of the engine: a surrogate, or a
            function whose answers are known.
        checkpoint: Wall time between two checkpoints [s].
        progress: Called with trains done and all trains.
        notify: Called with a sentence for everything that the user should know.
        stop: Called several times a second; if true, running trains are saved and the study ends.

    Returns:
        The study, for its answers.

    Raises:
        InputError: The plan or one of its trains breaks a rule, or the folder cannot be used.
        RunFailedError: Tasks could not be completed.
        RunStoppedError: ``stop`` returned true; :meth:`Study.resume` continues.
    """
    loaded, beside = load_plan(plan)
    if loaded.scenario is None and evaluate is None:
        raise InputError(
            "scenario: missing; a preset, a file or a table is required, or a function that evaluates trains"
        )
    if loaded.scenario is not None and evaluate is not None:
        raise InputError("scenario: must be left out where a function evaluates the trains")
    if part is not None and (Path(folder) / DESIGN).exists():  # another share has checked the plan
        made = Folder.open(folder)
        if made.design.plan != loaded:
            raise InputError(f"output = '{folder}': holds another study; choose another folder")
    else:
        design = expand(loaded, beside if start is None else Path(start), TOGETHER)
        check_space(design, Path(folder).absolute().parent)
        made = Folder.create(folder, design, shared=part is not None)
    found = Study(made)
    settings: dict[str, Any] = {"progress": progress, "notify": notify, "stop": stop}
    return found.resume(
        workers=workers, place=place, part=part, evaluate=evaluate, checkpoint=checkpoint,
        **{name: value for name, value in settings.items() if value is not None},
    )  # fmt: skip


class Study:
    """A study in its folder.

    Attributes:
        folder: The folder.
    """

    def __init__(self, folder: Folder) -> None:
        """Take a folder; use :meth:`open`."""
        self.folder = folder

    @classmethod
    def open(cls, path: str | Path) -> Study:
        """Open the folder of a study.

        Args:
            path: The folder.

        Raises:
            InputError: It holds no study.
        """
        return cls(Folder.open(path))

    def __repr__(self) -> str:
        """Folder and number of trains."""
        return f"<study {str(self.folder.path)!r}, {len(self.folder.design.members)} trains>"

    def status(self) -> Status:
        """How far the study is; can be asked while it runs."""
        return self.folder.status()

    def resume(
        self,
        *,
        workers: int | None = None,
        place: Place | None = None,
        part: tuple[int, int] | None = None,
        evaluate: Evaluate | None = None,
        checkpoint: float = 60.0,
        **settings: Any,
    ) -> Study:
        """Compute what is left.

        Args:
            workers: See :func:`study`.
            place: See :func:`study`.
            part: See :func:`study`.
            evaluate: See :func:`study`.
            checkpoint: See :func:`study`.
            settings: ``progress``, ``notify``, ``stop``; see :func:`study`.

        Returns:
            The study itself.

        Raises:
            InputError: Another process leads the study.
            RunFailedError: Tasks could not be completed.
            RunStoppedError: ``stop`` returned true.
        """
        from tiengine.simulation.simulate import cores
        from tiengine.study.home import run_here
        from tiengine.study.watch import Watch
        from tiengine.study.work import Work

        if self.folder.design.base is None and evaluate is None:
            raise InputError(
                f"{self.folder.path}: the study has no scenario; pass the function that evaluates its trains"
            )
        watch = Watch(self.folder, **settings)
        with self.folder.alone() if part is None else nullcontext():
            watch.begin()
            tasks = self._share(part)
            work = Work(checkpoint, evaluate, 0.0 if place is None else 3600.0)
            if not tasks:
                return self
            self.folder.log(f"{len(tasks)} tasks to do")
            if place is not None:
                place.run(self.folder, tasks, work, watch)
            else:
                run_here(self.folder, tasks, work, watch, cores() if workers is None else workers)
            watch.end()
        return self

    def table(self) -> Table:
        """Table of the trains that are done: factors, key figures, failures with their reasons."""
        from tiengine.study.table import read_table

        return read_table(self.folder)

    def percentiles(self, figure: str, percents: Sequence[float]) -> list[Percentile]:
        """Percentiles of a key figure over the trains, with intervals by the bootstrap.

        Args:
            figure: Its column in the table.
            percents: Shares of the trains [%].

        Raises:
            InputError: There is no such figure.
        """
        from tiengine.study.percentiles import percentiles

        return percentiles(self.table().values(figure), percents)

    def extremes(self, figure: str, law: Literal["auto", "gumbel", "gev"] = "auto") -> ExtremeLaw:
        """Extreme-value law of a key figure, a train being a block; its ``levels`` have intervals.

        Args:
            figure: Its column in the table; names that begin with ``smallest`` have a law of smallest values.
            law: ``"gumbel"``, ``"gev"``, or ``"auto"`` for Gumbel's unless the data speak against it.

        Raises:
            InputError: There is no such figure, or there are too few trains.
        """
        from tiengine.study.extreme_values import fit_extremes

        return fit_extremes(self.table().values(figure), law, smallest=figure.startswith("smallest"))

    def swings(self, figure: str) -> list[Swing]:
        """Ranges over which the mean of a key figure moves with each factor, the widest first.

        Args:
            figure: Its column in the table.
        """
        from tiengine.study.sensitivity import swings

        return swings(self.table(), figure)

    def sobol(self, figure: str, blocks: int | None = None) -> list[SobolIndex]:
        """First-order and total Sobol' indices of a key figure, from the design ``saltelli``.

        Args:
            figure: Its column in the table.
            blocks: Number of blocks of the design that are used, to see the convergence; all if None.

        Raises:
            InputError: The plan has another design, too few blocks are complete, or SALib is missing.
        """
        from tiengine.study.sensitivity import sobol_indices

        return sobol_indices(self.folder.design.plan, self.table(), figure, blocks)

    def dataset(self, path: str | Path, **windows: Any) -> dict[str, int]:
        """Cut the trains into windows for learning, split by seed, with a datasheet.

        Args:
            path: Folder to create, ending in ``.zarr`` or ``.parquet``.
            windows: ``length``, ``step``, ``samples``, ``channels``, ``inputs``, ``labels``, ``by_time``, ``shares``,
                ``seed``; see docs/studies.md.

        Returns:
            Number of windows in each split.

        Raises:
            InputError: A setting breaks a rule, or a channel is missing.
        """
        from tiengine.study.dataset import Windows, make_dataset

        return make_dataset(self.folder, Path(path), Windows(**windows))

    def report(self, path: str | Path) -> None:
        """Write a page with all answers.

        Args:
            path: HTML file, which is replaced.
        """
        from tiengine.study.page import write

        write(self.folder, Path(path))

    def _share(self, part: tuple[int, int] | None) -> list[int]:
        """Numbers of the tasks that are left in a share."""
        left = self.folder.left()
        if part is None:
            return left
        i, n = part
        if not 1 <= i <= n:
            raise InputError(f"part = {i}/{n}: must be 1/{n} to {n}/{n}")
        return [task for task in left if task % n == i - 1]
