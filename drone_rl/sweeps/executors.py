"""Executors of a sweep's runs: this machine, a Slurm cluster or a Ray cluster.

Each run is a process of its own.
"""

import collections
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from drone_rl.sweeps.manifest import THREADS, Run, Sweep
from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.files import is_locked, read_tail, write_atomically
from drone_rl.utils.limits import LOG_BYTES
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.ray_cluster import connect
from drone_rl.utils.run_result import read_result
from drone_rl.utils.schema import OneOf

PROGRAM = (sys.executable, "-m", "drone_rl.cli.main")
"""The program of a run."""
POLL_S = 0.1
"""Seconds between polls of a process."""


class RunProcess:
    """The process of one run: starts or resumes it, unless it has finished.

    If a process of an interrupted sweep still works on the run, this waits for it.
    """

    def __init__(self, run: Run, cwd: Path | None = None) -> None:
        """Take a run and its working directory, by default this one; the first `poll` starts it."""
        self.run, self._log, self._cwd = run, run.folder / "output.log", cwd
        self._process: subprocess.Popen | None = None
        self._begin = 0
        """Bytes of the log before the process: those of earlier attempts."""

    def poll(self) -> int | None:
        """Return the exit status, or None while the run is unfinished."""
        if self._process is None:
            if is_locked(self.run.folder):
                return None
            if read_result(self.run.folder) is not None:
                return 0
            self._process = self._start()
        status = self._process.poll()
        if not status:
            return status
        if is_locked(self.run.folder) or read_result(self.run.folder) is not None:
            self._process = None  # a process of an earlier sweep finished it
            return None
        written = max(0, self._log.stat().st_size - self._begin)
        last = read_tail(self._log, min(LOG_BYTES, written))
        tail = last.decode(errors="replace").splitlines()
        note_failure(self.run, _error(tail, status))
        return status

    def wait(self) -> int:
        """Wait for the exit status."""
        while (status := self.poll()) is None:
            time.sleep(POLL_S)
        return status

    def stop(self) -> None:
        """Ask the run to save its state and exit; `join` waits for it."""
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)

    def join(self) -> None:
        """Wait until the process of the run has exited, if one was started."""
        if self._process is not None:
            self._process.wait()

    def _start(self) -> subprocess.Popen:
        self.run.folder.mkdir(parents=True, exist_ok=True)
        self.run.failure.unlink(missing_ok=True)
        with self._log.open("ab") as log:
            self._begin = log.tell()
            return subprocess.Popen(
                [*PROGRAM, *self.run.arguments()],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                cwd=self._cwd,
                env={**os.environ, **THREADS},
                start_new_session=True,  # Ctrl-C goes to the sweep, which stops its runs
            )


def describe_active(sweep: Sweep, runs: Sequence[Run], most: int = 4) -> str:
    """Return the last line in the log of each run at work here, of `most` runs at most."""
    active = [r for r in runs if is_locked(r.folder) and (r.folder / "output.log").is_file()]
    lines = []
    for run in active[:most]:
        last = read_tail(run.folder / "output.log", 1000).decode(errors="replace").splitlines()
        line = re.sub(r"^\[[\d:]+\] ", "", last[-1] if last else "starts")
        lines.append(f"{sweep.name_of(run)}: {line}")
    left = len(active) - len(lines)
    return "; ".join(lines) + (f"; and {left} more" if left else "")


def note_failure(run: Run, error: str) -> None:
    """Write the reason of a failure to the run's folder."""
    run.folder.mkdir(parents=True, exist_ok=True)
    write_atomically(run.failure, json.dumps({"error": error}, indent=2))


def finish_run(run: Run, cwd: Path | None = None) -> int:
    """Run to the end, in a working directory, and return the exit status."""
    return RunProcess(run, cwd).wait()


def _error(lines: list[str], status: int) -> str:
    """Return the log line that gives the reason of a failure."""
    if status < 0:
        return f"ended by signal {signal.Signals(-status).name}"
    reasons = [line.removeprefix("error: ") for line in lines if line.startswith("error: ")]
    words = reasons or [line for line in lines if line.strip()]
    return words[-1].strip() if words else f"ended with status {status}"


class Executor(Protocol):
    """Executes runs."""

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """Execute the runs; yield each with its exit status as it ends, in any order."""
        ...


class LocalExecutor:
    """Executes runs in parallel on this machine."""

    def __init__(self, num_jobs: int | None = None) -> None:
        """Take the number of parallel runs, at least 1; None for one a core."""
        if num_jobs is not None and num_jobs < 1:
            raise InputError(f"hydra.launcher.num_jobs={num_jobs} must be at least 1, or null")
        self.num_jobs = num_jobs or num_cores()

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`. When interrupted, the runs save their state and exit."""
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
            for process in active:  # all of them first, so that they end at the same time
                process.stop()
            for process in active:
                process.join()


class SlurmExecutor:
    """Executes runs on a Slurm cluster through submitit, as one job array."""

    def __init__(
        self, folder: Path, *, cluster: str, num_jobs: int, resources: Mapping[str, Any]
    ) -> None:
        """Take the folder of submitit's scripts and logs, on a disk that all nodes share.

        The cluster is "slurm", or "local" for processes on this machine. The resources are
        arguments of submitit's `update_parameters`.

        Raises:
            InputError: The cluster or a resource is unknown, submitit isn't installed, or there is
                no Slurm here.
        """
        OneOf(("slurm", "local")).read(cluster, "hydra.launcher.cluster")
        submitit = extra("submitit", "slurm", "hydra/launcher=slurm")
        try:
            self._executor = submitit.AutoExecutor(folder=folder, cluster=cluster)
        except RuntimeError as error:
            raise InputError(
                f"hydra.launcher.cluster={cluster} is not available here ({error}); "
                "start the sweep on a node with sbatch"
            ) from error
        try:
            self._executor.update_parameters(slurm_array_parallelism=num_jobs, **resources)
        except (NameError, AssertionError) as error:
            raise InputError(
                f"submitit refuses a setting of hydra.launcher ({str(error).splitlines()[0]}); "
                "Slurm's own begin with slurm_, as in +hydra.launcher.slurm_partition=NAME"
            ) from error

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`. Submitted jobs continue when the sweep is stopped.

        Raises:
            InputError: Slurm refuses the jobs.
        """
        try:
            with self._executor.batch():
                jobs = [self._executor.submit(finish_run, run) for run in runs]
        except RuntimeError as error:
            reason = " ".join(str(error).split())[-300:]
            raise InputError(
                f"Slurm refuses the jobs ({reason}); change the settings of hydra.launcher"
            ) from error
        left = dict(zip(runs, jobs, strict=True))
        while left:
            ended = [run for run, job in left.items() if job.done()]
            for run in ended:
                job = left.pop(run)
                error = job.exception()
                yield run, job.result() if error is None else _lost(run, "Slurm job", error)
            if not ended:
                time.sleep(1.0)


class RayExecutor:
    """Executes runs as Ray tasks; Ray restarts the tasks of a lost node."""

    def __init__(self, *, address: str | None, num_cpus: float, num_gpus: float) -> None:
        """Connect to the cluster at an address; None joins the one known here or starts one.

        A run takes so many cores and GPUs, possibly a fraction.

        Raises:
            InputError: Ray isn't installed or the cluster can't be reached.
        """
        self._ray, self._started = connect(address, "hydra/launcher=ray")
        remote = self._ray.remote(num_cpus=num_cpus, num_gpus=num_gpus, max_retries=3)
        self._finish_run = remote(finish_run)

    def finish(self, runs: Sequence[Run]) -> Iterator[tuple[Run, int]]:
        """See `Executor`."""
        here = Path.cwd()  # a worker is in the folder where the cluster was started
        left = {self._finish_run.remote(run, here): run for run in runs}
        try:
            while left:
                ended, _ = self._ray.wait(list(left))
                for task in ended:
                    run = left.pop(task)
                    try:
                        status = self._ray.get(task)
                    except self._ray.exceptions.RayError as error:
                        status = _lost(run, "Ray task", error)
                    yield run, status
        finally:
            if self._started:
                self._ray.shutdown()


def _lost(run: Run, what: str, error: BaseException) -> int:
    """Note the line of a remote traceback that names the error; return an exit status."""
    lines = str(error).strip().splitlines() or [type(error).__name__]
    named = [line for line in lines if re.match(r"\w+(Error|Exception):", line)]
    note_failure(run, f"its {what} was lost: {(named or lines)[-1]}")
    return 1
