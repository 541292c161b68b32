"""Forces, motion, wind, gusts and contacts compared with closed forms."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics import Obstacles
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import GROUND, NOTHING
from tests.flying import (
    GRAVITY,
    POSITIONS,
    doubles,
    falling,
    hovering,
    make_goals,
    matrix,
    quadrotor,
    trajectory,
)

VACUUM = {"air_density": 0.0}


AT_ONCE = {"rotor_time_constant": 0.0}


THRUST, LEVER, TWIST = 4.179446268, 4.179446268 * 0.2275 / math.sqrt(2), 0.055562


NONE = doubles((0.0, 0.0, 0.0, 0.0))


def test_free_fall_in_vacuum():
    """Symplectic Euler: the fall after n ticks is g t^2 (n + 1) / (2 n)."""
    drone = quadrotor(**VACUUM)
    after = drone.push(falling(velocity=(1.0, -2.0, 3.0)), NONE, 1000)
    np.testing.assert_allclose(after.velocity[0], (1, -2, 3 - 3 * GRAVITY), rtol=1e-5)
    fallen = GRAVITY * 9.0 / 2 * 1.001
    np.testing.assert_allclose(after.position[0], (3, -6, 109 - fallen), rtol=1e-5)
    assert after.attitude[0].tolist() == [1, 0, 0, 0]


@pytest.mark.parametrize("mass", [1.0, 0.5])
def test_terminal_speed_balances_drag_and_weight(mass):
    after = quadrotor(mass=mass).push(falling(1000.0), NONE, 4000)
    speed = math.sqrt(mass * GRAVITY / (1.225 * 0.02989))
    np.testing.assert_allclose(after.velocity[0], (0, 0, -speed), rtol=1e-4)


@pytest.mark.parametrize(("axis", "area"), enumerate((0.00538, 0.00611, 0.02989)))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_drag_depends_on_the_area_of_each_side(axis, area, sign):
    state = falling()
    state.velocity[0, axis] = 10.0 * sign
    after = quadrotor().push(state, NONE)
    expected = state.velocity[0].clone()
    expected[axis] -= sign * 0.003 * 1.225 * area * 100.0
    expected[2] -= 0.003 * GRAVITY
    np.testing.assert_allclose(after.velocity[0], expected, atol=2e-6)


def test_drag_turns_with_the_body():
    """With 90 degrees of yaw the left side faces -x; with 90 degrees of roll the top faces +y."""
    root = math.sqrt(0.5)
    for attitude, axis, area in (
        ((root, 0, 0, root), 0, 0.00611),
        ((root, 0, 0, root), 1, 0.00538),
        ((root, root, 0, 0), 1, 0.02989),
        ((root, 0, root, 0), 0, 0.02989),
    ):
        state = falling()
        state.attitude[:], state.velocity[0, axis] = doubles(attitude), -5.0
        after = quadrotor().push(state, NONE)
        gained = float(after.velocity[0, axis]) + 5.0
        assert gained == pytest.approx(0.003 * 1.225 * area * 25.0, abs=1e-6)


def test_rotors_follow_a_first_order_filter():
    drone = quadrotor(rotor_time_constant=0.05)
    up = drone.push(falling(), doubles((1.0, 0.5, 0.0, 0.2)), 20)
    gained = 1 - math.exp(-20 * 0.003 / 0.05)
    np.testing.assert_allclose(up.rotors[0], np.array([1, 0.5, 0, 0.2]) * gained, rtol=1e-6)
    down = drone.push(up, NONE, 20)
    np.testing.assert_allclose(down.rotors[0], up.rotors[0] * math.exp(-1.2), rtol=1e-5)


def test_thrust_is_along_the_body_z_axis():
    """At 30 degrees nose down, half the thrust points forward; rolled right, to the right."""
    whole, angle = 4 * THRUST, math.radians(15)
    for attitude, axis, sign in (
        ((math.cos(angle), 0, math.sin(angle), 0), 0, 1),
        ((math.cos(angle), math.sin(angle), 0, 0), 1, -1),
    ):
        state = falling()
        state.attitude[:] = doubles(attitude)
        gained = quadrotor(**AT_ONCE, **VACUUM).push(state, doubles((1.0,) * 4)).velocity[0]
        expected = np.array([0, 0, whole * math.cos(2 * angle) - GRAVITY])
        expected[axis] = sign * whole * 0.5
        np.testing.assert_allclose(gained, 0.003 * expected, atol=2e-6)


@pytest.mark.parametrize(
    ("shares", "torque"),
    [
        ((0.0, 0.1, 0.1, 0.0), (0.2 * LEVER, 0, 0)),  # both left rotors: roll to the right
        ((0.1, 0.0, 0.0, 0.1), (-0.2 * LEVER, 0, 0)),
        ((0.0, 0.1, 0.0, 0.1), (0, 0.2 * LEVER, 0)),  # both rear rotors: nose down
        ((0.1, 0.0, 0.1, 0.0), (0, -0.2 * LEVER, 0)),
        ((0.0, 0.0, 0.1, 0.1), (0, 0, 0.2 * TWIST)),  # both clockwise rotors: yaw to the left
        ((0.1, 0.1, 0.0, 0.0), (0, 0, -0.2 * TWIST)),
        ((0.1, 0.0, 0.0, 0.0), (-0.1 * LEVER, -0.1 * LEVER, -0.1 * TWIST)),
    ],
)
def test_rotor_torques_follow_from_position_and_spin(shares, torque):
    after = quadrotor(**AT_ONCE).push(falling(), doubles(shares))
    gained = 0.003 * np.array(torque) / (0.00672, 0.00804, 0.01428)
    np.testing.assert_allclose(after.angular_velocity[0], gained, rtol=1e-5, atol=1e-8)


def test_angular_momentum_and_energy_are_conserved():
    """The spin axis is no symmetry axis; 3 s with ticks of 0.5 ms."""
    inertia = np.array([0.00672, 0.00804, 0.01428])
    drone, state = quadrotor(tick=0.0005, **VACUUM), falling(rates=(2.0, -1.0, 1.5))

    def of(state):
        rates = state.angular_velocity[0].numpy()
        return matrix(state.attitude[0]) @ (inertia * rates), 0.5 * rates @ (inertia * rates)

    (before, energy), (after, left) = of(state), of(drone.push(state, NONE, 6000))
    np.testing.assert_allclose(after, before, atol=0.01 * np.linalg.norm(before))
    assert left == pytest.approx(energy, rel=0.01)


MASS, ARM, MOST, RATIO = 0.0319, 0.03253, 0.12, 0.00735


INERTIA = np.diag((16.8e-6, 16.8e-6, 29.8e-6))


CURVE = np.array([0.0, -5.382196214637237e-7, 2.4582929831265485e-10])


def theirs(models, attitude, velocity, rates, speeds):
    """Return accelerations in m/s2 and rad/s2. Shapes: both (count, 3)."""
    mixing = np.array([[-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], float)
    _, _, linear, angular, _ = models.dynamics(
        np.zeros_like(velocity),
        attitude[:, [1, 2, 3, 0]],
        velocity,
        rates,
        speeds,
        mass=MASS,
        L=ARM,
        prop_inertia=0.0,
        gravity_vec=np.array([0.0, 0.0, -9.81]),
        J=INERTIA,
        J_inv=np.linalg.inv(INERTIA),
        rpm2thrust=CURVE,
        rpm2torque=CURVE * RATIO,
        mixing_matrix=mixing,
        drag_matrix=np.zeros((3, 3)),
        rotor_dyn_coef=np.ones(4),
    )
    return linear, angular


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_accelerations_of_a_crazyflie_equal_drone_models():
    """Compare with the package drone-models, without its linear drag, propeller inertia and
    separate torque curves, which this drone does not model."""
    models = pytest.importorskip(
        "drone_models.first_principles", reason="needs drone-models", exc_type=ImportError
    )
    source, count = np.random.default_rng(0), 50
    drone = quadrotor(
        mass=MASS,
        inertia=tuple(np.diag(INERTIA).tolist()),
        arm_length=ARM * 2**0.5,
        rotor_thrust=MOST,
        rotor_torque=MOST * RATIO,
        rotor_time_constant=0.0,
        air_density=0.0,
    )
    state = hovering(drone, count=count)
    attitude, speeds = source.normal(size=(count, 4)), source.uniform(5000, 23000, (count, 4))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    velocity, rates = source.normal(size=(2, count, 3))
    state.attitude[:], state.velocity[:] = doubles(*attitude), doubles(*velocity)
    state.angular_velocity[:] = doubles(*rates)
    shares = (CURVE[1] * speeds + CURVE[2] * speeds**2) / MOST
    ours = [0, 2, 3, 1]  # their order: front right, rear right, rear left, front left
    after = drone.push(state, torch.tensor(shares[:, ours]))
    linear, angular = theirs(models, attitude, velocity, rates, speeds)
    tick = drone.settings.tick
    np.testing.assert_allclose((after.velocity - state.velocity) / tick, linear, atol=2e-3)
    turned = (after.angular_velocity - state.angular_velocity) / tick
    np.testing.assert_allclose(turned, angular, rtol=1e-4, atol=1e-2)


def gusts(count=1000, ticks=4000, every=20, *, seeds=None, **changes):
    """Return air velocities at hovering drones. Shape: (times, drones, axes)."""
    drone = quadrotor(gusts=2.0, **changes)
    seeds = torch.arange(count) if seeds is None else seeds
    state = hovering(drone, count=count, seeds=seeds, height=1000.0)
    states = trajectory(
        drone, state, make_goals(POSITIONS, 0, 0, 0, 1000.0, count=count), ticks, every
    )
    return torch.stack([s.gust for s in states]).numpy()


def test_wind_causes_a_steady_position_error():
    """The wind force, 1.225 * 0.00538 * 25 N, needs a tilt, and that a position error."""
    drone = quadrotor(wind=(5.0, 0.0, 0.0))
    after = drone.fly(hovering(drone), make_goals(POSITIONS, 0, 0, 0, 100.0), 6000)
    away = float(after.position[0, 0])
    tilt = 1.225 * 0.00538 * 25 / 9.81
    expected = tilt / (np.pi / 5.5 * 0.2 * 6.0 * 0.25)
    assert away == pytest.approx(expected, rel=0.02) and away < 0.3
    assert after.velocity.abs().max() < 1e-3


def test_gusts_have_the_configured_strength_and_length():
    """At 5 m/s, the length of 20 m is 4 s, after which the correlation is 1 / e."""
    found = gusts(gust_length=20.0, wind=(5.0, 0.0, 0.0))[100:]
    assert found.std() == pytest.approx(2.0, rel=0.05)
    assert np.abs(found.mean((0, 1))).max() < 0.2
    seconds = 0.06
    for later in (10, 20, 40):
        alike = (found[later:] * found[:-later]).mean() / 4.0
        expected = np.exp(-later * seconds * 5.0 / 20.0)
        assert alike == pytest.approx(expected, abs=0.03)
    crossed = np.corrcoef(found.reshape(-1, 3).T)
    assert np.abs(crossed - np.eye(3)).max() < 0.05


def test_seed_determines_gusts():
    one, again, other = (gusts(1, 300, seeds=torch.tensor([seed])) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one[1:] - other[1:]).min() > 0.0
    first, second = gusts(2, 3000, 3, seeds=torch.tensor([0, 1])).transpose(1, 0, 2)
    steps = np.diff(first, axis=0).ravel(), np.diff(second, axis=0).ravel()
    assert abs(np.corrcoef(*steps)[0, 1]) < 0.05


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
