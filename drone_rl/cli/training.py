"""One training from its settings to its result, behind `drone-rl train`."""

import dataclasses
import json
import logging
import signal
from pathlib import Path
from typing import Any

import torch
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf

from drone_rl.cli.build import build_collector, plain
from drone_rl.cli.judging import judge_to_choose
from drone_rl.sweeps.pruning import PruneCallback
from drone_rl.training import (
    CheckpointCallback,
    CsvCallback,
    LoggerCallback,
    NotANumberError,
    ProgressCallback,
    ReinforceLearner,
    Trainer,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically
from drone_rl.utils.provenance import provenance
from drone_rl.utils.schema import Real
from drone_rl.utils.settings import check_same_config
from drone_rl.zoo import describe, read_checkpoint

MAY_CHANGE = (
    "resume",
    "logger",
    "paths",
    "trainer.total_frames",
    "trainer.total_episodes",
    "trainer.target_share",
    "trainer.checkpoint_interval_s",
    "evaluate_after",
    "trial",
)
"""Settings that a resumed run may change: they don't enter into what is learned."""

_BEST = Real(float("-inf"), 1e6)
_log = logging.getLogger(__name__)


def train(config: DictConfig, folder: Path) -> tuple[int, float]:
    """Trains one policy, or goes on with it.

    Args:
        config: Of conf/train.yaml.
        folder: Of the run.

    Returns:
        Exit status and the running mean of rewards.

    Raises:
        InputError: A setting is unusable, or learning broke down.
    """
    resolved = plain(config)
    state = read_checkpoint(folder / "checkpoints" / "last.pt") if config.resume else None
    if state is not None:
        check_same_config(state["config"], resolved, MAY_CHANGE)
    trainer, checkpoints = _build(config, folder, resolved)
    if state is not None:
        trainer.load_state_dict(state)
        checkpoints.best = _BEST.read(state.get("best"), "the checkpoint's best")
    try:
        reason = trainer.run()
    except NotANumberError as error:
        raise InputError(f"{error}; the last good checkpoint is {checkpoints.last_path}") from error
    finally:
        trainer.collector.shutdown()
    result = {"reason": reason, **dataclasses.asdict(trainer.progress)}
    result["num_cubes"] = config.task.num_cubes
    if config.evaluate_after and not reason.startswith("SIG"):
        episodes = config.evaluate_after
        result["verdict"], _ = judge_to_choose(checkpoints.last_path, episodes, config.device)
    write_atomically(folder / "result.json", json.dumps(result, indent=2))
    _log.info("run folder: %s", folder)
    status = 128 + signal.Signals[reason].value if reason.startswith("SIG") else 0
    if status:
        _log.info("go on with: drone-rl train resume=%s", folder)
    return status, trainer.progress.running_reward


def _build(
    config: DictConfig, folder: Path, resolved: dict[str, Any]
) -> tuple[Trainer, CheckpointCallback]:
    settings = dict(config.trainer)
    del settings["checkpoint_interval_s"]
    share = settings.pop("target_share")
    _check_trainer(config)
    description = describe(resolved).as_dict()
    # sums depend on how many threads make them: on as many everywhere, whatever the machine has
    torch.set_num_threads(config.collector.num_threads)
    collector, network, generators = build_collector(config)
    optimiser = instantiate(config.optimiser)(network.parameters())
    origin = provenance()
    noted = {"config": resolved, "description": description, **origin}
    OmegaConf.save(OmegaConf.create(noted), folder / "run.yaml")
    checkpoints = CheckpointCallback(
        folder / "checkpoints",
        interval_s=config.trainer.checkpoint_interval_s,
        extra={"config": resolved, "description": description, "provenance": origin},
    )
    loggers = [instantiate(logger) for logger in config.logger.values()]
    searching = [] if config.trial is None else [PruneCallback(folder.parent, config.trial)]
    trainer = Trainer(
        collector=collector,
        learner=ReinforceLearner(
            network=network,
            estimator=instantiate(config.returns).to(config.device),
            loss=instantiate(config.objective)(collector.actor).to(config.device),
            optimiser=optimiser,
            scheduler=instantiate(config.scheduler)(optimiser),
            max_grad_norm=settings.pop("max_grad_norm"),
            minibatch_frames=settings.pop("minibatch_frames"),
        ),
        callbacks=[
            CsvCallback(folder / "metrics.csv"),
            LoggerCallback(loggers),
            ProgressCallback(),
            checkpoints,
            *searching,
        ],
        generators=generators,
        target=None if share is None else share * config.task.num_cubes,
        **settings,
    )
    return trainer, checkpoints


def _check_trainer(config: DictConfig) -> None:
    trainer = config.trainer
    if trainer.total_frames < 1 or trainer.minibatch_frames < 1:
        raise InputError(
            f"trainer.total_frames={trainer.total_frames} and trainer.minibatch_frames="
            f"{trainer.minibatch_frames} must be 1 or more"
        )
    if config.evaluate_after < 0:
        raise InputError(f"evaluate_after={config.evaluate_after} must be 0 or more")
    if not 0 <= trainer.running_decay < 1:
        raise InputError(
            f"trainer.running_decay={trainer.running_decay} is out of range; give 0 to below 1"
        )
    lr = config.optimiser.get("lr")
    if lr is not None and not lr > 0:
        raise InputError(f"optimiser.lr={lr} is out of range; give a rate above 0")
    share = trainer.target_share
    if share is not None and not 0 < share <= 1:
        raise InputError(
            f"trainer.target_share={share} is out of range; give a share above 0, up to 1, or null"
        )
