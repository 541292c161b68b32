"""Images of observations: tinted, with heat maps, in grids, with action probabilities."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from drone_rl.sim.vocabulary import SHOWN_MOVES, ShownActions
from drone_rl.utils.palette import (
    BOX,
    DOWN,
    GROUND,
    INK,
    MUTED,
    NEXT_CUBE,
    PAPER,
    SKY,
    Rgb,
)

ROW = 18
"""Height of an action's row, pixels."""
SCALE = 5
"""Enlargement of a single frame."""
_NARROW = 64
"""Pixels of a frame's width below which it is enlarged more, so that captions have room."""
_CHANNELS = {"gray": 1, "rgb": 3, "chromaticity": 2, "classes": 5}
"""Number of channels of a frame, by kind."""
_CLASSES = np.array([NEXT_CUBE, DOWN, GROUND, MUTED, SKY]) / 255
"""Colors of the classes of a segmentation, see `drone_rl.config.inputs.CLASSES`."""


def tint(frame: NDArray, color: Rgb, strength: float = 0.4) -> NDArray:
    """Tint a frame, (H, W, 3), uint8, with its action's color. Shape and type kept."""
    wash = np.array(color, dtype=np.float64)
    return (frame * (1 - strength) + wash * strength).astype(np.uint8)


def heated(frame: NDArray, heat: NDArray) -> NDArray:
    """Overlay a heat map, (H, W), 0 or more, on a frame in gray. Shape: (H, W, 3), uint8."""
    gray = np.repeat(frame.mean(-1, keepdims=True), 3, -1) * 0.75
    top = float(heat.max())
    share = heat.astype(np.float64) / top if top > 0 else np.zeros(heat.shape)
    color = colormaps["inferno"](share)[..., :3] * 255
    weight = (0.15 + 0.75 * share)[..., None] * (top > 0)
    return (gray * (1 - weight) + color * weight).astype(np.uint8)


def thumbnails(frames: NDArray, colors: Sequence[Rgb], cells: NDArray) -> Image.Image:
    """Place frames, each tinted with its action's color, on the cells of a grid.

    Shapes: (N, H, W, 3) of the frames; (N, 2), column and row, of the cells.
    """
    height, width = frames.shape[1:3]
    columns, rows = cells.max(0) + 1
    canvas = Image.new("RGB", (int(columns) * width, int(rows) * height), PAPER)
    for frame, color, (column, row) in zip(frames, colors, cells, strict=True):
        picture = Image.fromarray(tint(frame, color))
        canvas.paste(picture, (int(column) * width, int(row) * height))
    return canvas


def explained_frame(
    frame: NDArray,
    heat: NDArray,
    probabilities: Sequence[float],
    chosen: int,
    captions: tuple[str, str],
    actions: ShownActions = SHOWN_MOVES,
) -> Image.Image:
    """Stack a frame, its heat map, each under a caption, and the action probabilities."""
    plain, hot = enlarge(frame), enlarge(heated(frame, heat))
    bars = indicator(probabilities, chosen, plain.width, actions)
    return stacked([titled(plain, captions[0]), titled(hot, captions[1]), bars])


def frame_with_probabilities(
    data: Mapping[str, NDArray], frame: int, caption: str, actions: ShownActions = SHOWN_MOVES
) -> Image.Image:
    """Stack a frame of the data set under a caption, and its action probabilities.

    `data` has "frames" (T, H, W, 3), "actions" (T,) and "probabilities" (T, num_actions).
    """
    plain = titled(enlarge(data["frames"][frame]), caption)
    chosen = int(data["actions"][frame])
    bars = indicator(data["probabilities"][frame], chosen, plain.width, actions)
    return stacked([plain, bars])


def enlarge(frame: NDArray, scale: int = SCALE) -> Image.Image:
    """Enlarge a frame without interpolation, narrow ones more, so that captions have room."""
    picture = Image.fromarray(frame)
    scale = max(scale, -(-_NARROW * scale // picture.width))
    return picture.resize((picture.width * scale, picture.height * scale), Image.Resampling.NEAREST)


def titled(picture: Image.Image, caption: str) -> Image.Image:
    """Put a line of text above an image."""
    canvas = Image.new("RGB", (picture.width, picture.height + 22), PAPER)
    ImageDraw.Draw(canvas).text((2, 2), caption, INK, ImageFont.load_default(14))
    canvas.paste(picture, (0, 22))
    return canvas


def stacked(pictures: Sequence[Image.Image], gap: int = 3) -> Image.Image:
    """Stack images from top to bottom."""
    width = max(p.width for p in pictures)
    height = sum(p.height for p in pictures) + gap * (len(pictures) - 1)
    canvas, y = Image.new("RGB", (width, height), PAPER), 0
    for picture in pictures:
        canvas.paste(picture, (0, y))
        y += picture.height + gap
    return canvas


def gridded(pictures: Sequence[Image.Image], columns: int, gap: int = 12) -> Image.Image:
    """Arrange images of one size in rows."""
    width, height = pictures[0].width, pictures[0].height
    rows = -(-len(pictures) // columns)
    size = (columns * (width + gap) - gap, rows * (height + gap) - gap)
    canvas = Image.new("RGB", size, PAPER)
    for i, picture in enumerate(pictures):
        canvas.paste(picture, ((i % columns) * (width + gap), (i // columns) * (height + gap)))
    return canvas


def shown_picture(observation: NDArray, low: float, high: float, channels: str) -> NDArray:
    """Convert the newest frame of an observation, shape (C, H, W), to an RGB image, uint8.

    `low` is shown as black, `high` as white. The channels are "gray", "rgb", "classes", each in its
    color, or "chromaticity" of red and blue. Their green is 1 minus the mean of both: the image
    distinguishes colors and does not show those of the scene. Shape: (H, W, 3).
    """
    newest = observation[-_CHANNELS.get(channels, 1) :].astype(np.float64)
    share = ((newest - low) / max(high - low, 1e-12)).clip(0, 1)
    if channels == "chromaticity":
        red, blue = share
        share = np.stack([red, 1 - (red + blue) / 2, blue])
    elif channels == "classes":
        share = np.tensordot(_CLASSES.T, share, 1).clip(0, 1)
    elif channels != "rgb":
        share = share.repeat(3, 0)
    return (np.moveaxis(share, 0, -1) * 255).astype(np.uint8)


def indicator(
    probabilities: Sequence[float], chosen: int, width: int, actions: ShownActions = SHOWN_MOVES
) -> Image.Image:
    """Draw a row per action, those to the left first: name, probability and a bar of its length.

    The bar of the chosen action is dark.
    """
    canvas = Image.new("RGB", (width, ROW * len(actions.names) + 4), BOX)
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(13)
    shares = [float(share) for share in probabilities]
    texts = [f"{name} {share:.2f}" for name, share in zip(actions.names, shares, strict=True)]
    start = max(width // 2, round(max(map(font.getlength, texts))) + 12)  # right of all texts
    for row, action in enumerate(actions.order):
        top, color = ROW * row + 4, INK if action == chosen else MUTED
        end = max(start + 1, start + (width - start - 6) * shares[action])
        draw.rectangle((start, top, end, top + ROW - 6), color)
        draw.text((6, top - 2), texts[action], INK, font)
    return canvas
