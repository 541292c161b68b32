import re

import numpy as np

from drone_rl.pilot.drone import Drone
from drone_rl.pilot.showing import shown, way


def test_a_way_from_above(quadrotor, hovering):
    drone = Drone(quadrotor, hovering((0, 0, 0.3)).position[0], 0.0, 0)
    drone.trajectory.note(1.0, hovering((14, 0, 1)))
    drone.trajectory.note(2.0, hovering((14, 7, 1)))
    points = re.search('points="([^"]+)"', way(drone.trajectory))[1]
    found = np.array([p.split(",") for p in points.split()], dtype=float)
    assert found.tolist() == [[80, 150], [80, 10], [10, 10]]  # ahead is up, left is left
    text = shown(drone.state, drone.trajectory)
    assert "0.00, 0.00, 0.30 m" in text
    assert "landed, disarmed" in text
    assert "nothing" in text
    assert len(text) < 2000
