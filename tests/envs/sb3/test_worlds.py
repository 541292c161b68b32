"""The adapter equals Stable-Baselines3's own, which steps environments in sequence."""

import numpy as np
import pytest

import drone_rl
from drone_rl.config.transforms import Crop, Gray, Standardize
from drone_rl.utils.errors import InputError

gymnasium = pytest.importorskip("gymnasium", reason="Gymnasium is not installed")


sb3 = pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed")
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor  # noqa: E402 (after the skip)

NAME = "drone_rl/CollectCubes-v0"


SHORT = {"num_cubes": 1, "first_distance": 3.0, "step_limit": 5, "front_margin": 3.0}


COUNT = 4


@pytest.fixture
def make():
    envs = []

    def build(num_envs=COUNT, **options):
        worlds = gymnasium.make_vec(NAME, num_envs=num_envs, autoreset_mode="SameStep", **options)
        envs.append(drone_rl.Sb3Worlds(worlds))
        return envs[-1]

    yield build
    for env in envs:
        env.close()


def assert_equal(ours, theirs):
    assert ours.keys() == theirs.keys()
    for name, value in theirs.items():
        assert np.array_equal(ours[name], value), name
        assert np.asarray(ours[name]).dtype == np.asarray(value).dtype, name


@pytest.mark.parametrize("observations", ["pixels", "state"])
def test_adapter_equals_stable_baselines3s_vec_env(make, observations):
    options = {**SHORT, "observations": observations}
    ours = make(**options)
    theirs = DummyVecEnv([lambda: gymnasium.make(NAME, **options)] * COUNT)
    assert (ours.observation_space, ours.action_space) == (
        theirs.observation_space,
        theirs.action_space,
    )
    assert ours.seed(7) == theirs.seed(7)
    assert np.array_equal(ours.reset(), theirs.reset())
    for one, other in zip(ours.reset_infos, theirs.reset_infos, strict=True):
        assert_equal(one, other)
    moves, cut = np.random.default_rng(2), []
    for _ in range(25):
        actions = moves.integers(0, 3, COUNT)
        seen, rewards, done, infos = ours.step(actions)
        wanted = theirs.step(actions)
        for one, other in zip((seen, rewards, done), wanted[:3], strict=True):
            assert one.dtype == other.dtype and np.array_equal(one, other)
        for i in range(COUNT):
            if done[i]:
                assert_equal(infos[i], wanted[3][i])
                cut.append(infos[i]["TimeLimit.truncated"])
            else:
                assert infos[i] == {}
    assert {False, True} == set(cut)
    assert np.array_equal(ours.reset(), theirs.reset())  # the random streams continue
    theirs.close()


def test_transforms_are_applied(make):
    steps = [Gray(), Standardize(), Crop(top=2, bottom=9)]
    raw, seen = make(**SHORT), make(transforms=steps, **SHORT)
    assert seen.observation_space.shape == (1, 7, 64)
    for env in (raw, seen):
        env.seed(0)
    frames, images = raw.reset(), seen.reset()
    done = np.zeros(COUNT, bool)
    while not done.any():
        gray = frames.astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32) / 255
        wanted = (gray[:, None, 2:9] - 0.53) / 0.21
        np.testing.assert_allclose(images, wanted, atol=1e-5)
        assert images.dtype == np.float32
        frames, _, done, infos = raw.step(np.zeros(COUNT, int))
        images, _, _, same = seen.step(np.zeros(COUNT, int))
    (world, *_) = np.flatnonzero(done)
    last = infos[world]["terminal_observation"].astype(np.float32)
    gray = last @ np.array([0.299, 0.587, 0.114], np.float32) / 255
    wanted = (gray[None, 2:9] - 0.53) / 0.21
    np.testing.assert_allclose(same[world]["terminal_observation"], wanted, atol=1e-5)


@pytest.mark.parametrize("algorithm", [sb3.PPO, sb3.A2C])
def test_ppo_and_a2c_train_our_network(make, algorithm):
    env = VecMonitor(make(transforms=[Gray(), Standardize()], **SHORT))
    kwargs = {"features_extractor_class": drone_rl.Sb3Trunk, "net_arch": []}
    batch = {"batch_size": 16, "n_epochs": 1} if algorithm is sb3.PPO else {}
    model = algorithm("CnnPolicy", env, n_steps=8, policy_kwargs=kwargs, seed=0, **batch)
    before = model.policy.action_net.weight.detach().clone()
    model.learn(64)
    assert model.num_timesteps == 64
    assert not before.equal(model.policy.action_net.weight)
    assert len(model.ep_info_buffer) == len(model.ep_success_buffer) >= 8


def test_environment_attributes_are_accessible(make):
    env = make(num_envs=2, render_mode="rgb_array")
    env.reset()
    assert env.render_mode == "rgb_array"
    assert env.get_attr("render_mode", 1) == ["rgb_array"]
    assert env.render().shape == (720, 640, 3)  # frames are stacked vertically
    assert env.env_is_wrapped(gymnasium.Wrapper) == [False, False]
    assert not env.has_attr("wind")


def test_invalid_options_raise_one_line(make):
    with pytest.raises(InputError, match=r"^autoreset_mode=NextStep, but Stable-Baselines3 needs"):
        drone_rl.Sb3Worlds(gymnasium.make_vec(NAME, num_envs=2))
    env = make(num_envs=2)
    with pytest.raises(InputError, match=r"^wind can't be set per environment"):
        env.set_attr("wind", 1)


def test_missing_extra_raises_with_install_command(monkeypatch):
    import sys

    for name in [*sys.modules]:
        if name.startswith(("stable_baselines3", "drone_rl.envs.sb3")):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    with pytest.raises(InputError, match=r"pip install -e '.\[sb3\]' in the checkout$"):
        import drone_rl.envs.sb3.worlds  # noqa: F401
