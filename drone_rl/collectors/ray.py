"""Collectors on a Ray cluster, whose workers may die.

TorchRL's `RayCollector` creates the workers, places them and ends them. It stacks the workers'
batches, which must have one length, and sends parameters through a process group that breaks with
its first member. Therefore the exchange of a batch is implemented here: parameters travel with the
request and random streams with the result, so that the replacement of a lost worker runs the very
episodes that were under way.
"""

import logging
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import nn
from torchrl.collectors import BaseCollector

from drone_rl.collectors.episodes import EpisodeCollector
from drone_rl.utils.errors import InputError
from drone_rl.utils.ray_cluster import connect

WorkerComponents = tuple[EpisodeCollector, nn.Module, torch.Generator]
"""A worker's collector, the network inside it and the stream of its actions."""

_log = logging.getLogger(__name__)


class _RemoteEpisodes(BaseCollector):
    """Run an `EpisodeCollector` in a worker, with the parameters and state of each request."""

    def __init__(
        self, create_env_fn: Sequence[Callable[[], WorkerComponents]], **unused: object
    ) -> None:
        super().__init__()
        torch.set_num_threads(1)
        self._episodes, self._network, self._actions = create_env_fn[0]()

    def __bool__(self) -> bool:
        """Return True; else Ray would ask for a length before it reports an error of `__init__`."""
        return True

    def collect(
        self, weights: dict[str, torch.Tensor], state: dict | None
    ) -> tuple[dict[str, Any], dict]:
        """Run one episode in every environment, with these weights, from this state or the start.

        Returns the batch as NumPy arrays, which Ray transfers without copies, and the new state.
        """
        self._network.load_state_dict(weights)
        if state is not None:
            self.load_state_dict(state)
        batch = self._episodes.collect().cpu()
        leaves = batch.items(include_nested=True, leaves_only=True)
        return {key: value.numpy() for key, value in leaves}, self.state_dict()

    def state_dict(self) -> dict:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Return the state between two batches."""
        return {"episodes": self._episodes.state_dict(), "actions": self._actions.get_state()}

    def load_state_dict(self, state_dict: dict) -> None:
        """Resume from a state."""
        self._episodes.load_state_dict(state_dict["episodes"])
        self._actions.set_state(state_dict["actions"])

    def iterator(self) -> Iterator[TensorDictBase]:
        """Yield batches without end."""
        while True:
            yield self._episodes.collect()

    def set_seed(self, seed: int, static_seed: bool = False) -> int:
        """Raise an error: the seed is part of the settings."""
        raise NotImplementedError("a worker's seed comes from its settings; set `seed` there")

    def shutdown(self, *args: object, **kwargs: object) -> None:
        """Close the environment."""
        self._episodes.shutdown()


class RayEpisodeCollector:
    """Join the batches of collectors that run in workers of a Ray cluster.

    The result is the same as of a `ThreadedCollector` with as many threads as workers.
    """

    def __init__(
        self,
        makers: Sequence[Callable[[], WorkerComponents]],
        actor: TensorDictModuleBase,
        network: nn.Module,
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
            network: Its network.
            address: Address of the cluster; None joins the one known here or starts one.
            num_cpus: Cores of a worker.
            max_lost_workers: Number of workers that may be replaced before training stops.
            device: Device of the batches.
            postproc: Applied to each joined batch, such as a return estimator.

        Raises:
            InputError: Ray isn't installed, or the cluster is out of reach or too small.
        """
        self.actor, self.postproc = actor, postproc
        self._network, self._device = network, device
        self._ray, self._pool = _start(makers, address, num_cpus)
        self._makers, self._num_cpus = list(makers), num_cpus
        self._states: list[dict | None] = [None] * len(makers)
        self._left = self._max_lost = max_lost_workers

    @property
    def workers(self) -> list[Any]:
        """Handles of the remote `_RemoteEpisodes`."""
        return self._pool.remote_collectors

    def __iter__(self) -> Iterator[TensorDictBase]:
        """Yield batches without end."""
        while True:
            yield self.collect()

    def collect(self) -> TensorDictBase:
        """Run one episode in every environment of every worker. Shape: (T_total,).

        Raises:
            InputError: Too many workers were lost.
        """
        weights = {k: v.detach().cpu() for k, v in self._network.state_dict().items()}
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
        self._pool.shutdown()

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
        self._pool.add_collectors(
            [self._makers[number]], 1, None, [{}], [{"num_cpus": self._num_cpus}]
        )
        self.workers[number] = self.workers.pop()


def _start(
    makers: Sequence[Callable[[], WorkerComponents]], address: str | None, num_cpus: float
) -> tuple[Any, Any]:
    """Return the module ray and TorchRL's collector, whose workers are ready."""
    ray, is_own = connect(address, "collector=ray")
    try:
        return ray, _start_workers(ray, makers, num_cpus)
    except InputError:
        if is_own:
            ray.shutdown()
        raise


def _start_workers(
    ray: Any, makers: Sequence[Callable[[], WorkerComponents]], num_cpus: float
) -> Any:
    """Return TorchRL's collector, whose workers are ready."""
    from torchrl.collectors.distributed import RayCollector

    cores = ray.cluster_resources().get("CPU", 0)
    if len(makers) * num_cpus > cores:
        raise InputError(
            f"collector.num_threads={len(makers)} workers of collector.num_cpus={num_cpus} need "
            f"more than the cluster's {cores:g} cores; lower one of them"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # about a policy, which need not be sent
            return RayCollector(
                list(makers),
                collector_class=_RemoteEpisodes,  # pyright: ignore[reportArgumentType]
                frames_per_batch=len(makers),
                sync=True,
                weight_sync_schemes={},
                remote_configs={"num_cpus": num_cpus},
            )
    except ray.exceptions.RayActorError as error:
        reason = str(error).strip().splitlines()[-1]
        raise InputError(
            f"a Ray worker did not start ({reason}); its machine needs the packages and the "
            "plugins= of this one"
        ) from error


def _to_tensordict(arrays: dict[Any, Any]) -> TensorDictBase:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # read-only memory, which cat copies from
        leaves = {key: torch.from_numpy(array) for key, array in arrays.items()}
    length = len(next(iter(leaves.values())))
    batch = TensorDict({}, [length])
    for key, value in leaves.items():
        batch.set(key, value)
    return batch
