"""A trained policy, wherever it comes from, and the worlds to fly it in."""

import contextlib
import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import TransformedEnv

from drone_rl.api.showing import table
from drone_rl.policies import PolicyNetwork, make_actor
from drone_rl.settings.changes import Changes
from drone_rl.sim.settings import BaseTaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest
from drone_rl.utils.seeding import Stream, torch_generator
from drone_rl.zoo import PolicyDescription, parse, policy_names, policy_path, read_policy


@dataclasses.dataclass(frozen=True)
class Policy:
    """A trained policy: what it flies in, what it sees, its network, and where it comes from."""

    name: str
    """For people: a name in the zoo, or that of the run's folder."""
    path: Path
    """Its file."""
    description: PolicyDescription = dataclasses.field(repr=False)
    """Task, camera, transforms and network."""
    state: dict[str, Any] = dataclasses.field(repr=False)
    """All that its file says, see `drone_rl.zoo.read_policy`."""

    @property
    def task(self) -> BaseTaskSettings:
        """What it flies in."""
        return self.description.task

    def in_task(self, **changes: Any) -> "Policy":
        """The same policy in a changed task, such as `policy.in_task(num_cubes=5)`.

        Args:
            changes: Settings of the task; None keeps its own.

        Raises:
            InputError: A setting is unknown or out of range; the message begins with "task.".
        """
        changed = Changes(type(self.task)).read(changes, "task")
        described = self.description.as_dict()
        described["task"] |= changed
        return dataclasses.replace(self, description=parse(described))

    def make_env(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
        **kwargs: Any,
    ) -> TransformedEnv:
        """Worlds like those that it was trained in, seen as it sees them.

        Args:
            num_envs: How many.
            seed: Root of their random streams.
            stream: Which worlds: by default those to report on, which training never sees.
            device: Where they are drawn.
            kwargs: See `drone_rl.envs.DroneEnv`.
        """
        return self.description.build_env(
            num_envs, seed=seed, stream=stream, device=device, **kwargs
        )

    def make_network(self, device: str | torch.device = "cpu") -> PolicyNetwork:
        """Its network."""
        network = self.description.build_network(torch.Generator().manual_seed(0))
        network.load_state_dict(self.state["policy"])
        return network.to(device)

    def make_actor(
        self, env: TransformedEnv, *, seed: int = 0, stream: Stream = Stream.REPORT
    ) -> TensorDictModuleBase:
        """It as a TorchRL actor, which draws its actions from a stream of its own.

        Args:
            env: From `make_env`.
            seed: Of the stream.
            stream: Which.
        """
        device = str(env.device or "cpu")
        generator = torch_generator(seed, stream, device=device)
        return make_actor(self.make_network(device), env.action_spec, generator)

    @contextlib.contextmanager
    def flying(
        self,
        num_envs: int,
        *,
        seed: int = 0,
        stream: Stream = Stream.REPORT,
        device: str = "cpu",
    ) -> Iterator[tuple[TransformedEnv, TensorDictModuleBase]]:
        """Worlds and it as their actor, for a while; then the worlds are closed.

        Args:
            num_envs: How many.
            seed: Root of their random streams and of its own.
            stream: Which worlds.
            device: Where they are drawn.
        """
        env = self.make_env(num_envs, seed=seed, stream=stream, device=device)
        try:
            yield env, self.make_actor(env, seed=seed, stream=stream)
        finally:
            env.close()

    def _repr_html_(self) -> str:
        """Shows itself in a notebook."""
        progress, described = self.state["progress"], self.description.as_dict()
        rows = {
            "network": ", ".join(f"{k}={v}" for k, v in described["network"].items()),
            "sees": " > ".join(step["name"] for step in described["transforms"]),
            "task": ", ".join(f"{k}={v}" for k, v in described["task"].items()),
            "trained": f"{progress['frames']:,} frames, {progress['episodes']:,} episodes",
            "file": str(self.path),
        }
        return table(["policy", self.name], [[name, text] for name, text in rows.items()])


def load_policy(which: str | Path, *, outputs: str | Path = "outputs") -> Policy:
    """A trained policy.

    Args:
        which: A policy that travels with the package ("good", "poor", "right_and_forward"), a .pt
            or .safetensors file, the folder of a run (its `last.pt`), or "latest" for the newest.
        outputs: Folder under which runs are kept.

    Raises:
        InputError: There is none, or it is unusable.
    """
    path = find_policy(which, outputs)
    state = read_policy(path)
    is_run = path.suffix == ".pt" and len(path.parents) > 1
    name = path.absolute().parents[1].name if is_run else path.stem
    return Policy(name, path, parse(state["description"]), state)


def find_policy(which: str | Path, outputs: str | Path = "outputs") -> Path:
    """The file of a policy, see `load_policy`.

    Raises:
        InputError: There is none.
    """
    if which == "latest":
        last = newest(Path(outputs).glob("train/**/checkpoints/last.pt"))
        if last is None:
            raise InputError(
                f"policy=latest, but there is no run under {outputs}/train; "
                "run drone-rl train first or give the path of a checkpoint"
            )
        return last
    if which in policy_names():
        return policy_path(str(which))
    path = Path(which)
    if not path.exists():
        raise InputError(
            f"policy={which} does not exist; give a file, the folder of a run, latest, or one of "
            f"{', '.join(policy_names())}"
        )
    return path / "checkpoints" / "last.pt" if path.is_dir() else path
