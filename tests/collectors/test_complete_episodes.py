import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, base_env
from drone_rl.policies.baselines import ConstantAgent, OracleAgent, RandomAgent
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.trust.metrics import summarise
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream


@pytest.mark.parametrize(
    "settings",
    [TaskSettings(), TaskSettings(num_cubes=5), TaskSettings(step_length=0.5, cube_size=1.0)],
)
def test_oracle_collects_all_cubes(settings):
    env = DroneEnv(100, settings, pixels=False, stream=Stream.REPORT)
    summary = summarise(rollout(OracleAgent(), env, 100))
    assert summary.success.share == 1.0


def test_random_policy_matches_the_original_study():
    env = DroneEnv(500, pixels=False)
    policy = RandomAgent(torch.Generator().manual_seed(0))
    summary = summarise(rollout(policy, env, 500))
    assert 0.7 < summary.mean_goals < 1.0  # 0.84 there
    assert 125 < summary.mean_length < 142  # 133 there


def test_more_episodes_than_fit_into_memory_are_refused():
    env, policy = DroneEnv(1, pixels=False), ConstantAgent(Move.FORWARD)
    with pytest.raises(InputError, match=r"episodes=1000000000000 .*give fewer episodes"):
        rollout(policy, env, 10**12)


def test_episodes_do_not_depend_on_the_batch_size():
    """Of 4 worlds, 10 episodes: three rounds, of which the last gives two worlds'."""
    policy = OracleAgent()
    together = rollout(policy, DroneEnv(4, pixels=False, seed=3), 10)
    alone = [rollout(policy, DroneEnv(1, pixels=False, seed=3, first_world=i), 3) for i in range(4)]
    for name, value in {**vars(together.goals), "length": together.length}.items():
        each = [getattr(one if name == "length" else one.goals, name) for one in alone]
        expected = torch.stack(each, 1).flatten(0, 1)[:10]
        torch.testing.assert_close(value, expected, equal_nan=True, rtol=0, atol=0)
    assert len(together.length.unique()) > 3  # no two alike, or order would not show


def test_greedy_takes_the_mode_and_sampling_follows_the_probabilities(make_pipeline):
    """Odds of 0.4, 0.3 and 0.3: the mode flies straight on, 11 steps to the boundary."""
    task = TaskSettings(num_cubes=1, first_distance=4.0, front_margin=6.5, step_limit=40)

    def lengths(greedy):
        env, actor = make_pipeline(16, task=task)
        logits = actor.module[0].module.layers.logits
        with torch.no_grad():
            logits.weight.zero_()
            logits.bias.copy_(torch.tensor([0.4, 0.3, 0.3]).log())
        episodes = rollout(actor, env, 16, greedy=greedy)
        missed = ~episodes.goals.reached[:, 0]
        return episodes.length[missed]

    assert lengths(True).unique().tolist() == [11]
    sampled = lengths(False).double()
    assert len(sampled.unique()) > 3
    assert 15 < float(sampled.mean()) < 40  # 11 / 0.4 = 27.5 less what hits a limit


def test_heights_are_metres_above_the_drone():
    env = DroneEnv(4, TaskSettings(vertical_bound=1.0, altitude=5.0), pixels=False)
    start = env.state_dict()
    drawn = env.reset()["info", "cube_positions"][..., 2]
    env.load_state_dict(start)
    flown = rollout(ConstantAgent(Move.FORWARD), env, 4)
    torch.testing.assert_close(flown.goals.height, drawn.double() - 5.0)
    assert (flown.end_reason == CubesEnd.FRONT_BOUNDARY).any()
    assert flown.length.max() == 45  # 44 is still within bounds


def test_initial_states_do_not_depend_on_the_policy():
    env = DroneEnv(8, TaskSettings(vertical_bound=1.0, altitude=5.0), pixels=False)
    start = env.state_dict()
    flown = []
    for policy in (OracleAgent(), ConstantAgent(Move.LEFT)):
        env.load_state_dict(start)
        flown.append(rollout(policy, env, 20))
    ours, theirs = (episodes.goals for episodes in flown)
    assert torch.equal(ours.world, theirs.world)
    assert torch.equal(ours.lateral[:, 0], theirs.lateral[:, 0])
    assert torch.equal(ours.height, theirs.height)  # of all cubes
    assert len(ours.height.unique()) == 60
    assert not torch.equal(ours.reached, theirs.reached)
    assert theirs.lateral[:, 1:].isnan().all()  # never reached


@pytest.mark.parametrize(
    ("compiled", "implementation"), [(True, "fused kernel"), (False, "PyTorch")]
)
def test_implementations_run_the_same_episodes(compiled, implementation):
    """Of 4 environments, 6 episodes: two batches, of four and of two."""
    policy = drone_rl.load_policy("good")
    with policy.flying(4, seed=3) as (env, actor):
        before = base_env(env).state_dict()
        flown = rollout(actor, env, 6)
        base_env(env).load_state_dict(before)
        again = rollout(actor, env, 6, compiled=compiled, exact=True)
    assert again.implementation == implementation
    assert again.length.equal(flown.length) and again.end_reason.equal(flown.end_reason)
    assert again.goals.reached.equal(flown.goals.reached)
    assert [len(actions) for actions in again.each("action")] == flown.length.tolist()
    assert torch.equal(torch.cat(again.each("action")), flown.steps["action"])


def test_entries_of_steps_are_kept_on_request():
    env = DroneEnv(2, TaskSettings(), pixels=False)
    oracle = OracleAgent()
    episodes = rollout(oracle, env, 3, keep=None)
    assert len(episodes.steps) == episodes.length.sum()
    assert episodes.steps["next", "info", "collected"].any()
    many = rollout(oracle, env, 1, frames=200)
    assert many.length.sum() >= 200 and len(many) > 2
