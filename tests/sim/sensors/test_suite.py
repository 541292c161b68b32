"""All sensors together, and their random streams."""

import pytest
import torch

from drone_rl.config.sensors import GpsSettings, SensorSettings
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors import Sensors
from drone_rl.utils.errors import InputError
from tests.perfect_sensors import without_noise

BODY = BodyState.at_rest(torch.tensor([[0.0, 0.0, 3.0]], dtype=torch.float64))


def run(settings=None, **choice):
    sensors = Sensors(BODY, settings or SensorSettings(), **choice)
    for _ in range(10):
        sensors.update(BODY, 0.003)
    return sensors


def test_ideal_sensors_of_a_hovering_drone():
    sensors = run(without_noise(SensorSettings(gps=GpsSettings(startup=0.0, latency=0.0))))
    assert sensors.time == pytest.approx(0.03)
    assert sensors.imu().specific_force.tolist() == pytest.approx([0.0, 0.0, 9.81])
    assert sensors.imu().angular_velocity.tolist() == [0.0, 0.0, 0.0]
    assert sensors.barometer().altitude == pytest.approx(125.0)
    assert sensors.magnetometer().field[2].item() < -0.4
    assert sensors.gps().place.tolist() == pytest.approx([47.641468, -122.140165, 125])


def test_noise_is_the_seeds_and_each_sensor_has_its_own():
    """The rate of the GPS does not change the readings of other sensors."""
    quick = SensorSettings(gps=GpsSettings(rate=1000.0, startup=0.0))
    first, same, other = run(seed=4), run(quick, seed=4), run(seed=5)
    for name in ("imu", "barometer", "magnetometer"):
        one, again, changed = (str(getattr(each, name)()) for each in (first, same, other))
        assert one == again != changed
    with pytest.raises(InputError, match="whole number"):
        run(seed=-1)
