"""Collectors on a Ray cluster, whose workers may die.

TorchRL's `RayCollector` stacks the workers' batches, which must have one length, and sends
parameters through a process group that breaks with its first member. Here, parameters travel with
the request and random streams with the result, so that the replacement of a lost worker runs the
very episodes that were under way.
"""

import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase

from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.policies.actor import DirectActor
from drone_rl.utils.errors import InputError
from drone_rl.utils.ray_cluster import connect

_log = logging.getLogger(__name__)


class _RemoteEpisodes:
    """Run an `EpisodeCollector` in a worker, with the parameters and state of each request."""

    def __init__(self, make: Callable[[], EpisodeCollector]) -> None:
        torch.set_num_threads(1)
        self._episodes = make()
        actor = self._episodes.actor
        self._network, self._actions = actor.network, actor.generator

    def collect(
        self, weights: dict[str, torch.Tensor], state: dict | None
    ) -> tuple[dict[str, Any], dict]:
        """Run one episode in every environment, with these weights, from this state or the start.

        Returns the batch as NumPy arrays, which Ray transfers without copies, and the new state.
        """
        self._network.load_state_dict(weights)
        if state is not None:
            self._episodes.load_state_dict(state["episodes"])
            self._actions.set_state(state["actions"])
        batch = self._episodes.collect().cpu()
        leaves = batch.items(include_nested=True, leaves_only=True)
        after = {"episodes": self._episodes.state_dict(), "actions": self._actions.get_state()}
        return {key: value.numpy() for key, value in leaves}, after


class RayEpisodeCollector:
    """Join the batches of collectors that run in workers of a Ray cluster.

    The result is the same as of a `ThreadedCollector` with as many threads as workers.
    """

    def __init__(
        self,
        makers: Sequence[Callable[[], EpisodeCollector]],
        actor: DirectActor,
        *,
        address: str | None = None,
        num_cpus: float = 1.0,
        max_lost_workers: int = 10,
        device: torch.device | str = "cpu",
        postproc: Callable[[TensorDictBase], TensorDictBase] | None = None,
    ) -> None:
        """Start the workers.

        Args:
            makers: One function for each worker, sent to it; makes its collector.
            actor: The policy that learns, in this process.
            address: Address of the cluster; None joins the one known here or starts one.
            num_cpus: Cores of a worker.
            max_lost_workers: Number of workers that may be replaced before training stops.
            device: Device of the batches.
            postproc: Applied to each joined batch, such as a return estimator.

        Raises:
            InputError: Ray isn't installed, or the cluster is out of reach or too small.
        """
        self.actor, self.postproc = actor, postproc
        self._device = device
        self._makers, self._num_cpus = list(makers), num_cpus
        self._ray, is_own = connect(address, "collector=ray")
        try:
            self.workers = self._start()
            """Handles of the remote `_RemoteEpisodes`."""
        except InputError:
            if is_own:
                self._ray.shutdown()
            raise
        self._states: list[dict | None] = [None] * len(makers)
        self._left = self._max_lost = max_lost_workers

    def __iter__(self) -> Iterator[TensorDictBase]:
        """Yield batches without end."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """Run one episode in every environment of every worker. Shape: (T_total,).

        Raises:
            InputError: Too many workers were lost.
        """
        weights = {k: v.detach().cpu() for k, v in self.actor.network.state_dict().items()}
        shared = self._ray.put(weights)
        numbers = range(len(self._makers))
        tasks = [self.workers[i].collect.remote(shared, self._states[i]) for i in numbers]
        answers = [self._answer(i, tasks[i], shared) for i in numbers]
        self._states = [state for _, state in answers]
        batches = [_to_tensordict(arrays) for arrays, _ in answers]
        batch = torch.cat(batches).to(self._device)  # pyright: ignore[reportArgumentType]
        return batch if self.postproc is None else self.postproc(batch)  # pyright: ignore[reportArgumentType]

    def state_dict(self) -> dict:
        """Return the workers' states between two batches."""
        return {"workers": self._states}

    def load_state_dict(self, state_dict: dict) -> None:
        """Resume from a `state_dict`."""
        self._states = list(state_dict["workers"])

    def shutdown(self) -> None:
        """End the workers; a cluster that was started here ends with this process."""
        for worker in self.workers:
            self._ray.kill(worker)

    def _start(self) -> list[Any]:
        """Return workers that are ready."""
        number, cores = len(self._makers), self._ray.cluster_resources().get("CPU", 0)
        if number * self._num_cpus > cores:
            raise InputError(
                f"collector.num_threads={number} workers of collector.num_cpus={self._num_cpus} "
                f"need more than the cluster's {cores:g} cores; lower one of them"
            )
        workers = [self._worker(make) for make in self._makers]
        try:
            self._ray.get([worker.__ray_ready__.remote() for worker in workers])
        except self._ray.exceptions.RayActorError as error:
            reason = str(error).strip().splitlines()[-1]
            raise InputError(
                f"a Ray worker did not start ({reason}); its machine needs the packages and the "
                "plugins= of this one"
            ) from error
        return workers

    def _worker(self, make: Callable[[], EpisodeCollector]) -> Any:
        remote = self._ray.remote(_RemoteEpisodes)
        return remote.options(num_cpus=self._num_cpus).remote(make)

    def _answer(self, number: int, task: Any, weights: Any) -> tuple[dict[str, Any], dict]:
        """Return the batch and state of a worker or of its replacement."""
        while True:
            try:
                return self._ray.get(task)
            except (
                self._ray.exceptions.RayActorError,
                self._ray.exceptions.WorkerCrashedError,
                self._ray.exceptions.ObjectLostError,
            ) as error:
                self._replace(number, error)
                task = self.workers[number].collect.remote(weights, self._states[number])

    def _replace(self, number: int, error: Exception) -> None:
        if self._left == 0:
            raise InputError(
                f"{self._max_lost + 1} Ray workers were lost, the last one by: "
                f"{' '.join(str(error).split())[:200]}; check the cluster, then resume with "
                "resume=FOLDER"
            ) from error
        self._left -= 1
        _log.warning("Ray worker %d was lost; another runs its unfinished episodes", number)
        self.workers[number] = self._worker(self._makers[number])


def _to_tensordict(arrays: dict[Any, Any]) -> TensorDictBase:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # read-only memory, which cat copies from
        leaves = {key: torch.from_numpy(array) for key, array in arrays.items()}
    length = len(next(iter(leaves.values())))
    batch = TensorDict({}, [length])
    for key, value in leaves.items():
        batch.set(key, value)
    return batch
