import math

import pytest
import torch

from drone_rl.pilot import path_following as of


def test_the_courses_are_what_they_are_called():
    courses = of.courses()
    assert len(courses) >= 5
    assert courses["square"].length == 40.0
    assert courses["straight"].length == 100.0
    assert courses["zigzag"].length == pytest.approx(6 * math.sqrt(50))
    assert courses["staircase"].length == 24.0
    around = math.hypot(2 * 2 * math.pi * 5, 10)
    assert courses["helix"].length == pytest.approx(around, rel=0.01)
    eight = courses["figure_eight"].points
    assert eight[[0, 32, 64]].abs().max() < 1e-12
    assert eight[16].tolist() == pytest.approx([10, 0, 0])


def test_a_short_way_is_followed():
    course = of.Course(torch.tensor([[0.0, 0, 0], [3, 0, 0], [3, 3, 0]]).double(), 1.0)
    followed = of.path_following({"corner": course})["corner"]
    assert (followed.length, followed.speed) == (6.0, 1.0)
    assert 0.0 < followed.mean < followed.greatest < 0.6
    assert 6.0 < followed.seconds < 12.0


def test_the_square_meets_its_target():
    square = of.path_following({"square": of.courses()["square"]})["square"]
    assert square.mean <= 0.5
    assert math.isfinite(square.seconds)
