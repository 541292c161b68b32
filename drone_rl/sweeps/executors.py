"""Where the processes of a sweep run: this machine, a Slurm cluster, a Ray cluster.

Each gives back the runs with their exit status as they end, in any order.
"""

import collections
import re
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from drone_rl.sweeps.process import POLL_S, RunProcess, finish_run, note_failure
from drone_rl.sweeps.runs import Run
from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.provenance import num_cores


class Executor(Protocol):
    """Runs processes somewhere."""

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """Brings the runs to their end; yields each with its exit status."""
        ...


class LocalExecutor:
    """Side by side on this machine."""

    def __init__(self, num_jobs: int | None = None) -> None:
        """Sets how many.

        Args:
            num_jobs: Runs at the same time; None for one a core.

        Raises:
            InputError: Fewer than one.
        """
        if num_jobs is not None and num_jobs < 1:
            raise InputError(f"hydra.launcher.num_jobs={num_jobs} must be 1 or more, or null")
        self.num_jobs = num_jobs or num_cores()

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`. When it is interrupted, the runs save their state and end."""
        waiting = collections.deque(RunProcess(run) for run in runs)
        active: list[RunProcess] = []
        try:
            while waiting or active:
                while waiting and len(active) < self.num_jobs:
                    active.append(waiting.popleft())
                ended = [(p, status) for p in active if (status := p.poll()) is not None]
                active = [p for p in active if p not in {process for process, _ in ended}]
                for process, status in ended:
                    yield process.run, status
                if not ended:
                    time.sleep(POLL_S)
        finally:
            for process in active:
                process.stop()


class SlurmExecutor:
    """On a Slurm cluster by submitit, as one array of jobs."""

    def __init__(self, folder: Path, *, cluster: str, num_jobs: int, **resources: Any) -> None:
        """Prepares the jobs' resources.

        Args:
            folder: Where submitit keeps its scripts and logs; on a disk that all nodes see.
            cluster: "slurm", or "local" for processes of this machine.
            num_jobs: Jobs of the array at the same time.
            resources: What submitit's `update_parameters` takes.

        Raises:
            InputError: submitit isn't installed, or there is no Slurm here.
        """
        submitit = extra("submitit", "slurm", "hydra/launcher=slurm")
        try:
            self._executor = submitit.AutoExecutor(folder=folder, cluster=cluster)
        except RuntimeError as error:
            raise InputError(
                f"hydra.launcher.cluster={cluster} is not to be had here ({error}); "
                "start the sweep on a node with sbatch"
            ) from error
        self._executor.update_parameters(slurm_array_parallelism=num_jobs, **resources)

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`. Jobs that were submitted go on when the sweep itself is stopped."""
        with self._executor.batch():
            jobs = [self._executor.submit(finish_run, run) for run in runs]
        left = dict(zip(runs, jobs, strict=True))
        while left:
            ended = [run for run, job in left.items() if job.done()]
            for run in ended:
                yield run, self._status(run, left.pop(run))
            if not ended:
                time.sleep(1.0)

    def _status(self, run: Run, job: Any) -> int:
        error = job.exception()
        if error is None:
            return job.result()
        note_failure(run, f"its Slurm job was lost: {_reason(error)}")
        return 1


class RayExecutor:
    """On a Ray cluster, one task a run; Ray starts anew what a lost node was busy with."""

    def __init__(self, *, address: str | None, num_cpus: float, num_gpus: float) -> None:
        """Joins the cluster.

        Args:
            address: Of the cluster; None starts one on this machine.
            num_cpus: Cores that one run takes.
            num_gpus: GPUs that one run takes; a share is possible.

        Raises:
            InputError: Ray isn't installed or the cluster can't be reached.
        """
        self._ray = extra("ray", "ray", "hydra/launcher=ray")
        self._started = not self._ray.is_initialized()
        try:
            self._ray.init(
                address=address,
                ignore_reinit_error=True,
                include_dashboard=False,
                log_to_driver=False,
            )
        except (ConnectionError, ValueError) as error:
            raise InputError(
                f"hydra.launcher.address={address} can't be reached; start a cluster with "
                "ray start --head or leave it null"
            ) from error
        remote = self._ray.remote(num_cpus=num_cpus, num_gpus=num_gpus, max_retries=3)
        self._finish_run = remote(finish_run)

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`."""
        left = {self._finish_run.remote(run): run for run in runs}
        try:
            while left:
                ended, _ = self._ray.wait(list(left))
                for task in ended:
                    run = left.pop(task)
                    yield run, self._status(run, task)
        finally:
            if self._started:
                self._ray.shutdown()

    def _status(self, run: Run, task: Any) -> int:
        try:
            return self._ray.get(task)
        except self._ray.exceptions.RayError as error:
            note_failure(run, f"its Ray task was lost: {_reason(error)}")
            return 1


def _reason(error: BaseException) -> str:
    """The line of a remote traceback that names the error."""
    lines = str(error).strip().splitlines() or [type(error).__name__]
    return next(
        (line for line in reversed(lines) if re.match(r"\w+(Error|Exception):", line)), lines[-1]
    )
