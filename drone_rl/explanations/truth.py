"""Where heat lies, by what the simulator knows to be there: not yet what moves a policy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.explanations.intervals import mean_interval
from drone_rl.explanations.scenes import Region


def pointing_game(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """Is the brightest pixel on the next cube? (Zhang et al., 2018).

    Frames on which the next cube is not to be seen don't count; a map without any heat misses.

    Args:
        maps: Shape (T, H, W), 0 or more.
        regions: `Region` of each pixel. Shape: (T, H, W).
        episode: Shape (T,).

    Returns:
        "hit", and beside it "chance": the share of the picture that the cube fills.
    """
    flat, target = _flat(maps), _flat(regions) == Region.NEXT_TARGET
    seen = target.any(1)
    brightest = flat.argmax(1)
    hit = target[np.arange(len(flat)), brightest] & (flat.max(1) > 0)
    return {
        "hit": mean_interval(np.where(seen, hit, np.nan), episode),
        "chance": mean_interval(np.where(seen, target.mean(1), np.nan), episode),
        "maps_without_heat": int((flat.max(1) <= 0).sum()),
    }


def heat_shares(maps: NDArray, regions: NDArray, episode: NDArray) -> dict[str, Any]:
    """How a map's heat is shared out to cubes, horizon, ground and sky.

    Returns:
        By region name, "share" of the heat and "chance": the region's share of the picture.
    """
    flat, areas = _flat(maps), _flat(regions)
    total = flat.sum(1)
    share = np.divide(
        flat, total[:, None], out=np.full_like(flat, np.nan), where=total[:, None] > 0
    )
    return {
        region.name.lower(): {
            "share": mean_interval((share * (areas == region)).sum(1), episode),
            "chance": mean_interval((areas == region).mean(1), episode),
        }
        for region in Region
    }


def _flat(pictures: NDArray) -> NDArray:
    flat = pictures.reshape(len(pictures), -1)
    return flat.astype(np.float64) if np.issubdtype(flat.dtype, np.floating) else flat
