import re

import numpy as np

from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.state import state_html, trajectory_svg


def test_a_way_from_above(quadrotor, hovering):
    drone = Drone(quadrotor, hovering((0, 0, 0.3)).position[0], 0.0, 0)
    drone.trajectory.append(1.0, hovering((14, 0, 1)))
    drone.trajectory.append(2.0, hovering((14, 7, 1)))
    points = re.search('points="([^"]+)"', trajectory_svg(drone.trajectory))[1]
    found = np.array([p.split(",") for p in points.split()], dtype=float)
    assert found.tolist() == [[80, 150], [80, 10], [10, 10]]  # ahead is up, left is left
    text = state_html(drone.state, drone.trajectory)
    assert "0.00, 0.00, 0.30 m" in text
    assert "landed, disarmed" in text
    assert "none" in text
    assert len(text) < 2000


class Long:
    """A thousand places on a line ahead."""

    positions = np.stack([np.arange(1000.0), np.zeros(1000), np.ones(1000)], -1)

    def __len__(self):
        return len(self.positions)


def test_of_a_long_way_every_other_place_is_drawn():
    points = re.search('points="([^"]+)"', trajectory_svg(Long()))[1].split()
    assert len(points) == 500
    assert points[0] == "10.0,150.0"
    scale = 140 / 998
    assert points[1] == f"10.0,{10 + scale * 996:.1f}"
