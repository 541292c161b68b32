import math

import pytest
import torch

from benchmarks import flight_paths as of


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


def test_courses_point_by_point():
    assert of.square(2.0).tolist() == [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 0]]
    assert of.zigzag(3, 5.0, 4.0).tolist() == [[0, 0, 0], [5, 4, 0], [10, 0, 0], [15, 4, 0]]
    assert of.staircase(2, 3.0).tolist() == [[0, 0, 0], [3, 0, 0], [3, 0, 3], [6, 0, 3], [6, 0, 6]]
    turns = of.helix(2.0, 8.0, turns=1, points=4)
    expected = [[0, 0, 0], [2, 2, 2], [0, 4, 4], [-2, 2, 6], [0, 0, 8]]
    torch.testing.assert_close(turns, torch.tensor(expected).double(), atol=1e-6, rtol=0)
    eight = of.figure_eight(4.0, points=8)
    half = math.sqrt(0.5)
    expected = [[0, 0, 0], [2 * half, 1, 0], [2, 0, 0], [2 * half, -1, 0], [0, 0, 0]]
    torch.testing.assert_close(eight[:5], torch.tensor(expected).double(), atol=1e-6, rtol=0)
    speeds = {name: course.speed for name, course in of.courses().items()}
    assert speeds == {"square": 2, "figure_eight": 2, "helix": 2, "zigzag": 2, "straight": 5,
                      "staircase": 1}  # fmt: skip


def test_a_course_may_take_three_times_as_long_as_it_should_and_20_s(monkeypatch):
    class EnoughError(Exception):
        pass

    def fly(quadrotor, body, command):
        raise EnoughError(command.limit)

    monkeypatch.setattr(of, "fly_command", fly)
    way = torch.tensor([[0.0, 0, 0], [6, 0, 0]]).double()
    with pytest.raises(EnoughError) as found:
        of.path_following({"fast": of.Course(way, 4.0), "slow": of.Course(way, 0.8)})
    assert found.value.args == (3 * 6 / 0.8 + 20,)


CORNER = torch.tensor(
    [[[0, 0, 1], [4, 0, 1], [4, 3, 1]], [[0, 0, 0], [0, 0, 2], [0, 0, 2]]], dtype=torch.float64
)


def test_shorter_paths_repeat_their_ends():
    assert torch.equal(of.stack_paths([CORNER[0], CORNER[1][:2]]), CORNER)
