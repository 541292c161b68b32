import pytest
import torch

from drone_rl.sim.dynamics import Goals, Mode
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.utils.errors import InputError
from tests.flying import POSITIONS, doubles

FOUR = doubles((1.0, 2.0, 3.0, 4.0))


def test_drifts_default_to_zero():
    assert Goals(POSITIONS, FOUR).drifts.tolist() == [[0, 0, 0, 0]]
    assert Goals(POSITIONS, FOUR, FOUR).drifts is FOUR


def test_rotor_goals_use_rotor_modes():
    goals = rotor_goals(FOUR)
    assert goals.modes == (Mode.ROTOR,) * 4 and goals.values is FOUR


P, V, A, R, H, T, S = (
    Mode.POSITION,
    Mode.VELOCITY,
    Mode.ANGLE,
    Mode.RATE,
    Mode.HEADING_VELOCITY,
    Mode.THROTTLE,
    Mode.ROTOR,
)


@pytest.mark.parametrize(
    ("modes", "message"),
    [
        ((T, P, A, P), r"modes\[0\]=.* is unknown; give one of: rate"),
        ((P, P, P, P), r"modes\[2\]=.* is unknown; give one of: rate, angle, rotor"),
        ((P, P, A, R), r"modes\[3\]=.* is unknown; give one of: throttle, velocity"),
        ((S, S, S, P), "modes=rotor, rotor, rotor, position: rotor is for all axes"),
        ((H, V, A, P), "modes=heading_velocity, velocity, angle, position: the first two go"),
        ((A, V, A, P), "the first two go together; give both the same"),
        ((R, A, A, P), "the first two go together"),
    ],
)
def test_invalid_mode_combinations_raise(modes, message):
    with pytest.raises(InputError, match=message):
        Goals(modes, FOUR)


@pytest.mark.parametrize(
    "modes", [(P, P, A, P), (V, V, R, T), (A, A, R, V), (R, R, A, T), (H, H, R, P)]
)
def test_valid_mode_combinations_are_accepted(modes):
    assert Goals(modes, FOUR).modes == modes


def test_goals_and_drifts_of_wrong_shape_raise():
    with pytest.raises(InputError, match=r"goals of shape \(4,\) are not \(num_envs, 4\)"):
        Goals(POSITIONS, FOUR[0])
    with pytest.raises(InputError, match=r"goals of shape \(1, 3\)"):
        Goals(POSITIONS, FOUR[:, :3])
    with pytest.raises(InputError, match=r"drift of shape \(4,\) is not that of the goals"):
        Goals(POSITIONS, FOUR, torch.zeros(4))
