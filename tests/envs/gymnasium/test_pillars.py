"""The task pillars as Gymnasium environments, single and batched."""

import warnings

import numpy as np
import pytest

from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", minversion="1.1", reason="Gymnasium is not installed")

NAME = "drone_rl/Pillars-v0"
WIDE = {"width": 64, "height": 64}
SHORT = {"num_rows": 1, "first_distance": 4.0, "finish_margin": 2.0, "step_limit": 12}


@pytest.mark.parametrize(
    "options", [{}, {"observations": "state"}, {"render_mode": "rgb_array"}, {"width": 0.6}]
)
def test_gymnasiums_checker_passes(options):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(NAME, **options)
        check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize("options", [{"observations": "state"}, {"camera": WIDE}])
def test_stable_baselines3s_checker_passes(options):
    reason = "Stable-Baselines3 is not installed"
    checker = pytest.importorskip("stable_baselines3.common.env_checker", reason=reason)
    env = gymnasium.make(NAME, **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(env.unwrapped)
    env.close()


def test_touching_a_pillar_terminates_and_the_limit_truncates():
    """Flying straight ahead touches a pillar; moving left and right never does."""
    ahead = gymnasium.make_vec(NAME, num_envs=8, autoreset_mode="Disabled", density=1.0, **SHORT)
    ahead.reset(seed=0)
    ended = np.zeros(8, bool)
    for _ in range(100):
        _, _, terminated, truncated, _ = ahead.step(np.zeros(8, int))
        assert not truncated.any()
        ended = terminated
        if ended.any():
            break
    assert ended.any()
    ahead.close()
    aside = gymnasium.make(NAME, **SHORT)
    aside.reset(seed=0)
    ends = [aside.step(1 + i % 2)[2:4] for i in range(12)]
    assert ends[:-1] == [(False, False)] * 11 and ends[-1] == (False, True)
    aside.close()


def test_batch_equals_single_environments():
    ours = gymnasium.make_vec(NAME, num_envs=3, **SHORT)
    theirs = gymnasium.make_vec(NAME, num_envs=3, vectorization_mode="sync", **SHORT)
    draw = np.random.default_rng(0)
    assert np.array_equal(ours.reset(seed=5)[0], theirs.reset(seed=5)[0])
    for _ in range(30):
        actions = draw.integers(0, 3, 3)
        for one, other in zip(ours.step(actions)[:4], theirs.step(actions)[:4], strict=True):
            assert np.array_equal(one, other)
    ours.close()
    theirs.close()


def test_invalid_fields_and_options_raise():
    with pytest.raises(InputError, match=r"num_cubes"):
        gymnasium.make(NAME, num_cubes=2)
    with pytest.raises(InputError, match=r"pillars|density|path"):
        gymnasium.make(NAME, density=50.0).reset(seed=0)
