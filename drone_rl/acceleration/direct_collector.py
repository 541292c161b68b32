"""Step environments without TorchRL, if all transforms are stateless."""

from collections.abc import Iterable, Mapping
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from tensordict.utils import NestedKey
from torch import Tensor

from drone_rl.envs.direct_renderer import DirectRenderer, Entries, Reasons


class DirectCollector:
    """Collect complete episodes with the same result as stepping by TorchRL, bit for bit.

    An environment whose episode has ended is neither stepped nor rendered. The state that the
    environment itself holds stays as it is at the start of the episodes.
    """

    implementation = "PyTorch"

    def __init__(
        self,
        renderer: DirectRenderer,
        actor: TensorDictModuleBase,
        action_key: NestedKey,
        actor_keys: Iterable[NestedKey] = (),
        keep_actor_entries: bool = True,
    ) -> None:
        """See `collectors.speedups.accelerated_collector`."""
        self.renderer, self.actor, self.action_key = renderer, actor, action_key
        self.keep_actor_entries = keep_actor_entries
        self.reasons = Reasons()
        """Why the collector is not fused; empty if no fused collector was requested."""
        self._actor_keys = tuple(actor_keys)

    @property
    def name(self) -> str:
        """Name in the log."""
        return f"direct collector: {self.reasons}" if self.reasons else "direct collector"

    def collect(self, num_envs: int) -> TensorDictBase:
        """Run an episode in each of the first environments; trajectories count from 0."""
        renderer = self.renderer
        renderer.env.start()
        active = torch.arange(num_envs, device=renderer.env.device)
        state: Any = renderer.worlds.state[active]
        rows: list[Tensor] = []
        steps: list[Entries] = []
        while len(active):
            acted = self.actor(renderer.observe(state, active))
            keys = (self.action_key, *self._actor_keys)
            keys = acted.keys(True, True) if self.keep_actor_entries else keys
            step: Entries = {key: acted.get(key) for key in keys}
            state, reward = renderer.worlds.advance(state, acted.get(self.action_key))
            entries, done = renderer.entries(state, reward)
            rows.append(active)
            steps.append(step | entries)
            running = (~done[:, 0]).nonzero()[:, 0]
            if len(running) < len(active):
                state, active = state[running], active[running]
        return _join(steps, rows, num_envs)

    def close(self) -> None:
        """Do nothing: there are no threads."""


def _join(steps: list[Entries], rows: list[Tensor], num_envs: int) -> TensorDictBase:
    """Return the steps of all episodes, one episode after the other. Shape: (T_total,)."""
    env_of_step = torch.cat(rows)
    lengths = env_of_step.bincount(minlength=num_envs)
    first = lengths.cumsum(0) - lengths
    targets = torch.cat([first[indices] + t for t, indices in enumerate(rows)])
    batch = TensorDict({}, [len(targets)], device=targets.device)
    spans = targets.split([len(indices) for indices in rows])
    for key, value in steps[0].items():
        joined = value.new_empty(len(batch), *value.shape[1:])
        for indices, step in zip(spans, steps, strict=True):
            joined.index_copy_(0, indices, step[key])
        batch.set(key, joined)
    traj_ids = torch.empty_like(env_of_step).index_copy_(0, targets, env_of_step)
    return batch.set(("collector", "traj_ids"), traj_ids)


class DirectStepper:
    """Step all environments continually, with the same result as `TorchrlStepper`, bit for bit."""

    name = "direct collector"

    def __init__(self, renderer: DirectRenderer) -> None:
        self._renderer = renderer
        self._pixels: Tensor | None = None

    def observe(self) -> TensorDictBase:
        """See `TorchrlStepper`."""
        if self._pixels is None:
            self._renderer.env.start()
            self._pixels = self._render()
        return TensorDict({"pixels": self._pixels}, [len(self._pixels)], device=self._pixels.device)

    def _render(self) -> Tensor:
        return self._renderer.observe(self._renderer.worlds.state).get("pixels")

    def step(self, action: Tensor) -> Entries:
        """See `TorchrlStepper`."""
        worlds = self._renderer.worlds
        worlds.state, reward = worlds.advance(worlds.state, action)
        entries, _ = self._renderer.entries(worlds.state, reward)
        self._pixels = self._render()
        return entries | {("next", "pixels"): self._pixels}

    def restart(self, ended: Tensor) -> None:
        """See `TorchrlStepper`."""
        rows = ended.flatten().nonzero()[:, 0]
        self._renderer.env.start(rows)
        fresh = self._renderer.observe(self._renderer.worlds.state[rows], rows).get("pixels")
        self._pixels = self.observe().get("pixels").index_copy(0, rows, fresh)

    def forget(self) -> None:
        """See `TorchrlStepper`."""
        self._pixels = None

    def state_dict(self) -> dict[str, Any]:
        """See `TorchrlStepper`; only the environments have a state."""
        self.observe()
        return {"worlds": self._renderer.env.running_state(), "transforms": {}, "carried": {}}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """See `TorchrlStepper`."""
        self._renderer.env.load_running_state(state["worlds"])
        self._pixels = self._render()
