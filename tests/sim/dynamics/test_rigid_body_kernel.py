import math

import pytest
from pytest import approx

from tests.flying import frame


def test_airframe_follows_from_the_settings():
    drone = frame(mass=1.25, wind=(1.0, 2.0, 3.0), drag_area=(0.1, 0.2, 0.4), air_density=1.5)
    assert drone.weight == pytest.approx(12.2625) and drone.per_mass == approx(0.8)
    assert tuple(drone.wind) == (1.0, 2.0, 3.0)
    assert tuple(drone.drag) == pytest.approx((0.15, 0.3, 0.6))
    assert tuple(drone.inertia) == pytest.approx((0.00672, 0.00804, 0.01428))
    assert drone.per_inertia[0] * 0.00672 == pytest.approx(1.0)
    assert drone.arm == pytest.approx(0.2275 / math.sqrt(2.0))
    assert drone.tick == pytest.approx(0.003) and drone.friction == 0.5
    assert drone.rate_limit[1] == 2.5 and drone.climb_integral == 2.0
    assert drone.gust_length == 50.0 and drone.rotor_torque == pytest.approx(0.055562)


@pytest.mark.parametrize(("lag", "pace"), [(0.003, 1 - math.exp(-1)), (0.0, 1.0), (3.0, 0.0009995)])
def test_rotor_pace_is_the_gain_of_a_first_order_filter(lag, pace):
    assert frame(rotor_time_constant=lag).rotor_pace == pytest.approx(pace, rel=1e-4)
