"""Tasks of a study as an array of jobs of a batch system, by submitit; each job computes its share of the tasks.

Jobs see the folder of the study and write their parts into it. A job that is preempted is submitted again by submitit
and continues from the checkpoints of its tasks.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tiengine.parameters.errors import InputError, RunStoppedError
from tiengine.parameters.optional_packages import needed_by
from tiengine.study.folder import Folder
from tiengine.study.watch import Watch
from tiengine.study.work import Work, do_task

__all__ = ["Slurm"]

POLL = 1.0  # s between two looks at the jobs
LOGS = "jobs"


@dataclass(frozen=True)
class Slurm:
    """Jobs of a batch system as the place of a study.

    Attributes:
        jobs: Number of jobs in the array.
        parameters: Settings of submitit: ``slurm_partition``, ``timeout_min``, ``mem_gb``, ...
        cluster: ``"slurm"``; ``"local"`` starts the jobs as processes on this machine.
    """

    jobs: int = 10
    parameters: Mapping[str, Any] = field(default_factory=dict)
    cluster: str = "slurm"

    def run(self, folder: Folder, tasks: Sequence[int], work: Work, watch: Watch) -> None:
        """Complete tasks.

        Args:
            folder: Folder of the study, which all nodes see.
            tasks: Numbers of the tasks.
            work: Settings.
            watch: Is told what happens.

        Raises:
            InputError: submitit is missing, or there is no such batch system here.
        """
        with needed_by("--slurm"):
            import submitit
        folder.allow()
        count = min(self.jobs, len(tasks))
        shares = [_Share(str(folder.path.resolve()), tuple(tasks[i::count]), work) for i in range(count)]
        try:
            executor = submitit.AutoExecutor(folder=folder.path / LOGS, cluster=self.cluster)
            executor.update_parameters(name="tiengine", cpus_per_task=1, **self.parameters)
            with executor.batch():
                jobs = [executor.submit(share) for share in shares]
        except (RuntimeError, ValueError, TypeError, NameError, OSError, submitit.core.utils.FailedJobError) as error:
            raise InputError(f"--slurm: jobs cannot be submitted ({' '.join(str(error).split())[:300]})") from None
        watch.notify(f"{count} jobs submitted: {jobs[0].job_id} and following; their output is in {folder.path / LOGS}")
        try:
            self._wait(folder, set(tasks), jobs, watch)
        except BaseException:
            for job in jobs:
                job.cancel(check=False)
            raise

    def _wait(self, folder: Folder, left: set[int], jobs: Sequence[Any], watch: Watch) -> None:
        """Wait until all jobs have ended; records show how far they are."""
        asked = False
        while True:
            ended = all(job.done() for job in jobs)
            for task in sorted(left & folder.complete()):
                left.discard(task)
                watch.done(task, folder.record(task) or {"trains": []})
            if ended:
                break
            if watch.stop() and not asked:
                asked = True
                folder.ask_to_stop()
                for job in jobs:
                    if job.state in ("PENDING", "UNKNOWN"):
                        job.cancel(check=False)
            time.sleep(POLL)
        for job in jobs:
            error = None if asked else job.exception()
            if error is not None:
                watch.failed(min(left, default=-1), f"job {job.job_id}: {str(error).strip().splitlines()[-1][:300]}")
            elif not asked:
                for task, why in job.result().items():
                    watch.failed(task, why)


@dataclass(frozen=True)
class _Share:
    """Tasks of one job, in the form that submitit can submit again.

    Attributes:
        path: Folder of the study.
        tasks: Numbers of the tasks.
        work: Settings.
    """

    path: str
    tasks: tuple[int, ...]
    work: Work

    def __call__(self) -> dict[int, str]:
        """Do the tasks; reasons of those that could not be completed."""
        folder, problems = Folder.open(Path(self.path)), {}
        for task in self.tasks:
            try:
                do_task(folder, task, self.work, stop=folder.asked_to_stop)
            except RunStoppedError:
                break
            except InputError as error:
                problems[task] = str(error)
        return problems

    def checkpoint(self) -> Any:
        """Submit the job again; called by submitit when it is preempted or its time is over."""
        import submitit

        return submitit.helpers.DelayedSubmission(self)
