"""Sweepers: which runs `drone-rl COMMAND -m` makes; `hydra_plugins` names them."""

import itertools
import logging
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, IntervalSweep, Override, RangeSweep
from hydra.core.plugins import Plugins
from hydra.plugins.launcher import Launcher
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig, OmegaConf

from drone_rl.sweeps.search import (
    METRICS,
    import_optuna,
    metric_of,
    next_trials,
    note_outcome,
    open_study,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import refuse_links
from drone_rl.utils.run_result import read_result
from drone_rl.utils.schema import OneOf, Whole, shown

_log = logging.getLogger(__name__)


class CombiningSweeper(Sweeper):
    """One run for each combination of values, see conf/hydra/sweeper/grid.yaml."""

    config: DictConfig
    hydra_context: HydraContext
    launcher: Launcher

    def __init__(self, params: Mapping[str, str]) -> None:
        self.params = params

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
        """Launch all runs at once; they start if all can be composed."""
        values = []
        for key, override in self.overrides(arguments).items():
            if override.is_interval_sweep():
                raise InputError(
                    f"{override.input_line}: only a search tries an interval; add "
                    "hydra/sweeper=optuna"
                )
            several = override.is_sweep_override()
            texts = override.sweep_string_iterator() if several else [_value(override)]
            values.append([f"{key}={text}" for text in texts])
        runs = [*map(list, itertools.product(*values))]
        if not runs:
            raise InputError(
                f"{' '.join(arguments)}: a sweep of no runs; give each setting at least one value"
            )
        for job in self.launcher.launch(runs, 0):
            _ = job.return_value  # raises the error of a job that failed

    def overrides(self, arguments: Sequence[str]) -> dict[str, Override]:
        """Return the last override of each setting in `params` and on the command line."""
        parser = OverridesParser.create(config_loader=self.hydra_context.config_loader)
        texts = [*(f"{key}={value}" for key, value in self.params.items()), *arguments]
        return {override.get_key_element(): override for override in parser.parse_overrides(texts)}


def _value(override: Override) -> str:
    return override.get_value_element_as_str()


class SearchSweeper(CombiningSweeper):
    """Maximize the final running reward or success rate, see conf/hydra/sweeper/optuna.yaml."""

    def __init__(
        self,
        *,
        metric: str,
        num_trials: int,
        batch: int,
        seed: int,
        prune: bool,
        startup_trials: int,
        report_frames: int,
        params: dict[str, str],
    ) -> None:
        super().__init__(params)
        import_optuna()
        numbers = {"num_trials": num_trials, "batch": batch, "report_frames": report_frames}
        for name, number in numbers.items():
            Whole(1).read(number, f"hydra.sweeper.{name}")
        self.num_trials, self.batch = num_trials, batch
        self.seed = Whole(0, 2**31).read(seed, "hydra.sweeper.seed")
        self.metric = OneOf(tuple(METRICS)).read(metric, "hydra.sweeper.metric")
        self.shared = {
            "metric": metric,
            "prune": prune,
            "startup_trials": startup_trials,
            "report_frames": report_frames,
        }

    def sweep(self, arguments: list[str]) -> None:
        """Sample settings, run them and report the results until all trials are done."""
        overrides = self.overrides(arguments)
        space = {key: distribution(o) for key, o in overrides.items() if o.is_sweep_override()}
        fixed = [f"{key}={_value(o)}" for key, o in overrides.items() if key not in space]
        if not space:
            raise InputError(
                "there is nothing to search; give a range such as "
                "'optimizer.lr=tag(log,interval(1e-4,1e-1))' or sweep=search"
            )
        self._check_comparable(space, fixed, overrides)
        folder = Path(str(self.config.hydra.sweep.dir)).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        refuse_links(folder)
        study = open_study(folder, direction="maximize")
        if study.trials and metric_of(study) != self.metric:
            raise InputError(
                f"hydra.sweeper.metric={self.metric}, but hydra.sweep.dir={folder} holds a search "
                f"by {metric_of(study)}; choose another folder"
            )
        for name, value in self.shared.items():
            study.set_user_attr(name, value)
        self._search(study, space, fixed)

    def _check_comparable(
        self, space: Mapping[str, Any], fixed: list[str], overrides: Mapping[str, Override]
    ) -> None:
        """Refuse ranges in which the metric is not comparable, and runs without the metric."""
        is_success = self.metric == "success"
        for key in space:
            name = key if is_success else key.lstrip("+").partition(".")[0]
            if name in ("task", "experiment"):
                other = "" if is_success else ", or add hydra.sweeper.metric=success"
                raise InputError(
                    f"{overrides[key].input_line} can't be searched: it changes the task, and a "
                    f"search maximizes the {METRICS[self.metric]}, which is comparable within one "
                    f"task only; give one value{other}"
                )
        config = self.hydra_context.config_loader.load_sweep_config(self.config, fixed)
        if is_success and not OmegaConf.select(config, "trainer.confirm_episodes"):
            raise InputError(
                "hydra.sweeper.metric=success is measured in trainer.confirm_episodes, which are "
                "0; give 1 or more"
            )

    def _search(self, study: Any, space: dict[str, Any], fixed: list[str]) -> None:
        states = import_optuna().trial.TrialState
        while (left := self.num_trials - sum(t.state.is_finished() for t in study.trials)) > 0:
            trials = next_trials(study, space, min(left, self.batch), self.seed)
            for trial in trials:
                check_params(trial.params, space)
            batch = [
                [*fixed, *(f"{k}={v}" for k, v in t.params.items()), f"trial={t.number}"]
                for t in trials
            ]
            jobs = self.launcher.launch(batch, trials[0].number)
            for trial, job in zip(trials, jobs, strict=True):
                note_outcome(study, trial.number, read_result(Path(str(job.working_dir))))
        if any(trial.state == states.COMPLETE for trial in study.trials):
            best = study.best_trial
            what = METRICS[self.metric]
            found = {name.lstrip("+"): value for name, value in best.params.items()}
            _log.info("best: run %d, %s %.3f, %s", best.number, what, best.value, found)


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
    if hasattr(searched, "choices"):
        return value in searched.choices
    return isinstance(value, int | float) and searched.low <= value <= searched.high


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
