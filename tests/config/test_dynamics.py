import pytest

from drone_rl.config import COMPUTER_VISION, DynamicsSettings
from drone_rl.utils.errors import InputError

FLIGHT = DynamicsSettings(mode="simple_flight")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mass": 0.0}, r"mass=0\.0: it must be a number above 0"),
        ({"mass": 2.0}, r"rotor_thrust=4\.179\d* can't carry .* mass=2\.0; give at least 5\.401"),
        ({"inertia": (1.0, 1.0, 2.1)}, r"inertia=\[1\.0, 1\.0, 2\.1\] is of no body"),
        ({"wind": (float("nan"), 0.0, 0.0)}, r"wind\[0\]=nan"),
        ({"mode": "hardware"}, "mode='hardware': it must be 'computer_vision' or"),
    ],
)
def test_impossible_drones_are_refused(changes, message):
    with pytest.raises(InputError, match=f"^{message}"):
        FLIGHT.replace(**changes)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("rotor_thrust", {"mass": 1.41, "rotor_thrust": 3.0}),
        ("inertia", {"inertia": (0.0123457, 0.0123457, 1.0)}),
    ],
)
def test_the_value_that_a_message_advises_is_accepted(name, values):
    with pytest.raises(InputError) as refused:
        FLIGHT.replace(**values)
    advised = float(str(refused.value).split()[-1])
    allowed = advised if name == "rotor_thrust" else (0.0123457, 0.0123457, advised)
    FLIGHT.replace(**{**values, name: allowed})


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
def test_wind_in_computer_vision_mode_is_refused(air, message):
    FLIGHT.replace(**air).check_air()
    COMPUTER_VISION.check_air()
    with pytest.raises(InputError, match=f"^{message}"):
        COMPUTER_VISION.replace(**air).check_air()
