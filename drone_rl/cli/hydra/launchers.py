# pyright: reportArgumentType=false
# pyright: reportCallIssue=false
# pyright: reportFunctionMemberAccess=false
# (Hydra's configuration is untyped; the job is a function with an attribute.)
"""Hydra's launchers for `drone-rl train -m`: each run of a sweep is a process of its own.

Hydra's own launcher runs all jobs in one process, and its joblib launcher has not been kept up;
a process a run starts each from the same state and lets one fail without the others.
"""

import copy
import importlib
import logging
import re
import signal
import sys
import types
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from hydra.core.hydra_config import HydraConfig
from hydra.core.plugins import Plugins
from hydra.core.utils import JobReturn, JobStatus, configure_log, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.plugins.plugin import Plugin
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict

from drone_rl.sweeps.executors import Executor, LocalExecutor, RayExecutor, SlurmExecutor
from drone_rl.sweeps.manifest import Sweep, open_sweep
from drone_rl.sweeps.runs import Run, read_failure, read_result
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock

NAMESPACE = "hydra_plugins.drone_rl"
"""Where Hydra wants plugins to live."""

_log = logging.getLogger(__name__)


class SweepLauncher(Launcher):
    """Finishes what is unfinished of a sweep, then reports on all of it."""

    config: DictConfig
    hydra_context: HydraContext
    task_function: TaskFunction

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Takes what Hydra hands over."""
        self.hydra_context, self.config = hydra_context, config
        self.task_function = task_function
        noted = Path(str(config.hydra.sweep.dir)) / "multirun.yaml"
        self._noted = noted, noted.read_bytes() if noted.is_file() else None

    def executor(self, folder: Path) -> Executor:
        """Where the processes run."""
        raise NotImplementedError

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Brings the runs to their end; one that fails stops no other."""
        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        folder = Path(str(self.config.hydra.sweep.dir)).absolute()
        runs = [self._run(folder, initial_job_idx + i, o) for i, o in enumerate(job_overrides)]
        folder.mkdir(parents=True, exist_ok=True)
        try:
            with folder_lock(folder), _sigterm_as_interrupt():
                sweep = open_sweep(folder, _command(), self._settings(), runs)
                finished = sum(read_result(run.folder) is not None for run in runs)
                _log.info("sweep of %d runs, %d finished before: %s", len(runs), finished, folder)
                failed = self._finish(sweep, runs)
        except InputError:
            self._leave_as_it_was()
            raise
        if failed:
            self.task_function.statuses.append(1)  # what `drone-rl` exits with
        return [_job_return(run) for run in runs]

    def _leave_as_it_was(self) -> None:
        """Undoes what Hydra's sweeper has noted of a sweep that is refused."""
        path, content = self._noted
        if content is None:
            path.unlink(missing_ok=True)
        else:
            path.write_bytes(content)

    def _finish(self, sweep: Sweep, runs: Sequence[Run]) -> int:
        """Returns how many runs failed."""
        from drone_rl.sweeps.report import (
            write_sweep_report,  # slow to import; no single run needs it
        )

        failed = 0
        try:
            unfinished = [run for run in runs if read_result(run.folder) is None]
            endings = self.executor(sweep.folder).finish(unfinished) if unfinished else ()
            for done, (run, status) in enumerate(endings, start=1):
                failed += status != 0
                _log.info("[%d/%d] %s: %s", done, len(unfinished), run.folder.name, _outcome(run))
        except KeyboardInterrupt:
            _log.info("go on with the same command: %s", sweep.command)
            raise
        finally:
            _log.info("report: %s", write_sweep_report(sweep))
        return failed

    def _run(self, folder: Path, number: int, overrides: Sequence[str]) -> Run:
        """A run in the folder that `hydra.sweep.subdir` names; composing it all would be slow."""
        config = copy.deepcopy(self.config)
        names = config.hydra.job.config.override_dirname
        left_out = tuple(f"{key}=" for key in names.exclude_keys)
        typed = sorted(o for o in overrides if not o.startswith(left_out))
        typed = [re.sub(r"[^\w.-]+", names.kv_sep, o) for o in typed]  # needs no quotes in a shell
        with open_dict(config):
            config.hydra.job.id = config.hydra.job.num = number
            config.hydra.job.override_dirname = names.item_sep.join(typed)
        HydraConfig.instance().set_config(config)
        return Run(number, tuple(overrides), folder / str(config.hydra.sweep.subdir)[:200])

    def _settings(self) -> dict[str, Any]:
        everything = OmegaConf.to_container(self.config, resolve=False)
        named = cast(dict[str, Any], everything)  # a configuration has names at its root
        return {name: value for name, value in named.items() if name != "hydra"}


class LocalLauncher(SweepLauncher):
    """`hydra/launcher=local`: side by side on this machine."""

    def __init__(self, num_jobs: int | None) -> None:
        """Sets how many at the same time; None for one a core."""
        self._executor = LocalExecutor(num_jobs)

    def executor(self, folder: Path) -> Executor:
        """See `LocalExecutor`."""
        del folder
        return self._executor


class SlurmLauncher(SweepLauncher):
    """`hydra/launcher=slurm`: on a Slurm cluster, by submitit."""

    def __init__(self, **settings: Any) -> None:
        """Sets the jobs' resources, see `SlurmExecutor`."""
        self._settings_of_jobs = settings

    def executor(self, folder: Path) -> Executor:
        """See `SlurmExecutor`."""
        return SlurmExecutor(folder / ".submitit", **self._settings_of_jobs)


class RayLauncher(SweepLauncher):
    """`hydra/launcher=ray`: on a Ray cluster."""

    def __init__(self, **settings: Any) -> None:
        """Sets the cluster and a run's share of it, see `RayExecutor`."""
        self._cluster = settings

    def executor(self, folder: Path) -> Executor:
        """See `RayExecutor`."""
        del folder
        return RayExecutor(**self._cluster)


def register_plugins(*plugins: type[Plugin]) -> None:
    """Tells Hydra of plugins; called by the command line before it composes.

    Hydra makes plugins of the namespace package `hydra_plugins` alone. Ours are made to go by a
    name in it, so that this package need not install a second one beside itself.
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
    """What the user typed, without the folder that follows from it."""
    typed = [word for word in sys.argv[1:] if not word.startswith("hydra.sweep.dir=${")]
    return [*sys.argv[0].split(), *typed]


def _job_return(run: Run) -> JobReturn:
    """What a sweeper gets to see of a run: the running mean of rewards, or None if it failed."""
    result = read_result(run.folder)
    value = None if result is None else _number(result.get("running_reward"))
    job = JobReturn(
        overrides=list(run.overrides), working_dir=str(run.folder), status=JobStatus.COMPLETED
    )
    job.return_value = value
    return job


def _outcome(run: Run) -> str:
    result = read_result(run.folder)
    if result is None:
        return f"failed: {read_failure(run) or 'for a reason unknown'}"
    return f"{result['reason']}, running reward {_number(result.get('running_reward'))}"


def _number(value: object) -> float | None:
    """A number out of a file, or none if it is something else there."""
    return float(value) if isinstance(value, int | float) else None


@contextmanager
def _sigterm_as_interrupt() -> Iterator[None]:
    """SIGTERM stops a sweep as Ctrl-C does, so that its runs save their state."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
