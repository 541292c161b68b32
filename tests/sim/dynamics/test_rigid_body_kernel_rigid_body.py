"""Forces and motion compared with closed forms: free fall, drag, rotors and rotation."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics.control import rotor_goals
from tests.flying import (
    GRAVITY,
    doubles,
    falling,
    hovering,
    matrix,
    quadrotor,
    rotation,
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


def test_energy_is_conserved_in_free_fall_up_to_the_tick():
    drone = quadrotor(**VACUUM)
    states = trajectory(drone, falling(velocity=(2.0, 0.0, 10.0)), rotor_goals(NONE), 1000, 100)
    energy = [0.5 * s.velocity.square().sum() + GRAVITY * s.position[0, 2] for s in states]
    most_speed = max(float(s.velocity.norm()) for s in states)
    assert max(abs(float(e - energy[0])) for e in energy) < 0.5 * GRAVITY * 0.003 * 2 * most_speed


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


def test_constant_torque_accelerates_rotation():
    """The rate is linear and the angle quadratic in time."""
    drone = quadrotor(**AT_ONCE, **VACUUM)
    after = drone.push(falling(), doubles((0.0, 0.005, 0.005, 0.0)), 100)
    rate = 0.3 * 0.01 * LEVER / 0.00672
    assert float(after.angular_velocity[0, 0]) == pytest.approx(rate, rel=1e-5)
    w, x = after.attitude[0, :2].tolist()
    assert 2 * math.atan2(x, w) == pytest.approx(rate * 0.3 / 2 * 1.01, rel=1e-5)


@pytest.mark.parametrize("axis", range(3))
def test_spin_about_a_principal_axis_is_constant(axis):
    rates = np.zeros(3)
    rates[axis] = 4.0
    after = quadrotor(**VACUUM).push(falling(rates=tuple(rates)), NONE, 1000)
    np.testing.assert_allclose(after.angular_velocity[0], rates, atol=1e-6)
    np.testing.assert_allclose(matrix(after.attitude[0]), rotation(rates * 3.0), atol=2e-5)


def test_symmetric_body_nutates_by_eulers_equations():
    """The nutation rate is (I3 - I1) / I1 of the spin: 1 rad/s, a quarter turn in 1.5708 s."""
    drone = quadrotor(inertia=(0.01, 0.01, 0.015), tick=0.0005, **VACUUM)
    after = drone.push(falling(rates=(0.1, 0.0, 2.0)), NONE, 3142)
    np.testing.assert_allclose(after.angular_velocity[0], (0.0, 0.1, 2.0), atol=2e-4)


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


def test_attitudes_stay_normalized():
    rates = torch.tensor(np.random.default_rng(0).normal(size=(20, 3)) * 5)
    state = falling()
    state = type(state)(state.numbers.repeat(20, 1))
    state.angular_velocity[:] = rates
    states = trajectory(quadrotor(), state, rotor_goals(torch.full((20, 4), 0.2).double()), 990, 33)
    lengths = torch.stack([s.attitude.norm(dim=-1) for s in states])
    assert float((lengths - 1).abs().max()) < 1e-6


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
