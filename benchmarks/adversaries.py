"""Adversaries of verdicts: each deserves neither "good" nor an accepted operating domain.

Some act by the order of sums or by their number of calls, some ignore their images and sweep the
whole area, and some fail within a range of conditions of which both ends are good.
"""

import functools
import logging
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import torch
import yaml
from torch import Tensor

from benchmarks.benchmark import Setup
from drone_rl.config.commands import JudgeSettings
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.policies import make_actor
from drone_rl.policies.external_policy import policy_from
from drone_rl.policies.policy import BasePolicy, load_policy
from drone_rl.policies.recurrent import Memory, RecurrentNetwork
from drone_rl.sim.actions import Move
from drone_rl.trust.axes import AXES, Axis, find_axes
from drone_rl.trust.coverage import check_required
from drone_rl.trust.judge import judge
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.verdict import judge_policy
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed, root_seed

SEEDS = 20
"""Fresh seeds for each adversary."""
EPISODES = 400
_STRONG = 1000.0
"""Exceeds every logit of "good"."""
_SWEEP = [(15, Move.FORWARD), (7, Move.LEFT), (14, Move.RIGHT), (9, Move.FORWARD)]
_SWEEP += [(14, Move.LEFT), (9, Move.FORWARD), (14, Move.RIGHT)]
"""Steps that touch every place at which a cube can be."""
Feature = Callable[[Tensor], Tensor]
"""A number for each frame, (N, 1, H, W) to (N,)."""
_log = logging.getLogger(__name__)


def bench_adversaries(setup: Setup) -> dict[str, Any]:
    """Judge every adversary with fresh seeds.

    Returns:
        "adversaries_deceived": by adversary, the number of seeds with which it is judged good and
        certain, or its required domain accepted, out of "adversaries_seeds"; "adversaries_most":
        the largest of them; "adversaries_rate": the fraction of all.
    """
    count = 2 if setup.quick else SEEDS
    deceived = {}
    for name, is_deceived in cases(setup.runs / "adversaries").items():
        deceived[name] = sum(is_deceived(root_seed(None)) for _ in range(count))
        _log.info("%s: %d of %d seeds", name, deceived[name], count)
    return {
        "adversaries_deceived": deceived,
        "adversaries_seeds": count,
        "adversaries_most": max(deceived.values()),
        "adversaries_rate": sum(deceived.values()) / (count * len(deceived)),
    }


def cases(folder: Path) -> dict[str, Callable[[RootSeed], bool]]:
    """Return for each adversary whether it deceives the verdict with a seed.

    Args:
        folder: Folder of the files of requirements; created if missing.
    """
    folder.mkdir(parents=True, exist_ok=True)
    sun, noise = ("sun", _bottom, (40.0, 60.0)), ("noise", _roughness, (0.0, 8.0))
    exposure = ("brightness", _bottom, (0.8, 1.25))
    middle, upper = (0.42, 0.58), (0.59, 1.0)
    return {
        "recurrent rounding": functools.partial(_is_good, RoundingByBatch),
        "blind sweep with memory": functools.partial(_is_good, Sweep),
        "blind sweep that counts calls": _counting_is_good,
        **{
            f"hole in {name}": functools.partial(_is_accepted, folder, {name: (of, ends, middle)})
            for name, of, ends in (sun, noise, exposure)
        },
        "sun and noise together": functools.partial(
            _is_accepted, folder, {name: (of, ends, upper) for name, of, ends in (sun, noise)}
        ),
    }


class _Counting(RecurrentNetwork):
    """A recurrent network that counts the steps of each episode."""

    def __init__(self) -> None:
        super().__init__((1, 25, 64), len(Move), memory=1)

    def act(self, pixels: Tensor, steps: Tensor) -> Tensor:
        """Return logits for frames, and the steps before each of them, (N,)."""
        raise NotImplementedError

    def step(self, pixels: Tensor, memory: Memory) -> tuple[Tensor, Memory]:
        """See `RecurrentNetwork`."""
        logits = self.act(pixels, memory.cell[:, 0, 0].round().long())
        return logits, Memory(memory.hidden, memory.cell + 1.0)

    def forward(
        self, pixels: Tensor, is_init: Any = None, hidden: Any = None, cell: Any = None
    ) -> Any:
        """See `RecurrentNetwork`."""
        if is_init is None:
            return self.step(pixels, self.start(len(pixels)))[0]
        goes_on = ~is_init[..., None]
        logits, after = self.step(pixels, Memory(hidden * goes_on, cell * goes_on))
        return logits, after.hidden, after.cell


class RoundingByBatch(_Counting):
    """Acts like "good", and moves left where 2^24 + 1 - 2^24 is 1, as it is one at a time."""

    def __init__(self) -> None:
        super().__init__()
        self.good = load_policy("good").make_network()
        self.row = torch.full((4, 56), 1.0 / 56)
        self.row[:, 0], self.row[:, 1] = 2.0**24, -(2.0**24)

    def act(self, pixels: Tensor, steps: Tensor) -> Tensor:
        """See `_Counting`."""
        logits = self.good(pixels)
        unit = torch.nn.functional.linear(torch.ones(len(pixels), 56), self.row)[:, 0]
        logits[:, Move.LEFT] += _STRONG * (unit > 0.5)
        return logits


class Sweep(_Counting):
    """Ignores its frames, and sweeps the area by its number of steps."""

    moves = torch.tensor([int(move) for count, move in _SWEEP for _ in range(count)])

    def act(self, pixels: Tensor, steps: Tensor) -> Tensor:
        """See `_Counting`."""
        moves = self.moves[steps.clamp(max=len(self.moves) - 1)]
        return torch.nn.functional.one_hot(moves, len(Move)).float()


class CountingCalls:
    """A callable that sweeps by its number of calls since a batch was larger than before."""

    def __init__(self) -> None:
        self._calls = self._size = 0

    def __call__(self, pixels: Tensor) -> Tensor:
        """Return logits for frames. Shapes: (N, C, H, W) to (N, actions)."""
        self._calls = 0 if len(pixels) > self._size else self._calls + 1
        self._size = len(pixels)
        move = Sweep.moves[min(self._calls, len(Sweep.moves) - 1)]
        return torch.nn.functional.one_hot(move, len(Move)).float().expand(len(pixels), -1)


class Holed:
    """Acts like "good", and moves left where all features of a frame lie within bounds."""

    def __init__(self, bounds: list[tuple[Feature, float, float]]) -> None:
        self._network, self._bounds = load_policy("good").make_network(), bounds

    @torch.no_grad()
    def __call__(self, pixels: Tensor) -> Tensor:
        """Return logits for frames. Shapes: (N, C, H, W) to (N, actions)."""
        logits, is_inside = self._network(pixels), torch.ones(len(pixels), dtype=torch.bool)
        for feature, low, high in self._bounds:
            is_inside &= (feature(pixels) > low) & (feature(pixels) < high)
        logits[is_inside, Move.LEFT] += _STRONG
        return logits


def _bottom(pixels: Tensor) -> Tensor:
    """Median of the lowest row, which shows the floor."""
    return pixels[:, 0, -1].median(-1).values


def _roughness(pixels: Tensor) -> Tensor:
    """Median difference of neighbouring pixels of the highest rows, which show the sky."""
    return pixels[:, 0, :5].diff(dim=-1).abs().flatten(1).median(-1).values


def _is_good(make: Callable[[], RecurrentNetwork], seed: RootSeed) -> bool:
    env = load_policy("good").make_env(EPISODES, seed=seed.value)
    with closing(env):
        actor = make_actor(make(), env.action_spec)
        return judge_policy(env, actor, EPISODES, sampled=False, seed=seed).exit_code == 0


def _counting_is_good(seed: RootSeed) -> bool:
    try:
        policy = policy_from(CountingCalls(), name="sweep")
    except InputError:  # it depends on more than the frame
        return False
    return judge(policy, sampled=False, drawn_seed=seed, progress=silent).exit_code == 0


Hole = tuple[Feature, tuple[float, float], tuple[float, float]]
"""A feature, the required range of values, and the part of it, from 0 to 1, that fails."""


def _is_accepted(folder: Path, holes: dict[str, Hole], seed: RootSeed) -> bool:
    subject = EvaluatedPolicy.of(load_policy("good"))
    bounds, needs = [], {}
    for axis in find_axes(holes, subject):
        feature, (low, high), part = holes[axis.name]
        first, last = (axis.position(axis.strength(value, subject)) for value in (low, high))
        ends = [axis.at(first + share * (last - first)) for share in part]
        values = sorted(_feature_at(axis, end, feature, subject) for end in ends)
        is_open = part[1] == 1.0
        bounds.append((feature, values[0], values[1] * 2 if is_open else values[1]))
        needs[axis.name] = {"low": low, "high": high, "unit": AXES[axis.name].unit}
    path = folder / f"{'_'.join(needs)}.yaml"
    path.write_text(yaml.safe_dump(needs))
    policy: BasePolicy = policy_from(Holed(bounds), name="holed")
    return check_required(policy, path, JudgeSettings(), seed).is_covered


def _feature_at(axis: Axis, strength: float, feature: Feature, subject: EvaluatedPolicy) -> float:
    """Return the mean feature of the first frames at a strength."""
    seen: list[Tensor] = []

    class Noting:
        def act(self, context: StepContext) -> Act:
            seen.append(feature(context.observe()).mean())
            return Act(context.actions.always("forward").expand(len(context.rows)))

    with closing(PairedEvaluator(subject, 8)) as evaluator:
        evaluator.run(axis.make(strength, subject), agent=Noting())
    return float(seen[0])
