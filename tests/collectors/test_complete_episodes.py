import pytest
import torch

import drone_rl
from drone_rl.collectors.complete_episodes import (
    StepLog,
    episode_batches,
    final_episodes,
    run_episodes,
)
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, base_env
from drone_rl.policies.baselines import constant_policy, oracle_policy, random_policy
from drone_rl.sim.actions import MOVES, Move
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
    summary = summarise(run_episodes(env, oracle_policy(settings), 100))
    assert summary["success"]["share"] == 1.0


def test_random_policy_matches_the_original_study():
    env = DroneEnv(500, pixels=False)
    policy = random_policy(MOVES, torch.Generator().manual_seed(0))
    summary = summarise(run_episodes(env, policy, 500))
    assert 0.7 < summary["mean_goals"] < 1.0  # 0.84 there
    assert 125 < summary["mean_length"] < 142  # 133 there


def test_more_episodes_than_fit_into_memory_are_refused():
    env, policy = DroneEnv(1, pixels=False), constant_policy(Move.FORWARD)
    with pytest.raises(InputError, match=r"episodes=1000000000000 .*give fewer episodes"):
        run_episodes(env, policy, 10**12)


def test_episodes_do_not_depend_on_the_batch_size():
    """Of 4 worlds, 10 episodes: three rounds, of which the last gives two worlds'."""
    policy = oracle_policy(TaskSettings())
    together = run_episodes(DroneEnv(4, pixels=False, seed=3), policy, 10)
    alone = [
        run_episodes(DroneEnv(1, pixels=False, seed=3, first_world=i), policy, 3) for i in range(4)
    ]
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
        episodes = run_episodes(env, actor, 16, greedy=greedy)
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
    flown = run_episodes(env, constant_policy(Move.FORWARD), 4)
    torch.testing.assert_close(flown.goals.height, drawn.double() - 5.0)
    assert (flown.end_reason == CubesEnd.FRONT_BOUNDARY).any()
    assert flown.length.max() == 45  # 44 is still within bounds


def test_initial_states_do_not_depend_on_the_policy():
    env = DroneEnv(8, TaskSettings(vertical_bound=1.0, altitude=5.0), pixels=False)
    start = env.state_dict()
    flown = []
    for policy in (oracle_policy(env.worlds.task.settings), constant_policy(Move.LEFT)):
        env.load_state_dict(start)
        flown.append(run_episodes(env, policy, 20))
    ours, theirs = (episodes.goals for episodes in flown)
    assert torch.equal(ours.world, theirs.world)
    assert torch.equal(ours.lateral[:, 0], theirs.lateral[:, 0])
    assert torch.equal(ours.height, theirs.height)  # of all cubes
    assert len(ours.height.unique()) == 60
    assert not torch.equal(ours.reached, theirs.reached)
    assert theirs.lateral[:, 1:].isnan().all()  # never reached


@pytest.mark.parametrize(
    ("is_compiled", "implementation"), [(True, "fused kernel"), (False, "PyTorch")]
)
def test_implementations_run_the_same_episodes(is_compiled, implementation):
    """Of 4 environments, 6 episodes: two batches, of four and of two."""
    policy, log = drone_rl.load_policy("good"), StepLog()
    with policy.flying(4, seed=3) as (env, actor):
        before = base_env(env).state_dict()
        flown = run_episodes(env, actor, 6)
        base_env(env).load_state_dict(before)
        batches = episode_batches(env, actor, 6, is_compiled=is_compiled, log=log)
        found = [final_episodes(env, batch) for batch in batches]
    assert log.implementation == implementation
    assert [len(one) for one in found] == [4, 2]
    assert torch.cat([one.length for one in found]).equal(flown.length)
    assert torch.cat([one.end_reason for one in found]).equal(flown.end_reason)
    assert torch.cat([one.goals.reached for one in found]).equal(flown.goals.reached)
    assert [len(actions) for actions in log.actions] == flown.length.tolist()
