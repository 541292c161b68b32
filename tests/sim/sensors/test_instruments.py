"""Accelerometer and gyroscope, magnetometer, GPS and barometer against closed forms and tables."""

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

TICK = 0.003
MANY = 2000


def stream(seed=5):
    return torch.Generator().manual_seed(seed)


def vector(*values):
    return torch.tensor(values, dtype=torch.float64)


def body(position=(0.0, 0.0, 0.0), velocity=(0.0, 0.0, 0.0), attitude=None):
    made = BodyState.at_rest(vector(position), None if attitude is None else attitude[None])
    made.velocity[:] = vector(velocity)
    return made


def readings(sensor, count, seconds, where=body()):  # noqa: B008
    """Yield the readings at so many later times, and the first one."""
    for step in range(count + 1):
        sensor.update(where, step * seconds)
        yield sensor.read()


def test_specific_force_at_rest_in_free_fall_and_banked():
    def measure(attitude, velocity):
        return specific_force(attitude, vector(0, 0, 0), vector(*velocity), 0.5).tolist()

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


def test_ideal_imu_returns_the_true_values():
    start, moving = body(attitude=turned("yaw", 90.0)), body((0, 0, 0), (0.0, 0.03, 0.0))
    start.angular_velocity[:] = vector(0.1, 0.2, 0.3)
    imu = Imu(ImuSettings(noise=0.0), start, stream())
    (reading,) = readings(imu, 0, TICK, start)
    assert reading.specific_force.tolist() == pytest.approx([0.0, 0.0, 9.81])
    assert reading.angular_velocity.tolist() == pytest.approx([0.1, 0.2, 0.3])
    assert torch.equal(reading.attitude, start.attitude[0])
    imu.update(moving, TICK)
    assert imu.read().time == TICK
    assert imu.read().specific_force.tolist() == pytest.approx([0.0, 10.0, 9.81])


def test_slow_imu_returns_the_mean_since_its_last_reading():
    imu = Imu(ImuSettings(noise=0.0, rate=10.0), body(), stream())
    for step in range(11):
        imu.update(body(velocity=(1.0 if step >= 5 else 0.0, 0, 0)), 0.01 * step)
        ahead = imu.read().specific_force[0].item()
        assert ahead == pytest.approx(10.0 if step == 10 else 0.0)


def test_white_noise_of_the_imu_matches_the_datasheet():
    """0.3 deg/sqrt(h) = 8.73e-5 rad/sqrt(s); divided by sqrt(3 ms): 1.593e-3 rad/s.

    0.24 mg = 2.3536e-3 m/s2; divided by sqrt(3 ms): 0.04297 m/s2.
    """
    _, *later = readings(Imu(ImuSettings(), body(), stream()), MANY, TICK)
    rates = torch.stack([one.angular_velocity for one in later])
    force = torch.stack([one.specific_force for one in later]) - vector(0.0, 0.0, 9.81)
    assert rates.std().item() == pytest.approx(1.5933e-3, rel=0.03)
    assert force.std().item() == pytest.approx(0.042971, rel=0.03)
    assert abs(force.mean().item()) < 3e-3


def test_biases_of_the_imu_are_random_at_the_start_and_walk():
    """4.6 deg/h = 2.2301e-5 rad/s in 500 s; 36 ug = 3.5304e-4 m/s2 in 800 s; measured at 250 s."""
    source, starts, walks = stream(), [], []
    settings = ImuSettings(rate=0.01, gyro_turn_on_bias=3600.0, accel_turn_on_bias=10.0)
    for _ in range(MANY):
        imu = Imu(settings, body(), source)
        starts.append(torch.cat([imu.gyro_bias, imu.accel_bias]))
        [*_] = readings(imu, 1, 150.0)  # the first reading is that after 100 s
        walks.append(torch.cat([imu.gyro_bias, imu.accel_bias]) - starts[-1])
    gyro, accel = torch.stack(starts).split(3, 1)
    assert gyro.std().item() == pytest.approx(math.radians(1.0), rel=0.03)
    assert accel.std().item() == pytest.approx(0.0980665, rel=0.03)
    gyro, accel = torch.stack(walks).split(3, 1)
    assert gyro.std().item() == pytest.approx(2.2301e-5 * math.sqrt(250 / 500), rel=0.03)
    assert accel.std().item() == pytest.approx(3.5304e-4 * math.sqrt(250 / 800), rel=0.03)


def test_constant_field_is_rotated_to_the_body_frame():
    """The field is 0.34252 north, 0.09805 east, 0.93438 down; facing west, east is behind."""
    settings = MagnetometerSettings(field="constant", noise=0.0)
    for attitude, field in (
        (turned("yaw", 0.0), [0.34252, -0.09805, -0.93438]),
        (turned("yaw", 90.0), [-0.09805, -0.34252, -0.93438]),
        (turned("roll", 90.0), [0.34252, -0.93438, 0.09805]),  # down is to the right
    ):
        (reading,) = readings(Magnetometer(settings, stream()), 0, 0, body(attitude=attitude))
        assert reading.field.tolist() == pytest.approx(field)


def test_dipole_field_at_poles_and_equator():
    places = torch.tensor([[80.31, -72.62, 0.0], [-80.31, 107.38, 0.0], [0.0, -162.62, 0.0]])
    north, south, equator = dipole_field(places.double())
    strong = 2 * 0.312
    assert north.tolist() == pytest.approx([0.0, 0.0, -strong], abs=1e-7)
    assert south.tolist() == pytest.approx([0.0, 0.0, strong], abs=1e-7)
    assert equator.norm().item() == pytest.approx(0.312)
    assert equator[2].item() == pytest.approx(0.0, abs=1e-7) and equator[0].item() > 0.3
    assert dipole_field(vector(80.31, -72.62, 6371000.0))[2].item() == pytest.approx(-strong / 8)


def test_dipole_field_is_near_the_world_magnetic_model():
    """WMM2015 at 47.637, -122.147, 622 m in gauss: 0.1835 north, 0.0520 east, 0.5016 down."""
    there = dipole_field(vector(47.637, -122.147, 622.0))
    assert there.tolist() == pytest.approx([0.1835, -0.0520, -0.5016], abs=0.02)
    (here,) = readings(Magnetometer(MagnetometerSettings(noise=0.0), stream()), 0, 0)
    torch.testing.assert_close(here.field, there, rtol=0.0, atol=1e-3)


def test_noise_scale_and_bias_of_the_magnetometer():
    """A bias up to 0.3 gauss is constant; the white noise has 0.005 gauss."""
    settings = MagnetometerSettings(field="constant", scale=2.0, bias=0.3, latency=0.0)
    source, biases = stream(), []
    truth = 2 * vector(0.34252, -0.09805, -0.93438)
    for _ in range(MANY // 10):
        sensor = Magnetometer(settings, source)
        errors = torch.stack([one.field - truth for one in readings(sensor, 20, 0.02)])
        assert errors.std(0).max().item() < 0.011
        biases.append(errors.mean(0))
    biases = torch.stack(biases)
    assert biases.mean().item() == pytest.approx(0.0, abs=0.03)
    assert biases.std().item() == pytest.approx(0.3 / math.sqrt(3), rel=0.06)
    assert 0.28 < biases.abs().max().item() < 0.31


def follow(settings, ticks):
    """Yield the readings of a drone that flies north at 2 m/s, tick by tick."""
    gps = Gps(settings, stream())
    for tick in range(ticks + 1):
        time = tick * TICK
        gps.update(body((2 * time, 0.0, 0.0), (2.0, 0.0, 0.0)), time)
        yield time, gps.read()


def test_gps_readings_are_delayed_by_200_ms():
    """The first reading is taken at 1 s and returned at 1.2 s; then 50 follow per second.

    By 2.1 s, 45 readings up to 1.9 s are returned; the one due at 1.9 s is taken at 1.902 s.
    """
    times = set()
    for time, reading in follow(GpsSettings(), 700):
        assert reading.is_valid == (time > 1.2)
        if reading.is_valid:
            assert 0.2 - 1e-9 < time - reading.time < 0.2 + 0.02 + TICK
            place = world_from_geo(reading.place)
            assert place[0].item() == pytest.approx(2 * reading.time, abs=1e-6)
            assert reading.velocity.tolist() == [2.0, 0.0, 0.0]
            times.add(reading.time)
    assert len(times) == 45
    assert (min(times), max(times)) == (pytest.approx(1.002), pytest.approx(1.881, abs=0.003))


def test_estimated_error_decreases_until_a_fix():
    """0.1 + 99.9 exp(-t / 0.9): 4 m at 2.9189 s, 3 m at 3.1856 s, 0.1 m in the limit."""
    gps, settings = Gps(GpsSettings(), stream()), GpsSettings(latency=0.0, rate=1000.0)
    for seconds, error in ((0.0, 100.0), (2.9189, 4.0), (3.1856, 3.0), (60.0, 0.1)):
        assert gps.stated_error(seconds) == pytest.approx(error, abs=2e-3)
    fixes = [(reading.time, reading.fix) for _, reading in follow(settings, 1100)]
    firsts = {fix: min(time for time, kind in fixes if kind == fix) for fix in (2, 3)}
    assert firsts[Fix.TWO_D] == pytest.approx(2.9189, abs=0.0031)
    assert firsts[Fix.THREE_D] == pytest.approx(3.1856, abs=0.0031)


def test_gps_positions_are_exact_up_to_the_noise():
    settings = GpsSettings(
        startup=0.0, latency=0.0, horizontal_noise=1.5, vertical_noise=4.0, velocity_noise=0.1
    )
    found = [*readings(Gps(settings, stream()), MANY, 0.02)]
    places = torch.stack([world_from_geo(one.place) for one in found])
    assert places.std(0).tolist() == pytest.approx([1.5, 1.5, 4.0], rel=0.05)
    speeds = torch.stack([one.velocity for one in found])
    assert speeds.std(0).tolist() == pytest.approx([0.1] * 3, rel=0.05)
    (exact,) = readings(Gps(settings.replace(noise=0.0), stream()), 0, 0)
    assert exact.place.tolist() == [*HOME]


def test_pressure_matches_the_standard_atmosphere():
    """Tables: 1013.25 hPa at sea level, 898.76 at 1 km, 540.48 at 5 km, 227.00 at 11 km."""
    altitude = vector(0.0, 1000.0, 5000.0, 11_000.0)
    torch.testing.assert_close(
        1013.25 * pressure_ratio(altitude),
        vector(1013.25, 898.76, 540.48, 227.00),
        rtol=5e-5,
        atol=0.0,
    )
    torch.testing.assert_close(altitude_from_pressure_ratio(pressure_ratio(altitude)), altitude)
    assert pressure_ratio(vector(20_000.0)) == pressure_ratio(vector(12_000.0))


def test_ideal_barometer_returns_the_altitude():
    for settings, home, height, altitude in (
        (BarometerSettings(noise=0.0, sea_level_pressure=990.0), HOME, 30.0, 152.0),
        (BarometerSettings(noise=0.0), HOME._replace(altitude=500.0), 0.0, 500.0),
    ):
        barometer = Barometer(settings, stream(), home)
        (reading,) = readings(barometer, 0, 0, body((0.0, 0.0, height)))
        assert reading.altitude == pytest.approx(altitude)
        share = (1 - 0.0065 * altitude / 288.15) ** 5.255877
        assert reading.pressure == pytest.approx(
            100 * settings.sea_level_pressure * share, rel=1e-4
        )


def test_white_noise_of_the_barometer_is_20_cm():
    """The noise is 2.7 Pa, and the pressure gradient at 122 m is 11.88 Pa/m."""
    found = [*readings(Barometer(BarometerSettings(drift=0.0), stream()), MANY, 0.02)]
    altitudes = vector(*(one.altitude for one in found))
    assert vector(*(one.pressure for one in found)).std().item() == pytest.approx(2.7, rel=0.04)
    assert altitudes.std().item() == pytest.approx(2.7 / 11.88, rel=0.04)
    assert altitudes.mean().item() == pytest.approx(122.0, abs=0.02)


def test_pressure_drifts_by_about_15_m_per_hour():
    """0.1825% of 998.6 hPa is 182.2 Pa; after one time constant the deviation is 93% of it."""
    source, settings = stream(), BarometerSettings(white_noise=0.0)
    found = [[*readings(Barometer(settings, source), 1, 3600.0)][1] for _ in range(MANY)]
    deviation = vector(*(one.pressure for one in found)).std().item()
    assert deviation == pytest.approx(182.2 * 0.92987, rel=0.04)
