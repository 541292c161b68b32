"""A whole training run: environment, policy, collector, returns, loss, optimizer, loop.

`drone-rl train` and `drone_rl.train` run this file; `examples/train_with_torchrl.py` is a plain
script of the same components. Learners with a critic are in `actor_critic.py`, Ray workers in
`ray_workers.py`, files in `run_folder.py`, imitation in `cloning.py`.
"""

import contextlib
import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Self

import torch
from torchrl.envs import EnvBase

from drone_rl.acceleration import ActivationRecorder, with_fused_passes
from drone_rl.collectors import EpisodeCollector, ThreadedCollector
from drone_rl.config.learning import Episodes, Ray, Reinforce
from drone_rl.config.registry import implements, modules_of
from drone_rl.config.training import TrainSettings
from drone_rl.envs import base_env
from drone_rl.objectives import ReinforceLoss
from drone_rl.policies import ImageNetwork, make_actor
from drone_rl.policies.actor import exploring
from drone_rl.policies.zoo import Checkpoint, describe
from drone_rl.sim.rendering.devices import check_device
from drone_rl.sim.tasks import FailureReplayTask, Task, as_task
from drone_rl.training import run_folder
from drone_rl.training.callbacks import (
    Callback,
    CollapseCheck,
    CsvCallback,
    UnpaidTerms,
    WidenRanges,
    with_progress,
)
from drone_rl.training.cloning import clone
from drone_rl.training.confirmation import Confirmation
from drone_rl.training.learners import NotANumberError, ReinforceLearner
from drone_rl.training.metrics import success_metric
from drone_rl.training.run_folder import Judge, RunFolder, Training
from drone_rl.training.trainer import Trainer
from drone_rl.utils.available_memory import require_memory
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress
from drone_rl.utils.provenance import num_cores
from drone_rl.utils.run_result import RunResult
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
    **changes: Any,
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
    state: Checkpoint | None,
    callbacks: Sequence[Callback],
    replay: FailureReplayTask | None = None,
) -> RunResult:
    """Clone demonstrations, if any, and train until solved, out of budget or stopped; write files.

    Args:
        settings: All settings.
        folder: The run's folder, locked by this process.
        state: Checkpoint to resume from, if any.
        callbacks: See `train`.
        replay: Task that replays failures, used instead of the settings' task; not saved.

    Returns:
        The content of `result.json`, without a verdict.

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
            parts = make_collector(settings, replay)
            stack.callback(parts.collector.shutdown)
            learner = make_learner(settings, parts)
        confirmation = Confirmation(settings, parts.network) if limits.confirm_episodes else None
        if confirmation is not None:
            stack.callback(confirmation.close)
        checkpoints = run.checkpoints(settings)
        task = as_task(settings.task)
        collapse = CollapseCheck(target or task.largest_reward, success_metric(task))
        first = [CsvCallback(folder / "metrics.csv"), checkpoints, collapse, UnpaidTerms()]
        if task.curriculum is not None:
            if not parts.tasks:
                raise InputError("collector=ray widens no task.curriculum; give another collector")
            first.append(WidenRanges(parts.tasks, is_new=state is None))
        trainer = Trainer(
            collector=parts.collector,
            learner=learner,
            callbacks=[*first, *callbacks],
            generators=parts.generators,
            stream=stream if modules_of(settings) else None,
            target=target,
            confirm=confirmation,
            confirm_interval=run_folder.confirm_interval_of(settings),
            total_frames=limits.total_frames,
            total_episodes=limits.total_episodes,
            running_decay=limits.running_decay,
            ends=run_folder.possible_ends(settings),
            reward_terms=task.reward_terms,
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
        return run_folder.result_of(trainer, settings, confirmation, checkpoints, collapse)


class Components(NamedTuple):
    """The collector of batches with returns, and the network that learns from them."""

    collector: Any
    """Has `actor` and `postproc`, in addition to what `Trainer` needs."""
    network: ImageNetwork
    generators: dict[str, torch.Generator]
    """Random streams of this process, by name."""
    tasks: tuple[Task[Any], ...] = ()
    """That of each group of environments in this process."""
    activations: ActivationRecorder | None = None
    """What a fused collector records, if it alone makes the batches."""

    @classmethod
    def of(cls, collector: Any, groups: Sequence[tuple[EnvBase, Any]]) -> Self:
        """Return the components of a training run whose groups are in this process."""
        generators = {f"actions_{i}": actor.generator for i, (_, actor) in enumerate(groups)}
        tasks = tuple(base_env(env).worlds.task for env, _ in groups)
        return cls(collector, collector.actor.network, generators, tasks)


def make_collector(settings: TrainSettings, replay: FailureReplayTask | None = None) -> Components:
    """Make the collector of the settings, with environments and an untrained network.

    Raises:
        InputError: There is no such device, too little memory, or an extra isn't installed.
    """
    check_device(settings.device)
    if not settings.device.startswith("cuda"):
        _require_batch(settings)
    return settings.collector.make(settings, replay)  # by default `threaded_collector`


def _require_batch(settings: TrainSettings) -> None:
    """Raise an `InputError` unless a batch of frames fits into memory.

    Complete episodes count a quarter of the longest one, which untrained policies reach on average.
    """
    chosen, shapes = settings.collector, describe(settings).shapes.values()
    longest = getattr(settings.task, "step_limit", 1)
    steps = getattr(settings.objective, "num_steps", max(1, longest // 4))
    needed = chosen.num_envs * steps * sum(4 * math.prod(shape) for shape in shapes)
    setting = f"collector.num_envs={chosen.num_envs}, batches of about {steps} steps of each,"
    require_memory(needed, setting, "give fewer environments, steps or pixels")


@implements(Episodes)
def threaded_collector(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> Components:
    """Make `collector=episodes`: complete episodes, with returns, from threads of this process."""
    chosen = settings.collector
    assert isinstance(chosen, Episodes)
    groups, cores = local_groups(settings, replay)
    collectors = [
        EpisodeCollector(env, actor, compiled=chosen.compiled, num_threads=cores)
        for env, actor in groups
    ]
    _log.info("%s", collectors[0].name)
    returns = settings.returns.make().to(settings.device)
    collector = ThreadedCollector(
        collectors, num_threads=settings.trainer.num_threads, postproc=returns
    )
    made = Components.of(collector, groups)
    if len(collectors) > 1:  # whose batches are copied
        return made
    return made._replace(activations=getattr(collectors[0].fused, "activations", None))


def local_groups(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> tuple[list[tuple[EnvBase, Any]], int]:
    """Make the groups of threads of this process; return them and the cores that each has."""
    sizes = group_sizes(settings)
    cores = max(1, num_cores() // len(sizes))
    return make_groups(settings, sizes, cores, replay), cores


def group_sizes(settings: TrainSettings) -> list[int]:
    """Return the number of environments of each thread or worker; on a GPU there is one thread."""
    chosen = settings.collector
    has_one_group = settings.device.startswith("cuda") and not isinstance(chosen, Ray)
    groups = 1 if has_one_group else min(chosen.num_envs, chosen.num_threads)
    return [chosen.num_envs // groups + (i < chosen.num_envs % groups) for i in range(groups)]


def make_groups(
    settings: TrainSettings,
    sizes: list[int],
    num_shards: int,
    replay: FailureReplayTask | None = None,
    numbers: Iterable[int] | None = None,
) -> list[tuple[EnvBase, Any]]:
    """Make the environments of threads or workers, and the policy that acts in them.

    `sizes` are the numbers of environments of the groups, `numbers` the indices of those to make,
    and `num_shards` the threads that render each group.
    The actors share a network and have a random stream each.
    """
    description, seed, device = describe(settings), settings.seed, settings.device
    network = description.build_network(torch_generator(seed, Stream.POLICY_INIT)).to(device)
    groups = []
    for number in range(len(sizes)) if numbers is None else numbers:
        env = description.build_env(
            sizes[number],
            seed=seed,
            device=device,
            task=replay or as_task(settings.task),  # the description lacks its rewards
            first_world=sum(sizes[:number]),
            num_shards=num_shards,
            renderer=settings.renderer,
        )
        generator = torch_generator(seed, Stream.ACTIONS, number=number, device=device)
        groups.append((env, make_actor(network, env.action_spec, generator)))
    return groups


def make_learner(settings: TrainSettings, components: Components) -> Any:
    """Make the learner; raise an `InputError` if no policy could be read from its state."""
    learner = settings.objective.make(settings, components)  # by default `reinforce_learner`
    saved = learner.state_dict().get("policy")
    if not isinstance(saved, Mapping) or saved.keys() != components.network.state_dict().keys():
        raise InputError(
            f"objective={settings.objective.name}: state_dict of {type(learner).__name__} lacks "
            'the policy\'s weights; add "policy": components.network.state_dict()'
        )
    return learner


@implements(Reinforce)
def reinforce_learner(
    settings: TrainSettings, components: Components, *, entropy_coeff: float, reduction: str
) -> ReinforceLearner:
    """Make the learner without a critic; its loss has the last two settings."""
    limits, network, actor = settings.trainer, components.network, components.collector.actor
    learning = network
    if limits.compiled and not network.is_recurrent:
        # its logits are those that the collector has recorded, its gradients come from a kernel;
        # the loss must keep this very object: a copy would hold a recorder of its own
        activations = components.activations
        learning = with_fused_passes(network, limits.num_threads, activations=activations)
    is_fused = learning is not network  # its kernel has `limits.num_threads` threads
    if is_fused:
        actor = make_actor(learning, actor.spec["action"])
    loss = ReinforceLoss(actor, entropy_coeff=entropy_coeff, reduction=reduction)
    optimizer = settings.optimizer.make(network.parameters())
    return ReinforceLearner(
        network=network,
        loss=loss.to(settings.device),
        optimizer=optimizer,
        scheduler=settings.scheduler.make(optimizer),
        max_grad_norm=limits.max_grad_norm,
        chunk_frames=limits.chunk_frames,
        whole_episodes=network.is_recurrent,
        # the steps of an LSTM are too small to share
        num_threads=1 if is_fused or network.is_recurrent else None,
    )
