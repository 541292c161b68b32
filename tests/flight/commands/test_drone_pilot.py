import math

import numpy as np
import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.checks import radians, time_limit
from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError


def test_it_begins_on_the_ground_disarmed(quadrotor):
    pilot = Pilot(quadrotor, start=(3, -2), yaw=30)
    state = pilot.state
    assert state.position == (3, -2, 0.3)
    assert state.attitude.yaw == pytest.approx(30)
    assert (state.armed, state.landed, state.collision) == (False, "landed", None)
    assert (pilot.time, pilot.running) == (0.0, None)


def test_settings_one_by_one():
    pilot = Pilot(DynamicsSettings(mass=1.2), wind=[5, 0, 0])
    assert pilot.settings.wind == (5.0, 0.0, 0.0)
    assert (pilot.settings.mass, pilot.settings.mode) == (1.2, "simple_flight")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"wind": [math.nan, 0, 0]}, "wind"),
        ({"mass": -1}, "mass=-1"),
        ({"mass": 3}, "too small to control"),
        ({"wings": 2}, "wings is unknown"),
        ({"start": (0, 0, 5)}, r"start=\(0, 0, 5\) is invalid; give 2 numbers"),
        ({"start": 5}, "start=5 is invalid"),
        ({"start": 5, "mode": "computer_vision"}, "start=5 is invalid"),
        ({"seed": 0.5}, "seed=0.5"),
        ({"sensors": True}, "sensors=True is no SensorSettings"),
        ({"yaw": "north"}, "yaw='north'"),
        ({"start": (0, math.inf)}, r"start\[1\]=inf"),
    ],
)
def test_what_can_be_no_drone(given, told):
    with pytest.raises(InputError, match=told):
        Pilot(**given)


def test_a_drone_with_strong_rotors_counts_as_flying():
    pilot = Pilot(mass=0.1)  # hovers at 6% of the thrust
    pilot.arm()
    assert pilot.take_off()
    assert pilot.state.landed == "flying"
    assert pilot.move_to(2, 0, 3, speed=2)
    assert pilot.land() and pilot.state.landed == "landed"


def test_what_does_not_go_together(quadrotor):
    with pytest.raises(InputError, match="mass and a Quadrotor are given"):
        Pilot(quadrotor, mass=1.1)
    with pytest.raises(InputError, match="worlds has 2 worlds"):
        Pilot(worlds=Worlds(2))


def test_no_arming_and_no_disarming_in_the_air(flying):
    with pytest.raises(PilotError, match="can't disarm in the air"):
        flying.disarm()
    flying.disarm(force=True)
    assert not flying.state.armed
    flying.advance(0.1)
    with pytest.raises(PilotError, match="can't arm in the air"):
        flying.arm()
    flying.advance(5.0)
    assert flying.state.landed == "landed"
    flying.arm()
    assert flying.state.armed


def test_commands_of_a_drone_that_is_not_armed_or_does_not_fly():
    pilot = Pilot()
    for command in (pilot.take_off, pilot.land, pilot.go_home, pilot.hover):
        with pytest.raises(PilotError, match=r"isn't armed; call arm\(\) first"):
            command()
    pilot.arm()
    with pytest.raises(PilotError, match=r"hover: the drone is on the ground; call take_off"):
        pilot.hover()


def test_a_lost_drone_is_told_nothing(flying):
    flying.body.velocity[0, 0] = math.nan
    flying.advance(0.1)
    assert flying.state.lost
    with pytest.raises(PilotError, match="simulation has diverged; make a new Pilot"):
        flying.hover()


def test_time_passes_as_it_is_told(flying):
    before = flying.time
    assert flying.advance(0.3).time == pytest.approx(before + 0.3)
    with pytest.raises(InputError, match="seconds=-1"):
        flying.advance(-1)


def test_the_running_command_ends_with_the_block(flying):
    with flying as pilot:
        future = pilot.hover(9.0, wait=False)
        assert pilot.running is future
    assert future.cancelled


def test_cancelling(flying):
    future = flying.move_to(9, 0, 3, wait=False)
    flying.advance(0.5)
    flying.cancel()
    assert (future.cancelled, flying.running) == (True, None)


def test_limits():
    assert time_limit(None, 10.0, 2.0) == 25.0
    assert time_limit(3, 10.0, 2.0) == 3.0
    assert radians(180, "yaw") == pytest.approx(math.pi)
    with pytest.raises(InputError, match="timeout=-1"):
        time_limit(-1, 10.0, 2.0)


def test_a_way_may_take_three_times_as_long_as_it_should_and_10_s():
    assert time_limit(None, 12.0, 4.0) == 19.0
    assert time_limit(0.5, 12.0, 4.0) == 0.5
    with pytest.raises(InputError, match=r"timeout=-0\.5"):
        time_limit(-0.5, 12.0, 4.0)


def test_in_a_world_it_is_the_drone_of_that_world_unless_another_is_given():
    heavy = DynamicsSettings(mode="simple_flight", mass=1.25)
    worlds = Worlds(1, dynamics=heavy)
    worlds.reset(torch.tensor([0]), [np.random.RandomState(0)])
    assert Pilot(worlds=worlds).settings.mass == 1.25
    assert Pilot(heavy.replace(mass=1.1), worlds=worlds).settings.mass == 1.1
    worlds.close()
