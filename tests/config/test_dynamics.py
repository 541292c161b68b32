"""A drone is data, of which some can't be."""

import dataclasses
import math

import pytest

from drone_rl.config import COMPUTER_VISION, DynamicsSettings
from drone_rl.utils.errors import InputError

FLIGHT = DynamicsSettings(mode="simple_flight")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": 0.0}, r"mass=0\.0 is out of range"),
        ({"mass": -1.0}, r"mass=-1\.0 is out of range"),
        (
            {"mass": 2.0},
            r"rotor_thrust=4\.17945 is too small to control the drone: four rotors give 16\.72 N, "
            r"needed are 1\.1 times its weight, 21\.58 N; give at least 5\.4$",
        ),
        ({"inertia": (1.0, 1.0, 2.1)}, r"inertia=\[1\.0, 1\.0, 2\.1\] is that of no body"),
        ({"wind": (float("nan"), 0.0, 0.0)}, r"wind\[0\]=nan"),
        ({"mode": "hardware"}, "mode='hardware' is unknown; give computer_vision, simple_flight"),
    ],
)
def test_what_can_not_fly_is_named(changes, message):
    with pytest.raises(InputError, match=f"^{message}"):
        dataclasses.replace(FLIGHT, **changes)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rotor_thrust", {"mass": 1.41, "rotor_thrust": 3.0}),
        ("inertia", {"inertia": (0.0123457, 0.0123457, 1.0)}),
    ],
)
def test_the_value_that_a_message_advises_is_accepted(name, values):
    with pytest.raises(InputError) as refused:
        dataclasses.replace(FLIGHT, **values)
    advised = float(str(refused.value).split()[-1])
    allowed = advised if name == "rotor_thrust" else (0.0123457, 0.0123457, advised)
    dataclasses.replace(FLIGHT, **{**values, name: allowed})


def test_figures_of_the_generic_drone_by_hand():
    assert FLIGHT.control_timestep == pytest.approx(0.099)
    assert FLIGHT.hover_throttle == pytest.approx(9.81 / 16.717785072)
    assert COMPUTER_VISION.is_computer_vision and not FLIGHT.is_computer_vision


@pytest.mark.parametrize(
    ("air", "message"),
    [
        ({"wind": (5.0, 0.0, 0.0)}, r"dynamics\.wind=\[5\.0, 0\.0, 0\.0\] moves nothing"),
        ({"gusts": 1.5}, r"dynamics\.gusts=1\.5 moves nothing in computer-vision mode; give "),
    ],
)
def test_air_moves_nothing_in_computer_vision_mode(air, message):
    dataclasses.replace(FLIGHT, **air).check_air()
    COMPUTER_VISION.check_air()
    with pytest.raises(InputError, match=f"^{message}"):
        dataclasses.replace(COMPUTER_VISION, **air).check_air()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"camera_mount": "wing"}, "camera_mount="),
        ({"mass": math.nan}, "mass=nan"),
        ({"inertia": (1.0, 1.0)}, "inertia"),
        ({"inertia": (-0.01, 0.01, 0.01)}, "inertia"),
        ({"wind": (0.0, 0.0, 51.0)}, "wind"),
        ({"gusts": -1.0}, "gusts=-1.0"),
        ({"gust_length": 0.0}, "gust_length=0.0"),
        ({"tick": 0.0}, "tick=0.0"),
        ({"control_ticks": 0}, "control_ticks=0"),
        ({"restitution": 1.1}, "restitution=1.1"),
        ({"angle_limit": 1.6}, "angle_limit=1.6"),
        ({"rate_gain": (1.0, -1.0, 1.0)}, "rate_gain"),
        ({"rotor_time_constant": -0.1}, "rotor_time_constant=-0.1"),
    ],
)
def test_what_no_drone_has_is_named(change, message):
    with pytest.raises(InputError, match=message):
        dataclasses.replace(FLIGHT, **change)


def test_the_thrust_that_is_asked_for_is_enough():
    needed = 1.1 * 2.0 * 9.81 / 4
    dataclasses.replace(FLIGHT, mass=2.0, rotor_thrust=needed * 1.001)
    with pytest.raises(InputError, match="too small to control"):
        dataclasses.replace(FLIGHT, mass=2.0, rotor_thrust=needed * 0.999)


def test_a_flat_plate_is_a_body():
    """Its moment about the normal is the sum of the other two."""
    plate = dataclasses.replace(FLIGHT, inertia=(0.1, 0.2, 0.3))
    assert plate.inertia == (0.1, 0.2, 0.3)
