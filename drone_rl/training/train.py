"""A whole training run: environment, policy, collector, returns, loss, optimizer, loop.

`drone-rl train` and `drone_rl.train` run this file; `examples/train_with_torchrl.py` is a plain
script of the same components. A critic and Ray workers are in `variants.py`, files in
`run_folder.py`, imitation in `cloning.py`.
"""

import contextlib
import functools
import logging
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Unpack

import torch

from drone_rl.acceleration import with_fused_passes
from drone_rl.collectors import EpisodeCollector, ThreadedCollector
from drone_rl.config.learning import Episodes, Reinforce
from drone_rl.config.options import TrainOptions
from drone_rl.config.registry import implements, modules_of
from drone_rl.config.training import TrainSettings
from drone_rl.objectives import ReinforceLoss
from drone_rl.policies import make_actor
from drone_rl.policies.actor import exploring
from drone_rl.policies.zoo import describe
from drone_rl.sim.tasks import FailureReplayTask, as_task
from drone_rl.training import components, run_folder
from drone_rl.training.callbacks import Callback, CollapseCheck, CsvCallback, with_progress
from drone_rl.training.cloning import clone
from drone_rl.training.components import Components, EnvGroup
from drone_rl.training.confirmation import Confirmation
from drone_rl.training.learners import NotANumberError, ReinforceLearner
from drone_rl.training.run_folder import Judge, RunFolder, Training
from drone_rl.training.trainer import Trainer
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.seeding import Stream, as_global_stream, torch_generator
from drone_rl.utils.threads import torch_threads

_log = logging.getLogger(__name__)


def train(
    settings: TrainSettings | None = None,
    *,
    folder: str | Path | None = None,
    resume: bool = False,
    callbacks: Sequence[Callback] = (),
    progress: Progress | None = None,
    judge: Judge | None = None,
    **changes: Unpack[TrainOptions],
) -> Training:
    """Train one policy, or resume its training.

    In the main thread, Ctrl-C and SIGTERM act after the current update, once its state is saved.

    Args:
        settings: All settings; by default those of the run if it is resumed.
        folder: The run's folder; by default a new one under outputs/train/runs.
        resume: Whether to resume the run in the folder; on a CPU bit for bit.
        callbacks: Called after every update, besides those that write checkpoints and metrics.
        progress: Called with the progress; a bar by default.
        judge: Judges the last policy if `evaluate_after` requests it; `drone_rl.train` passes one.
        changes: Settings by name, as in `train(seed=1)`; `task` may also be a `Task` object.

    Raises:
        InputError: A setting is unusable, or learning broke down.
        KeyboardInterrupt: Ctrl-C stopped it; its attribute `training` is the result so far.
        SystemExit: SIGTERM stopped it (status 143); it has the same attribute. A signal handler
            that the caller has set is called instead, and nothing is raised.
    """
    hooks = with_progress(callbacks, progress)
    run, state = RunFolder.open(folder, resume)
    settings = run_folder.settings_for(settings, state, changes, train)
    run_folder.check_judge(settings, judge)
    with run.locked(is_new=state is None):
        result = learn(settings, run.path, state, hooks)
        training = run_folder.finish(settings, run.path, result, judge)
    return run_folder.reraise_signal(training)


def learn(
    settings: TrainSettings,
    folder: Path,
    state: Mapping[str, Any] | None,
    callbacks: Sequence[Callback],
    replay: FailureReplayTask | None = None,
) -> dict[str, Any]:
    """Clone demonstrations, if any, and train until solved, out of budget or stopped; write files.

    Args:
        settings: All settings.
        folder: The run's folder, locked by this process.
        state: Checkpoint to resume from, if any.
        callbacks: See `train`.
        replay: Task that replays failures, used instead of the settings' task; not saved.

    Returns:
        Why it stopped and how far it came, as in `result.json`.

    Raises:
        InputError: The checkpoint is of another training run, or learning broke down.
    """
    run, limits = RunFolder(folder), settings.trainer
    target = run_folder.target_of(settings)
    demonstrations = run.prepare(settings, state)
    stream = torch_generator(settings.seed, Stream.TORCH)
    with contextlib.ExitStack() as stack:
        stack.enter_context(torch.inference_mode(False))
        stack.enter_context(torch.enable_grad())
        stack.enter_context(exploring(greedy=False))
        stack.enter_context(torch_threads(limits.num_threads))  # sums depend on it
        with as_global_stream(stream):
            parts = components.make_collector(settings, replay)
            stack.callback(parts.collector.shutdown)
            learner = components.make_learner(settings, parts)  # by default `reinforce_learner`
        confirmation = Confirmation(settings, parts.network) if limits.confirm_episodes else None
        if confirmation is not None:
            stack.callback(confirmation.close)
        checkpoints = run.checkpoints(settings)
        collapse = CollapseCheck(target or as_task(settings.task).largest_reward)
        first = (CsvCallback(folder / "metrics.csv"), checkpoints, collapse)
        trainer = Trainer(
            collector=parts.collector,
            learner=learner,
            callbacks=[*first, *callbacks],
            generators=parts.generators,
            stream=stream if modules_of(settings) else None,
            target=target,
            confirm=confirmation,
            total_frames=limits.total_frames,
            total_episodes=limits.total_episodes,
            running_decay=limits.running_decay,
            ends=run_folder.possible_ends(settings),
        )
        own_threads = getattr(learner, "num_threads", None)
        stack.enter_context(torch_threads(own_threads or limits.num_threads))
        run.resume(trainer, checkpoints, state)
        with as_global_stream(stream):
            cloned = clone(settings, parts.network, demonstrations, trainer.callbacks)
        checkpoints.extra |= cloned
        del demonstrations  # release memory
        try:
            with trainer.running() as batches:
                for batch in batches:
                    trainer.finish_update(batch, learner.update(batch))  # log, save, callbacks
        except NotANumberError as error:
            last = checkpoints.last_path
            raise InputError(f"{error}; the last good checkpoint is {last}") from error
        return run_folder.result_of(trainer, settings, confirmation, checkpoints) | collapse.result


@implements(Episodes)
def threaded_collector(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> Components:
    """Make `collector=episodes`: complete episodes, with returns, from threads of this process."""
    sizes = components.group_sizes(settings)
    estimator = settings.returns.make().to(settings.device)
    groups = make_groups(settings, sizes, replay)
    options = components.episode_options(settings, max(1, num_cores() // len(sizes)))
    collectors = [EpisodeCollector(group.env, group.actor, **options) for group in groups]
    _log.info("%s", collectors[0].name)
    made = components.joined(ThreadedCollector(collectors, postproc=estimator), groups)
    if len(collectors) > 1:  # whose batches are copied
        return made
    return made._replace(activations=getattr(collectors[0].fused, "activations", None))


def make_groups(
    settings: TrainSettings,
    sizes: list[int],
    replay: FailureReplayTask | None = None,
    numbers: Iterable[int] | None = None,
) -> list[EnvGroup]:
    """Make the environments of threads or workers, and the policy that acts in them.

    `sizes` are the numbers of environments of the groups, `numbers` the indices of those to make.
    """
    description, seed, device = describe(settings), settings.seed, settings.device
    network = description.build_network(torch_generator(seed, Stream.POLICY_INIT)).to(device)
    groups = []
    for number in range(len(sizes)) if numbers is None else numbers:
        env = description.build_env(
            sizes[number],
            seed=seed,
            device=device,
            task=replay,
            first_world=sum(sizes[:number]),
            num_shards=1,
            renderer=settings.renderer,
        )
        generator = torch_generator(seed, Stream.ACTIONS, number=number, device=device)
        actor = make_actor(network, env.action_spec, generator)
        groups.append(EnvGroup(env, actor, network, generator))
    return groups


@implements(Reinforce)
def reinforce_learner(
    settings: TrainSettings, parts: Components, *, entropy_coeff: float, reduction: str
) -> ReinforceLearner:
    """Make the learner without a critic; its loss has the last two settings."""
    limits, network, actor = settings.trainer, parts.network, parts.collector.actor
    may_fuse = limits.compiled and not network.is_recurrent
    fused = functools.partial(with_fused_passes, activations=parts.activations)
    learning = fused(network, limits.num_threads) if may_fuse else network
    is_fused = learning is not network  # its kernel has `limits.num_threads` threads
    if is_fused:
        actor = make_actor(learning, actor.spec["action"])
    optimizer = settings.optimizer.make(network.parameters())
    return ReinforceLearner(
        network=network,
        loss=ReinforceLoss(actor, entropy_coeff=entropy_coeff, reduction=reduction).to(
            settings.device
        ),
        optimizer=optimizer,
        scheduler=settings.scheduler.make(optimizer),
        max_grad_norm=limits.max_grad_norm,
        chunk_frames=limits.chunk_frames,
        whole_episodes=network.is_recurrent,
        # the steps of an LSTM are too small to share
        num_threads=1 if is_fused or network.is_recurrent else None,
    )
