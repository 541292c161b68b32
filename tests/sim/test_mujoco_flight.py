"""MuJoCo simulates the same drone as the batch."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings, PillarsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.composer_task import ComposerTask, make_environment
from drone_rl.sim.dynamics import FlightState, Mode, Obstacles, Quadrotor
from drone_rl.sim.dynamics.state import GROUND, NOTHING
from drone_rl.utils.seeding import world_random_state
from tests.flying import (
    POSITIONS,
    VELOCITIES,
    angles,
    degrees_between,
    doubles,
    make_goals,
    matrix,
    quadrotor,
    settings,
)

DROP = (Mode.ROTOR,) * 4
FAR = doubles((50.0, 50.0, 3.0))


class Both:
    """One drone in the batch and in MuJoCo, with the same pillars."""

    def __init__(self, place, **changes):
        self.drone = quadrotor(**changes)
        rules = PillarsSettings(num_rows=1)
        self.env = make_environment(
            rules, dynamics=self.drone, pixels=False, random_state=world_random_state(0, 0)
        )
        self.env.reset()
        self.flight, self.physics = self.env.task._flight, self.env.physics
        self.here = self.drone.start(doubles(place))
        self.flight.begin(self.physics, self.here)
        self.there = self.here
        frames = self.env.task._frames
        self.count = len(frames)
        self.half = tuple(self.physics.named.model.geom_size["pillar_0/geom"])
        self.move([(50.0, 50.0 + i, 3.0) for i in range(self.count)])

    def move(self, places):
        """Move the pillars."""
        for frame, place in zip(self.env.task._frames, places, strict=True):
            self.physics.bind(frame).mocap_pos = place
        self.obstacles = Obstacles(doubles(*places)[None], self.half)
        self.physics.forward()

    def fly(self, goals, ticks):
        for first in range(0, ticks, 33):
            self.here = self.drone.fly(self.here, goals, min(33, ticks - first), self.obstacles)
        self.flight.set_goals(self.physics, self.there, goals)
        for _ in range(ticks):
            self.flight.push(self.physics)
            self.physics.step()
            self.flight.record_contacts(self.physics)
        self.there = self.flight.finished(self.physics)
        return self

    def apart(self):
        """Return the differences in meters and degrees."""
        turn = degrees_between(matrix(self.here.attitude[0]), matrix(self.there.attitude[0]))
        return float((self.here.position - self.there.position).norm()), turn


FLIGHTS = {
    "step": ((POSITIONS, (3.0, -2.0, 1.0, 21.0)), (POSITIONS, (0.0, 0.0, -2.0, 20.0))),
    "roll": (
        ((Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION), (0.7, -0.4, 0.5, 20.0)),
        ((Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION), (-0.7, 0.4, 0.0, 20.0)),
    ),
    "speed": ((VELOCITIES, (3.0, 1.0, 0.5, 0.5)), (VELOCITIES, (-1.0, 2.0, -0.5, 0.0))),
}


WINDY = {"wind": (4.0, -3.0, 0.5), "gusts": 1.0}


@pytest.mark.parametrize(("name", "air"), [("roll", {}), *((name, WINDY) for name in FLIGHTS)])
def test_trajectories_in_the_air_agree(name, air):
    """After 4 s they agree within 1 mm and 0.01 degrees."""
    both = Both((0.0, 0.0, 20.0), **air)
    for modes, goal in FLIGHTS[name]:
        both.fly(make_goals(modes, *goal), 660)
    metres, degrees = both.apart()
    assert metres < 0.001 and degrees < 0.01
    torch.testing.assert_close(both.there.velocity, both.here.velocity, atol=1e-3, rtol=0)
    torch.testing.assert_close(both.there.reference, both.here.reference, atol=1e-3, rtol=0)
    torch.testing.assert_close(both.there.gust, both.here.gust, atol=1e-3, rtol=0)
    assert both.there.ticks.tolist() == [1320] and both.there.contact.thing.tolist() == [NOTHING]


def test_both_simulators_land_and_rest_level():
    """They descend at 0.5 m/s, then rotors stop."""
    both = Both((0.0, 0.0, 1.5))
    both.fly(make_goals(VELOCITIES, 0.3, 0.0, 0.0, -0.5), 990).fly(
        make_goals(DROP, 0, 0, 0, 0), 990
    )
    for state in (both.here, both.there):
        assert float(state.position[0, 2]) == pytest.approx(0.3, abs=0.005)
        assert float(state.velocity.norm()) < 0.01 and float(angles(state)[0, :2].norm()) < 0.01
        assert state.contact.thing.tolist() == [GROUND]
        assert float(state.contact.normal[0, 2]) == pytest.approx(1.0, abs=1e-6)
    assert both.apart()[0] < 0.2


def test_both_simulators_bounce_off_a_pillar():
    """The goal is on the other side of a pillar."""
    both = Both((0.0, 0.0, 2.0))
    both.move([(4.0, 0.0, both.half[2])] + [(50.0, 50.0 + i, 3.0) for i in range(both.count - 1)])
    both.fly(make_goals(POSITIONS, 8.0, 0.0, 0.0, 2.0), 700)
    for state in (both.here, both.there):
        contact = state.contact
        assert contact.thing.tolist() == [0]
        assert 0.5 < float(contact.time) <= 2.1  # seconds, of 700 ticks
        np.testing.assert_allclose(contact.normal[0], (-1, 0, 0), atol=1e-3)
        face = 4.0 - both.half[0]
        np.testing.assert_allclose(contact.point[0], (face, 0.0, 2.0), atol=0.1)
        assert float(state.position[0, 0]) < face - 0.29
    both.fly(make_goals(POSITIONS, 0.0, 0.0, 0.0, 2.0), 2000)
    assert both.apart()[0] < 0.1
    np.testing.assert_allclose(both.there.position, both.here.position, atol=0.1)


def test_bounce_height_follows_from_restitution():
    """After a drop of 1 m, 0.55 of the speed is 0.3 of the height."""
    both = Both((0.0, 0.0, 1.3), air_density=0.0)
    heights = {"here": [], "there": []}
    for _ in range(40):
        both.fly(make_goals(DROP, 0, 0, 0, 0), 10)
        heights["here"].append(float(both.here.position[0, 2]))
        heights["there"].append(float(both.there.position[0, 2]))
    tops = [max(list_[15:30]) - 0.3 for list_ in heights.values()]
    assert tops == pytest.approx([0.55**2] * 2, rel=0.2)


@pytest.mark.parametrize("task", [None, PillarsSettings()])
def test_environment_flies_like_the_batch(task):
    drone = quadrotor(gusts=0.5)
    env = make_environment(task, dynamics=drone, pixels=False, random_state=3)
    env.reset()
    assert env.control_timestep() == pytest.approx(0.099)
    assert env.physics.timestep() == pytest.approx(0.003)
    state = FlightState(env.task.state.body.numbers.clone())
    for action in (Move.FORWARD, Move.LEFT, Move.FORWARD, Move.RIGHT, Move.RIGHT) * 3:
        env.step(action)
        state = drone.step(state, torch.tensor([action]))
    found = env.task.state.body
    torch.testing.assert_close(found.numbers, state.numbers, atol=1e-3, rtol=0)
    env.reset()
    assert env.task.state.body.position.tolist() == [[0, 0, 2.5]]
    assert not env.task.state.body.velocity.any()


def test_environment_supports_velocities():
    drone = Quadrotor(settings(), ActionSettings(kind="velocity"))
    env = make_environment(dynamics=drone, pixels=False, random_state=3)
    env.reset()
    state = FlightState(env.task.state.body.numbers.clone())
    for action in ((0.5, 0.3, -0.4), (1.0, -1.0, 0.8)) * 5:
        env.step(np.array(action))
        state = drone.step(state, torch.tensor([action], dtype=drone.actions.entry.dtype))
    torch.testing.assert_close(env.task.state.body.numbers, state.numbers, atol=1e-3, rtol=0)


def test_externally_moved_drone_keeps_its_position():
    env = make_environment(dynamics=quadrotor(), pixels=False, random_state=3)
    env.reset()
    env.task.drone.set_pose(env.physics, (1.0, 2.0, 3.0), (1, 0, 0, 0))
    env.step(Move.LEFT)
    np.testing.assert_allclose(env.task.state.body.reference, [[1.0, 2.396, 0, 3]], atol=1e-6)


@pytest.mark.parametrize(("mount", "is_level"), [("gimbal", True), ("body", False)])
def test_gimballed_cameras_stay_level(mount, is_level):
    both = Both((0.0, 0.0, 20.0), camera_mount=mount)
    modes = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
    both.fly(make_goals(modes, 0.3, 0.2, 0.8, 20.0), 660)
    both.physics.forward()
    camera = both.physics.named.data.cam_xmat["drone/front_center"].reshape(3, 3)
    ahead, tilt = -camera[:, 2], angles(both.there)[0]
    assert float(tilt[0]) == pytest.approx(0.3, abs=0.02)
    heading = np.array([math.cos(tilt[2]), math.sin(tilt[2])])
    assert (abs(ahead[2]) < 1e-6) == is_level and (abs(camera[2, 0]) < 1e-6) == is_level
    np.testing.assert_allclose(ahead[:2] / np.linalg.norm(ahead[:2]), heading, atol=0.05)


def test_other_modes_disable_physics():
    task = ComposerTask(pixels=False)
    assert task._flight is None and task.control_timestep == 0.1
    assert not np.any(task.root_entity.mjcf_model.option.gravity)
