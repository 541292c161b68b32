"""Hydra plugins of `drone-rl train -m`: launchers and a sweeper; each run is its own process.

Hydra's default launcher runs all jobs in one process, and its joblib launcher is unmaintained.
Separate processes all start from the same state, and one can fail without the others.
"""

import copy
import importlib
import logging
import re
import signal
import sys
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, IntervalSweep, Override, RangeSweep
from hydra.core.plugins import Plugins
from hydra.core.utils import JobReturn, JobStatus, configure_log, setup_globals
from hydra.plugins.launcher import Launcher
from hydra.plugins.plugin import Plugin
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf, open_dict

from drone_rl.sweeps.executors import (
    Executor,
    LocalExecutor,
    RayExecutor,
    SlurmExecutor,
    describe_active,
)
from drone_rl.sweeps.manifest import Run, Sweep, open_sweep, read_failure, read_result
from drone_rl.sweeps.search import import_optuna, next_trials, note_outcome, open_study
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, refuse_links
from drone_rl.utils.progress import Heartbeat
from drone_rl.utils.schema import Whole, shown
from drone_rl.utils.text import plural

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
        multirun = Path(str(config.hydra.sweep.dir)) / "multirun.yaml"
        self._multirun = multirun, multirun.read_bytes() if multirun.is_file() else None

    def launch(
        self, job_overrides: Sequence[Sequence[str]], initial_job_idx: int
    ) -> Sequence[JobReturn]:
        """Complete the runs; a failure does not stop the others."""
        setup_globals()
        configure_log(self.config.hydra.hydra_logging, self.config.hydra.verbose)
        folder = Path(str(self.config.hydra.sweep.dir)).absolute()
        runs = [self._run(folder, initial_job_idx + i, o) for i, o in enumerate(job_overrides)]
        folder.mkdir(parents=True, exist_ok=True)
        try:
            with folder_lock(folder), _sigterm_as_interrupt():
                sweep = open_sweep(folder, _command(), self._settings(), runs)
                begun = {run.number: run for run in sweep.runs}
                runs = [begun[run.number] for run in runs]  # in the folders of the first start
                finished = sum(read_result(run.folder) is not None for run in runs)
                count = plural(len(runs), "run")
                _log.info("sweep of %s, %d finished before: %s", count, finished, folder)
                failed = self._finish(sweep, runs)
        except InputError:
            self._restore_multirun()
            raise
        if failed:
            self.task_function.statuses.append(1)  # pyright: ignore[reportFunctionMemberAccess]
        return [_job_return(run) for run in runs]

    def _restore_multirun(self) -> None:
        """Restore multirun.yaml, which Hydra's sweeper wrote for a sweep that is refused."""
        path, content = self._multirun
        if content is None:
            path.unlink(missing_ok=True)
        else:
            path.write_bytes(content)

    def _finish(self, sweep: Sweep, runs: Sequence[Run]) -> int:
        """Run the unfinished runs and write the report; return the number of failed ones."""
        from drone_rl.sweeps.report import write_sweep_report  # slow to import

        failed = 0
        try:
            unfinished = [run for run in runs if read_result(run.folder) is None]
            endings = self.executor(sweep.folder).finish(unfinished) if unfinished else ()
            with Heartbeat(lambda: describe_active(unfinished)):
                for done, (run, status) in enumerate(endings, start=1):
                    failed += status != 0
                    line = "[%d/%d] %s: %s"
                    _log.info(line, done, len(unfinished), run.folder.name, _outcome(run))
        except KeyboardInterrupt:
            _log.info("resume with the same command: %s", sweep.command)
            raise
        finally:
            _log.info("report: %s", write_sweep_report(sweep)[0])
        return failed

    def _run(self, folder: Path, number: int, overrides: Sequence[str]) -> Run:
        """A run in the folder `hydra.sweep.subdir`, resolved without a full composition."""
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


class OptunaSweeper(Sweeper):
    """Maximize the final running mean of rewards, see conf/hydra/sweeper/optuna.yaml."""

    config: DictConfig
    hydra_context: HydraContext
    launcher: Launcher

    def __init__(
        self, *, num_trials: int, batch: int, seed: int, params: dict[str, str], **shared: Any
    ) -> None:
        import_optuna()
        frames = shared["report_frames"]
        if num_trials < 1 or batch < 1 or frames < 1:
            raise InputError(
                f"hydra.sweeper.num_trials={num_trials}, batch={batch} and report_frames={frames} "
                "must be 1 or more"
            )
        seed = Whole(0, 2**31).read(seed, "hydra.sweeper.seed")
        self.num_trials, self.batch, self.seed = num_trials, batch, seed
        self.params, self.shared = dict(params), shared

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Store Hydra's objects and make the launcher."""
        # set once, before use, though Hydra declares them optional
        self.hydra_context = hydra_context  # pyright: ignore[reportIncompatibleVariableOverride]
        self.config = config  # pyright: ignore[reportIncompatibleVariableOverride]
        self.launcher = Plugins.instance().instantiate_launcher(  # pyright: ignore[reportIncompatibleVariableOverride]
            hydra_context=hydra_context, task_function=task_function, config=config
        )

    def sweep(self, arguments: list[str]) -> None:
        """Sample settings, run them and report the results until all trials are done."""
        parser = OverridesParser.create(config_loader=self.hydra_context.config_loader)
        typed = parser.parse_overrides([f"{k}={v}" for k, v in self.params.items()] + arguments)
        last = {override.get_key_element(): override for override in typed}
        space = {k: distribution(o) for k, o in last.items() if o.is_sweep_override()}
        fixed = [
            f"{k}={o.get_value_element_as_str()}"
            for k, o in last.items()
            if not o.is_sweep_override()
        ]
        if not space:
            raise InputError(
                "there is nothing to search; give a range such as "
                "'optimizer.lr=tag(log,interval(1e-4,1e-1))' or sweep=search"
            )
        folder = Path(str(self.config.hydra.sweep.dir)).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        refuse_links(folder)
        study = open_study(folder, direction="maximize")
        for name, value in self.shared.items():
            study.set_user_attr(name, value)
        self._search(study, space, fixed)

    def _search(self, study: Any, space: dict[str, Any], fixed: list[str]) -> None:
        optuna = import_optuna()
        done = optuna.trial.TrialState.is_finished
        while (left := self.num_trials - sum(done(t.state) for t in study.trials)) > 0:
            trials = next_trials(study, space, min(left, self.batch), self.seed)
            for trial in trials:
                check_params(trial.params, space)
            batch = [
                [*fixed, *(f"{k}={v}" for k, v in t.params.items()), f"trial={t.number}"]
                for t in trials
            ]
            self.validate_batch_is_legal(batch)
            for trial, job in zip(
                trials, self.launcher.launch(batch, trials[0].number), strict=True
            ):
                note_outcome(study, trial.number, read_result(Path(str(job.working_dir))))
        complete = [t for t in study.trials if t.state == optuna.trial.TrialState.COMPLETE]
        if complete:
            best = study.best_trial
            _log.info("best: run %d, running reward %.3f, %s", best.number, best.value, best.params)


def check_params(params: Mapping[str, Any], space: Mapping[str, Any]) -> None:
    """Raise an `InputError` for parameters of a journal outside this search's space."""
    for name, value in params.items():
        if name not in space or not _contains(space[name], value):
            raise InputError(
                f"optuna.journal sets {shown(name)} to {shown(value)}, which is outside "
                "this search's space; choose another folder"
            )


def _contains(searched: Any, value: object) -> bool:
    """Return whether a distribution of Optuna contains a value."""
    try:
        return searched._contains(searched.to_internal_repr(value))
    except ValueError:  # from Optuna, for none of the choices or no number
        return False


def distribution(override: Override) -> Any:
    """Return Optuna's distribution of a range in Hydra's grammar.

    Raises:
        InputError: It is no range that can be searched.
    """
    d = import_optuna().distributions
    value = override.value()
    if isinstance(value, ChoiceSweep):
        return d.CategoricalDistribution([str(v) for v in override.sweep_string_iterator()])
    try:
        if isinstance(value, RangeSweep):
            numbers = [int(value.start or 0), int(value.stop or 0), int(value.step)]
            start, stop, step = numbers
            if numbers == [value.start or 0, value.stop or 0, value.step] and step > 0:
                return d.IntDistribution(
                    start, start + (stop - 1 - start) // step * step, step=step
                )
        elif isinstance(value, IntervalSweep):
            low, high = cast(float, value.start), cast(float, value.end)  # Hydra wants both
            is_log = "log" in value.tags
            if isinstance(low, int) and isinstance(high, int):  # int(interval(LOW,HIGH))
                return d.IntDistribution(low, high, log=is_log)
            return d.FloatDistribution(float(low), float(high), log=is_log)
    except (ValueError, OverflowError):  # an empty, negative logarithmic or infinite range
        pass
    raise InputError(
        f"{override.input_line} can't be searched; give a choice, interval(LOW,HIGH), or an "
        "ascending range of whole numbers"
    )
