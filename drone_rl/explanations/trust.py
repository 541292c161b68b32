"""Which heat map of a policy is to be trusted, if any: four tests, all of which it must pass.

- "placebos": it tells better than every placebo which patches of a picture move the policy.
- "random weights": it does so better than its own maps of policies whose weights were shuffled. A
  permutation test: a map that hides what it knows of pictures behind whatever it makes of the
  weights does as well with any weights, hence no better than all of them but with the probability
  of the level. Shuffled policies are as lively as the policy, or one that draws a lucky guess where
  a policy is alive, and noise where it is not, would pass.
- "pointing": its hottest patch is one of those that move the policy most, more often than chance.
- "likeness": it changes when the weights do.

A method fails with its first test, so that each may be made at the full level; the level is shared
out to the methods, so that the best of them is not luck. What is said holds for the typical
episode: the median of the episodes' means, whose order statistics are exact for any distribution
and any dependence within episodes. A mean of differences would need some hundred episodes.

For those who plug it in: `make_trial` from scenes and rollouts, `check_maps` with
`method_maps(explainer)` (or any functions of that kind); the result is plain data, ready for JSON.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.explanations import patches
from drone_rl.explanations.controls import likeness, placebo_maps, shuffled_networks
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.patches import Grid, make_grid, sample_frames
from drone_rl.explanations.scenes import Scenes, alternatives, empty_scene
from drone_rl.policies import PictureNetwork
from drone_rl.sim.tasks import State
from drone_rl.utils.intervals import episode_means, median_bounds

MapOf = Callable[[PictureNetwork, Tensor, Tensor], Tensor]
"""A method: network, pictures (T, C, h, w) and an action each (T,) to maps (T, h, w), 0 or more."""
ERROR_RATE = 0.05
"""Probability that anything is trusted that knows nothing of the policy, all methods together."""
FRAMES_AN_EPISODE = 10
"""Pictures of an episode that are put to the test, evenly spread."""
WEIGHT_SEEDS = 5
"""Shuffled policies whose maps are compared with the policy's own, pixel by pixel."""
MOST_ALIKE = 0.5
"""Rank correlation with maps of shuffled weights from which on a map does not depend on them."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Trial:
    """What maps of one policy are held against. All pictures are such that some patch moves it."""

    network: PictureNetwork
    observations: Tensor  # (T, C, h, w)
    actions: Tensor  # (T,)
    """The actions whose maps are asked for."""
    effects: NDArray  # (T, patches)
    """What each patch does to the policy; see `patch_effects`."""
    placebos: dict[str, Tensor]  # (T, h, w) each
    episode: NDArray  # (T,)
    grid: Grid
    still: int = 0
    """Pictures left out because no patch moves the policy."""
    seed: int = 0

    def __getitem__(self, rows: NDArray) -> "Trial":
        """Returns the trial on some of its pictures, given as indices or as a mask."""
        index = torch.from_numpy(rows)
        return dataclasses.replace(
            self,
            observations=self.observations[index],
            actions=self.actions[index],
            effects=self.effects[rows],
            placebos={name: maps[index] for name, maps in self.placebos.items()},
            episode=self.episode[rows],
        )

    def maps(self, method: MapOf, network: PictureNetwork | None = None) -> Tensor:
        """A method's maps of the trial's pictures. Shape: (T, h, w)."""
        if not len(self.observations):
            return self.observations.new_zeros(0, *self.observations.shape[-2:])
        return method(network or self.network, self.observations, self.actions)

    def scores(self, maps: Tensor) -> NDArray:
        """The score of each map. Shape: (T, h, w) to (T,)."""
        return patches.scores(self.grid.means(maps), self.effects)

    def thinned(self) -> "Trial":
        """One picture an episode, its middle one: enough for many random weights."""
        rows = [np.flatnonzero(self.episode == e) for e in np.unique(self.episode)]
        return self[np.array([r[len(r) // 2] for r in rows], np.int64)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pictures:
    """Pictures and what they might have been: all of a trial but the policy."""

    observations: Tensor  # (T, C, h, w)
    others: list[Tensor]  # (T, C, h, w) each
    absent: Tensor  # (C, h, w)
    """The scene without cubes."""
    episode: NDArray  # (T,)
    seed: int = 0

    def trial(self, network: PictureNetwork, actions: Tensor) -> Trial:
        """Finds out which patches move a policy; `actions` (T,) are those to be explained."""
        grid = make_grid(*self.observations.shape[-2:])
        effects = patches.patch_effects(network, self.observations, self.others, grid)
        trial = Trial(
            network=network,
            observations=self.observations,
            actions=actions,
            effects=effects,
            placebos=placebo_maps(self.observations, self.absent, self.others, self.seed),
            episode=self.episode,
            grid=grid,
            seed=self.seed,
        )
        moved = patches.moving(effects)
        return dataclasses.replace(trial[moved], still=int((~moved).sum()))


def draw_pictures(scenes: Scenes, state: State, episode: NDArray, seed: int = 0) -> Pictures:
    """Draws scenes and what they might have been.

    Args:
        scenes: Where they are drawn.
        state: T of them.
        episode: Shape: (T,).
        seed: Of the cubes' random places, of noise and of random weights.
    """
    return Pictures(
        observations=scenes.observe(state),
        others=list(alternatives(scenes, state, seed).values()),
        absent=scenes.observe(empty_scene(scenes))[0],
        episode=episode,
        seed=seed,
    )


def make_trial(
    scenes: Scenes,
    network: PictureNetwork,
    state: State,
    actions: Tensor,
    episode: NDArray,
    seed: int = 0,
) -> Trial:
    """Finds out what moves a policy, patch by patch, on pictures of its flights.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        state: The worlds as they stood; `RolloutDataset.state()`. T of them.
        actions: Taken there. Shape: (T,).
        episode: Shape: (T,).
        seed: See `draw_pictures`.
    """
    rows = sample_frames(episode, FRAMES_AN_EPISODE)
    chosen = state[torch.from_numpy(rows)].to(scenes.worlds.device)
    pictures = draw_pictures(scenes, chosen, episode[rows], seed)
    return pictures.trial(network, actions[torch.from_numpy(rows)])


def method_maps(explainer: Explainer) -> dict[str, MapOf]:
    """An explainer's methods, as functions of any network of the same shape."""

    def make(name: str) -> MapOf:
        return lambda network, x, a: dataclasses.replace(explainer, network=network).methods()[
            name
        ](x, a)

    return {name: make(name) for name in explainer.methods()}


def check_maps(
    trial: Trial,
    methods: Mapping[str, MapOf],
    maps: Mapping[str, Tensor] | None = None,
    *,
    num_methods: int | None = None,
) -> dict[str, Any]:
    """Puts methods to the four tests.

    Args:
        trial: What moves the policy.
        methods: By name.
        maps: `trial.maps` of each, if they have been made already.
        num_methods: To how many methods the error rate is shared out; as many as there are.

    Returns:
        "trusted": the name of the best method that passed all, None if none did; "methods", by
        name, see `check_method`; "placebos": their "score"s; "frames", "episodes" and
        "frames_unmoved"; "level": the error rate of each method; "confidence": of each bound but
        the scores'.
    """
    level = ERROR_RATE / (num_methods or max(1, len(methods)))
    maps = maps or {name: trial.maps(method) for name, method in methods.items()}
    results = {n: check_method(trial, method, level, maps[n]) for n, method in methods.items()}
    trusted = [name for name, method in results.items() if method["trusted"]]
    return {
        "trusted": max(trusted, key=lambda n: results[n]["score"]["lower95"]) if trusted else None,
        "methods": results,
        "placebos": {
            name: patches.summarise_scores(trial.scores(maps), trial.episode)
            for name, maps in trial.placebos.items()
        },
        "frames": len(trial.episode),
        "frames_unmoved": trial.still,
        "episodes": len(np.unique(trial.episode)),
        "level": level,
        "confidence": 1.0 - 2 * level,
    }


def check_method(
    trial: Trial, method: MapOf, level: float, maps: Tensor | None = None
) -> dict[str, Any]:
    """One method's evidence; see `check_maps`.

    Returns:
        "trusted", and "failed": names of the tests that it failed; "score": mean over episodes
        with its interval; "placebos": by name, how much more it scores; "pointing": how much more
        often than "chance" it hits, and the mean "hit"; "likeness" with maps of shuffled weights;
        "random_weights"; "maps_without_heat". Where there are bounds, "median", "lower" and
        "upper", of which each holds with probability 1 - level; None of too few episodes.
    """
    if not len(trial.episode):
        return {"trusted": False, "failed": ["nothing moves the policy"], "score": _no_score()}
    maps = trial.maps(method) if maps is None else maps
    heat, scores = trial.grid.means(maps), trial.scores(maps)
    hit, chance = patches.pointing(heat, trial.effects)
    result = {
        "score": patches.summarise_scores(scores, trial.episode),
        "placebos": {
            name: _typical(scores - trial.scores(placebo), trial.episode, level)
            for name, placebo in trial.placebos.items()
        },
        "pointing": {
            **_typical(hit - chance, trial.episode, level),
            "hit": float(hit.mean()),
            "chance": float(chance.mean()),
        },
        "likeness": _alike(trial, method, level),
        "maps_without_heat": int((maps.flatten(1).amax(1) <= 0).sum()),
    }
    failed = [name for name, is_passed in _tests(result).items() if not is_passed]
    if not failed:
        result["random_weights"] = random_weights(trial, method, level)
        failed = [] if result["random_weights"]["as_good"] == 0 else ["random weights"]
    return {"trusted": not failed, "failed": failed, **result}


def random_weights(trial: Trial, method: MapOf, level: float) -> dict[str, Any]:
    """Does the method do better on the policy than on all policies of shuffled weights?

    It stops at the first on which it does as well.

    Returns:
        "score" on one picture an episode, "best" and "mean" of the others' scores, "tried": how
        many there were, "as_good": how many of them scored as much.
    """
    few = trial.thinned()
    own = float(few.scores(few.maps(method)).mean())
    others: list[float] = []
    count = math.ceil(1 / level) - 1
    for network in shuffled_networks(trial.network, trial.observations, count, trial.seed):
        others.append(float(few.scores(few.maps(method, network)).mean()))
        if others[-1] >= own - 1e-9:
            break
    return {
        "score": own,
        "best": max(others),
        "mean": float(np.mean(others)),
        "tried": len(others),
        "as_good": sum(score >= own - 1e-9 for score in others),
    }


def _tests(result: dict[str, Any]) -> dict[str, bool]:
    """Whether each test but that of random weights is passed."""
    alike = result["likeness"]
    return {
        "placebos": all(_above(b["lower"], 0.0) for b in result["placebos"].values()),
        "pointing": _above(result["pointing"]["lower"], 0.0),
        "likeness": alike["upper"] is not None
        and alike["upper"] < MOST_ALIKE
        and max(alike["seeds"]) < MOST_ALIKE,
    }


def _above(value: float | None, bar: float) -> bool:
    return value is not None and value > bar


def _alike(trial: Trial, method: MapOf, level: float) -> dict[str, Any]:
    """How like a policy's maps are to those of shuffled weights, all seeds together and each."""
    few = trial.thinned()
    own = few.maps(method)
    networks = shuffled_networks(trial.network, trial.observations, WEIGHT_SEEDS, trial.seed)
    seeds = np.stack([likeness(own, few.maps(method, network)) for network in networks])
    return {
        **_typical(seeds.mean(0), few.episode, level),
        "seeds": np.median(seeds, axis=1).tolist(),
    }


def _typical(values: NDArray, episode: NDArray, level: float) -> dict[str, float | None]:
    """The median of the episodes' means; each bound alone holds with probability 1 - level."""
    means = episode_means(values, episode)
    lower, upper = median_bounds(means, 1.0 - 2 * level) or (None, None)
    return {"median": float(np.median(means)), "lower": lower, "upper": upper}


def _no_score() -> dict[str, Any]:
    return patches.summarise_scores(np.zeros(0), np.zeros(0))
