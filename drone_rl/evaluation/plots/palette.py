"""Colours that pictures share."""

Color = tuple[int, int, int]
"""Red, green, blue, 0 to 255."""
BACKGROUND: Color = (255, 255, 255)
INK: Color = (30, 32, 36)
MUTED: Color = (150, 156, 166)
CHOSEN: Color = (214, 39, 40)
BOX: Color = (236, 238, 242)
