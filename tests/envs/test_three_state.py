import torch
from torchrl.envs.utils import check_env_specs

from drone_rl.envs.three_state import ThreeStateEnv


def test_specs():
    check_env_specs(ThreeStateEnv(4))


def test_action_zero_stays_and_is_truncated():
    env = ThreeStateEnv(5, horizon=2)
    rollout = env.rollout(9, policy=lambda td: td.set("action", torch.zeros(5).long()))
    assert rollout.shape == (5, 2)
    assert rollout["next", "truncated"][:, -1].all()
    assert rollout["next", "reward"].sum() == 0


def test_action_one_succeeds_three_times_in_four():
    env = ThreeStateEnv(20_000)
    state = env.reset().set("action", torch.ones(20_000).long())
    after = env.step(state)["next"]
    assert after["terminated"].all()
    assert abs(float(after["reward"].mean()) - 0.75) < 4 * (0.75 * 0.25 / 20_000) ** 0.5
    assert torch.equal(after["reward"][:, 0], after["observation"][:, 2])


def test_seed_repeats():
    def draw(seed):
        env = ThreeStateEnv(50, seed=seed)
        return env.step(env.reset().set("action", torch.ones(50).long()))["next", "reward"]

    assert torch.equal(draw(1), draw(1))
    assert not torch.equal(draw(1), draw(2))
