"""Colors of plots, images and pages, one meaning each, by red, green and blue from 0 to 255.

Most are Okabe and Ito's, which readers with a color vision deficiency can tell apart. Red is left
to the cubes, which are red in every image.
"""

Rgb = tuple[int, int, int]

FORWARD: Rgb = (204, 121, 167)
LEFT: Rgb = (230, 159, 0)
RIGHT: Rgb = (0, 114, 178)
TURN_LEFT: Rgb = (242, 207, 128)
TURN_RIGHT: Rgb = (128, 184, 216)
UP: Rgb = (0, 120, 90)
DOWN: Rgb = (120, 94, 60)
BACK: Rgb = (230, 188, 211)
"""Actions; a turn is a lighter shade of its side, back one of forward."""
GOOD: Rgb = (0, 158, 115)
"""Good, reached, passed."""
ONE_SIDED: Rgb = (86, 180, 233)
BAD: Rgb = (213, 94, 0)
"""Poor, failed, impossible."""
INK: Rgb = (30, 32, 36)
"""Text, the policy that a plot is about, and the action that it takes."""
FAINT: Rgb = (91, 97, 107)
"""Captions, and methods that are not trusted."""
MUTED: Rgb = (150, 156, 166)
"""Actions not taken, placebos, references."""
EMPTY: Rgb = (217, 217, 222)
"""No result: not reached, no verdict."""
BOX: Rgb = (236, 238, 242)
PAPER: Rgb = (255, 255, 255)
NEXT_CUBE: Rgb = (214, 39, 40)
GROUND: Rgb = (140, 154, 123)
SKY: Rgb = (158, 202, 233)
"""What a camera image contains."""


def css(color: Rgb) -> str:
    """Return a color as "#rrggbb", for style sheets and Matplotlib."""
    return "#{:02x}{:02x}{:02x}".format(*color)


def light(color: Rgb, strength: float = 0.35) -> Rgb:
    """Return a color mixed with white, for areas behind text."""
    red, green, blue = (round(255 + strength * (c - 255)) for c in color)
    return red, green, blue
