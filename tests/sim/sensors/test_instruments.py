"""Accelerometer and gyroscope, magnetometer, GPS and barometer against closed forms and tables."""

import dataclasses
import math

import pytest
import torch

from drone_rl.config.sensors import (
    BarometerSettings,
    GpsSettings,
    ImuSettings,
    MagnetometerSettings,
)
from drone_rl.sim.coordinates import HOME, world_from_geo
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.rendering.appearance import turned
from drone_rl.sim.sensors.instruments import (
    Barometer,
    Fix,
    Gps,
    Imu,
    Magnetometer,
    altitude_from_pressure_ratio,
    dipole_field,
    pressure_ratio,
    specific_force,
)

PERFECT = ImuSettings(noise=0.0)


def stream(seed):
    return torch.Generator().manual_seed(seed)


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


def test_ideal_sensor_returns_the_true_values():
    imu, time = Imu(PERFECT), seconds(0.0)
    body = BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64), turned("yaw", 90.0)[None])
    body = dataclasses.replace(body, angular_velocity=torch.tensor([[0.1, 0.2, 0.3]]).double())
    state = imu.start(body, time, stream(5))
    reading = imu.read(state, time)
    assert reading.specific_force[0].tolist() == pytest.approx([0.0, 0.0, 9.81])
    assert reading.angular_velocity[0].tolist() == pytest.approx([0.1, 0.2, 0.3])
    assert torch.equal(reading.attitude, body.attitude)
    moving = dataclasses.replace(body, velocity=torch.tensor([[0.0, 0.03, 0.0]]).double())
    later = imu.update(state, moving, time + 0.003, stream(5))
    reading = imu.read(later, time + 0.003)
    assert reading.time.item() == 0.003
    assert reading.specific_force[0].tolist() == pytest.approx([10.0, 0.0, 9.81])
    assert imu.read(state, time).specific_force[0, 0].item() == pytest.approx(0.0)


def test_slow_sensor_returns_the_mean_since_its_last_reading():
    imu, time = Imu(ImuSettings(noise=0.0, rate=10.0)), seconds(0.0)
    body = BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64))
    state = imu.start(body, time, stream(5))
    for step in range(1, 11):
        speed = 1.0 if step >= 5 else 0.0
        moving = dataclasses.replace(body, velocity=torch.tensor([[speed, 0.0, 0.0]]).double())
        state = imu.update(state, moving, time + 0.01 * step, stream(5))
        reading = imu.read(state, time + 0.01 * step).specific_force[0, 0].item()
        assert reading == pytest.approx(10.0 if step == 10 else 0.0)


def hovering(settings, count, steps, tick):
    imu, source = Imu(settings), stream(5)
    body = BodyState.at_rest(torch.zeros(count, 3, dtype=torch.float64))
    state, time = imu.start(body, seconds(0.0, count), source), seconds(0.0, count)
    for _ in range(steps):
        time = time + tick
        state = imu.update(state, body, time, source)
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


CONSTANT = MagnetometerSettings(field="constant", noise=0.0)


def still(count=1, attitude=None):
    return BodyState.at_rest(torch.zeros(count, 3, dtype=torch.float64), attitude)


def read(settings, body):
    magnetometer, time = Magnetometer(settings), seconds(0.0, len(body))
    return magnetometer.read(magnetometer.start(body, time, stream(7)), time)


def test_constant_field_is_rotated_to_the_body_frame():
    """The field is 0.34252 north, 0.09805 east, 0.93438 down; facing west, east is behind."""
    assert read(CONSTANT, still()).field[0].tolist() == pytest.approx([0.34252, -0.09805, -0.93438])
    west = read(CONSTANT, still(attitude=turned("yaw", 90.0)[None]))
    assert west.field[0].tolist() == pytest.approx([-0.09805, -0.34252, -0.93438])
    # Banked right by 90 degrees: down is to the right.
    right = read(CONSTANT, still(attitude=turned("roll", 90.0)[None]))
    assert right.field[0].tolist() == pytest.approx([0.34252, -0.93438, 0.09805])


def test_dipole_field_at_poles_and_equator():
    places = torch.tensor([[80.31, -72.62, 0.0], [-80.31, 107.38, 0.0], [0.0, -162.62, 0.0]])
    found = dipole_field(places.double())
    strong = 2 * 0.312
    assert found[0].tolist() == pytest.approx([0.0, 0.0, -strong], abs=1e-7)
    assert found[1].tolist() == pytest.approx([0.0, 0.0, strong], abs=1e-7)
    assert found[2].norm().item() == pytest.approx(0.312)
    assert found[2, 2].item() == pytest.approx(0.0, abs=1e-7)
    assert found[2, 0].item() > 0.3
    high = dipole_field(torch.tensor([[80.31, -72.62, 6371000.0]]).double())
    assert high[0, 2].item() == pytest.approx(-strong / 8)


def test_dipole_field_is_near_the_world_magnetic_model():
    """WMM2015 at 47.637, -122.147, 622 m in gauss: 0.1835 north, 0.0520 east, 0.5016 down."""
    found = dipole_field(torch.tensor([47.637, -122.147, 622.0], dtype=torch.float64))
    assert found.tolist() == pytest.approx([0.1835, -0.0520, -0.5016], abs=0.02)
    here = read(MagnetometerSettings(noise=0.0), still())
    torch.testing.assert_close(here.field[0], found, rtol=0.0, atol=1e-3)


def test_noise_scale_and_bias():
    settings = MagnetometerSettings(field="constant", scale=2.0, bias=0.3)
    found = read(settings, still(20_000)).field
    truth = 2 * torch.tensor([0.34252, -0.09805, -0.93438], dtype=torch.float64)
    wrong = found - truth
    assert wrong.mean().item() == pytest.approx(0.0, abs=0.005)
    assert wrong.std().item() == pytest.approx((0.3**2 / 3 + 0.005**2) ** 0.5, rel=0.02)
    assert 0.29 < wrong.abs().max().item() < 0.33
    white = read(MagnetometerSettings(field="constant"), still(20_000)).field - truth / 2
    assert white.std().item() == pytest.approx(0.005, rel=0.02)


def test_bias_is_constant_and_readings_are_held():
    settings = MagnetometerSettings(field="constant", bias=0.3, white_noise=0.0)
    magnetometer, source = Magnetometer(settings), stream(7)
    state = magnetometer.start(still(), seconds(0.0), source)
    first = magnetometer.read(state, seconds(0.0))
    turned_about = still(attitude=turned("yaw", 90.0)[None])
    state = magnetometer.update(state, turned_about, seconds(0.018), source)
    assert torch.equal(magnetometer.read(state, seconds(0.018)).field, first.field)
    state = magnetometer.update(state, turned_about, seconds(0.021), source)
    reading = magnetometer.read(state, seconds(0.021))
    assert reading.time.item() == 0.021
    changed = torch.tensor([[-0.09805 - 0.34252, -0.34252 + 0.09805, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(reading.field - first.field, changed)


def flying(count=1, x=0.0):
    """Return drones that fly north at 2 m/s."""
    position = torch.zeros(count, 3, dtype=torch.float64)
    position[:, 0] = x
    body = BodyState.at_rest(position)
    velocity = torch.tensor([2.0, 0.0, 0.0], dtype=torch.float64).expand(count, 3)
    return dataclasses.replace(body, velocity=velocity)


def follow(settings, ticks):
    """Yield the readings of a drone that flies north at 2 m/s, tick by tick."""
    gps, time, source = Gps(settings), torch.zeros(1, dtype=torch.float64), stream(13)
    state = gps.start(flying(), time, source)
    yield 0.0, gps.read(state, time)
    for _ in range(ticks):
        time = time + TICK
        state = gps.update(state, flying(x=2 * time.item()), time, source)
        yield time.item(), gps.read(state, time)


def test_readings_are_delayed_by_200_ms():
    """The first reading is taken at 1 s and returned at 1.2 s; then 50 follow per second.

    By 2.1 s, 45 readings up to 1.9 s are returned; the one due at 1.9 s is taken at 1.902 s.
    """
    times = []
    for time, reading in follow(GpsSettings(), 700):
        assert reading.is_valid.item() == (time > 1.2)
        if not reading.is_valid.item():
            continue
        age = time - reading.time.item()
        assert 0.2 - 1e-9 < age < 0.2 + 0.02 + TICK
        place = world_from_geo(reading.place)[0]
        assert place[0].item() == pytest.approx(2 * reading.time.item(), abs=1e-6)
        assert reading.velocity[0].tolist() == [2.0, 0.0, 0.0]
        times.append(reading.time.item())
    steps = torch.tensor(sorted(set(times))).diff()
    assert min(times) == pytest.approx(1.002)
    assert len(steps) == 44 and steps.mean().item() == pytest.approx(0.02, abs=1e-4)


def test_estimated_error_decreases_until_a_fix():
    """0.1 + 99.9 exp(-t / 0.9): 4 m at 2.9189 s, 3 m at 3.1856 s, 0.1 m in the limit."""
    gps = Gps()
    seconds = torch.tensor([0.0, 0.9, 2.9189, 3.1856, 60.0], dtype=torch.float64)
    expected = torch.tensor([100.0, 0.1 + 99.9 * math.exp(-1), 4.0, 3.0, 0.1]).double()
    torch.testing.assert_close(gps.stated_error(seconds), expected, rtol=0.0, atol=2e-3)
    settings = GpsSettings(latency=0.0, rate=1000.0)
    fixes = [(reading.time.item(), reading.fix.item()) for _, reading in follow(settings, 1100)]
    firsts = {fix: min(time for time, kind in fixes if kind == fix) for fix in (2, 3)}
    assert firsts[Fix.TWO_D] == pytest.approx(2.9189, abs=0.0031)
    assert firsts[Fix.THREE_D] == pytest.approx(3.1856, abs=0.0031)


def test_positions_are_exact_up_to_the_noise():
    count = 20_000
    settings = GpsSettings(
        startup=0.0, latency=0.0, horizontal_noise=1.5, vertical_noise=4.0, velocity_noise=0.1
    )
    time = torch.zeros(count, dtype=torch.float64)
    gps = Gps(settings)
    reading = gps.read(gps.start(flying(count), time, stream(13)), time)
    deviation = world_from_geo(reading.place).std(0)
    assert deviation.tolist() == pytest.approx([1.5, 1.5, 4.0], rel=0.02)
    assert reading.velocity.std(0).tolist() == pytest.approx([0.1] * 3, rel=0.02)
    gps = Gps(settings.replace(noise=0.0))
    reading = gps.read(gps.start(flying(count), time, stream(13)), time)
    assert (reading.place == torch.tensor(HOME, dtype=torch.float64)).all()


TICK = 0.003


def at(heights):
    position = torch.zeros(len(heights), 3, dtype=torch.float64)
    position[:, 2] = torch.tensor(heights, dtype=torch.float64)
    return BodyState.at_rest(position)


def test_pressure_matches_the_standard_atmosphere():
    """Tables: 1013.25 hPa at sea level, 898.76 at 1 km, 540.48 at 5 km, 227.00 at 11 km."""
    altitude = torch.tensor([0.0, 1000.0, 5000.0, 11_000.0], dtype=torch.float64)
    found = 1013.25 * pressure_ratio(altitude)
    torch.testing.assert_close(
        found, torch.tensor([1013.25, 898.76, 540.48, 227.00]).double(), rtol=5e-5, atol=0.0
    )
    torch.testing.assert_close(altitude_from_pressure_ratio(pressure_ratio(altitude)), altitude)
    assert pressure_ratio(seconds(20_000.0)) == pressure_ratio(seconds(12_000.0))


def test_ideal_barometer_returns_the_altitude():
    barometer = Barometer(BarometerSettings(noise=0.0, sea_level_pressure=990.0))
    state = barometer.start(at([0.0, 30.0]), seconds(0.0, 2), stream(11))
    reading = barometer.read(state, seconds(0.0, 2))
    torch.testing.assert_close(reading.altitude, torch.tensor([122.0, 152.0]).double())
    share = (1 - 0.0065 * 122.0 / 288.15) ** 5.255877
    assert reading.pressure[0].item() == pytest.approx(99_000.0 * share, rel=1e-6)
    assert reading.time.tolist() == [0.0, 0.0]
    elsewhere = Barometer(BarometerSettings(noise=0.0), HOME._replace(altitude=500.0))
    state = elsewhere.start(at([0.0]), seconds(0.0), stream(11))
    assert elsewhere.read(state, seconds(0.0)).altitude.item() == pytest.approx(500.0)


def test_readings_are_held_and_delayed():
    """At 50 Hz with 50 ms latency, the reading at 81 ms is that of 21 ms, at a height of 21 m."""
    barometer = Barometer(BarometerSettings(noise=0.0, latency=0.05))
    state, time = barometer.start(at([0.0]), seconds(0.0), stream(11)), seconds(0.0)
    assert barometer.read(state, time).time.item() == -math.inf
    for tick in range(1, 28):
        time = time + TICK
        state = barometer.update(state, at([3.0 * tick]), time, stream(11))
    reading = barometer.read(state, time)
    assert reading.time.item() == pytest.approx(0.021)
    assert reading.altitude.item() == pytest.approx(122.0 + 21.0)


def test_white_noise_is_20_cm():
    """The noise is 2.7 Pa, and the pressure gradient at 122 m is 11.88 Pa/m."""
    barometer, count = Barometer(), 20_000
    state = barometer.start(at([0.0] * count), seconds(0.0, count), stream(11))
    reading = barometer.read(state, seconds(0.0, count))
    assert reading.pressure.std().item() == pytest.approx(2.7, rel=0.02)
    assert reading.altitude.std().item() == pytest.approx(2.7 / 11.88, rel=0.02)
    assert reading.altitude.mean().item() == pytest.approx(122.0, abs=0.01)


@pytest.mark.parametrize("steps", [1, 20])
def test_pressure_drifts_by_about_15_m_per_hour(steps):
    """0.1825% of 998.6 hPa is 182.2 Pa; after one time constant the deviation is 93% of it."""
    barometer, count, source = Barometer(BarometerSettings(white_noise=0.0)), 20_000, stream(11)
    body, time = at([0.0] * count), seconds(0.0, count)
    state = barometer.start(body, time, source)
    for _ in range(steps):
        time = time + 3600.0 / steps
        state = barometer.update(state, body, time, source)
    reading = barometer.read(state, time)
    assert reading.pressure.std().item() == pytest.approx(182.2 * 0.92987, rel=0.02)
