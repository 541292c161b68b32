"""What is read off a drone in flight, and how it is shown."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.dynamics import FlightState
from drone_rl.trust import instruments
from drone_rl.trust.instruments import HEIGHT, WIDTH, Reading, horizon, panel, read

LEVEL = Attitude(0.0, 0.0, 0.0)


def ground(attitude):
    """Where the dial shows the ground. Shape: (136, 136)."""
    return np.asarray(horizon(attitude)).astype(int)[..., 2] < 100


def test_speeds_are_the_drones_own():
    body = FlightState.at_rest(torch.tensor([[0.0, 0.0, 2.5]], dtype=torch.float64))
    half = math.radians(90.0) / 2  # looks to the world's left
    body.attitude[:] = torch.tensor([math.cos(half), 0.0, 0.0, math.sin(half)])
    body.velocity[:] = torch.tensor([1.0, 2.0, -0.5])
    body.rotors[:] = torch.tensor([0.1, 0.2, 0.3, 0.4])
    found = read(body)
    assert found.speeds == pytest.approx((2.0, -1.0, -0.5))  # 1 m/s along x is to its right
    assert found.attitude.yaw == pytest.approx(-90.0)
    assert found.rotors == pytest.approx((0.1, 0.2, 0.3, 0.4))


def test_the_horizon_lies_across_the_middle_of_a_level_drones():
    shown = ground(LEVEL)
    assert shown[90, 68] and not shown[46, 68]
    assert shown[80, 20:116].all() and not shown[56, 20:116].any()


def test_with_the_nose_down_there_is_more_ground():
    assert ground(Attitude(0.0, -20.0, 0.0))[40, 60]  # 20 of 40 degrees: half the radius up, 34
    assert not ground(Attitude(0.0, -20.0, 0.0))[28, 60]
    assert not ground(Attitude(0.0, 20.0, 0.0))[96, 60]


def test_with_the_right_side_down_the_ground_rises_there():
    shown = ground(Attitude(30.0, 0.0, 0.0))
    # 40 pixels to the right it stands 40 tan 30 = 23 above the middle
    assert shown[68 - 19, 108] and not shown[68 - 28, 108]
    assert shown[68 + 28, 28] and not shown[68 + 19, 28]


def bar_pixels(image, left, top, right, bottom):
    return int((np.asarray(image)[top:bottom, left:right] == instruments._BAR).all(-1).sum())


def test_motors_have_bars_as_long_as_they_push_where_they_are():
    image = panel(Reading(LEVEL, (0.0, 0.0, 0.0), (1.0, 0.0, 0.5, 0.0)), 6.0, 0.5)
    assert image.size == (WIDTH, HEIGHT)
    front_left, front_right = (bar_pixels(image, x, 30, x + 36, 90) for x in (341, 413))
    rear = bar_pixels(image, 330, 106, WIDTH, 170)
    assert front_right > 1.8 * front_left > 0
    assert rear < 0.05 * front_right  # a line, at nothing


def test_speed_to_the_left_is_a_bar_to_the_left():
    still = panel(Reading(LEVEL, (0.0, 0.0, 0.0), (0.0,) * 4), 6.0, 0.5)
    left = panel(Reading(LEVEL, (0.0, 3.0, 0.0), (0.0,) * 4), 6.0, 0.5)
    right = panel(Reading(LEVEL, (0.0, -3.0, 0.0), (0.0,) * 4), 6.0, 0.5)
    middle = 172 + 70
    row = (107, 120)
    assert bar_pixels(left, 172, row[0], middle, row[1]) > 300
    assert bar_pixels(left, middle + 2, row[0], 312, row[1]) == 0
    assert bar_pixels(right, 172, row[0], middle - 2, row[1]) == 0
    assert bar_pixels(still, 172, row[0], middle - 2, row[1]) == 0


def test_words_say_where_it_goes(monkeypatch):
    said = []

    class Canvas:
        def text(self, place, text, *_, **__):
            said.append(text)

        def rectangle(self, *_):
            pass

        line = rectangle

    instruments._draw_speeds(Canvas(), (-1.0, -0.02, -2.0), 6.0)
    assert said == ["speed", "backward", "1.0 m/s", "left", "0.0 m/s", "sinks", "2.0 m/s"]


class Pen:
    """Notes what is drawn where."""

    def __init__(self):
        self.texts, self.boxes, self.lines = [], [], []

    def text(self, place, text, *_, **__):
        self.texts.append((*place, text))

    def rectangle(self, box, color):
        self.boxes.append((*box, color))

    def line(self, ends, color, width):
        self.lines.append(ends)


def test_bars_of_speed_by_the_pixel():
    pen = Pen()
    instruments._draw_speeds(pen, (3.0, 3.0, -12.0), 6.0)
    tray = (50, 54, 63)
    assert pen.boxes == [
        (172, 54, 312, 66, tray),
        (242, 54, 277, 66, instruments._BAR),  # half of 70 pixels
        (172, 107, 312, 119, tray),
        (207, 107, 242, 119, instruments._BAR),
        (172, 160, 312, 172, tray),
        (172, 160, 242, 172, instruments._BAR),  # never longer than its tray
    ]
    assert pen.lines == [(242, 51, 242, 69), (242, 104, 242, 122), (242, 157, 242, 175)]


def test_bars_of_motors_by_the_pixel():
    pen = Pen()
    instruments._draw_motors(pen, (1.0, 0.0, 0.5, 2.0), 0.25)
    bars = [box[:4] for box in pen.boxes if box[4] == instruments._BAR]
    assert bars == [(342, 57, 376, 84), (414, 30, 448, 84), (342, 162, 376, 162),
                    (414, 108, 448, 162)]  # fmt: skip
    trays = [box[:4] for box in pen.boxes if box[4] != instruments._BAR]
    assert trays == [(342, 30, 376, 84), (414, 30, 448, 84), (342, 108, 376, 162),
                     (414, 108, 448, 162)]  # fmt: skip
    assert pen.lines == [(x, y, x + 42, y) for y in (70, 148) for x in (338, 410)]
    assert pen.texts[1:] == [
        (359, 93, "front left"),
        (431, 93, "front right"),
        (359, 171, "rear left"),
        (431, 171, "rear right"),
    ]


@pytest.mark.parametrize(
    ("attitude", "text"),
    [
        (LEVEL, "0° left, 0° up"),
        (Attitude(12.4, 3.0, 0.0), "12° right, 3° up"),
        (Attitude(-2.0, -7.0, 0.0), "2° left, 7° down"),
    ],
)
def test_the_needles_stand_still_and_the_attitude_is_written_below(attitude, text):
    pen, image = Pen(), panel(Reading(LEVEL, (0.0, 0.0, 0.0), (0.0,) * 4), 6.0, 0.5)
    instruments._draw_horizon(image, pen, attitude)
    assert [box[:4] for box in pen.boxes] == [
        (44, 100, 72, 103),
        (96, 100, 124, 103),
        (82, 100, 85, 103),
    ]
    assert pen.texts[-1] == (84, 178, text)


def test_the_dial_is_round_and_has_a_line_each_ten_degrees():
    dial = np.asarray(horizon(LEVEL)).astype(int)
    corners = dial[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert (corners == instruments._BACKGROUND).all()
    white = dial.min(-1) > 150
    for degrees in (-20, -10, 10, 20):  # 40 degrees are 68 pixels
        rows = slice(66 - round(1.7 * degrees), 70 - round(1.7 * degrees))
        assert white[rows, 56:80].any(0).all()
        assert not white[rows, :52].any() and not white[rows, 84:].any()
    assert white[66:70, 2:134].any(0).all()  # across the whole dial
    assert white.any(1).sum() == pytest.approx(5 * 2, abs=5)


def test_of_several_drones_the_first_is_read():
    body = FlightState.at_rest(torch.zeros(3, 3, dtype=torch.float64))
    body.velocity[:] = torch.arange(9.0).view(3, 3)
    body.rotors[:] = torch.arange(12.0).view(3, 4)
    found = read(body)
    assert found.speeds == (0.0, 1.0, 2.0) and found.rotors == (0.0, 1.0, 2.0, 3.0)
