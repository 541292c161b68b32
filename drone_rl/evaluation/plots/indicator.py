"""What a policy wishes for, as bars: the chapter's three arrows, or a row for each action."""

from collections.abc import Sequence

from PIL import Image, ImageDraw, ImageFont

from drone_rl.evaluation.plots.palette import BOX, CHOSEN, INK, MUTED
from drone_rl.sim.action_display import MOVES, ShownActions

LEFT, UP, RIGHT = (-1.0, 0.0), (0.0, 1.0), (1.0, 0.0)
HEIGHT = 84
"""Pixels of the three arrows."""
ROW = 18
"""Pixels of one row, where actions point otherwise."""


def indicator(
    probabilities: Sequence[float], chosen: int, width: int, actions: ShownActions = MOVES
) -> Image.Image:
    """One bar an action, as long as it is probable.

    Args:
        probabilities: By action number.
        chosen: Its bar is red.
        width: Pixels across.
        actions: What they are called and where they point.
    """
    if sorted(actions.arrows) == sorted((LEFT, UP, RIGHT)):
        return _arrows(probabilities, chosen, width, actions)
    return _rows(probabilities, chosen, width, actions)


def _arrows(
    probabilities: Sequence[float], chosen: int, width: int, actions: ShownActions
) -> Image.Image:
    """Left, up and right from the middle of the lower edge."""
    canvas, draw, font = _canvas(width, HEIGHT)
    middle, base, thick = width // 2, HEIGHT - 16, 10
    reach, up = width // 2 - 62, HEIGHT - 24
    left, ahead, right = (actions.arrows.index(arrow) for arrow in (LEFT, UP, RIGHT))
    share = {action: float(probabilities[action]) for action in (left, ahead, right)}
    bars = {
        left: (middle - 8 - reach * share[left], base - thick, middle - 8, base),
        right: (middle + 8, base - thick, middle + 8 + reach * share[right], base),
        ahead: (middle - thick // 2, base - up * share[ahead], middle + thick // 2, base),
    }
    for action, box in bars.items():
        color = CHOSEN if action == chosen else MUTED
        draw.rectangle((box[0], min(box[1], box[3] - 1), max(box[2], box[0] + 1), box[3]), color)
    places = {left: (6, base - 14), right: (width - 62, base - 14), ahead: (middle + 12, 4)}
    for action, place in places.items():
        draw.text(place, f"{actions.names[action]} {share[action]:.2f}", INK, font)
    return canvas


def _rows(
    probabilities: Sequence[float], chosen: int, width: int, actions: ShownActions
) -> Image.Image:
    """A row for each action, those to the left first."""
    canvas, draw, font = _canvas(width, ROW * len(actions.names) + 4)
    start = width // 2
    for row, action in enumerate(actions.order):
        share, top = float(probabilities[action]), ROW * row + 4
        color = CHOSEN if action == chosen else MUTED
        end = max(start + 1, start + (width - start - 6) * share)
        draw.rectangle((start, top, end, top + ROW - 6), color)
        draw.text((6, top - 2), f"{actions.names[action]} {share:.2f}", INK, font)
    return canvas


def _canvas(
    width: int, height: int
) -> tuple[Image.Image, ImageDraw.ImageDraw, ImageFont.FreeTypeFont | ImageFont.ImageFont]:
    canvas = Image.new("RGB", (width, height), BOX)
    return canvas, ImageDraw.Draw(canvas), ImageFont.load_default(13)
