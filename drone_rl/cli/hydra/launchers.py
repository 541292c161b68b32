"""Launchers, Hydra plugins of `drone-rl train -m`: each run is its own process.

Hydra's default launcher runs all jobs in one process, and its joblib launcher is unmaintained.
Separate processes all start from the same state, and one can fail without the others.
"""

import hashlib
import importlib
import logging
import os
import re
import signal
import sys
import types
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.core.utils import JobReturn, JobStatus, configure_log, setup_globals
from hydra.errors import HydraException
from hydra.plugins.launcher import Launcher
from hydra.plugins.plugin import Plugin
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict
from omegaconf.errors import OmegaConfBaseException

from drone_rl.sweeps.executors import (
    Executor,
    LocalExecutor,
    RayExecutor,
    SlurmExecutor,
    describe_active,
)
from drone_rl.sweeps.manifest import Run, Sweep, check_folders, inside, open_sweep, read_failure
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock
from drone_rl.utils.progress import Heartbeat
from drone_rl.utils.readers import read_result
from drone_rl.utils.text import plural

_LONGEST_NAME = 180
NAMESPACE = "hydra_plugins.drone_rl"
"""Module of the plugins, as in the files of conf/."""

_log = logging.getLogger(__name__)


class SweepLauncher(Launcher):
    """Finish the unfinished runs of a sweep, then report on all runs."""

    config: DictConfig
    hydra_context: HydraContext
    task_function: TaskFunction
    executor: Callable[[Path], Executor]
    """Makes the executor of a sweep's runs from the sweep's folder."""

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Store Hydra's objects."""
        self.hydra_context, self.config = hydra_context, config
        self.task_function = task_function
        folder = Path(str(config.hydra.sweep.dir)).absolute()
        multirun = folder / "multirun.yaml"
        self._multirun = multirun, multirun.read_bytes() if multirun.is_file() else None
        self._new_folders = [path for path in (folder, *folder.parents) if not path.exists()]

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Complete the runs; a failure does not stop the others."""
        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        folder = Path(str(self.config.hydra.sweep.dir)).absolute()
        try:
            runs = [self._run(folder, initial_job_idx + i, o) for i, o in enumerate(job_overrides)]
            self._check(runs)
            folder.mkdir(parents=True, exist_ok=True)
            with folder_lock(folder), _sigterm_as_interrupt():
                sweep = open_sweep(folder, _command(), self._settings(), runs)
                begun = {run.number: run for run in sweep.runs}
                runs = [begun[run.number] for run in runs]  # in the folders of the first start
                finished = sum(read_result(run.folder) is not None for run in runs)
                count = plural(len(runs), "run")
                _log.info("sweep of %s, %d finished before: %s", count, finished, folder)
                failed = self._finish(sweep, runs)
        except (InputError, HydraException, OmegaConfBaseException):
            self._remove_traces()
            raise
        if failed:
            self.task_function.statuses.append(1)  # pyright: ignore[reportFunctionMemberAccess]
        return [_job_return(run) for run in runs]

    def _check(self, runs: Sequence[Run]) -> None:
        if not runs:
            typed = " ".join(self.config.hydra.overrides.task)
            raise InputError(f"{typed}: a sweep of no runs; give each setting at least one value")
        check_folders(runs)

    def _remove_traces(self) -> None:
        """Restore multirun.yaml, which Hydra's sweeper wrote for a sweep that is refused."""
        path, content = self._multirun
        if content is None:
            path.unlink(missing_ok=True)
        else:
            path.write_bytes(content)
        for folder in self._new_folders:
            with suppress(OSError):  # it contains something
                folder.rmdir()

    def _finish(self, sweep: Sweep, runs: Sequence[Run]) -> int:
        """Run the unfinished runs and write the report; return the number of failed ones."""
        from drone_rl.sweeps.report import write_sweep_report  # slow to import

        failed = 0
        try:
            unfinished = [run for run in runs if read_result(run.folder) is None]
            endings = self.executor(sweep.folder).finish(unfinished) if unfinished else ()
            with Heartbeat(lambda: describe_active(sweep, unfinished)):
                for done, (run, status) in enumerate(endings, start=1):
                    failed += status != 0
                    line = "[%d/%d] %s: %s"
                    _log.info(line, done, len(unfinished), sweep.name_of(run), _outcome(run))
        except KeyboardInterrupt:
            _log.info("resume with the same command: %s", sweep.command)
            raise
        finally:
            _log.info("report: %s", write_sweep_report(sweep)[0])
        return failed

    def _run(self, folder: Path, number: int, overrides: Sequence[str]) -> Run:
        """A run in the folder `hydra.sweep.subdir`, which Hydra resolves with its settings."""
        config = self.hydra_context.config_loader.load_sweep_config(self.config, [*overrides])
        names = config.hydra.job.config.override_dirname
        left_out = tuple(f"{key}=" for key in names.exclude_keys)
        typed = sorted(o for o in overrides if not o.startswith(left_out))
        typed = [re.sub(r"[^\w.-]+", names.kv_sep, o) for o in typed]  # needs no quotes in a shell
        with open_dict(config):
            config.hydra.job.id = config.hydra.job.num = number
            config.hydra.job.override_dirname = _shortened(names.item_sep.join(typed))
        HydraConfig.instance().set_config(config)
        subdir = os.path.normpath(str(config.hydra.sweep.subdir))
        return Run(number, tuple(overrides), inside(folder, subdir, "hydra.sweep.subdir="))

    def _settings(self) -> dict[str, Any]:
        everything: Any = OmegaConf.to_container(self.config, resolve=False)
        return {name: value for name, value in everything.items() if name != "hydra"}


class LocalLauncher(SweepLauncher):
    """`hydra/launcher=local`: in parallel on this machine, see `LocalExecutor`."""

    def __init__(self, num_jobs: int | None) -> None:
        executor = LocalExecutor(num_jobs)
        self.executor = lambda _: executor


class SlurmLauncher(SweepLauncher):
    """`hydra/launcher=slurm`: on a Slurm cluster by submitit, see `SlurmExecutor`."""

    def __init__(self, **settings: Any) -> None:
        self.executor = lambda folder: SlurmExecutor(folder / ".submitit", **settings)


class RayLauncher(SweepLauncher):
    """`hydra/launcher=ray`: on a Ray cluster, see `RayExecutor`."""

    def __init__(self, **settings: Any) -> None:
        self.executor = lambda _: RayExecutor(**settings)


def register_plugins(*plugins: type[Plugin]) -> None:
    """Register plugins with Hydra, before it composes.

    Hydra instantiates plugins from the namespace package `hydra_plugins` only. These get a module
    in it, so that this package does not install a second one.
    """
    package, _, name = NAMESPACE.partition(".")
    try:
        parent = importlib.import_module(package)
    except ImportError:
        parent = sys.modules[package] = types.ModuleType(package)
        parent.__path__ = []
    home = sys.modules.setdefault(NAMESPACE, types.ModuleType(NAMESPACE))
    setattr(parent, name, home)
    for plugin in plugins:
        plugin.__module__ = NAMESPACE
        setattr(home, plugin.__name__, plugin)
        Plugins.instance().register(plugin)


def _command() -> list[str]:
    """The command that the user typed, without the sweep's folder that was added."""
    typed = [word for word in sys.argv[1:] if not word.startswith("hydra.sweep.dir=${")]
    return [*sys.argv[0].split(), *typed]


def _job_return(run: Run) -> JobReturn:
    """A run's result for the sweeper: the running mean of rewards, or None if it failed."""
    result = read_result(run.folder)
    value = None if result is None else _number(result.get("running_reward"))
    job = JobReturn(
        overrides=list(run.overrides), working_dir=str(run.folder), status=JobStatus.COMPLETED
    )
    job.return_value = value
    return job


_NOT_SOLVED = {
    "frames": "not solved in trainer.total_frames",
    "episodes": "not solved in trainer.total_episodes",
}


def _outcome(run: Run) -> str:
    result = read_result(run.folder)
    if result is None:
        return f"failed: {read_failure(run) or 'reason unknown'}"
    reward = _number(result.get("running_reward"))
    why = str(_NOT_SOLVED.get(result["reason"], result["reason"]))
    collapsed_at = _number(result.get("collapsed_at_frames"))
    if collapsed_at is not None and result["reason"] in _NOT_SOLVED:
        why += f" (learning collapsed after {collapsed_at:,.0f} frames)"
    judged = result.get("verdict")
    kind = f", verdict: {judged.get('kind')}" if isinstance(judged, dict) else ""
    return f"{why}, running reward {'none' if reward is None else f'{reward:.3f}'}{kind}"


def _number(value: object) -> float | None:
    """A number from a file; None if the file contains something else."""
    return float(value) if isinstance(value, int | float) else None


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
