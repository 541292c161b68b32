"""Poses without dynamics, keys, objects by name, reset and API control."""

import math

import pytest

import drone_rl
from drone_rl.flight.commands.drone import KEYS, STEP, TURN
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


@pytest.fixture
def pilot():
    return drone_rl.Pilot(mode="computer_vision", start=(1.0, 2.0, 3.0), worlds=Worlds(1))


def test_a_pose_is_set_with_airsims_signs(pilot):
    state = pilot.set_pose([4, -5, 6], roll=10, pitch=20, yaw=30)
    assert state.position == (4.0, -5.0, 6.0)
    angles = state.attitude
    assert (angles.roll, angles.pitch, angles.yaw) == pytest.approx((10, 20, 30))
    assert float(pilot.body.heading) == pytest.approx(-math.radians(30))


@pytest.mark.parametrize(
    ("key", "change"),
    [
        # at a yaw of 90 degrees the drone faces -y
        ("forward", (0, -STEP, 0)),
        ("backward", (0, STEP, 0)),
        ("left", (STEP, 0, 0)),
        ("right", (-STEP, 0, 0)),
        ("up", (0, 0, STEP)),
        ("down", (0, 0, -STEP)),
    ],
)
def test_keys_move_in_the_heading(pilot, key, change):
    pilot.set_pose([0, 0, 5], yaw=90)
    found = pilot.press(key, 2).position
    assert found == pytest.approx([2 * d + p for d, p in zip(change, (0, 0, 5), strict=True)])


@pytest.mark.parametrize("key", [key for key in KEYS if "_" in key])
def test_keys_turn(pilot, key):
    angle, side = key.split("_")
    pilot.set_pose([0, 0, 5], roll=1, pitch=2, yaw=3)
    sign = 1 if side in ("right", "up") else -1
    expected = {"roll": 1.0, "pitch": 2.0, "yaw": 3.0}
    expected[angle] += sign * TURN
    found = pilot.press(key).attitude
    assert vars(found) == pytest.approx(expected)


def test_keys_with_the_nose_straight_up(pilot):
    """The drone keeps its heading, and moves in it."""
    pilot.set_pose([0, 0, 5], yaw=15)
    for _ in range(18):
        pilot.press("pitch_up")
    assert vars(pilot.state.attitude) == pytest.approx({"roll": 0, "pitch": 90, "yaw": 15})
    forward, right = STEP * math.cos(math.radians(15)), STEP * math.sin(math.radians(15))
    assert pilot.press("forward").position == pytest.approx((forward, -right, 5))
    for _ in range(18):
        pilot.press("pitch_down")
    assert vars(pilot.state.attitude) == pytest.approx({"roll": 0, "pitch": 0, "yaw": 15}, abs=1e-6)


def test_a_compressed_image_is_a_png_file(pilot):
    (image,) = pilot.images([drone_rl.ImageRequest(0, 0, False, True)])
    assert bytes(image[:8].tolist()) == b"\x89PNG\r\n\x1a\n"
    with pytest.raises(InputError, match="both given"):
        drone_rl.ImageRequest(0, 0, True, True)


def test_objects_have_names_and_positions(pilot):
    assert pilot.object_names == ("cube_0", "cube_1", "cube_2")
    pilot.set_object_position("cube_1", [9, 8, 7])
    assert pilot.object_position("cube_1") == (9.0, 8.0, 7.0)
    pilot.worlds.state.present[0, 1] = False
    assert all(map(math.isnan, pilot.object_position("cube_1")))
    with pytest.raises(InputError, match="did you mean cube_1"):
        pilot.object_position("cube1")


def test_reset_restores_drone_objects_and_time(pilot):
    place = pilot.object_position("cube_0")
    pilot.set_object_position("cube_0", [9, 8, 7])
    pilot.press("forward")
    pilot.advance(1.0)
    for _ in range(2):
        state = pilot.reset()
        assert (state.position, state.time) == ((1.0, 2.0, 3.0), 0.0)
        assert pilot.object_position("cube_0") == place
        pilot.press("up")
        pilot.advance(0.5)


def test_a_moved_pillar_is_felt_where_it_stands_until_a_reset():
    """Pillar 0 is put over the drone, which then touches it and, after the reset, does not."""
    pilot = drone_rl.Pilot(worlds=Worlds(1, "pillars"))
    height = pilot.object_position("pillar_0")[2]
    pilot.advance(0.1)
    assert pilot.state.collision is None or pilot.state.collision.thing == "ground"
    pilot.set_object_position("pillar_0", [0.1, 0.0, height])
    pilot.advance(0.1)
    assert pilot.state.collision.thing == "obstacle 0"
    pilot.reset()
    pilot.advance(0.1)
    assert pilot.state.collision is None or pilot.state.collision.thing == "ground"


def test_movements_are_refused(pilot):
    for command in (pilot.arm, pilot.take_off, pilot.land, lambda: pilot.move_to(0, 0, 1)):
        with pytest.raises(drone_rl.PilotError, match="no dynamics; use set_pose or press"):
            command()


def test_a_flying_drone_is_not_put_elsewhere():
    with pytest.raises(drone_rl.PilotError, match="the drone has dynamics"):
        drone_rl.Pilot().set_pose([0, 0, 1])


def test_commands_need_api_control(flying):
    flying.enable_api_control(False)
    with pytest.raises(drone_rl.PilotError, match="API control is off"):
        flying.hover()
    flying.enable_api_control()
    assert flying.hover(0.1) and flying.has_api_control


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda p: p.set_pose([0, 0, math.nan]), r"position\[2\]=nan"),
        (lambda p: p.press("foward"), "did you mean forward"),
        (lambda p: drone_rl.Pilot(mode="car"), "mode='car'"),
    ],
)
def test_invalid_poses_and_keys(pilot, act, message):
    with pytest.raises(InputError, match=message):
        act(pilot)
