import math

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, DynamicsSettings, PillarsSettings
from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.image_types import ImageRequest, ImageType
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


def test_cameras_hang_in_a_gimbal_or_tilt_with_the_body():
    camera = CameraSettings(width=64, height=24)
    level, tilted = (
        Pilot(worlds=Worlds(1, camera=camera), camera_mount=mount) for mount in ("gimbal", "body")
    )
    pictures = []
    for pilot in (level, tilted):
        pilot.body.attitude[0] = torch.tensor([math.cos(0.2), 0, math.sin(0.2), 0]).double()
        pictures.append(pilot.picture())
    assert torch.equal(pictures[0], Pilot(worlds=Worlds(1, camera=camera)).picture())
    assert (pictures[0] != pictures[1]).any()


def test_images_of_several_types_and_cameras():
    worlds = Worlds(1, camera=CameraSettings(width=64, height=24))
    worlds.reset(torch.tensor([0]), [np.random.RandomState(0)])
    pilot = Pilot(worlds=worlds)
    asked = [
        ImageRequest(),
        ImageRequest("bottom_center", ImageType.DEPTH_PLANAR, as_float=True),
        ImageRequest(4, ImageType.SEGMENTATION),
    ]
    scene, below, behind = pilot.images(asked)
    assert torch.equal(scene, pilot.picture())
    assert below.tolist() == [[pytest.approx(0.2)] * 64] * 24  # 0.1 m below 0.3 m
    assert behind.dtype == torch.uint8 and behind.shape == (24, 64, 3)
    (small,) = pilot.images(asked[:1], height=6, width=8)
    assert small.shape == (6, 8, 3)


def test_what_stands_in_its_worlds_is_in_the_way():
    pillars = Worlds(
        1, PillarsSettings(), dynamics=DynamicsSettings(mode="simple_flight", mass=1.1)
    )
    pillars.reset(torch.tensor([0]), [np.random.RandomState(0)])
    x, y, _ = pillars.task.places(pillars.state)[0, 0].tolist()
    pilot = Pilot(worlds=pillars, start=(x - 3, y))
    assert pilot.settings.mass == 1.1
    pilot.arm()
    pilot.take_off()
    assert pilot.move_to(x + 3, y, 2, speed=2, timeout=8) is False
    assert pilot.state.collision.thing.startswith("obstacle")
    assert pilot.trajectory.positions[:, 0].max() < x


def test_without_worlds_there_is_nothing_to_see(flying):
    with pytest.raises(PilotError, match="picture: there is nothing to render; give worlds"):
        flying.picture()
    with pytest.raises(PilotError, match="images: there is nothing to render; give worlds"):
        flying.images([ImageRequest()])
