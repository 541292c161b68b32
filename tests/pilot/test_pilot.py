import math

import numpy as np
import pytest
import torch

from drone_rl.pilot.errors import PilotError
from drone_rl.pilot.pilot import Pilot
from drone_rl.sim.settings import CameraSettings
from drone_rl.sim.worlds import Worlds


def test_a_whole_flight_in_wind():
    with Pilot(wind=[5, 0, 0]) as pilot:
        pilot.arm()
        assert pilot.take_off()
        assert pilot.move_along([(3, 0, 2), (3, 3, 2)], speed=2)
        assert pilot.land()
    assert math.dist(pilot.state.position, (3, 3, 0.3)) < 0.2
    times, places = pilot.trajectory.times, pilot.trajectory.positions
    assert len(times) == len(places) > 100
    assert times[-1] == pytest.approx(pilot.time)
    assert places[:, 2].max() < 2.5


def test_pictures():
    worlds = Worlds(1, camera=CameraSettings(width=64, height=24))
    worlds.reset(torch.tensor([0]), [np.random.RandomState(0)])
    pilot = Pilot(worlds=worlds)
    low = pilot.picture()
    assert low.shape == (24, 64, 3)
    pilot.arm()
    pilot.take_off()
    assert (pilot.picture() != low).any()
    assert pilot.picture("bottom_center", height=4, width=6).shape == (4, 6, 3)


def test_without_worlds_there_is_nothing_to_see(flying):
    with pytest.raises(PilotError, match="picture: there is nothing to see; give worlds"):
        flying.picture()
