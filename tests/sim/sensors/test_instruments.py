import dataclasses
import math

import pytest
import torch

from drone_rl.config.sensors import ImuSettings
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.rendering.appearance import turned
from drone_rl.sim.sensors.instruments import Imu, specific_force

PERFECT = ImuSettings(noise=0.0)


def generator():
    return torch.Generator().manual_seed(5)


def seconds(value, count=1):
    return torch.full((count,), value, dtype=torch.float64)


def measure(attitude, velocity, duration=0.5):
    before = torch.zeros(1, 3, dtype=torch.float64)
    after = torch.tensor([velocity], dtype=torch.float64)
    return specific_force(attitude[None], before, after, seconds(duration))[0].tolist()


def test_specific_force_at_rest_in_free_fall_and_banked():
    level, banked = turned("yaw", 70.0), turned("roll", 30.0)
    assert measure(level, (0.0, 0.0, 0.0)) == pytest.approx([0.0, 0.0, 9.81])
    assert measure(level, (0.0, 0.0, -4.905)) == pytest.approx([0.0, 0.0, 0.0])
    # At rest, banked right by 30 degrees: half of the force is to the left.
    assert measure(banked, (0.0, 0.0, 0.0)) == pytest.approx([0.0, 4.905, 9.81 * math.sqrt(0.75)])
    # In a level turn at 30 degrees the force is along the rotor axis: g / cos(30).
    sideways = -9.81 * math.tan(math.radians(30.0)) * 0.5
    assert measure(banked, (0.0, sideways, 0.0)) == pytest.approx(
        [0.0, 0.0, 9.81 / math.sqrt(0.75)]
    )


def test_specific_force_is_in_the_body_frame():
    left = turned("yaw", 90.0)
    assert measure(left, (0.0, 2.0, 0.0)) == pytest.approx([4.0, 0.0, 9.81])


def test_ideal_sensor_returns_the_true_values():
    imu, time = Imu(PERFECT), seconds(0.0)
    body = BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64), turned("yaw", 90.0)[None])
    body = dataclasses.replace(body, angular_velocity=torch.tensor([[0.1, 0.2, 0.3]]).double())
    state = imu.start(body, time, generator())
    reading = imu.read(state, time)
    assert reading.specific_force[0].tolist() == pytest.approx([0.0, 0.0, 9.81])
    assert reading.angular_velocity[0].tolist() == pytest.approx([0.1, 0.2, 0.3])
    assert torch.equal(reading.attitude, body.attitude)
    moving = dataclasses.replace(body, velocity=torch.tensor([[0.0, 0.03, 0.0]]).double())
    later = imu.update(state, moving, time + 0.003, generator())
    reading = imu.read(later, time + 0.003)
    assert reading.time.item() == 0.003
    assert reading.specific_force[0].tolist() == pytest.approx([10.0, 0.0, 9.81])
    assert imu.read(state, time).specific_force[0, 0].item() == pytest.approx(0.0)


def test_slow_sensor_returns_the_mean_since_its_last_reading():
    imu, time = Imu(ImuSettings(noise=0.0, rate=10.0)), seconds(0.0)
    body = BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64))
    state = imu.start(body, time, generator())
    for step in range(1, 11):
        speed = 1.0 if step >= 5 else 0.0
        moving = dataclasses.replace(body, velocity=torch.tensor([[speed, 0.0, 0.0]]).double())
        state = imu.update(state, moving, time + 0.01 * step, generator())
        reading = imu.read(state, time + 0.01 * step).specific_force[0, 0].item()
        assert reading == pytest.approx(10.0 if step == 10 else 0.0)


def hovering(settings, count, steps, tick):
    imu, stream = Imu(settings), generator()
    body = BodyState.at_rest(torch.zeros(count, 3, dtype=torch.float64))
    state, time = imu.start(body, seconds(0.0, count), stream), seconds(0.0, count)
    for _ in range(steps):
        time = time + tick
        state = imu.update(state, body, time, stream)
    return state, imu.read(state, time)


def test_white_noise_matches_the_datasheet():
    """0.3 deg/sqrt(h) = 8.73e-5 rad/sqrt(s); divided by sqrt(3 ms): 1.593e-3 rad/s.

    0.24 mg = 2.3536e-3 m/s2; divided by sqrt(3 ms): 0.04297 m/s2.
    """
    _, reading = hovering(ImuSettings(), 20_000, 1, 0.003)
    assert reading.angular_velocity.std().item() == pytest.approx(1.5933e-3, rel=0.02)
    up = torch.tensor([0.0, 0.0, 9.81], dtype=torch.float64)
    assert (reading.specific_force - up).std().item() == pytest.approx(0.042971, rel=0.02)
    assert abs((reading.specific_force - up).mean().item()) < 1e-3


def test_biases_follow_a_random_walk():
    """4.6 deg/h = 2.2301e-5 rad/s in 500 s; 36 ug = 3.5304e-4 m/s2 in 800 s; measured at 260 s."""
    settings = ImuSettings(rate=0.1)
    state, _ = hovering(settings, 5000, 25, 10.0)
    random_walk_step = math.sqrt((250.0 + 10.0) / 500.0)
    assert state.gyro_bias.std().item() == pytest.approx(2.2301e-5 * random_walk_step, rel=0.03)
    random_walk_step = math.sqrt((250.0 + 10.0) / 800.0)
    assert state.accel_bias.std().item() == pytest.approx(3.5304e-4 * random_walk_step, rel=0.03)


def test_turn_on_bias_is_constant():
    quiet = ImuSettings(gyro_random_walk=0.0, accel_random_walk=0.0)
    settings = quiet.replace(gyro_turn_on_bias=3600.0, accel_turn_on_bias=10.0)
    _, reading = hovering(settings, 5000, 0, 0.003)
    assert reading.angular_velocity.std().item() == pytest.approx(math.radians(1.0), rel=0.03)
    up = torch.tensor([0.0, 0.0, 9.81], dtype=torch.float64)
    assert (reading.specific_force - up).std().item() == pytest.approx(0.0980665, rel=0.03)
    _, perfect = hovering(settings.replace(noise=0.0), 2, 3, 0.003)
    assert torch.equal(perfect.specific_force, up.expand(2, 3))
