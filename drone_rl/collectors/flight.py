# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# pyright: reportCallIssue=false
# (Warp's structures are untyped, and torch's modules hold anything.)
"""Complete episodes flown by one kernel, with no Python between their steps.

Where Python takes each step, it takes most of the time: a small network is asked about a picture in
ten microseconds, and a picture drawn in as many.
"""

from collections.abc import Mapping
from typing import Any, Self

import torch
import warp as wp
from tensordict import TensorDict, TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs.utils import ExplorationType

from drone_rl.collectors import flight_kernel
from drone_rl.collectors.logbook import Logbook
from drone_rl.collectors.sight import Entries, Sight
from drone_rl.envs.transforms import StandardizePixels
from drone_rl.policies.actor import CategoricalActor
from drone_rl.policies.finite import require_finite
from drone_rl.policies.known_outputs import KnownOutputs
from drone_rl.policies.packing import PackedNetwork
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels
from drone_rl.sim.rendering.raytrace.renderer import Raytracer
from drone_rl.sim.rendering.raytrace.structs_kernel import Images
from drone_rl.sim.tasks.collect_cubes.flying import FlyingCubes

_LONGEST = 64
"""Steps that are flown at a time; most episodes end within them."""
_MOST_NUMBERS = 2**23
"""Of the pictures that are flown through at a time."""
_MOST_OUTPUTS = 2**24
"""Numbers that layers make of pictures and that are kept: 64 MiB."""


class Flight:
    """Flies the policy of an actor in the worlds of an environment."""

    def __init__(
        self,
        sight: Sight,
        actor: CategoricalActor,
        network: PackedNetwork,
        worlds: FlyingCubes,
        num_cores: int,
    ) -> None:
        """Makes what the kernel needs; see `find`."""
        self._sight, self._actor, self._network, self._worlds = sight, actor, network, worlds
        count, view = sight.worlds.num_worlds, sight.view
        self._workers = WorkerPool(count, num_cores)
        tools = sight.worlds.renderer.kernel_inputs(view, self._workers.size)
        self._eye = flight_kernel.Eye()
        self._eye.view, self._eye.geoms, self._eye.materials, self._eye.scratch = tools
        self._eye.mean, self._eye.deviation = _standard(sight)
        self._rooms = wp.empty((self._workers.size, network.room), dtype=float, device="cpu")
        pixels = view.height * view.width
        self._length = max(1, min(_LONGEST, _MOST_NUMBERS // (count * pixels)))
        self._num_rows = rows = count * self._length
        num_actions = sight.worlds.dynamics.actions.num_outputs
        self._book = Logbook(
            {
                "pixels": torch.empty(rows, 1, view.height, view.width),
                "logits": torch.empty(rows, num_actions),
                "action": torch.empty(rows, dtype=torch.int32),
                "reward": torch.empty(rows),
                "end_reason": torch.empty(rows, dtype=torch.int32),
            }
        )
        self._known: KnownOutputs | None = None
        self._logits = torch.empty(0, num_actions)
        self._owner = getattr(actor.network, "owner", "the policy")
        load_kernels(flight_kernel)

    @classmethod
    def find(cls, sight: Sight, actor: TensorDictModuleBase, num_cores: int) -> Self | None:
        """The same, where task, pictures, network and renderer are such as the kernel knows.

        Args:
            sight: Of the environment.
            actor: The policy.
            num_cores: Shares of the worlds, each on a thread; no result depends on it.
        """
        if type(actor) is not CategoricalActor:
            return None
        worlds, renderer = sight.worlds, sight.worlds.renderer
        is_drawn = type(renderer) is Raytracer and renderer.device.type == "cpu"
        if not is_drawn or sight.view.modalities != ("gray",) or _standard(sight) is None:
            return None
        if worlds.appearance is not None:
            return None
        network = PackedNetwork.find(actor.network, flight_kernel.TOGETHER)
        flown = FlyingCubes.find(worlds.task, worlds.dynamics, worlds.num_worlds)
        if network is None or flown is None:
            return None
        return cls(sight, actor, network, flown, num_cores)

    def can_act(self) -> bool:
        """Whether actions shall be drawn, or the most probable be taken."""
        return self._actor.exploration in (ExplorationType.RANDOM, ExplorationType.DETERMINISTIC)

    def keep_outputs(self) -> KnownOutputs | None:
        """Keeps what all layers make of pictures from now on, where it is not too much."""
        parts = _MOST_OUTPUTS // (self._num_rows * self._network.num_outputs)
        if self._known is None and parts:
            self._known = KnownOutputs(parts * self._num_rows, self._network.num_outputs)
        return self._known

    def fly(self, num_worlds: int, keep_observations: bool = True) -> TensorDictBase:
        """Runs an episode in the first worlds; the environment's stay as they were at the start.

        Args:
            num_worlds: How many.
            keep_observations: Whether to return "pixels" and "logits".

        Returns:
            Episode after episode: what was seen, "action", what `Sight.tell` tells, and
            ("collector", "traj_ids"), from 0. Shape: (T_total,).
        """
        load_kernels(flight_kernel).result()
        self._sight.env.start()
        state: Any = self._sight.worlds.state
        self._worlds.begin(state)
        if self._known is not None:
            self._known.forget()
        self._network.update()
        world, logged = self._flown(num_worlds, keep_observations)
        for name in ("action", "end_reason"):
            logged[name] = logged[name].long()
        if self._sight.is_brief:
            told = self._sight.flags(logged["reward"], logged["end_reason"])
        else:
            told = self._replayed(world, logged)
        batch = TensorDict({}, [len(world)])
        for key in ("pixels", "logits", "action"):
            if key in logged:
                batch.set(key, logged[key])
        for key, value in told.items():
            batch.set(key, value)
        return batch.set(("collector", "traj_ids"), world)

    def close(self) -> None:
        """Ends the threads."""
        self._workers.close()

    def _flown(self, num_worlds: int, keep_observations: bool) -> tuple[Tensor, dict[str, Tensor]]:
        """Worlds of steps, episode after episode, and what was written down of these."""
        taken, reasons = self._worlds.steps[:num_worlds], self._worlds.end_reasons[:num_worlds]
        seen = ("pixels", "logits") if keep_observations else ()
        names, parts = ("action", "reward", "end_reason", *seen), []
        while not (parts and bool(reasons.all())):
            before, first = taken.clone(), len(parts) * self._num_rows
            self._go_on(num_worlds, self._open_log(len(parts), names))
            worlds, rows = self._written(taken - before)
            require_finite(self._logits[rows], self._owner)
            parts.append((worlds, rows + first))
        worlds, rows = (torch.cat(column) for column in zip(*parts, strict=True))
        order = worlds.argsort(stable=True)
        worlds, rows = worlds[order], rows[order]
        logged = self._book.read(rows, names)
        if self._known is not None and keep_observations:
            self._known.note(logged["pixels"], rows, self._network.weights)
        return worlds, logged

    def _open_log(self, part: int, kept: tuple[str, ...]) -> flight_kernel.Log:
        """Where a part is written, and what of it is kept."""
        log, pictures, room = flight_kernel.Log(), Images(), self._book.open(part, kept)
        pictures.gray = wp.from_torch(room["pixels"].flatten(1))
        self._logits = room["logits"]
        log.pictures, log.logits = pictures, wp.from_torch(self._logits)
        log.actions, log.rewards = wp.from_torch(room["action"]), wp.from_torch(room["reward"])
        log.end_reasons = wp.from_torch(room["end_reason"])
        if self._known is not None:
            first, last = part * self._num_rows, (part + 1) * self._num_rows
            log.outputs = wp.from_torch(
                self._known.outputs[first:last]
            )  # none, if there is no room
        return log

    def _go_on(self, num_worlds: int, log: flight_kernel.Log) -> None:
        draws = torch.full((num_worlds, self._length), -1.0)
        if self._actor.exploration == ExplorationType.RANDOM:
            draws.uniform_(generator=self._actor.generator)
        given = [
            self._eye,
            self._network.layers,
            self._rooms,
            self._worlds.flights,
            self._worlds.poses,
            wp.from_torch(draws),
            log,
        ]

        def work(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, *given]
            wp.launch(flight_kernel.fly, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, num_worlds, work)

    def _written(self, lengths: Tensor) -> tuple[Tensor, Tensor]:
        """Worlds and rows of the log, world after world.

        Args:
            lengths: Steps of each world. Shape: (num_worlds,).
        """
        is_step = torch.arange(self._length) < lengths[:, None]
        rows = is_step.flatten().nonzero()[:, 0]
        return rows // self._length, rows

    def _replayed(self, world: Tensor, logged: Mapping[str, Tensor]) -> Entries:
        """What is told of steps, by the rules that know everything: nothing is drawn again."""
        worlds = self._sight.worlds
        lengths = world.bincount()
        first = lengths.cumsum(0) - lengths
        state, going, entries = worlds.state, torch.arange(len(lengths)), Entries()
        state = state if len(state) == len(going) else state[going]
        for step in range(int(lengths.max())):
            is_on = lengths[going] > step
            if not bool(is_on.all()):
                state, going = state[is_on], going[is_on]
            rows = first[going] + step
            state, reward = worlds.advance(state, logged["action"][rows])
            for key, value in self._sight.tell(state, reward)[0].items():
                if step == 0:
                    entries[key] = value.new_empty(len(world), *value.shape[1:])
                entries[key].index_copy_(0, rows, value)
        return entries


def _standard(sight: Sight) -> tuple[float, float] | None:
    """Mean and deviation by which gray pictures are standardised, if nothing else is done."""
    after = sight.after
    if not after:
        return 0.0, 1.0
    is_known = len(after) == 1 and type(after[0]) is StandardizePixels
    return (after[0].mean, after[0].std) if is_known else None
