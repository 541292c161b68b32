"""Scores of heat maps by the effects of patches, and controls: placebos and shuffled weights.

All patches of a frame have one size, so neither the size of a target nor the sharpness of a map
matters. A map of random values has a mean score of 0 with any policy. A map that follows only the
scene can have a higher one, which the placebos measure.
"""

import copy
import dataclasses
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats import rankdata
from torch import Tensor
from torch.nn import functional

from drone_rl.explanations.hooks import BATCH, evaluate, probabilities
from drone_rl.policies import ImageNetwork
from drone_rl.utils.seeding import plain_generator

PATCHES = 40  # approximate number of patches of a frame
MIN_EFFECT = 1e-4  # frames on which every patch has a smaller effect are left out of tests of maps
TOP = 0.1  # fraction of the patches that count as those with the largest effect
_EQUAL = 1e-6  # smaller differences are ties: of effects, and of heat relative to the map's maximum
NO_HEAT = 1e-6  # heat up to this fraction of the map's maximum counts as none
NO_CHANGE = 1e-9  # a logit with a smaller standard deviation over observations is constant


@dataclasses.dataclass(frozen=True)
class PatchGrid:
    """Patches of one size; remaining rows and columns of pixels are left out on both sides."""

    height: int  # height of a patch, pixels
    width: int
    rows: int
    columns: int
    top: int = 0  # rows of pixels above the first patch
    left: int = 0

    @property
    def count(self) -> int:
        """Number of patches."""
        return self.rows * self.columns

    def masks(self, size: tuple[int, ...]) -> Tensor:
        """Return the pixels of each patch in a frame of that size. Shape: (count, h, w), bool."""
        one = torch.eye(self.count, dtype=torch.bool).view(-1, self.rows, self.columns)
        inside = one.repeat_interleave(self.height, 1).repeat_interleave(self.width, 2)
        right, below = size[1] - inside.shape[2], size[0] - inside.shape[1]
        return functional.pad(inside, (self.left, right - self.left, self.top, below - self.top))

    def means(self, maps: Tensor) -> NDArray:
        """Return the mean heat of each patch. Shape: (T, h, w) to (T, count), float64."""
        inside = maps[:, None, self.top :, self.left :].double()
        heat = functional.avg_pool2d(inside, (self.height, self.width))
        return heat[:, 0, : self.rows, : self.columns].flatten(1).cpu().numpy()


def make_grid(height: int, width: int, patches: int = PATCHES) -> PatchGrid:
    """Return about so many patches, nearly square, that leave out few pixels of a frame."""

    def cost(grid: PatchGrid) -> float:
        lost = 1 - grid.count * grid.height * grid.width / (height * width)
        shape = abs(np.log(grid.width / grid.height))
        return 4 * lost + abs(np.log(grid.count / patches)) + 0.5 * shape

    grids = []
    for rows in range(1, height + 1):
        for columns in range(1, min(width, 2 * patches // rows) + 1):
            down, across = height // rows, width // columns
            top, left = (height - rows * down) // 2, (width - columns * across) // 2
            grids.append(PatchGrid(down, across, rows, columns, top, left))
    return min(grids, key=cost)


@torch.no_grad()
def replaced(
    network: ImageNetwork,
    observations: Tensor,
    other: Tensor,
    masks: Tensor,
    rest: Tensor | None = None,
) -> Iterator[tuple[Tensor, Tensor, Tensor]]:
    """Evaluate the policy with one part of an observation replaced, for all parts that differ.

    Observations and replacements are (T, C, h, w), the masks of the parts (P, h, w). Yields batches
    of indices of observations (n,) and of parts (n,), and the probabilities (n, num_actions).
    """
    masks = masks.to(observations.device)
    pixels = (observations != other).any(1).flatten(1).float()
    for batch in (pixels @ masks.flatten(1).float().T > 0).nonzero().split(BATCH):
        frames, parts = batch.unbind(1)
        changed = torch.where(masks[parts, None], other[frames], observations[frames])
        kept = None if rest is None else rest[frames]
        yield frames, parts, network.actions.probabilities(evaluate(network, changed, kept))


def patch_effects(
    network: ImageNetwork,
    observations: Tensor,
    others: Iterable[Tensor],
    grid: PatchGrid,
    rest: Tensor | None = None,
) -> NDArray:
    """Return the effect on the policy of replacing each patch by alternatives (T, C, h, w).

    It is the mean distance of the action probabilities. Shape: (T, count).
    """
    base = probabilities(network, observations, rest)
    masks, effects = grid.masks(observations.shape[-2:]), []
    distance = network.actions.distance
    for other in others:
        effect = base.new_zeros(len(base), grid.count)
        for frames, patches, after in replaced(network, observations, other, masks, rest):
            effect[frames, patches] = distance(after, base[frames])
        effects.append(effect)
    return torch.stack(effects).mean(0).double().cpu().numpy()


def has_effect(effects: NDArray) -> NDArray:
    """Return whether some patch of a frame affects the policy. Shape: (T,)."""
    return effects.max(1) >= MIN_EFFECT


def scores(heat: NDArray, effects: NDArray) -> NDArray:
    """Return the rank correlation of heat with effects of patches, both (T, count). Shape: (T,)."""
    return rank_correlation(_levels(heat), np.round(effects / _EQUAL))


def pointing(heat: NDArray, effects: NDArray) -> tuple[NDArray, NDArray]:
    """Return the fractions of the hottest patches, and of all (chance), among the most effective.

    The most effective are the tenth with the largest effects. Chance is more than a tenth if
    effects tie, and less if fewer patches have any effect. Heat and effects are (T, count), the
    fractions (T,).
    """
    levels, moved = _levels(heat), np.round(effects / _EQUAL)
    number = max(1, round(TOP * effects.shape[1]))
    least = np.sort(moved, axis=1)[:, -number]
    most = (moved >= least[:, None]) & (moved > 0)
    hottest = levels == levels.max(1, keepdims=True)
    return (hottest & most).sum(1) / hottest.sum(1), most.mean(1)


def rank_correlation(first: NDArray, second: NDArray) -> NDArray:
    """Return Spearman's correlation of corresponding rows; 0 where one is constant. Shape: (T,)."""
    a, b = rankdata(first, axis=1), rankdata(second, axis=1)
    a, b = a - a.mean(1, keepdims=True), b - b.mean(1, keepdims=True)
    norm = np.sqrt((a**2).sum(1) * (b**2).sum(1))
    return np.divide((a * b).sum(1), norm, out=np.zeros(len(a)), where=norm > 0)


def _levels(heat: NDArray) -> NDArray:
    """Round heat so that differences from floating-point errors become ties. Shape kept."""
    peak = np.abs(heat).max(1, keepdims=True)
    return np.round(heat / np.where(peak > 0, peak, 1.0) / _EQUAL)


def placebo_maps(
    observations: Tensor, absent: Tensor, others: Sequence[Tensor], seed: int = 0
) -> dict[str, Tensor]:
    """Return maps (T, h, w) that do not use the policy, by name; a method must beat all of them.

    Observations and `others`, see `alternatives`, are (T, C, h, w), `absent` is (C, h, w).
    """
    count, _, height, width = observations.shape
    generator = plain_generator(seed)
    differs = difference(observations, absent)
    return {
        "ones": torch.ones(count, height, width),
        "noise": torch.rand(count, height, width, generator=generator),
        "blob in the middle": blob(height, width, 0.5, 0.5).expand(count, -1, -1),
        "horizon": band(height, width, horizon_row(absent)).expand(count, -1, -1),
        "difference to the empty scene": differs,
        "difference to the empty scene, smoothed": smoothed(differs),
        "mean difference to re-rendered patches": torch.stack(
            [difference(observations, o) for o in others]
        ).mean(0),
    }


def difference(observations: Tensor, absent: Tensor) -> Tensor:
    """Return each pixel's difference from the empty scene. Shape: (T, h, w)."""
    return (observations - absent).abs().sum(1)


def blob(height: int, width: int, down: float, across: float, size: float = 0.2) -> Tensor:
    """Return a Gaussian. Shape: (height, width).

    Its centre and its standard deviation `size` are fractions of height and width.
    """
    y = (torch.arange(height) + 0.5) / height
    x = (torch.arange(width) + 0.5) / width
    return torch.exp(-((y[:, None] - down) ** 2 + (x - across) ** 2) / (2 * size**2))


def band(height: int, width: int, row: float, size: float = 0.1) -> Tensor:
    """Return a horizontal band around a row of pixels; `size` is a fraction of the height."""
    away = (torch.arange(height) - row) / (size * height)
    return torch.exp(-(away[:, None] ** 2) / 2).expand(height, width)


def horizon_row(absent: Tensor) -> float:
    """Return the row of pixels with the largest vertical change of the empty scene."""
    return float(absent.diff(dim=1).abs().mean((0, 2)).argmax()) + 0.5


def smoothed(maps: Tensor, passes: int = 2) -> Tensor:
    """Blur maps by a box of a tenth of the width, repeatedly. Shape kept: (T, h, w)."""
    box = 2 * max(1, maps.shape[-1] // 20) + 1
    for _ in range(passes):
        padded = functional.pad(maps[:, None], [box // 2] * 4, mode="replicate")
        maps = functional.avg_pool2d(padded, box, stride=1)[:, 0]
    return maps


def shuffled_networks(
    network: ImageNetwork,
    observations: Tensor,
    count: int,
    seed: int = 0,
    rest: Tensor | None = None,
) -> Iterator[ImageNetwork]:
    """Yield copies of a policy with weights and biases shuffled within each layer.

    They are often nearly constant, which alone would distinguish their maps. So each copy's logits,
    unless constant, are rescaled to the policy's mean and standard deviation on observations
    (T, C, h, w). The first copies do not depend on `count`.
    """
    generator = plain_generator(seed)
    with torch.no_grad():
        wanted = evaluate(network, observations, rest)
        wanted_deviation, wanted_mean = torch.std_mean(wanted, 0, correction=0)
    for _ in range(count):
        other = copy.deepcopy(network)
        with torch.no_grad():
            for parameter in other.parameters():
                order = torch.randperm(parameter.numel(), generator=generator)
                parameter.copy_(parameter.flatten()[order].view(parameter.shape))
            outputs = evaluate(other, observations, rest)
            deviation, mean = torch.std_mean(outputs, 0, correction=0)
            factor = torch.where(deviation > NO_CHANGE, wanted_deviation / deviation, 1.0)
            other.rescale(factor, wanted_mean - factor * mean)
        yield other


def likeness(first: Tensor, second: Tensor) -> NDArray:
    """Return the rank correlation of maps (T, h, w) over the pixels on which one of them has heat.

    Pixels without heat in both (such as those equal to the baseline) would make any maps similar.
    The result (T,) is 1 where both are constant or one has no heat, which shows no dependence.
    """
    likeness = np.ones(len(first))
    pairs = zip(first.flatten(1).double().numpy(), second.flatten(1).double().numpy(), strict=True)
    for t, (a, b) in enumerate(pairs):
        if a.max() > 0 and b.max() > 0:
            hot = (a > NO_HEAT * a.max()) | (b > NO_HEAT * b.max())
            if max(np.ptp(a[hot]) / a.max(), np.ptp(b[hot]) / b.max()) > NO_HEAT:
                likeness[t] = rank_correlation(a[None, hot], b[None, hot])[0]
    return likeness
