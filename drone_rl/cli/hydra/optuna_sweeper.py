# pyright: reportArgumentType=false
# pyright: reportOptionalMemberAccess=false
# pyright: reportIncompatibleVariableOverride=false
# (Hydra's sweeper and Optuna's study are annotated to hold anything, or nothing.)
"""`hydra/sweeper=optuna`: a search for settings, in which hopeless runs are stopped early.

Hydra's own Optuna plugin wants Optuna 2, and its runs can't be pruned.
"""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, IntervalSweep, Override, RangeSweep
from hydra.core.plugins import Plugins
from hydra.plugins.launcher import Launcher
from hydra.plugins.sweeper import Sweeper
from hydra.types import HydraContext, TaskFunction
from omegaconf import DictConfig

from drone_rl.sweeps.runs import read_result
from drone_rl.sweeps.search import import_optuna, next_trials, note_outcome, open_study
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import refuse_links
from drone_rl.utils.schema import shown

_log = logging.getLogger(__name__)


class OptunaSweeper(Sweeper):
    """Maximises the running mean of rewards at the end of a run."""

    config: DictConfig
    hydra_context: HydraContext
    launcher: Launcher

    def __init__(
        self,
        *,
        num_trials: int,
        batch: int,
        seed: int,
        prune: bool,
        startup_trials: int,
        report_frames: int,
        params: dict[str, str],
    ) -> None:
        """Sets the search; see conf/hydra/sweeper/optuna.yaml.

        Raises:
            InputError: Optuna isn't installed, or a number is below 1.
        """
        import_optuna()
        if num_trials < 1 or batch < 1 or report_frames < 1:
            raise InputError(
                f"hydra.sweeper.num_trials={num_trials}, batch={batch} and report_frames="
                f"{report_frames} must be 1 or more"
            )
        self.num_trials, self.batch, self.seed = num_trials, batch, seed
        self.params = dict(params)
        self.shared = {
            "prune": prune,
            "startup_trials": startup_trials,
            "report_frames": report_frames,
        }

    def setup(
        self, *, hydra_context: HydraContext, task_function: TaskFunction, config: DictConfig
    ) -> None:
        """Takes what Hydra hands over."""
        self.hydra_context, self.config = hydra_context, config
        self.launcher = Plugins.instance().instantiate_launcher(
            hydra_context=hydra_context, task_function=task_function, config=config
        )

    def sweep(self, arguments: list[str]) -> None:
        """Asks for settings, runs them, tells the results, until all trials are done."""
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
                "'optimiser.lr=tag(log,interval(1e-4,1e-1))' or sweep=search"
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
            _log.info("best: run %d, %.3f cubes, %s", best.number, best.value, best.params)


def check_params(params: Mapping[str, Any], space: Mapping[str, Any]) -> None:
    """Refuses what a journal says of a trial unless this search could have drawn it.

    Raises:
        InputError: A setting is not among those that are searched, or its value out of range.
    """
    for name, value in params.items():
        if name not in space or not space[name]._contains(space[name].to_internal_repr(value)):
            raise InputError(
                f"optuna.journal sets {shown(name)} to {shown(value)}, which this search never "
                "draws; choose another folder"
            )


def distribution(override: Override) -> Any:
    """Optuna's distribution for a range in Hydra's grammar."""
    d = import_optuna().distributions
    value = override.value()
    if isinstance(value, ChoiceSweep):
        return d.CategoricalDistribution([str(v) for v in override.sweep_string_iterator()])
    if isinstance(value, RangeSweep):
        start, step = int(value.start or 0), int(value.step)
        last = start + (int(value.stop or 0) - 1 - start) // step * step
        return d.IntDistribution(start, last, step=step)
    if not isinstance(value, IntervalSweep):
        raise InputError(f"{override.input_line} can't be searched; give a choice or an interval")
    low, high = cast(float, value.start), cast(float, value.end)  # Hydra's parser wants both
    return d.FloatDistribution(float(low), float(high), log="log" in value.tags)
