"""What a policy wishes for in worlds that were only imagined, through its camera and transforms."""

from collections.abc import Callable, Iterable

import torch
from torch import Tensor, nn
from torchrl.envs import CatFrames, Transform, TransformedEnv

from drone_rl.envs import CameraFault, worlds_of
from drone_rl.policies.rounding import RoundingBound
from drone_rl.sim.tasks.collect_cubes import WorldState
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.chain import Ask
from drone_rl.verification.prover.graph import Graph

MOST_ROUNDING = 0.1
"""Largest bound on the rounding error of a logit. Honest policies have about 0.01."""
_FEW = 256
BATCH = 1000
"""Pictures drawn at a time; bounds memory."""


class Sight:
    """Draws nodes of lattices as the policy's camera does, and asks its network."""

    def __init__(self, env: TransformedEnv, network: Callable[[Tensor], Tensor]) -> None:
        """Borrows worlds, transforms and a network.

        Args:
            env: Worlds of cube collection and the policy's transforms.
            network: Pictures (N, C, H, W) to logits (N, A).

        Raises:
            InputError: The policy remembers pictures or its camera goes wrong, so that a node
                doesn't decide what it does.
        """
        self.pictures = 0
        """Drawn so far."""
        self._worlds, self._network = worlds_of(env), network
        is_module = isinstance(network, nn.Module)
        self._rounding = RoundingBound.find(network) if is_module else None
        pipeline: Iterable[Transform] = env.transform  # type: ignore[assignment]
        self._transforms = [t for t in pipeline if "pixels" in (t.in_keys or [])]
        stacks = [t.N for t in self._transforms if isinstance(t, CatFrames)]
        if max(stacks, default=1) > 1:
            raise InputError(
                f"the policy stacks {max(stacks)} frames, so that its moves depend on the past; "
                "give a policy that sees one picture"
            )
        if faults := [t for t in self._transforms if isinstance(t, CameraFault)]:
            raise InputError(
                f"the policy's camera goes wrong ({faults[0]}), so that its moves depend on chance "
                "or the past; give a policy without"
            )

    def on(self, graph: Graph) -> Ask:
        """How to ask what the policy does in nodes of a graph; no picture is drawn twice."""
        node, picture = graph.pictures()
        every = graph.states()
        known = torch.full(
            (len(node), len(self._worlds.dynamics.actions.names)), torch.nan
        ).double()

        def ask(nodes: Tensor) -> Tensor:
            wanted = picture[nodes].unique()
            new = wanted[known[wanted, 0].isnan()]
            if len(new):
                known[new] = self._wishes(every[node[new]])
            return known[picture[nodes]]

        return ask

    @torch.no_grad()
    def _wishes(self, states: WorldState) -> Tensor:
        """Probabilities of the moves in worlds. Shape: (N, A), float64, on the CPU."""
        self.pictures += len(states)
        parts = states.to(self._worlds.device).split(BATCH)
        return torch.cat([self._logits(part) for part in parts]).double().softmax(-1).cpu()

    def _logits(self, state: WorldState) -> Tensor:
        pixels = self._worlds.render(state)
        for transform in self._transforms:
            pixels = transform._apply_transform(pixels)
        logits = self._network(pixels)  # refuses what is not finite
        self._require_known(pixels)
        return logits

    def _require_known(self, pixels: Tensor) -> None:
        """Refuse probabilities that depend on the order of summation.

        Raises:
            InputError: They may differ by more than `MOST_ROUNDING`.
        """
        if self._rounding is None:
            return
        _, error = self._rounding.together(pixels)
        if bool((error <= MOST_ROUNDING).all()):  # a probability changes by no more than its logit
            return
        for part in pixels.split(_FEW):
            most = float(self._rounding.errors(part).max())
            if not most <= MOST_ROUNDING:
                raise InputError(
                    f"rounding can change a logit of the policy by {most:.3g}, so that its "
                    f"chances depend on the order of sums; give a policy with at most "
                    f"{MOST_ROUNDING:g}"
                )
