import math

import pytest
import torch

from benchmarks import flight_paths


def test_courses_have_the_shapes_of_their_names():
    courses = flight_paths.courses()
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


def test_a_short_path_is_followed():
    course = flight_paths.Course(torch.tensor([[0.0, 0, 0], [3, 0, 0], [3, 3, 0]]).double(), 1.0)
    followed = flight_paths.path_following({"corner": course})["corner"]
    assert (followed.length, followed.speed) == (6.0, 1.0)
    assert 0.0 < followed.mean < followed.greatest < 0.6
    assert 6.0 < followed.seconds < 12.0


def test_the_square_meets_its_target():
    square = flight_paths.path_following({"square": flight_paths.courses()["square"]})["square"]
    assert square.mean <= 0.5
    assert math.isfinite(square.seconds)


def test_points_of_courses_by_hand():
    assert flight_paths.square(2.0).tolist() == [
        [0, 0, 0],
        [2, 0, 0],
        [2, 2, 0],
        [0, 2, 0],
        [0, 0, 0],
    ]
    assert flight_paths.zigzag(3, 5.0, 4.0).tolist() == [
        [0, 0, 0],
        [5, 4, 0],
        [10, 0, 0],
        [15, 4, 0],
    ]
    assert flight_paths.staircase(2, 3.0).tolist() == [
        [0, 0, 0],
        [3, 0, 0],
        [3, 0, 3],
        [6, 0, 3],
        [6, 0, 6],
    ]
    turns = flight_paths.helix(2.0, 8.0, turns=1, points=4)
    expected = [[0, 0, 0], [2, 2, 2], [0, 4, 4], [-2, 2, 6], [0, 0, 8]]
    torch.testing.assert_close(turns, torch.tensor(expected).double(), atol=1e-6, rtol=0)
    eight = flight_paths.figure_eight(4.0, points=8)
    half = math.sqrt(0.5)
    expected = [[0, 0, 0], [2 * half, 1, 0], [2, 0, 0], [2 * half, -1, 0], [0, 0, 0]]
    torch.testing.assert_close(eight[:5], torch.tensor(expected).double(), atol=1e-6, rtol=0)
    speeds = {name: course.speed for name, course in flight_paths.courses().items()}
    assert speeds == {"square": 2, "figure_eight": 2, "helix": 2, "zigzag": 2, "straight": 5,
                      "staircase": 1}  # fmt: skip


def test_the_time_limit_of_a_course(monkeypatch):
    """Three times the time at the commanded speed, and 20 s."""

    class StopError(Exception):
        pass

    def fly(quadrotor, body, command):
        raise StopError(command.limit)

    monkeypatch.setattr(flight_paths, "fly_command", fly)
    path = torch.tensor([[0.0, 0, 0], [6, 0, 0]]).double()
    with pytest.raises(StopError) as found:
        flight_paths.path_following(
            {"fast": flight_paths.Course(path, 4.0), "slow": flight_paths.Course(path, 0.8)}
        )
    assert found.value.args == (3 * 6 / 0.8 + 20,)


CORNER = torch.tensor(
    [[[0, 0, 1], [4, 0, 1], [4, 3, 1]], [[0, 0, 0], [0, 0, 2], [0, 0, 2]]], dtype=torch.float64
)


def test_shorter_paths_repeat_their_last_point():
    assert torch.equal(flight_paths.stack_paths([CORNER[0], CORNER[1][:2]]), CORNER)
