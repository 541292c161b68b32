"""Instruments for videos: an artificial horizon, three speeds and the motors' thrust."""

import math
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.dynamics import FlightState

WIDTH, HEIGHT = 476, 190
"""Pixels of the panel."""
_BACKGROUND, _TEXT, _FAINT = (24, 26, 31), (235, 235, 240), (120, 130, 150)
_SKY, _GROUND, _NEEDLE = (70, 130, 200), (140, 95, 50), (255, 205, 60)
_BAR = (90, 190, 120)
_RADIUS, _DIAL = 68, (84, 102)
"""Radius and centre of the horizon, pixels."""
_DEGREES = 40.0
"""Degrees of pitch from the centre of the horizon to its edge."""
_SHARPER = 3
"""Supersampling factor of the horizon."""
_SPEEDS = (172, 40)
"""Position of the speeds, pixels."""
_MOTORS = (330, 30)
_STILL = 0.05
"""Motion backward, right or down up to this speed, m/s, is labelled forward, left or climbs."""
_WORDS = (("forward", "backward"), ("left", "right"), ("climbs", "sinks"))
_PLACES = {"front left": 2, "front right": 0, "rear left": 1, "rear right": 3}
"""Index of each rotor in `FlightState.rotors`."""


class Reading(NamedTuple):
    """Instrument readings of one drone."""

    attitude: Attitude
    """Degrees."""
    speeds: tuple[float, float, float]
    """Forward (level), to the left and up, m/s."""
    rotors: tuple[float, ...]
    """Thrust of each as a fraction of its maximum."""


def read(body: FlightState) -> Reading:
    """Return the readings of the first drone of a batch."""
    w, x, y, z = body.attitude[0].tolist()
    x_speed, y_speed, climb = body.velocity[0].tolist()
    heading = float(body.heading[0])
    cos, sin = math.cos(heading), math.sin(heading)
    speeds = (cos * x_speed + sin * y_speed, cos * y_speed - sin * x_speed, climb)
    return Reading(Attitude.of((w, x, y, z)), speeds, tuple(body.rotors[0].tolist()))


def panel(reading: Reading, hover: float) -> Image.Image:
    """Draw the instruments. Size: (WIDTH, HEIGHT).

    A mark on each bar of a motor shows `hover`, thrust in hover as a fraction of the maximum.
    """
    image = Image.new("RGB", (WIDTH, HEIGHT), _BACKGROUND)
    draw = ImageDraw.Draw(image)
    _draw_horizon(image, draw, reading.attitude)
    _draw_speeds(draw, reading.speeds)
    _draw_motors(draw, reading.rotors, hover)
    return image


def horizon(attitude: Attitude) -> Image.Image:
    """Draw the artificial horizon, a square of twice its radius."""
    size = 2 * _RADIUS * _SHARPER
    across = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(across, -across)
    roll = math.radians(attitude.roll)
    above = y * math.cos(roll) - x * math.sin(roll) + attitude.pitch / _DEGREES
    along = x * math.cos(roll) + y * math.sin(roll)
    colors = np.where(above[..., None] < 0.0, _GROUND, _SKY).astype(np.uint8)
    for degrees in (-20.0, -10.0, 0.0, 10.0, 20.0):
        reach = 2.0 if degrees == 0.0 else 0.2
        is_on = (abs(above - degrees / _DEGREES) < 0.013) & (abs(along) < reach)
        colors[is_on] = _TEXT
    colors[x * x + y * y > 1.0] = _BACKGROUND
    return Image.fromarray(colors).resize((2 * _RADIUS, 2 * _RADIUS), Image.Resampling.BOX)


def _draw_horizon(image: Image.Image, draw: ImageDraw.ImageDraw, attitude: Attitude) -> None:
    x, y = _DIAL
    draw.text((x - _RADIUS, 8), "horizon", _FAINT, ImageFont.load_default(13))
    image.paste(horizon(attitude), (x - _RADIUS, y - _RADIUS))
    for side in (-1, 1):
        ends = sorted((x + side * 12, x + side * 40))
        draw.rectangle((ends[0], y - 2, ends[1], y + 1), _NEEDLE)
    draw.rectangle((x - 2, y - 2, x + 1, y + 1), _NEEDLE)
    side, nose = "right" if attitude.roll > 0 else "left", "down" if attitude.pitch < 0 else "up"
    text = f"{abs(attitude.roll):.0f}° {side}, {abs(attitude.pitch):.0f}° {nose}"
    draw.text((x, HEIGHT - 12), text, _TEXT, ImageFont.load_default(13), anchor="mm")


def _draw_speeds(draw: ImageDraw.ImageDraw, speeds: tuple[float, float, float]) -> None:
    x, y = _SPEEDS
    draw.text((x, 8), "speed", _FAINT, ImageFont.load_default(13))
    for speed, words in zip(speeds, _WORDS, strict=True):
        text = f"{words[speed < -_STILL]} {abs(speed):.1f} m/s"
        draw.text((x, y), text, _TEXT, ImageFont.load_default(15))
        y += 53


def _draw_motors(draw: ImageDraw.ImageDraw, rotors: tuple[float, ...], hover: float) -> None:
    left, top = _MOTORS
    draw.text((left, 8), "motors (line: hovering)", _FAINT, ImageFont.load_default(13))
    tall, wide = 54, 34
    for i, (name, rotor) in enumerate(_PLACES.items()):
        x, y = left + 12 + 72 * (i % 2), top + 78 * (i // 2)
        share = max(0.0, min(1.0, rotors[rotor]))
        draw.rectangle((x, y, x + wide, y + tall), (50, 54, 63))
        full = y + tall - round(tall * share)
        draw.rectangle((x, full, x + wide, y + tall), _BAR)
        mark = y + tall - round(tall * hover)
        draw.line((x - 4, mark, x + wide + 4, mark), _TEXT, 2)
        draw.text(
            (x + wide / 2, y + tall + 9), name, _TEXT, ImageFont.load_default(12), anchor="mm"
        )
