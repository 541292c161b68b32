"""The exact map of a greedy policy's action over all positions of one cube.

Let D and Y be the cube's position ahead of and to the left of the camera, see `cube_images`, a the
slope of a column's rays to the left, b that of a row's rays upwards, and h half a cube's edge. The
image changes only along these lines:

- fronts begin and end at Y = a (D - h) - h and Y = a (D - h) + h;
- a side ends at Y = a (D + h) +- h, where a row sees its far edge;
- or at Y = a h / |b| +- h, where the row leaves it by its upper or lower edge before;
- a row sees nothing of a cube beyond D = h / |b| + h: a vertical border as long as the front is
  wide.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from drone_rl.config.commands import PlacesSettings
from drone_rl.explanations import results
from drone_rl.explanations.results import ActionShares, ExactMap, Outlines
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.tasks.common import SIDES
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.action_table import workers
from drone_rl.verification.prover.arrangement import SAME, Arrangement, Pieces, Window, arrange
from drone_rl.verification.prover.boxes import unite
from drone_rl.verification.prover.cube_images import NOTHING, UNIT, CameraModel, CubeImages

RenderFaces = Callable[[NDArray[np.uint8]], Tensor]  # faces to the network's input (N, C, H, W)

NEEDED = (Move.LEFT, Move.FORWARD, Move.RIGHT)  # the action that a cube on each side requires
_DIGITS = 14  # slopes of mirrored rows are rounded differently
_BATCH = 256  # images per batch; constant, so that sums are reproducible


@dataclasses.dataclass(frozen=True)
class ActionMap:
    """Cells of positions in which the image, and so the action, is constant."""

    window: Window
    arrangement: Arrangement
    places: NDArray[np.float64]  # a point of each cell, metres ahead and left. Shape: (cells, 2)
    areas: NDArray[np.float64]  # area of each cell, m^2, by `SIDES`. Shape: (cells, 3)
    action: NDArray[np.int64]  # argmax action. Shape: (cells,)
    gap: NDArray[np.float64]  # gap of the two highest logits. Shape: (cells,)
    is_unseen: NDArray[np.bool_]  # whether no pixel shows the cube. Shape: (cells,)
    alone: int  # the action without a visible cube
    touch_distance: float  # metres; a cube further to the side requires a turn
    doubtful: float  # bound on the area, m^2, where float32 may show a neighbour's image

    def at(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the actions at positions inside the window. Shape: (N, 2) to (N,)."""
        return self.action[self.arrangement.locate(places)]

    def summary(self, logit_gap: float) -> ExactMap:
        """Return the map in figures; logits closer than `logit_gap` may tie."""
        areas, total = self.areas, self.areas.sum()
        counts = [np.bincount(self.action, area, len(MOVES)) for area in areas.T]
        needed, action = np.array(NEEDED), self.action[:, None]
        is_blind = (action == self.alone) & (action != needed) & (needed != Move.FORWARD)
        blind, unseen = areas * is_blind, areas * self.is_unseen[:, None]
        closest = int(self.gap.argmin())
        sides = {
            side: ActionShares(
                share=_share(area.sum(), total),
                actions=tuple(_share(c, area.sum()) for c in count),
                unseen=_share(unseen[:, k].sum(), area.sum()),
                blind=_share(blind[:, k].sum(), area.sum()),
            )
            for k, (side, area, count) in enumerate(zip(SIDES, areas.T, counts, strict=True))
            if area.sum() > 0
        }
        return ExactMap(
            window=results.Window(**dataclasses.asdict(self.window)),
            area=float(total),
            cells=len(self.action),
            actions=tuple(_share(c, total) for c in np.sum(counts, 0)),
            sides=sides,
            alone=self.alone,
            touch_distance=self.touch_distance,
            unseen=_share(unseen.sum(), total),
            blind=_share(blind.sum(), total),
            least_gap=float(self.gap[closest]),
            least_gap_ahead=float(self.places[closest, 0]),
            least_gap_left=float(self.places[closest, 1]),
            logit_gap=logit_gap,
            close=_share(areas[self.gap <= logit_gap].sum(), total),
            in_doubt=min(1.0, self.doubtful / float(total)),
            outlines=self.outlines(),
        )

    def outlines(self) -> Outlines:
        """Return closed polygons around regions of equal action, for plots."""
        outlines = self.arrangement.outlines(self.action)
        unseen = self.arrangement.outlines(self.is_unseen.astype(np.int64))
        outlines += [(len(MOVES), polygon) for label, polygon in unseen if label]
        return Outlines(
            points=np.concatenate([polygon for _, polygon in outlines]),
            ends=np.cumsum([len(polygon) for _, polygon in outlines]),
            labels=np.array([label for label, _ in outlines]),
        )


def map_policy(
    images: CubeImages,
    transform: Callable[[Tensor], Tensor],
    network: nn.Module,
    settings: PlacesSettings,
) -> ActionMap:
    """Compute the map of a policy, whose `transform` makes observations of RGB images.

    Raises:
        InputError: See `map_actions`.
    """
    return map_actions(
        images.camera,
        Window(settings.nearest, settings.farthest, settings.sideways),
        lambda faces: transform(images.paint(faces)),
        network.eval(),
        touch_distance=images.lattice.task.touch_distance,
        most_cells=settings.most_cells,
    )


def map_actions(
    camera: CameraModel,
    window: Window,
    render: RenderFaces,
    network: nn.Module,
    *,
    touch_distance: float,
    most_cells: int,
) -> ActionMap:
    """Compute a policy's action for every position of one cube within a window.

    The network maps images to the logits of `MOVES`, shape (N, 3), on the CPU. A cube further than
    `touch_distance` metres to the side requires a turn.

    Raises:
        InputError: The camera would be in the cube, or there are more cells than `most_cells`.
    """
    if window.nearest <= camera.half:
        raise InputError(
            f"nearest={window.nearest} puts the camera into a cube; give more than {camera.half} "
            "(half of cube_size)"
        )
    borders = find_borders(camera, window)
    cells = arrange(borders, window, most_cells)
    places = cells.inner_points()
    nothing = np.full((1, len(camera.up), len(camera.left)), NOTHING, np.uint8)
    (alone,), _ = _decide(render, network, nothing)
    parts = np.split(places, range(_BATCH, len(places), _BATCH))

    def decide(part: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        faces = camera.faces(*part.T)
        return *_decide(render, network, faces), (faces == NOTHING).all((1, 2))

    action, gap, is_unseen = map(np.concatenate, zip(*workers().map(decide, parts), strict=True))
    return ActionMap(
        window=window,
        arrangement=cells,
        places=places,
        areas=_areas_by_side(cells, touch_distance),
        action=action,
        gap=gap,
        is_unseen=is_unseen,
        alone=int(alone),
        touch_distance=touch_distance,
        doubtful=doubtful_area(camera, borders, window),
    )


def find_borders(camera: CameraModel, window: Window) -> Pieces:
    """Return all borders within a window, whose distances all exceed half a cube's edge.

    No two of them overlap.
    """
    slopes, half = np.unique(camera.left), camera.half
    with np.errstate(divide="ignore"):
        leaves = half / np.unique(np.abs(camera.up).round(_DIGITS))
    last = leaves.max()
    aside = slopes[slopes != 0]
    outer = half * np.sign(aside)
    pieces = [
        _lines(slopes, -slopes * half - half, last + half),
        _lines(slopes, -slopes * half + half, last + half),
        _lines(aside, aside * half + outer, last - half),
        *_levels(aside, outer, leaves[np.isfinite(leaves)], half),
    ]
    slope, offset, begin, end = np.concatenate(pieces, 1)
    upright = [
        [leave + half, *span]
        for leave in leaves[np.isfinite(leaves)]
        for span in unite(np.stack([slopes * leave - half, slopes * leave + half], -1), SAME)
    ]
    return Pieces(slope, offset, begin, end, np.reshape(upright, (-1, 3))).clipped(window)


def doubtful_area(camera: CameraModel, pieces: Pieces, window: Window) -> float:
    """Bound the area, m^2, so close to a border that float32 may confuse its sides.

    See `CameraModel.borders` and `CameraModel.grazed` for the errors.
    """
    farthest = max(camera.farthest, window.farthest + 1.0)
    widest = max(camera.widest, window.sideways)

    def error(x: NDArray) -> NDArray:
        y = np.abs(pieces.slope * x + pieces.offset)
        return 16 * (y + camera.half) + 3 * np.abs(pieces.slope) * farthest + 3 * widest

    length = pieces.end - pieces.begin
    bands = (length * (error(pieces.begin) + error(pieces.end))).sum()
    _, low, high = pieces.upright.T
    return UNIT * float(bands + 2 * 32 * farthest * (high - low).sum())


def _lines(slope: NDArray, offset: NDArray, end: float) -> NDArray:
    """Return lines from -inf to x = end. Shape: (4, N)."""
    return np.stack([slope, offset, np.full_like(slope, -np.inf), np.full_like(slope, end)])


def _levels(aside: NDArray, outer: NDArray, leaves: NDArray, half: float) -> list[NDArray]:
    """Return the horizontal borders, joined where several rows have the same. Each: (4, 1)."""
    height = (aside[:, None] * leaves + outer[:, None]).reshape(-1)
    spans = np.stack([leaves - half, leaves + half], -1)[None].repeat(len(aside), 0).reshape(-1, 2)
    order = np.argsort(height)
    borders = []
    for group in np.split(order, np.flatnonzero(np.diff(height[order]) > SAME) + 1):
        for begin, end in unite(spans[group], SAME):
            borders.append(np.array([[0.0], [height[group[0]]], [begin], [end]]))
    return borders


@torch.no_grad()
def _decide(
    render: RenderFaces, network: nn.Module, faces: NDArray[np.uint8]
) -> tuple[NDArray, NDArray]:
    """Return the actions and the gaps to the second-highest logit. Shapes: (N,)."""
    highest = network(render(faces)).topk(2)
    gap = highest.values[:, 0] - highest.values[:, 1]
    return highest.indices[:, 0].numpy(), gap.double().numpy()


def _areas_by_side(cells: Arrangement, touch_distance: float) -> NDArray[np.float64]:
    """Return the area of each cell, m^2, by `SIDES`. Shape: (cells, 3)."""
    left = cells.areas(above=touch_distance)
    not_right = cells.areas(above=-touch_distance)
    sides = np.stack([left, not_right - left, cells.areas() - not_right], -1)
    return np.where(sides > SAME, sides, 0.0)


def _share(area: float, total: float) -> float:
    """Return a fraction to the digits that sums of areas are good to."""
    return round(float(area / total), 12)
