"""What a policy does about one cube, over the continuum of the places where that can stand."""

import dataclasses
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from drone_rl.sim.actions import MOVES, Move
from drone_rl.utils.errors import InputError
from drone_rl.utils.provenance import num_cores
from drone_rl.verification.prover.arrangement import SAME, Arrangement, Pieces, Window, arrange
from drone_rl.verification.prover.cube_images import NOTHING, UNIT, Eye

_DIGITS = 14
"""Of slopes: those of a row above and one below are rounded otherwise."""


def find_borders(eye: Eye, window: Window) -> Pieces:
    """All of them within a rectangle; no two on one line overlap.

    Args:
        eye: The camera.
        window: Metres ahead of it, all more than half a cube's edge, and to its sides.
    """
    slopes, half = np.unique(eye.left), eye.half
    with np.errstate(divide="ignore"):
        leaves = half / np.unique(np.abs(eye.up).round(_DIGITS))
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
        for span in joined(np.stack([slopes * leave - half, slopes * leave + half], -1))
    ]
    return Pieces(slope, offset, begin, end, np.reshape(upright, (-1, 3))).clipped(window)


def doubtful_area(eye: Eye, pieces: Pieces, window: Window) -> float:
    """Square metres, at most, so near to a border that it may lie on its other side in float32.

    See `Eye.borders` and `Eye.grazed` for how near that is.
    """
    farthest = max(eye.farthest, window.farthest + 1.0)
    widest = max(eye.widest, window.sideways)

    def error(x: NDArray) -> NDArray:
        y = np.abs(pieces.slope * x + pieces.offset)
        return 16 * (y + eye.half) + 3 * np.abs(pieces.slope) * farthest + 3 * widest

    length = pieces.end - pieces.begin
    bands = (length * (error(pieces.begin) + error(pieces.end))).sum()
    _, low, high = pieces.upright.T
    return UNIT * float(bands + 2 * 32 * farthest * (high - low).sum())


def joined(spans: NDArray[np.float64]) -> list[list[float]]:
    """Spans that overlap or touch as one. Shape: (N, 2)."""
    found: list[list[float]] = []
    for low, high in spans[np.argsort(spans[:, 0])].tolist():
        if found and low <= found[-1][1] + SAME:
            found[-1][1] = max(found[-1][1], high)
        else:
            found.append([low, high])
    return found


def _lines(slope: NDArray, offset: NDArray, end: float) -> NDArray:
    """Lines from anywhere to x = end. Shape: (4, N)."""
    return np.stack([slope, offset, np.full_like(slope, -np.inf), np.full_like(slope, end)])


def _levels(aside: NDArray, outer: NDArray, leaves: NDArray, half: float) -> list[NDArray]:
    """The level borders; those of several rows at the same height are joined. Each: (4, 1)."""
    height = (aside[:, None] * leaves + outer[:, None]).reshape(-1)
    spans = np.stack([leaves - half, leaves + half], -1)[None].repeat(len(aside), 0).reshape(-1, 2)
    order = np.argsort(height)
    height, spans = height[order], spans[order]
    groups = np.split(np.arange(len(height)), np.flatnonzero(np.diff(height) > SAME) + 1)
    return [
        np.array([[0.0], [height[group[0]]], [begin], [end]])
        for group in groups
        if len(group)
        for begin, end in joined(spans[group])
    ]


Look = Callable[[NDArray[np.uint8]], Tensor]
"""From what pixels show, see `Eye.faces`, to pictures as the network sees them: (N, C, H, W)."""

SIDES = ("left", "ahead", "right")
"""Of a place: to its left or right, flying straight on misses the cube."""
NEEDED = (Move.LEFT, Move.FORWARD, Move.RIGHT)
"""What a cube calls for that stands to that side."""
UNSEEN, BLIND = "unseen", "blind"
_BATCH = 256
"""Pictures that a thread decides in one go: always as many, so that sums are always the same."""


@dataclasses.dataclass(frozen=True)
class PlaceMap:
    """Cells of places. In each, the cube's picture is the same everywhere."""

    window: Window
    arrangement: Arrangement
    places: NDArray[np.float64]
    """One of each cell: metres ahead of the camera and to its left. Shape: (cells, 2)."""
    areas: NDArray[np.float64]
    """Square metres of each, by `SIDES`. Shape: (cells, 3)."""
    action: NDArray[np.int64]
    """Of the highest logit. Shape: (cells,)."""
    gap: NDArray[np.float64]
    """Between the two highest logits. Shape: (cells,)."""
    is_unseen: NDArray[np.bool_]
    """Whether no pixel shows the cube. Shape: (cells,)."""
    alone: int
    """The action with no cube in sight."""
    touch_distance: float
    """A cube farther aside than that calls for a turn, metres."""
    doubtful: float
    """Square metres, at most, so near to a border that a renderer that computes in float32 may show
    another cell's picture, or parts of both."""

    @property
    def is_blind(self) -> NDArray[np.bool_]:
        """Cells, by side, where it does what it does with no cube in sight, and not the turn.

        Shape: (cells, 3).
        """
        needed = np.array(NEEDED)
        turns = needed != Move.FORWARD
        return (self.action == self.alone)[:, None] & (self.action[:, None] != needed) & turns

    def at(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        """The actions at places inside of the window.

        Args:
            places: Metres ahead of the camera and to its left. Shape: (N, 2).
        """
        return self.action[self.arrangement.locate(places)]

    def summary(self, logit_gap: float) -> dict[str, Any]:
        """Plain numbers; all shares are of areas.

        Args:
            logit_gap: Where the two highest logits are closer, the action is not certain.
        """
        areas, total = self.areas, self.areas.sum()
        counts = [np.bincount(self.action, area, len(MOVES)) for area in areas.T]
        blind, unseen = areas * self.is_blind, areas * self.is_unseen[:, None]
        closest = int(self.gap.argmin())
        sides = {
            side: {
                "share": _share(area.sum(), total),
                "actions": [_share(c, area.sum()) for c in count],
                UNSEEN: _share(unseen[:, k].sum(), area.sum()),
                BLIND: _share(blind[:, k].sum(), area.sum()),
            }
            for k, (side, area, count) in enumerate(zip(SIDES, areas.T, counts, strict=True))
            if area.sum() > 0
        }
        return {
            "window": dataclasses.asdict(self.window),
            "area": float(total),
            "cells": len(self.action),
            "actions": [_share(c, total) for c in np.sum(counts, 0)],
            "sides": sides,
            "alone": self.alone,
            "touch_distance": self.touch_distance,
            "unmoved": _share(areas[self.action == self.alone].sum(), total),
            UNSEEN: _share(unseen.sum(), total),
            BLIND: _share(blind.sum(), total),
            "least_gap": float(self.gap[closest]),
            "least_gap_ahead": float(self.places[closest, 0]),
            "least_gap_left": float(self.places[closest, 1]),
            "least_gap_area": float(areas[closest].sum()),
            "logit_gap": logit_gap,
            "close": _share(areas[self.gap <= logit_gap].sum(), total),
            "in_doubt": min(1.0, self.doubtful / float(total)),
        }

    def outlines(self) -> dict[str, NDArray]:
        """Closed ways around what is alike, for pictures.

        Returns:
            "points", the corners of all ways, shape (P, 2); "ends", where each way ends among them;
            "labels", of each: an action's number, or one more than the last for what is unseen.
        """
        ways = self.arrangement.outlines(self.action)
        unseen = self.arrangement.outlines(self.is_unseen.astype(np.int64))
        ways += [(len(MOVES), way) for label, way in unseen if label]
        return {
            "points": np.concatenate([way for _, way in ways]),
            "ends": np.cumsum([len(way) for _, way in ways]),
            "labels": np.array([label for label, _ in ways]),
        }


def map_places(
    eye: Eye,
    window: Window,
    look: Look,
    network: nn.Module,
    *,
    touch_distance: float,
    most_cells: int,
) -> PlaceMap:
    """Decides a policy's action at every place of one cube.

    Args:
        eye: The policy's camera.
        window: The places.
        look: Makes pictures.
        network: Gives the logits of `MOVES`, shape (N, 3); on the CPU.
        touch_distance: A cube farther aside than that calls for a turn, metres.
        most_cells: See `arrange`.

    Raises:
        InputError: The window reaches into the cube, or there are more cells.
    """
    if window.nearest <= eye.half:
        raise InputError(
            f"nearest={window.nearest} puts the camera into a cube; give more than {eye.half} "
            "(half of cube_size)"
        )
    borders = find_borders(eye, window)
    cells = arrange(borders, window, most_cells)
    places = cells.inner_points()
    (alone,), _ = _decide(look, network, _no_faces(eye))
    parts = np.split(places, range(_BATCH, len(places), _BATCH))

    def decide(part: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        faces = eye.faces(*part.T)
        return *_decide(look, network, faces), (faces == NOTHING).all((1, 2))

    with ThreadPoolExecutor(
        num_cores(), "places", initializer=torch.set_num_threads, initargs=(1,)
    ) as pool:
        action, gap, is_unseen = map(np.concatenate, zip(*pool.map(decide, parts), strict=True))
    return PlaceMap(
        window=window,
        arrangement=cells,
        places=places,
        areas=_areas_by_side(cells, touch_distance),
        action=action,
        gap=gap,
        is_unseen=is_unseen,
        alone=int(alone),
        touch_distance=touch_distance,
        doubtful=doubtful_area(eye, borders, window),
    )


def _no_faces(eye: Eye) -> NDArray[np.uint8]:
    """What pixels show with no cube in sight. Shape: (1, H, W)."""
    return np.full((1, len(eye.up), len(eye.left)), NOTHING, np.uint8)


@torch.no_grad()
def _decide(look: Look, network: nn.Module, faces: NDArray[np.uint8]) -> tuple[NDArray, NDArray]:
    """Actions, and the gaps to the next best. Shapes: (N,)."""
    highest = network(look(faces)).topk(2)
    gap = highest.values[:, 0] - highest.values[:, 1]
    return highest.indices[:, 0].numpy(), gap.double().numpy()


def _areas_by_side(cells: Arrangement, touch_distance: float) -> NDArray[np.float64]:
    """Square metres of each cell, by `SIDES`. Shape: (cells, 3)."""
    left = cells.areas(above=touch_distance)
    not_right = cells.areas(above=-touch_distance)
    sides = np.stack([left, not_right - left, cells.areas() - not_right], -1)
    return np.where(sides > SAME, sides, 0.0)


def _share(area: float, total: float) -> float:
    """To as many digits as sums of areas are good to."""
    return round(float(area / total), 12)
