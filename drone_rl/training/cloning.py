"""Behavior cloning: train a policy's network to repeat the actions of demonstrations.

The network learns from the recorded readings through the policy's transforms, without its simulated
errors. The loss is the cross-entropy of discrete actions, the negative log-likelihood of
continuous ones. A new run clones before its first update; the result is part of its first
checkpoint, so that a resumed run does not repeat it.
"""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple, Self, TypeVar

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor

from drone_rl.config.training import TrainSettings
from drone_rl.envs.readings import Readings
from drone_rl.policies import ImageNetwork
from drone_rl.policies.actor import distribution_of
from drone_rl.policies.zoo import describe
from drone_rl.sim.continuous_actions import MOST_MEAN
from drone_rl.training.callbacks import Callback
from drone_rl.training.demonstrations import Demonstration
from drone_rl.training.learners import NotANumberError, add_gradients, descend
from drone_rl.utils.errors import InputError
from drone_rl.utils.run_result import Cloning
from drone_rl.utils.seeding import Stream, torch_generator

MOST_ACTION = math.tanh(MOST_MEAN)
"""Largest magnitude of a continuous action that a greedy policy takes."""
_LOSS = "loss_cloning"
T = TypeVar("T")


class RecordedFrames(NamedTuple):
    """The frames of several flights, one flight after the other."""

    readings: dict[str, Tensor]  # (N, *), as in `drone_rl.envs.readings`
    actions: Tensor  # (N,), then the shape of an action
    starts: Tensor  # (N,) int64, index of the first frame of each frame's flight

    @classmethod
    def of(cls, demonstrations: Sequence[Demonstration], device: str) -> Self:
        """Join at least one flight."""
        readings = {
            name: torch.cat([torch.from_numpy(flight.readings[name]) for flight in demonstrations])
            for name in demonstrations[0].readings
        }
        actions = torch.cat([torch.from_numpy(flight.actions) for flight in demonstrations])
        lengths = torch.tensor([len(flight) for flight in demonstrations])
        starts = (lengths.cumsum(0) - lengths).repeat_interleave(lengths)
        readings = {name: values.to(device) for name, values in readings.items()}
        return cls(readings, actions.to(device), starts.to(device))

    def observe(self, rows: Tensor, reader: Readings) -> dict[str, Tensor]:
        """Return the network's inputs for some frames, (k,) to (k, *).

        Transforms that stack frames get the earlier frames of the same flight, and repeat its first
        one, as in an episode.
        """
        seen: dict[str, Tensor] = {}
        for by in range(reader.earlier, -1, -1):
            at = torch.maximum(rows - by, self.starts[rows])
            readings = {name: values[at] for name, values in self.readings.items()}
            seen = reader(readings, starts=by == reader.earlier)
        return seen


def imitation_loss(outputs: Tensor, actions: Tensor) -> Tensor:
    """Return the negative log-likelihood of recorded actions, given the network's outputs.

    For discrete actions this is the cross-entropy. Continuous actions are clamped to those that a
    greedy policy can take, because the density is unbounded where a number is 1 or -1.

    Args:
        outputs: Shape: (k, num_outputs).
        actions: Shape: (k,), then that of an action.

    Returns:
        The loss of each frame. Shape: (k,).
    """
    if actions.is_floating_point():
        actions = actions.clamp(-MOST_ACTION, MOST_ACTION)
    return -distribution_of(actions.dtype)(outputs).log_prob(actions)


def hold_out(
    items: Sequence[T], share: float, generator: torch.Generator
) -> tuple[list[T], list[T]]:
    """Split items at random into those to learn from and those held out.

    At least one is held out if there are two or more and `share`, a fraction, is above 0; one
    is always left to learn from.
    """
    count = len(items)
    held = min(count - 1, max(1, round(share * count))) if share > 0 else 0
    order = torch.randperm(count, generator=generator).tolist()
    return [items[i] for i in order[held:]], [items[i] for i in order[:held]]


class Cloner:
    """Learn the actions of frames, and measure loss and accuracy on others."""

    def __init__(self, settings: TrainSettings, network: ImageNetwork) -> None:
        """Take the network, which is trained in place."""
        self.network = network
        self.how, self.limits = settings.cloning, settings.trainer
        self.reader = Readings(describe(settings).inputs)
        self.optimizer = torch.optim.Adam(network.parameters(), lr=self.how.lr)

    def learn(self, frames: RecordedFrames, generator: torch.Generator) -> dict[str, float]:
        """Pass over the frames once, in random order; return loss and accuracy while learning.

        Raises:
            NotANumberError: The loss or a gradient is NaN or infinite.
        """
        order = torch.randperm(len(frames.actions), generator=generator)
        return _mean(self._steps(frames, order.to(frames.actions.device)))

    def _steps(
        self, frames: RecordedFrames, order: Tensor
    ) -> Iterator[tuple[int, dict[str, float]]]:
        for rows in order.split(self.how.minibatch_size):
            self.optimizer.zero_grad()
            minibatch = TensorDict({"row": rows}, [len(rows)])
            terms = add_gradients(
                minibatch, lambda chunk: self._terms(frames, chunk), self.limits.chunk_frames
            )
            descend(self.optimizer, self.network.named_parameters(), self.limits.max_grad_norm)
            yield len(rows), _named(terms)
        self.optimizer.zero_grad()

    @torch.no_grad()
    def measure(self, frames: RecordedFrames) -> dict[str, float]:
        """Return mean loss and accuracy over the frames."""
        every = torch.arange(len(frames.actions), device=frames.actions.device)
        chunks = TensorDict({"row": every}, [len(every)]).split(self.limits.chunk_frames)
        return _mean((len(chunk), _named(self._terms(frames, chunk))) for chunk in chunks)

    def _terms(self, frames: RecordedFrames, chunk: TensorDictBase) -> TensorDict:
        """Return the mean loss and the accuracy of the frames with the indices "row"."""
        rows = chunk.get("row")
        taken, actions = frames.actions[rows], self.network.actions
        outputs = self.network(*frames.observe(rows, self.reader).values())
        is_same = actions.part(actions.greedy(outputs)) == actions.part(taken)
        return TensorDict(
            {_LOSS: imitation_loss(outputs, taken).mean(), "accuracy": is_same.float().mean()}
        )


def clone(
    settings: TrainSettings,
    network: ImageNetwork,
    demonstrations: Sequence[Demonstration],
    callbacks: Iterable[Callback] = (),
) -> dict[str, Any]:
    """Train a network on demonstrations, in place; the same seed gives the same weights on a CPU.

    Args:
        settings: Those of the training, of which `cloning` says how to clone.
        network: The policy's network.
        demonstrations: Recorded under the conditions of the settings; without any, nothing is
            done.
        callbacks: Their `on_clone` is called after each pass.

    Returns:
        The entry "cloning" of checkpoints and `result.json`, see `Cloning`; none without
        demonstrations.

    Raises:
        InputError: Cloning broke down because a loss or gradient was NaN or infinite.
    """
    if not demonstrations:
        return {}
    how, begin = settings.cloning, time.perf_counter()
    generator = torch_generator(settings.seed, Stream.CLONING)
    learned, held_out = hold_out(demonstrations, how.held_out_share, generator)
    frames = RecordedFrames.of(learned, settings.device)
    others = RecordedFrames.of(held_out, settings.device) if held_out else None
    cloner = Cloner(settings, network)
    done: dict[str, float] = {}
    for epoch in range(1, how.epochs + 1):
        try:
            done = cloner.learn(frames, generator)
        except NotANumberError as error:
            raise InputError(
                f"{error} in epoch {epoch} of cloning; lower cloning.lr={how.lr:g} or set "
                "trainer.max_grad_norm"
            ) from error
        measured = {} if others is None else cloner.measure(others)
        done |= {f"held_out_{name}": value for name, value in measured.items()}
        for callback in callbacks:
            callback.on_clone(epoch, how.epochs, {f"cloning/{k}": v for k, v in done.items()})
    result = Cloning(
        folder=str(settings.demonstrations),
        demonstrations=len(learned),
        frames=len(frames.actions),
        held_out_demonstrations=len(held_out),
        held_out_frames=0 if others is None else len(others.actions),
        epochs=how.epochs,
        loss=done["loss"],
        accuracy=done["accuracy"],
        held_out_loss=done.get("held_out_loss"),
        held_out_accuracy=done.get("held_out_accuracy"),
        seconds=round(time.perf_counter() - begin, 3),
    )
    return {"cloning": result.model_dump()}


def _named(terms: Any) -> dict[str, float]:
    """Return the loss and the accuracy, which rounding of means must not raise above 1."""
    return {"loss": float(terms[_LOSS]), "accuracy": min(1.0, float(terms["accuracy"]))}


def _mean(parts: Iterable[tuple[int, dict[str, float]]]) -> dict[str, float]:
    """Return the means of values by name, weighted by the numbers of frames."""
    weighted = list(parts)
    total = sum(count for count, _ in weighted)
    names = weighted[0][1]
    return {name: sum(n * values[name] for n, values in weighted) / total for name in names}
