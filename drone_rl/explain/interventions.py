"""The causal test that only a simulator allows: change one thing in the scene and draw it again."""

import copy
import dataclasses
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import rankdata
from torch import Tensor

from drone_rl.explain.hooks import probabilities
from drone_rl.explain.scenes import Region, Scenes
from drone_rl.policies import PolicyNetwork
from drone_rl.sim.arena import SKY_COLOR
from drone_rl.sim.collect_cubes import shown_cubes
from drone_rl.sim.renderer import WarpRenderer
from drone_rl.sim.rules import WorldState

OTHER_CUBE_COLOR = (0.9, 0.85, 0.2)
OTHER_GROUND_COLOR = (0.25, 0.25, 0.22)
MOVED_METRES = 2.0
DRAWS = 1000


@dataclasses.dataclass
class Intervention:
    """One change to many scenes, and what it did to the policy."""

    name: str
    area: Tensor  # (T, H, W) bool
    """Pixels that the change touched."""
    effect: NDArray  # (T,)
    """Total variation distance of the action probabilities before and after; NaN where there
    was nothing to change."""
    frames: Tensor  # (T, H, W, 3) uint8
    """The pictures after the change."""


def intervene(
    scenes: Scenes, network: PolicyNetwork, state: WorldState, regions: Tensor, seed: int = 0
) -> list[Intervention]:
    """Takes the next cube away, moves it, recolours it; changes a patch of ground.

    Args:
        scenes: Where they are drawn.
        network: The policy's.
        state: The scenes.
        regions: `Region` of each pixel. Shape: (T, H, W).
        seed: Of the patches' places.
    """
    before = scenes.frames(state)
    base = probabilities(network, scenes.transform(before))
    visible = regions == Region.NEXT_CUBE
    ground = _patches(regions == Region.GROUND, visible.sum((1, 2)), seed)
    recoloured = _drawn_in(scenes, state, "cube_", OTHER_CUBE_COLOR)
    repainted = _drawn_in(scenes, state, "floor", OTHER_GROUND_COLOR)
    moved = scenes.frames(_moved(state))
    changes = {
        "cube taken away": (scenes.frames(_without_next(state)), visible),
        "cube moved": (moved, (moved != before).any(-1)),
        "cube recoloured": (torch.where(visible[..., None], recoloured, before), visible),
        "ground patch changed": (torch.where(ground[..., None], repainted, before), ground),
    }
    return [
        Intervention(name, area, _effect(network, scenes, base, frames, area), frames)
        for name, (frames, area) in changes.items()
    ]


def claim(maps: Tensor, area: Tensor) -> NDArray:
    """What a map said that the area mattered: its share of the heat, NaN without heat. (T,)."""
    total = maps.flatten(1).sum(1)
    inside = (maps * area).flatten(1).sum(1)
    return torch.where(total > 0, inside / total, torch.nan).double().cpu().numpy()


def agreement(
    maps: Tensor, interventions: list[Intervention], episode: NDArray, seed: int = 0
) -> dict[str, Any]:
    """Rank correlation of what a map claimed and what the changes did, over all of them.

    Args:
        maps: Shape (T, H, W).
        interventions: On the same frames.
        episode: Shape (T,); the interval resamples whole episodes.
        seed: Of the resampling.

    Returns:
        "correlation" with "lower95" and "upper95" (None if nothing varies); chance is 0.
    """
    claims = np.concatenate([claim(maps, change.area) for change in interventions])
    effects = np.concatenate([change.effect for change in interventions])
    clusters = np.tile(episode, len(interventions))
    told = np.isfinite(claims) & np.isfinite(effects)
    claims, effects, clusters = claims[told], effects[told], clusters[told]
    value = _spearman(claims, effects)
    if value is None:
        return {"correlation": None, "lower95": None, "upper95": None, "changes": len(claims)}
    members = [np.flatnonzero(clusters == c) for c in np.unique(clusters)]
    rng = np.random.default_rng(seed)
    draws = []
    for _ in range(DRAWS if len(members) > 1 else 0):
        rows = np.concatenate([members[i] for i in rng.integers(0, len(members), len(members))])
        drawn = _spearman(claims[rows], effects[rows])
        draws.append(0.0 if drawn is None else drawn)
    low, high = np.quantile(draws, [0.025, 0.975]) if draws else (-1.0, 1.0)
    return {
        "correlation": value,
        "lower95": float(low),
        "upper95": float(high),
        "changes": len(claims),
    }


def _effect(
    network: PolicyNetwork, scenes: Scenes, base: Tensor, frames: Tensor, area: Tensor
) -> NDArray:
    after = probabilities(network, scenes.transform(frames))
    change = 0.5 * (after - base).abs().sum(-1)
    touched = area.flatten(1).any(1)
    return torch.where(touched, change, torch.nan).double().cpu().numpy()


def _without_next(state: WorldState) -> WorldState:
    changed = copy.deepcopy(state)
    changed.passed |= _is_next(state)
    return changed


def _moved(state: WorldState) -> WorldState:
    """The next cube, moved towards the middle of the picture."""
    changed = copy.deepcopy(state)
    lateral = state.cubes[..., 1] - state.drone[:, None, 1]
    step = torch.where(lateral > 0, -MOVED_METRES, MOVED_METRES)
    changed.cubes[..., 1] += step * _is_next(state)
    return changed


def _is_next(state: WorldState) -> Tensor:
    index = torch.arange(state.cubes.shape[1], device=state.drone.device)
    return index == state.next_cube[:, None]


def _drawn_in(scenes: Scenes, state: WorldState, geoms: str, color: tuple[float, ...]) -> Tensor:
    """The scenes with some geoms in another colour."""
    worlds = scenes.worlds
    model = copy.copy(worlds.model)
    for i in range(model.ngeom):
        if model.geom(i).name.startswith(geoms):
            model.geom_rgba[i, :3] = color
    renderer = WarpRenderer(
        model,
        worlds.policy_view,
        max_worlds=worlds.num_worlds,
        device=str(worlds.device),
        background=SKY_COLOR,
    )
    qpos, mocap = worlds.qpos(state), shown_cubes(state).float()
    size = worlds.num_worlds
    parts = [
        renderer.render(q, m) for q, m in zip(qpos.split(size), mocap.split(size), strict=True)
    ]
    renderer.close()
    return torch.cat(parts)


def _patches(ground: Tensor, size: Tensor, seed: int) -> Tensor:
    """A square of ground in each picture, of about as many pixels as the cube has. (T, H, W)."""
    rng = np.random.default_rng(seed)
    patches = torch.zeros_like(ground)
    for t, free in enumerate(ground):
        places = free.nonzero()
        if not len(places) or not size[t]:
            continue
        row, column = places[int(rng.integers(len(places)))].tolist()
        half = max(1, round(float(size[t]) ** 0.5)) // 2
        rows = slice(max(0, row - half), row + half + 1)
        columns = slice(max(0, column - half), column + half + 1)
        patches[t, rows, columns] = free[rows, columns]
    return patches


def _spearman(first: NDArray, second: NDArray) -> float | None:
    if len(first) < 3 or np.ptp(first) == 0 or np.ptp(second) == 0:
        return None
    return float(np.corrcoef(rankdata(first), rankdata(second))[0, 1])
