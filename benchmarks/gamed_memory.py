"""Adversarial policies that memorise the environments of a known seed and fail in all others.

Each acts like a good policy in the environments that an analysis used by default in version 0.1
(seed 0) and moves left in all others. A test checks that each deceives its analysis with `seed=0`.
With the default seed none may.
"""

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor

from drone_rl.collectors import EpisodeCollector
from drone_rl.config import TaskSettings
from drone_rl.config.networks import Mlp
from drone_rl.config.training import TrainSettings
from drone_rl.policies import MLP
from drone_rl.policies.actor import exploring
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import ExternalPolicy, policy_from
from drone_rl.policies.policy import BasePolicy, load_policy
from drone_rl.policies.zoo import describe
from drone_rl.sim.actions import Move
from drone_rl.trust.evaluate import evaluate
from drone_rl.trust.judge import judge
from drone_rl.trust.shifts import shifts
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream

KNOWN_SEED = 0
"""The default of version 0.1."""
EPISODES = 120
"""Episodes of each analysis."""
TASK = TaskSettings(num_cubes=2)
"""A task with few frames to memorise."""
WIDTH = 2500
"""Hidden units of the memorising network; more than frames, so that it can fit all of them."""
COUNTEREXAMPLES = 20
"""Episodes of other environments in which the network learns to move left."""
_GOOD = 0.9
"""Success rate above which an evaluation counts as good, as in a verdict."""
_CONFIDENT = 20.0
"""Logit of the chosen action; its probability is almost 1."""
_RIDGE = 1e-9
"""Regularization relative to the mean diagonal of the kernel matrix."""
Judgement = Callable[[int | None], bool]
"""Return whether an analysis judges the policy good, with a seed; None is the default seed."""


class Recording(NamedTuple):
    """Observations and actions of a good policy in consecutive episodes."""

    frames: Tensor
    """Shape: (T, C, h, w)."""
    actions: Tensor
    """Shape: (T,)."""
    episode: Tensor
    """Shape: (T,)."""


def record(episodes: int, *, seed: int = KNOWN_SEED, stream: Stream = Stream.REPORT) -> Recording:
    """Record greedy episodes of a good policy in the environments of a seed.

    The policy's action depends on the frame alone, so equal frames have equal actions.

    Args:
        episodes: Number of episodes, each in its own environment.
        seed: Root of the environments' random streams.
        stream: Purpose of the environments.
    """
    policy = load_policy("good").in_task(num_cubes=TASK.num_cubes)
    with policy.flying(episodes, seed=seed, stream=stream) as (env, actor), exploring(greedy=True):
        batch = EpisodeCollector(env, actor).collect()
    frames: Any = batch["pixels"]
    actions: Any = batch["action"]
    episode: Any = batch["collector", "traj_ids"]
    return Recording(frames.clone(), actions.flatten().clone(), episode.clone())


def frame_lookup(recording: Recording) -> Logits:
    """Return a callable that looks up the action of each frame and moves left if it is unknown.

    Args:
        recording: Frames and actions to memorise.
    """
    pairs = zip(recording.frames, recording.actions.tolist(), strict=True)
    known = {frame.numpy().tobytes(): action for frame, action in pairs}

    def logits(frames: Tensor) -> Tensor:
        keys = (frame.detach().cpu().numpy().tobytes() for frame in frames)
        return _confident_logits([known.get(key, int(Move.LEFT)) for key in keys])

    return logits


def step_playback(recording: Recording) -> Logits:
    """Return a callable that recognises the first frame of a batch and plays back the actions.

    It ignores all other frames: it counts its calls and knows which environments still run.

    Args:
        recording: Actions to memorise.
    """
    first = recording.frames[0].numpy().tobytes()
    lengths = recording.episode.bincount()
    starts = lengths.cumsum(0) - lengths
    steps = [recording.actions[starts[lengths > t] + t].tolist() for t in range(int(lengths.max()))]
    state = {"step": len(steps)}

    def logits(frames: Tensor) -> Tensor:
        if frames[0].detach().cpu().numpy().tobytes() == first:
            state["step"] = 0
        step = state["step"]
        if step < len(steps) and len(steps[step]) == len(frames):
            state["step"] += 1
            return _confident_logits(steps[step])
        return _confident_logits([int(Move.LEFT)] * len(frames))

    return logits


def write_memorising_policy(path: Path) -> Path:
    """Write a valid policy file with an MLP that is fitted to recorded frames.

    Its hidden layer has random weights. Its output layer interpolates: a good policy's actions on
    frames of known environments, left on frames of others.

    Args:
        path: Path of the file, ending in .safetensors.

    Returns:
        The path.
    """
    described = describe(TrainSettings(task=TASK, network=Mlp(hidden=(WIDTH,))))
    known = record(EPISODES)
    other = record(COUNTEREXAMPLES, seed=KNOWN_SEED + 1)
    frames, actions = _examples(known, other)
    generator = torch.Generator().manual_seed(0)
    network = MLP(frames.shape[1:], len(Move), hidden=(WIDTH,), generator=generator)
    _fit(network, frames, actions)
    origin = load_policy("good").state
    policy = origin.replace(description=described, weights=network.state_dict())
    path.write_bytes(policy.replace(verdict=None, seed=None, chosen=None).to_bytes())
    return path


def _examples(known: Recording, other: Recording) -> tuple[Tensor, Tensor]:
    """Return unique frames and their target actions; known frames keep the good policy's action."""
    targets = {frame.numpy().tobytes(): (frame, int(Move.LEFT)) for frame in other.frames}
    pairs = zip(known.frames, known.actions.tolist(), strict=True)
    targets |= {frame.numpy().tobytes(): (frame, action) for frame, action in pairs}
    frames, actions = zip(*targets.values(), strict=True)
    return torch.stack(frames), torch.tensor(actions)


@torch.no_grad()
def _fit(network: MLP, frames: Tensor, actions: Tensor) -> None:
    """Fit the last layer to the actions by ridge regression in double precision."""
    features = network.layers[:-1](frames).double()
    features = torch.cat([features, torch.ones(len(features), 1).double()], 1)
    targets = _CONFIDENT * torch.nn.functional.one_hot(actions, len(Move)).double()
    kernel = features @ features.T
    kernel.diagonal().add_(_RIDGE * kernel.diagonal().mean())
    weights = features.T @ torch.cholesky_solve(targets, torch.linalg.cholesky(kernel))
    layer = network.layers.get_submodule("logits")
    layer.get_parameter("weight").copy_(weights[:-1].T)
    layer.get_parameter("bias").copy_(weights[-1])


def _confident_logits(actions: list[int]) -> Tensor:
    """Return logits that give these actions a probability of almost 1. Shape: (N, 3)."""
    return _CONFIDENT * torch.nn.functional.one_hot(torch.tensor(actions), len(Move)).float()


def _always_left(frames: Tensor) -> Tensor:
    return _confident_logits([int(Move.LEFT)] * len(frames))


def _memorising(make: Callable[[Recording], Logits], stream: Stream) -> ExternalPolicy:
    """Return a third-party policy that memorises environments of the known seed."""
    policy = policy_from(_always_left, task=TASK, name="memory")
    return dataclasses.replace(policy, logits=make(record(EPISODES, stream=stream)))


def _verdict(make: Callable[[], BasePolicy | Path], seed: int | None) -> bool:
    try:
        done = judge(make(), episodes=EPISODES, sampled=False, seed=seed, progress=silent)
    except InputError:  # the policy depends on more than the frame
        return False
    return done.verdict.exit_code == 0


def _evaluation(make: Callable[[], BasePolicy | Path], seed: int | None) -> bool:
    done = evaluate(make(), episodes=EPISODES, baselines=False, seed=seed, progress=silent)
    return done.greedy.success.lower95 > _GOOD


def _conditions(make: Callable[[], BasePolicy | Path], seed: int | None) -> bool:
    done = shifts(
        make(),
        axes=["noise"],
        strengths=[1],
        modes=["constant"],
        episodes=1,
        domain_episodes=EPISODES,
        seed=seed,
        progress=silent,
    )
    return done.domain is not None and done.domain.plain.good


def judgements(folder: Path) -> dict[str, Judgement]:
    """Return the analysis that each adversarial policy attacks, by name.

    Args:
        folder: Folder of the policy file; created if missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    remember = functools.cache(_memorising)
    by_frame = functools.partial(remember, frame_lookup, Stream.REPORT)
    by_step = functools.partial(remember, step_playback, Stream.REPORT)
    shifted = functools.partial(remember, frame_lookup, Stream.SHIFTED)
    written = functools.partial(write_memorising_policy, folder / "memory.safetensors")
    return {
        "verdict, callable that looks frames up": functools.partial(_verdict, by_frame),
        "verdict, callable that counts steps": functools.partial(_verdict, by_step),
        "verdict, file of an MLP": functools.partial(_verdict, written),
        "evaluate, callable that looks frames up": functools.partial(_evaluation, by_frame),
        "shifts, callable that looks frames up": functools.partial(_conditions, shifted),
    }


def cases(folder: Path) -> dict[str, Callable[[], bool]]:
    """Return for each adversarial policy whether it is judged good with the default seed."""
    return {
        f"memory: {name}": functools.partial(judgement, None)
        for name, judgement in judgements(folder).items()
    }
