import math

import numpy as np
import pytest
import torch

from drone_rl.config import CameraSettings, DynamicsSettings, PillarsSettings
from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.path_following import YawMode
from drone_rl.flight.commands.pilot import Pilot, Sticks
from drone_rl.flight.image_types import ImageRequest, ImageType
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


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


def test_taking_off_and_landing():
    pilot = Pilot(start=(1, 1))
    pilot.arm()
    assert pilot.take_off() is True
    pilot.advance(3.0)
    assert pilot.state.position == pytest.approx((1, 1, 2.3), abs=0.02)
    assert pilot.state.landed == "flying"
    assert pilot.land() is True
    assert pilot.state.landed == "landed"
    assert pilot.state.position == pytest.approx((1, 1, 0.3), abs=0.02)
    pilot.disarm()
    assert not pilot.state.armed


def test_nobody_takes_off_while_moving(flying):
    flying.move_by_velocity(1, 0, 0, 1)
    with pytest.raises(PilotError, match="can't take off while moving at 0"):
        flying.take_off()


def test_going_home(flying):
    assert flying.move_to(4, 3, 2.3, speed=2) is True
    assert flying.go_home(speed=2) is True
    assert flying.state.landed == "landed"
    assert flying.state.position == pytest.approx((0, 0, 0.3), abs=0.05)


def test_going_home_takes_no_longer_than_it_may(flying):
    before = flying.time
    assert flying.go_home(timeout=1.05) is False
    assert flying.time == pytest.approx(before + 1.05, abs=0.021)


def test_the_same_commands_give_the_same_flight():
    def fly(seed):
        with Pilot(gusts=2.0, seed=seed) as pilot:
            pilot.arm()
            pilot.take_off()
            return pilot.state.position

    assert fly(1) == fly(1)
    assert fly(1) != fly(2)


def test_to_a_place_and_to_a_height(flying):
    assert flying.move_to(3, 0, 2, speed=2, drivetrain="forward_only") is True
    assert flying.move_to_z(4) is True
    flying.advance(5.0)
    assert flying.state.position[2] == pytest.approx(4, abs=0.02)


def test_turning(flying):
    assert flying.rotate_to(-90, margin=1) is True
    assert flying.state.attitude.yaw == pytest.approx(-90, abs=1)
    assert flying.rotate_by(90, 1) is True
    assert flying.state.attitude.yaw > -40
    assert flying.rotate_to(90, timeout=0.1) is False


def test_sticks_are_read_while_time_passes(flying):
    flight = flying.move_by_manual(4, 4, 1, 4, wait=False)
    flying.sticks = Sticks(pitch=0.5)
    flying.advance(2.0)
    assert flying.state.velocity[0] > 1.5
    flying.sticks = Sticks(roll=0.5)
    assert flight.result() is True
    assert flying.state.velocity[1] < -1.0


@pytest.mark.parametrize(
    ("name", "given", "choices", "told"),
    [
        ("move_along", ([],), {}, "has no points"),
        ("move_along", ([(1, 2, 3), (0, math.nan, 1)],), {}, r"path\[1\]\[1\]=nan"),
        ("move_to", (1, 2, -3), {}, r"path\[0\]\[2\]=-3"),
        ("move_to", (1, 2, 3), {"lookahead": 0}, "lookahead=0 is too short"),
        (
            "move_to",
            (1, 2, 3),
            {"drivetrain": "forward_only", "yaw_mode": YawMode(True, 5)},
            "turns at a rate",
        ),
        ("move_by_velocity", (1, 0, 1), {"z": 3}, "z=3.0 and vz=1 are both given"),
        ("move_by_angle", (0, 0, 1), {"z": 3, "throttle": 0.5}, "z=3.0 and throttle=0.5"),
        ("move_by_angle", (0, 0, 1), {"yaw": 3, "yaw_rate": 2}, "yaw=3.0 and yaw_rate=2.0"),
        ("move_by_manual", (0, 1, 1, 1), {}, "vx_max=0"),
    ],
)
def test_what_is_refused_before_anything_moves(flying, name, given, choices, told):
    before = flying.time
    with pytest.raises(InputError, match=told) as error:
        getattr(flying, name)(*given, **choices)
    assert not isinstance(error.value, PilotError)
    assert "\n" not in str(error.value)
    assert flying.time == before
