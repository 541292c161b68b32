"""Launchers: how the runs of `drone-rl COMMAND -m` are executed; `hydra_plugins` names them.

A training is a process of its own: all start from the same state, and one can fail without the
others. Hydra's joblib launcher, which does the same, is unmaintained.
"""

import hashlib
import logging
import os
import re
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.core.utils import JobReturn, JobStatus, configure_log, run_job, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict, read_write

from drone_rl.sweeps.executors import Executor, describe_active
from drone_rl.sweeps.manifest import Run, Sweep, check_folders, inside, open_sweep, read_failure
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock
from drone_rl.utils.progress import Heartbeat
from drone_rl.utils.run_result import read_result
from drone_rl.utils.text import plural

_LONGEST_NAME = 180
_log = logging.getLogger(__name__)


class RunLauncher(Launcher):
    """Composes and checks settings and folders of all runs before the first run starts."""

    config: DictConfig
    hydra_context: HydraContext
    task_function: TaskFunction

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Store Hydra's objects."""
        self.hydra_context, self.config = hydra_context, config
        self.task_function = task_function

    @property
    def folder(self) -> Path:
        """Folder of the sweep."""
        return Path(str(self.config.hydra.sweep.dir)).absolute()

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Execute the runs; a failure does not stop the others."""
        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        configs = [self._compose(initial_job_idx + i, o) for i, o in enumerate(job_overrides)]
        runs = [self._run(config, o) for config, o in zip(configs, job_overrides, strict=True)]
        check_folders(runs)
        for run, config in zip(runs, configs, strict=True):
            if config.get("trial") is None:  # a search continues after a trial with bad settings
                self._check(run, config)
        return self.execute(runs, configs)

    def _check(self, run: Run, config: DictConfig) -> None:
        """Raise an `InputError` if the command does not accept a run's settings."""
        with read_write(config.hydra.runtime), open_dict(config.hydra.runtime):
            config.hydra.runtime.output_dir = str(run.folder)  # settings may refer to it
        HydraConfig.instance().set_config(config)
        job: Any = self.task_function
        try:
            job.check(OmegaConf.masked_copy(config, [str(k) for k in config if k != "hydra"]))
        except InputError as error:
            raise InputError(f"run {run.number} ({' '.join(run.overrides)}): {error}") from None

    def execute(self, runs: Sequence[Run], configs: Sequence[DictConfig]) -> list[JobReturn]:
        """Execute runs with these settings."""
        raise NotImplementedError

    def _compose(self, number: int, overrides: Sequence[str]) -> DictConfig:
        config = self.hydra_context.config_loader.load_sweep_config(self.config, [*overrides])
        names = config.hydra.job.config.override_dirname
        left_out = tuple(f"{key}=" for key in names.exclude_keys)
        typed = sorted(o for o in overrides if not o.startswith(left_out))
        typed = [re.sub(r"[^\w.-]+", names.kv_sep, o) for o in typed]  # needs no quotes in a shell
        with open_dict(config):
            config.hydra.job.id = config.hydra.job.num = number
            config.hydra.job.override_dirname = _shortened(names.item_sep.join(typed))
        return config

    def _run(self, config: DictConfig, overrides: Sequence[str]) -> Run:
        """A run in the folder `hydra.sweep.subdir`, which Hydra resolves with its settings."""
        HydraConfig.instance().set_config(config)
        subdir = os.path.normpath(str(config.hydra.sweep.subdir))
        folder = inside(self.folder, subdir, "hydra.sweep.subdir=")
        return Run(config.hydra.job.num, tuple(overrides), folder)


class InProcessLauncher(RunLauncher):
    """Calls the command's function for one run after the other in this process."""

    def execute(self, runs: Sequence[Run], configs: Sequence[DictConfig]) -> list[JobReturn]:
        """See `RunLauncher`."""
        jobs = []
        for run, config in zip(runs, configs, strict=True):
            _log.info("run %d of %d: %s", len(jobs) + 1, len(runs), " ".join(run.overrides))
            jobs.append(
                run_job(
                    hydra_context=self.hydra_context,
                    task_function=self.task_function,
                    config=config,
                    job_dir_key="hydra.sweep.dir",
                    job_subdir_key="hydra.sweep.subdir",
                )
            )
            configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        return jobs


class SweepLauncher(RunLauncher):
    """Finishes the unfinished trainings of a sweep, each in its own process; reports on all."""

    executor: Callable[[Path], Executor]
    """Makes the executor of a sweep's runs from the sweep's folder."""

    def execute(self, runs: Sequence[Run], configs: Sequence[DictConfig]) -> list[JobReturn]:
        """See `RunLauncher`."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with folder_lock(self.folder), _sigterm_as_interrupt():
            sweep = open_sweep(self.folder, _command(), self._settings(), runs)
            begun = {run.number: run for run in sweep.runs}
            runs = [begun[run.number] for run in runs]  # in the folders of the first start
            finished = sum(read_result(run.folder) is not None for run in runs)
            count = plural(len(runs), "run")
            _log.info("sweep of %s, %d finished before: %s", count, finished, self.folder)
            failed = self._finish(sweep, runs)
        if failed:
            self.task_function.statuses.append(1)  # pyright: ignore[reportFunctionMemberAccess]
        return [_job_return(run) for run in runs]

    def _finish(self, sweep: Sweep, runs: Sequence[Run]) -> int:
        """Run the unfinished runs and write the report; return the number of failed ones."""
        from drone_rl.sweeps.report import write_sweep_report  # slow to import

        failed = 0
        try:
            unfinished = [run for run in runs if read_result(run.folder) is None]
            endings = self.executor(sweep.folder).finish(unfinished) if unfinished else ()
            with Heartbeat(lambda: describe_active(sweep, unfinished)):
                for number, (run, status) in enumerate(endings, start=1):
                    failed += status != 0
                    line = "[%d/%d] %s: %s"
                    _log.info(line, number, len(unfinished), sweep.name_of(run), _outcome(run))
        except KeyboardInterrupt:
            _log.info("resume with the same command: %s", sweep.command)
            raise
        finally:
            _log.info("report: %s", write_sweep_report(sweep)[0])
        return failed

    def _settings(self) -> dict[str, Any]:
        everything: Any = OmegaConf.to_container(self.config, resolve=False)
        return {name: value for name, value in everything.items() if name != "hydra"}


def _command() -> list[str]:
    """The command that the user typed, without the sweep's folder that was added."""
    typed = [word for word in sys.argv[1:] if not word.startswith("hydra.sweep.dir=${")]
    return [*sys.argv[0].split(), *typed]


def _job_return(run: Run) -> JobReturn:
    """A run's result for the sweeper: the running mean of rewards, or None if it failed."""
    result = read_result(run.folder)
    job = JobReturn(
        overrides=list(run.overrides), working_dir=str(run.folder), status=JobStatus.COMPLETED
    )
    job.return_value = None if result is None else result.running_reward
    return job


def _outcome(run: Run) -> str:
    result = read_result(run.folder)
    if result is None:
        return f"failed: {read_failure(run) or 'reason unknown'}"
    kind = f", verdict: {result.verdict.kind}" if result.verdict else ""
    return f"ended ({result.reason}), running reward {result.running_reward:.3f}{kind}"


def _shortened(name: str) -> str:
    """Return a name that fits into the name of a folder; a hash replaces the rest."""
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[: _LONGEST_NAME - 9]}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


@contextmanager
def _sigterm_as_interrupt() -> Iterator[None]:
    """Make SIGTERM stop a sweep as Ctrl-C does, with status 143; its runs save their state."""
    came: list[object] = []

    def interrupt(number: int, _: object) -> None:
        came.append(number)
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    except KeyboardInterrupt:
        if came:
            raise SystemExit(128 + signal.SIGTERM) from None
        raise
    finally:
        signal.signal(signal.SIGTERM, before)
