"""Bounces, friction and boxes."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import Obstacles
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import GROUND, NOTHING
from tests.flying import doubles, falling, quadrotor

NONE = doubles((0.0, 0.0, 0.0, 0.0))
VACUUM = {"air_density": 0.0}


def flown(drone, state, ticks, obstacles=None, rotors=NONE):
    return drone.fly(state, rotor_goals(rotors), ticks, obstacles)


def pillar(*centers, half=(0.5, 0.5, 5.0)):
    return Obstacles(doubles(*centers)[None], half)


@pytest.mark.parametrize("restitution", [0.0, 0.55, 1.0])
def test_bounce_returns_the_restitution_of_the_speed(restitution):
    """Thrown at 2 m/s from 3 mm above contact, it moves up after two ticks."""
    drone = quadrotor(restitution=restitution, friction=0.0, **VACUUM)
    after = flown(drone, falling(0.303, (1.0, 0.0, -2.0)), 1)
    into = 2.0 + 9.81 * 0.003
    np.testing.assert_allclose(after.velocity[0], (1.0, 0.0, restitution * into), atol=1e-5)
    assert float(after.position[0, 2]) == pytest.approx(0.3, abs=1e-6)


def test_friction_includes_the_impulse_of_the_bounce():
    """Coulomb friction: the tangential loss is 0.2 times the normal impulse, 1.5 of the speed."""
    drone = quadrotor(restitution=0.5, friction=0.2, **VACUUM)
    after = flown(drone, falling(0.303, (3.0, 0.0, -2.0)), 1)
    into = 2.0 + 9.81 * 0.003
    expected = (3.0 - 0.2 * 1.5 * into, 0.0, 0.5 * into)
    np.testing.assert_allclose(after.velocity[0], expected, atol=1e-5)


def test_slide_distance_follows_from_friction():
    """The distance is v^2 / (2 mu g) up to one tick."""
    for friction in (0.5, 0.25):
        drone = quadrotor(friction=friction, **VACUUM)
        after = flown(drone, falling(0.3, (2.0, -1.0, 0.0)), 1000)
        path = 5.0 / (2 * friction * 9.81)
        expected = path * np.array([2.0, -1.0]) / math.sqrt(5.0)
        np.testing.assert_allclose(after.position[0, :2], expected, rtol=0.02)
        assert not after.velocity.any()


def test_drone_rests_level_at_its_radius():
    drone = quadrotor()
    state = falling(3.0, (1.0, 0.5, 0.0), rates=(1.0, 2.0, 3.0))
    after = flown(drone, state, 3000)
    assert float(after.position[0, 2]) == pytest.approx(0.3, abs=1e-6)
    assert not after.velocity.any() and not after.angular_velocity.any()
    assert after.attitude[0, 1:3].tolist() == [0.0, 0.0]  # the heading is kept
    assert float(after.attitude.norm()) == pytest.approx(1.0, abs=1e-6)
    assert after.contact.thing.tolist() == [GROUND]
    again = flown(drone, after, 3000)
    np.testing.assert_allclose(again.position, after.position, atol=1e-6)


def test_rotors_lift_the_drone_off_the_ground():
    drone = quadrotor()
    rested = flown(drone, falling(0.3), 100)
    risen = flown(drone, rested, 333, rotors=doubles((0.7,) * 4))
    assert float(risen.position[0, 2]) > 0.6


def test_obstacle_reflects_the_drone_and_is_recorded():
    """A ball of 0.3 m at 2 m/s, 1 m in front of a box, hits it after 0.35 s."""
    drone = quadrotor(**VACUUM)
    boxes = pillar((0.0, 50.0, 100.0), (2.0, 0.0, 98.0))
    state = falling(100.0, (2.0, 0.0, 0.0))
    state.position[0, 0] = 0.2
    after = flown(drone, state, 300, boxes)
    assert float(after.velocity[0, 0]) == pytest.approx(-1.1, abs=1e-5)
    contact = after.contact
    assert contact.thing.tolist() == [1] and contact.normal.tolist() == [[-1, 0, 0]]
    assert float(contact.time) == pytest.approx(0.5, abs=0.004)
    assert float(contact.point[0, 0]) == pytest.approx(1.5, abs=1e-5)
    assert 0.0 <= float(contact.depth) <= 2.0 * 0.003
    assert float(after.position[0, 0]) == pytest.approx(1.2 - 1.1 * 0.4, abs=0.01)
    assert flown(drone, state, 100, boxes).contact.thing.tolist() == [NOTHING]


def test_edges_reflect_along_the_contact_normal():
    """It hits the edge at 45 degrees and leaves along the other axis."""
    drone = quadrotor(restitution=1.0, friction=0.0, **VACUUM)
    state = falling(100.0, (2.0, 0.0, 0.0))
    reach = 0.3 * math.sqrt(0.5)
    state.position[:] = doubles((0.5 - reach - 0.006, -0.5 - reach, 100.0))
    after = flown(drone, state, 6, pillar((1.0, 0.0, 100.0)))
    np.testing.assert_allclose(after.velocity[0, :2], (0.0, -2.0), atol=0.1)
    np.testing.assert_allclose(
        after.contact.normal[0], (-math.sqrt(0.5), -math.sqrt(0.5), 0), atol=0.02
    )


@pytest.mark.parametrize(
    ("inside", "out"),
    [
        ((0.3, 0.0, 0.0), (0.8, 0.0, 0.0)),
        ((-0.3, 0.1, 0.0), (-0.8, 0.1, 0.0)),
        ((0.0, 0.4, 0.0), (0.0, 0.8, 0.0)),
        ((0.0, -0.4, 1.0), (0.0, -0.8, 1.0)),
        ((0.1, 0.1, 4.9), (0.1, 0.1, 5.3)),
        ((0.1, 0.1, -4.9), (0.1, 0.1, -5.3)),
    ],
)
def test_penetrating_drone_leaves_by_the_nearest_side(inside, out):
    state = falling(100.0)
    state.position[:] += doubles(inside)
    after = flown(quadrotor(**VACUUM), state, 1, pillar((0.0, 0.0, 100.0)))
    np.testing.assert_allclose(after.position[0] - doubles((0, 0, 100))[0], out, atol=1e-3)


def test_drone_lands_on_a_box():
    drone = quadrotor()
    after = flown(drone, falling(7.0), 3000, pillar((0.2, 0.0, 5.0), half=(0.5, 0.5, 1.0)))
    assert float(after.position[0, 2]) == pytest.approx(6.3, abs=1e-3)
    assert after.contact.thing.tolist() == [0]


def test_obstacle_contact_precedes_ground_contact():
    """The drone touches the ground and a box at the same time."""
    drone = quadrotor()
    state = falling(0.3, (1.0, 0.0, 0.0))
    after = flown(drone, state, 60, pillar((0.9, 0.0, 0.5)))
    assert after.contact.thing.tolist() == [0]
    assert float(after.position[0, 2]) == pytest.approx(0.3, abs=1e-6)


def test_each_environment_has_its_own_obstacles():
    state = falling(100.0, (2.0, 0.0, 0.0))
    both = type(state)(state.numbers.repeat(2, 1))
    boxes = Obstacles(doubles((1.0, 0, 100.0), (1.0, 0, -900.0)).reshape(2, 1, 3), (0.5, 0.5, 5.0))
    rotors = torch.zeros(2, 4).double()
    after = flown(quadrotor(**VACUUM), both, 100, boxes, rotors)
    assert after.contact.thing.tolist() == [0, NOTHING]
    assert float(after.velocity[0, 0]) < 0 < float(after.velocity[1, 0])


def test_slow_contacts_do_not_bounce():
    after = flown(quadrotor(**VACUUM), falling(0.3, (0.0, 0.0, -0.05)), 1)
    assert float(after.velocity[0, 2]) == 0.0
