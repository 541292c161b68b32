"""Tests of heat maps: which method can be trusted on a policy, if any.

A method is trusted if it passes four tests:

- "placebos": its maps agree better with the effects of patches than every placebo map.
- "random weights": they do so better than its maps of policies with shuffled weights. This is a
  permutation test: the level bounds the probability that a method that ignores the weights passes.
- "pointing": its hottest patch is one of those with the largest effect, more often than chance.
- "likeness": its maps change when the weights do.

A method must pass all tests, so each is made at the full level; the level is divided by the number
of methods. Bounds are for the median of the episodes' means: its order statistics are exact for any
distribution and any dependence within episodes.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import patches
from drone_rl.explanations.context import Context
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.patches import (
    PatchGrid,
    likeness,
    make_grid,
    placebo_maps,
    shuffled_networks,
)
from drone_rl.explanations.results import (
    Likeness,
    MapTests,
    Median,
    MethodTest,
    Pointing,
)
from drone_rl.explanations.rollouts import spread_frames
from drone_rl.explanations.scenes import alternatives
from drone_rl.policies import ImageNetwork
from drone_rl.utils.intervals import Mean, episode_means, mean_interval

MapOf = Callable[..., Tensor]
"""A method: network, observations (T, C, h, w), actions (T,), and the rest of the inputs, see
`hooks`, if there is one, to maps (T, h, w), 0 or more."""
ERROR_RATE = 0.05  # probability that any method is trusted whose maps do not depend on the policy
FRAMES_AN_EPISODE = 10  # frames of an episode that are tested, evenly spaced
WEIGHT_SEEDS = 5  # shuffled policies whose maps are compared with the policy's, pixel by pixel
UNMOVED = "nothing moves the policy"
"""Why a method can't be tested without frames."""
MAX_CORRELATION = 0.5  # from this correlation with maps of shuffled weights on, a map ignores them


@dataclasses.dataclass(frozen=True, kw_only=True)
class Trial:
    """The reference for tests of one policy's maps: frames in which some patch affects it."""

    network: ImageNetwork
    observations: Tensor  # (T, C, h, w)
    actions: Tensor  # (T,); actions to explain
    effects: NDArray  # (T, patches); effect of each patch; see `patch_effects`
    placebos: dict[str, Tensor]  # (T, h, w) each
    episode: NDArray  # (T,)
    grid: PatchGrid
    rest: Tensor | None = None  # see `hooks`
    frames_without_effect: int = 0  # left out, as no patch affects the policy
    seed: int = 0  # of shuffled weights

    def __getitem__(self, rows: NDArray) -> "Trial":
        """Return the trial on some of its frames, given as indices or as a mask."""
        index = torch.from_numpy(rows)
        return dataclasses.replace(
            self,
            observations=self.observations[index],
            actions=self.actions[index],
            effects=self.effects[rows],
            placebos={name: maps[index] for name, maps in self.placebos.items()},
            episode=self.episode[rows],
            rest=None if self.rest is None else self.rest[index],
        )

    def maps(self, method: MapOf, network: ImageNetwork | None = None) -> Tensor:
        """Return a method's maps of the trial's frames. Shape: (T, h, w)."""
        rest = () if self.rest is None else (self.rest,)
        return method(network or self.network, self.observations, self.actions, *rest)

    def shuffled(self, count: int) -> Iterator[ImageNetwork]:
        """Yield policies with shuffled weights, see `shuffled_networks`."""
        return shuffled_networks(self.network, self.observations, count, self.seed, rest=self.rest)

    def scores(self, maps: Tensor) -> NDArray:
        """Return the score of each map. Shape: (T, h, w) to (T,)."""
        return patches.scores(self.grid.means(maps), self.effects)

    @functools.cached_property
    def placebo_scores(self) -> dict[str, NDArray]:
        """Scores of the placebos, by name. Shape: (T,)."""
        return {name: self.scores(maps) for name, maps in self.placebos.items()}

    def thinned(self) -> "Trial":
        """Return the trial on the middle frame of each episode."""
        return self[spread_frames(self.episode, 1)]


def make_trial(context: Context) -> Trial:
    """Return a trial on some frames of each rollout, those in which a patch affects the policy."""
    data, scenes = context.dataset, context.scenes
    rows, seed = spread_frames(data.episode, FRAMES_AN_EPISODE), context.seed.value
    index = torch.from_numpy(rows)
    state = data.state(scenes.worlds)[index]
    others = list(alternatives(scenes, state, seed).values())
    actions, seen = data.tensor("actions")[index], scenes.observe(state)
    rest = data.rest
    rest = None if rest is None else rest[index]
    episode, network = data.episode[rows], context.network
    return measure(network, actions, seen, others, scenes.absent, episode, seed, rest)


def measure(
    network: ImageNetwork,
    actions: Tensor,
    observations: Tensor,
    others: Sequence[Tensor],
    absent: Tensor,
    episode: NDArray,
    seed: int = 0,
    rest: Tensor | None = None,
) -> Trial:
    """Return a trial on the frames in which some patch affects a policy.

    Args:
        network: The policy's network.
        actions: Actions to explain. Shape: (T,).
        observations: Shape: (T, C, h, w).
        others: Observations with other contents, see `alternatives`. Shapes as above.
        absent: Observation of the scene without objects. Shape: (C, h, w).
        episode: Number of each frame's episode. Shape: (T,).
        seed: Of noise and shuffled weights.
        rest: What else the policy reads, see `hooks`.
    """
    grid = make_grid(*observations.shape[-2:])
    effects = patches.patch_effects(network, observations, others, grid, rest)
    moved = patches.has_effect(effects)
    trial = Trial(
        network=network,
        observations=observations,
        actions=actions,
        effects=effects,
        placebos=placebo_maps(observations, absent, others, seed),
        episode=episode,
        grid=grid,
        rest=rest,
        frames_without_effect=int((~moved).sum()),
        seed=seed,
    )
    return trial[moved]


def method_maps(explainer: Explainer) -> dict[str, MapOf]:
    """Return an explainer's methods as functions of any network of the same shape."""

    def of(name: str, network: ImageNetwork, *inputs: Tensor) -> Tensor:
        return dataclasses.replace(explainer, network=network).methods()[name](*inputs)

    return {name: functools.partial(of, name) for name in explainer.methods()}


def check_maps(
    trial: Trial, methods: Mapping[str, MapOf], *, num_methods: int | None = None
) -> MapTests:
    """Test methods, by name.

    The error rate is shared by `num_methods`, by default those that are given.
    """
    level = ERROR_RATE / (num_methods or max(1, len(methods)))
    results = {name: check_method(trial, method, level) for name, method in methods.items()}
    scores = {name: one.score.lower95 for name, one in results.items() if one.trusted}
    return MapTests(
        trusted=max(scores, key=lambda name: scores[name], default=None),
        methods=results,
        placebos={n: _mean(scores, trial.episode) for n, scores in trial.placebo_scores.items()},
        frames=len(trial.episode),
        frames_unmoved=trial.frames_without_effect,
        episodes=len(np.unique(trial.episode)),
        level=level,
        confidence=1.0 - 2 * level,
    )


def check_method(trial: Trial, method: MapOf, level: float) -> MethodTest:
    """Test one method; each bound of a median holds with probability 1 - level."""
    episode = trial.episode
    if not len(episode):
        return MethodTest(trusted=False, failed=(UNMOVED,), score=_mean(episode, episode))
    maps = trial.maps(method)
    scores = trial.scores(maps)
    hit, chance = patches.pointing(trial.grid.means(maps), trial.effects)
    placebos = {
        name: Median.of(scores - placebo, episode, level)
        for name, placebo in trial.placebo_scores.items()
    }
    shares = {"hit": float(hit.mean()), "chance": float(chance.mean())}
    pointing = Pointing.of(hit - chance, episode, level, **shares)
    resembling = _likeness(trial, method, level)
    is_passed = {  # a bound of None fails
        "placebos": all((b.lower or 0.0) > 0.0 for b in placebos.values()),
        "pointing": (pointing.lower or 0.0) > 0.0,
        "likeness": resembling.upper is not None
        and max(resembling.upper, *resembling.seeds) < MAX_CORRELATION,
    }
    if all(is_passed.values()):
        is_passed["random weights"] = depends_on_weights(trial, method, level)
    return MethodTest(
        trusted=all(is_passed.values()),
        failed=tuple(name for name, passed in is_passed.items() if not passed),
        score=_mean(scores, episode),
        placebos=placebos,
        pointing=pointing,
        likeness=resembling,
    )


def depends_on_weights(trial: Trial, method: MapOf, level: float) -> bool:
    """Return whether the method scores more on the policy than on all with shuffled weights.

    The maps are those of one frame of each episode.
    """
    few = trial.thinned()
    score = float(few.scores(few.maps(method)).mean())
    count = math.ceil(1 / level) - 1
    networks = trial.shuffled(count)
    return all(few.scores(few.maps(method, n)).mean() < score - 1e-9 for n in networks)


def _likeness(trial: Trial, method: MapOf, level: float) -> Likeness:
    """Compare a policy's maps with those of shuffled weights, all seeds together and each."""
    few = trial.thinned()
    maps = few.maps(method)
    networks = trial.shuffled(WEIGHT_SEEDS)
    seeds = np.stack([likeness(maps, few.maps(method, network)) for network in networks])
    medians = tuple(np.median(seeds, axis=1).tolist())
    return Likeness.of(seeds.mean(0), few.episode, level, seeds=medians)


def _mean(scores: NDArray, episode: NDArray) -> Mean:
    """Return the mean of scores over episodes with its interval."""
    means = episode_means(scores, episode).clip(-1, 1)
    return mean_interval(means, np.arange(len(means)), -1.0)
