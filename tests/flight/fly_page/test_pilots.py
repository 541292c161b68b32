"""How controls and the policy move the drone."""

import math

import pytest
import torch

from drone_rl.config import ActionSettings
from drone_rl.config.networks import SmallCnn
from drone_rl.flight.fly_page.pilots import Controls, make_pilot
from drone_rl.sim.dynamics import FlightState
from tests.untrained import untrained


class Steps(list):
    """The steps that a pilot has taken."""

    def note(self, readings, action, reward):
        self.append((tuple(readings["pixels"].shape), action.tolist(), reward))


def fly(pilot, controls, seconds, speed=4.0, period=0.025):
    """Let time pass as the page does."""
    for _ in range(round(seconds / period)):
        controls.advance(period)
        pilot.advance(period, controls, speed)


def place(world):
    return world.body.position[0].tolist()


def test_controls_note_each_press_once_and_repeat_after_a_while():
    controls = Controls()
    controls.hold(["left"])
    controls.hold(["left", "forward"])
    controls.hold(["left"])
    assert controls.presses == ["left", "forward"]
    assert controls.axes == [0.0, 1.0, 0.0, 0.0]
    controls.advance(0.29)
    assert controls.repeating == []
    controls.advance(0.02)
    assert controls.repeating == ["left"]
    controls.release()
    assert controls.presses == [] and controls.repeating == [] and not any(controls.axes)


def test_opposite_keys_cancel():
    controls = Controls()
    controls.hold(["forward", "backward", "right"])
    assert controls.axes == [0.0, -1.0, 0.0, 0.0]


def test_the_policy_acts_at_the_speed(make_world):
    world, steps = make_world(), Steps()
    pilot = make_pilot("policy", world, steps.note)
    fly(pilot, Controls(), 1.0)
    assert len(steps) == 4 and sum(map(abs, place(world)[:2])) == 4.0
    fly(pilot, Controls(), 1.0, speed=2.0)
    assert len(steps) == 6
    assert steps[0][0] == (1, 25, 64, 3)


def test_a_press_is_one_action_and_time_stands_still_between(make_world):
    world, steps, controls = make_world(), Steps(), Controls()
    pilot = make_pilot("actions", world, steps.note)
    fly(pilot, controls, 2.0)
    assert steps == []
    controls.hold(["forward"])
    fly(pilot, controls, 0.1)
    controls.hold([])
    controls.hold(["left"])
    fly(pilot, controls, 0.1)
    controls.hold(["backward"])  # no action of this policy
    fly(pilot, controls, 1.0)
    assert [action for _, action, _ in steps] == [[0], [1]]
    assert place(world) == [1.0, 1.0, 2.5]


def test_a_held_key_repeats_the_action_at_the_speed(make_world):
    world, steps, controls = make_world(), Steps(), Controls()
    pilot = make_pilot("actions", world, steps.note)
    controls.hold(["forward"])
    fly(pilot, controls, 1.325, speed=4.0)  # one at once, then from 0.3 s on every 0.25 s
    assert len(steps) == 5
    controls.hold(["forward", "right"])
    fly(pilot, controls, 0.1)
    assert steps[-1][1] == [2]


@pytest.mark.parametrize(
    ("kind", "keys", "expected"),
    [
        ("moves_turning", ["left", "yaw_right", "backward"], [[1], [2]]),  # it has no moves back
        ("moves_full", ["left", "yaw_right", "backward", "up"], [[1], [7], [5], [3]]),
    ],
)
def test_keys_choose_turns(make_world, kind, keys, expected):
    network = SmallCnn(channels=(2,), hidden=(4,))
    world = make_world(untrained(network, actions=ActionSettings(kind=kind)))
    world.move(world.body.moved(world.body.position, torch.tensor([[0.8, 0, 0, 0.6]]).double()))
    steps, controls = Steps(), Controls()
    pilot = make_pilot("actions", world, steps.note)
    assert world.body.attitude[0].tolist() == pytest.approx([0.8, 0, 0, 0.6])  # it stays turned
    for key in keys:
        controls.hold([key])
        fly(pilot, controls, 0.05)
        controls.hold([])
    assert [action for _, action, _ in steps] == expected


def test_continuous_actions_follow_keys(make_world):
    world, steps, controls = make_world("flight_velocity"), Steps(), Controls()
    pilot = make_pilot("actions", world, steps.note)
    fly(pilot, controls, 0.5)
    assert steps == []
    controls.hold(["forward", "yaw_right"])
    fly(pilot, controls, 0.05)
    assert steps == [((1, 25, 64, 3), [[1.0, 0.0, -1.0]], 0.0)]
    controls.hold(["left"])
    fly(pilot, controls, 0.2)
    assert steps[-1][1] == [[-1.0, 1.0, 0.0]] and len(steps) in (2, 3)


def test_computer_vision_keys_step_the_pose(make_world):
    world, controls = make_world(), Controls()
    pilot = make_pilot("computer_vision", world, Steps().note)
    controls.hold(["forward"])
    fly(pilot, controls, 0.1)
    assert place(world) == pytest.approx([0.25, 0.0, 2.5])
    controls.hold(["yaw_left"])
    fly(pilot, controls, 0.1)
    controls.hold(["up"])
    fly(pilot, controls, 0.1)
    assert place(world) == pytest.approx([0.25, 0.0, 2.75])
    assert float(world.body.heading[0]) == pytest.approx(math.radians(5.0))
    assert world.worlds.state.steps.tolist() == [0]  # no time passes


def test_walls_of_a_scene_file_stop_keys_and_velocities(make_world):
    """For ten seconds at 4 m/s, in a house of 10 m."""
    for mode in ("computer_vision", "simple_flight"):
        world, controls = make_world(untrained(SmallCnn(), task={"name": "reach"})), Controls()
        pilot = make_pilot(mode, world, Steps().note)
        controls.hold(["forward"])
        fly(pilot, controls, 10.0)
        solids = world.task.solids(world.worlds.state).solids
        away = float(solids.distances(world.body.position))
        radius = world.task.drone_size / 2
        assert away == pytest.approx(radius, abs=0.2) and away >= radius - 1e-4


def test_velocities_accelerate_the_drone_and_letting_go_stops_it(make_world):
    world, controls = make_world(), Controls()
    pilot = make_pilot("simple_flight", world, Steps().note)
    fly(pilot, controls, 1.0)
    assert place(world) == pytest.approx([0.0, 0.0, 2.5], abs=0.05)  # it hovers
    controls.hold(["forward"])
    fly(pilot, controls, 3.0, speed=3.0)
    assert world.body.velocity[0].tolist() == pytest.approx([3.0, 0.0, 0.0], abs=0.4)
    assert isinstance(world.body, FlightState)
    controls.hold([])
    fly(pilot, controls, 5.0)
    assert float(world.body.velocity.norm()) < 0.1
    before = place(world)
    fly(pilot, controls, 2.0)
    assert place(world) == pytest.approx(before, abs=0.1)


def test_velocities_are_those_of_the_heading(make_world):
    world, controls = make_world(), Controls()
    pilot = make_pilot("simple_flight", world, Steps().note)
    controls.hold(["yaw_left"])
    fly(pilot, controls, 1.5)  # 60 degrees a second
    assert float(world.body.heading[0]) == pytest.approx(math.radians(90.0), abs=0.3)
    controls.hold(["forward"])
    fly(pilot, controls, 2.0)
    x, y, _ = place(world)
    assert y > 3.0 and abs(x) < 0.4 * y


def test_the_drone_lands_and_takes_off(make_world):
    world, controls = make_world(), Controls()
    pilot = make_pilot("simple_flight", world, Steps().note)
    fly(pilot, controls, 0.2)
    pilot.land()
    fly(pilot, controls, 16.0)
    assert place(world)[2] == pytest.approx(0.3, abs=0.05)  # the radius of its ball
    pilot.take_off()
    fly(pilot, controls, 8.0)
    assert place(world)[2] == pytest.approx(2.3, abs=0.25)
    controls.hold(["up"])
    fly(pilot, controls, 2.0)
    assert place(world)[2] > 4.0


def test_wind_drifts_a_braking_drone_and_can_change(make_world):
    world, controls = make_world(), Controls()
    pilot = make_pilot("simple_flight", world, Steps().note)
    world.set_wind(8.0, 270.0)  # from the left, to the right
    fly(pilot, controls, 3.0)
    assert place(world)[1] < -0.1
    world.set_wind(0.0, 0.0)
    fly(pilot, controls, 6.0)
    assert place(world) == pytest.approx([0.0, 0.0, 2.5], abs=0.1)  # it holds its place


def test_it_takes_over_a_flying_drone_with_its_speed(make_world):
    world, steps = make_world("flight"), Steps()
    fly(make_pilot("policy", world, steps.note), Controls(), 2.0)
    speed = world.body.velocity[0].tolist()
    assert speed[0] > 1.0
    make_pilot("simple_flight", world, steps.note)
    assert world.body.velocity[0].tolist() == speed


def test_pillars_stop_a_flying_drone(make_world):
    world, controls = make_world("pillars_good"), Controls()
    x, y, _ = next(place for place in world.objects if place)
    start = torch.tensor([[x - 4.0, y, 2.0]]).double()
    world.move(world.body.moved(start))
    pilot = make_pilot("simple_flight", world, Steps().note)
    controls.hold(["forward"])
    fly(pilot, controls, 4.0)
    assert place(world)[0] < x
