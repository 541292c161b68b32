import pytest
import torch

from drone_rl.collectors import EpisodeCollector
from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import constant_policy, oracle_policy, random_policy
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.trust.metrics import summarise
from drone_rl.utils.seeding import Stream


@pytest.mark.parametrize(
    "settings",
    [TaskSettings(), TaskSettings(num_cubes=5), TaskSettings(step_length=0.5, cube_size=1.0)],
)
def test_oracle_collects_everything(settings):
    env = DroneEnv(100, settings, pixels=False, stream=Stream.REPORT)
    summary = summarise(run_episodes(env, oracle_policy(settings), 100))
    assert summary["success"]["share"] == 1.0


def test_random_policy_collects_what_the_original_studys_did():
    env = DroneEnv(500, pixels=False)
    policy = random_policy(MOVES, torch.Generator().manual_seed(0))
    summary = summarise(run_episodes(env, policy, 500))
    assert 0.7 < summary["mean_goals"] < 1.0  # 0.84 there
    assert 125 < summary["mean_length"] < 142  # 133 there


def test_exactly_as_many_episodes_as_asked_for():
    env = DroneEnv(8, pixels=False)
    episodes = run_episodes(env, oracle_policy(env.worlds.task.settings), 11)
    assert len(episodes.length) == 11


def test_episodes_are_those_of_each_world_alone_in_order_and_the_first_of_them():
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


def test_greedy_flies_by_the_mode_and_sampling_by_the_odds(make_pipeline):
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


@pytest.mark.parametrize(("number", "batches"), [(1, 1), (8, 1), (9, 2), (16, 2)])
def test_no_batch_is_flown_in_vain_and_no_picture_kept(make_pipeline, monkeypatch, number, batches):
    collected, collect = [], EpisodeCollector.collect
    monkeypatch.setattr(
        EpisodeCollector, "collect", lambda *how: collected.append(collect(*how)) or collected[-1]
    )
    task = TaskSettings(num_cubes=1, first_distance=4.0, step_limit=4)
    env, actor = make_pipeline(8, task=task)
    assert len(run_episodes(env, actor, number)) == number
    assert len(collected) == batches
    assert not any("pixels" in batch for batch in collected)


def test_heights_are_metres_above_the_drone():
    env = DroneEnv(4, TaskSettings(vertical_bound=1.0, altitude=5.0), pixels=False)
    start = env.state_dict()
    drawn = env.reset()["info", "cube_positions"][..., 2]
    env.load_state_dict(start)
    flown = run_episodes(env, constant_policy(Move.FORWARD), 4)
    torch.testing.assert_close(flown.goals.height, drawn.double() - 5.0)
    assert (flown.end_reason == EndReason.FRONT_BOUNDARY).any()
    assert flown.length.max() == 45  # 44 is still within bounds


def test_the_kth_episode_is_the_same_world_whatever_the_policy():
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


def test_greedy_repeats_and_sampling_does_not(make_pipeline):
    settings = TaskSettings(num_cubes=1, first_distance=4.0, step_limit=20)

    def lengths(greedy):
        env, actor = make_pipeline(6, task=settings)
        first = run_episodes(env, actor, 6, greedy=greedy).length
        env.set_seed(0)
        return first, run_episodes(env, actor, 6, greedy=greedy).length

    assert torch.equal(*lengths(True))
    assert not torch.equal(*lengths(False))
