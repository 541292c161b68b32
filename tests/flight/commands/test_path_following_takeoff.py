import pytest

from benchmarks.flight_paths import fly_command
from drone_rl.config import DynamicsSettings
from drone_rl.flight.commands.path_following import TakeoffCommand
from drone_rl.sim.dynamics import Quadrotor


@pytest.mark.parametrize("wind", [0.0, 5.0])
def test_two_metres_up_whatever_the_wind(wind, hovering):
    body = hovering((1, 2, 0.3))
    air = Quadrotor(DynamicsSettings(mode="simple_flight", wind=(wind, 0.0, 0.0)))
    states, done = fly_command(air, body, TakeoffCommand(body, 20.0))
    assert 3.8 < done.item() * 0.021 < 6.0  # 1.9 m at 0.5 m/s, and braking
    assert states[-1].position[0, 2].item() == pytest.approx(2.2, abs=0.02)
