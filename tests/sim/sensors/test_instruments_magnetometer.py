import pytest
import torch

from drone_rl.config.sensors import MagnetometerSettings
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.rendering.appearance import turned
from drone_rl.sim.sensors.instruments import Magnetometer, dipole_field

CONSTANT = MagnetometerSettings(field="constant", noise=0.0)


def generator():
    return torch.Generator().manual_seed(7)


def seconds(value, count=1):
    return torch.full((count,), value, dtype=torch.float64)


def still(count=1, attitude=None):
    return BodyState.at_rest(torch.zeros(count, 3, dtype=torch.float64), attitude)


def read(settings, body):
    magnetometer, time = Magnetometer(settings), seconds(0.0, len(body))
    return magnetometer.read(magnetometer.start(body, time, generator()), time)


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
    magnetometer, stream = Magnetometer(settings), generator()
    state = magnetometer.start(still(), seconds(0.0), stream)
    first = magnetometer.read(state, seconds(0.0))
    turned_about = still(attitude=turned("yaw", 90.0)[None])
    state = magnetometer.update(state, turned_about, seconds(0.018), stream)
    assert torch.equal(magnetometer.read(state, seconds(0.018)).field, first.field)
    state = magnetometer.update(state, turned_about, seconds(0.021), stream)
    reading = magnetometer.read(state, seconds(0.021))
    assert reading.time.item() == 0.021
    changed = torch.tensor([[-0.09805 - 0.34252, -0.34252 + 0.09805, 0.0]], dtype=torch.float64)
    torch.testing.assert_close(reading.field - first.field, changed)
