import numpy as np
import pytest
import torch

from drone_rl.envs import DroneEnv
from drone_rl.evaluation import ConstantPolicy, Oracle, RandomPolicy, run_episodes, summarise
from drone_rl.evaluation.video import film_episode, write_video
from drone_rl.sim.rules import Action
from drone_rl.sim.settings import TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.seeding import Stream


@pytest.mark.parametrize(
    "settings",
    [TaskSettings(), TaskSettings(num_cubes=5), TaskSettings(step_length=0.5, cube_size=1.0)],
)
def test_oracle_collects_everything(settings):
    env = DroneEnv(100, settings, pixels=False, stream=Stream.REPORT)
    summary = summarise(run_episodes(env, Oracle(settings), 100))
    assert summary["success"]["share"] == 1.0


def test_random_policy_collects_what_the_original_studys_did():
    env = DroneEnv(500, pixels=False)
    policy = RandomPolicy(3, torch.Generator().manual_seed(0))
    summary = summarise(run_episodes(env, policy, 500))
    assert 0.7 < summary["mean_cubes"] < 1.0  # 0.84 there
    assert 125 < summary["mean_length"] < 142  # 133 there


def test_exactly_as_many_episodes_as_asked_for():
    env = DroneEnv(8, pixels=False)
    episodes = run_episodes(env, Oracle(env.worlds.settings), 11)
    assert len(episodes.length) == 11


def test_the_kth_episode_is_the_same_world_whatever_the_policy():
    env = DroneEnv(8, TaskSettings(vertical_bound=1.0, altitude=5.0), pixels=False)
    start = env.state_dict()
    flown = []
    for policy in (Oracle(env.worlds.settings), ConstantPolicy(Action.LEFT)):
        env.load_state_dict(start)
        flown.append(run_episodes(env, policy, 20))
    ours, theirs = flown
    assert torch.equal(ours.lateral[:, 0], theirs.lateral[:, 0])
    assert torch.equal(ours.height, theirs.height)  # of all cubes
    assert len(ours.height.unique()) == 60
    assert not torch.equal(ours.collected, theirs.collected)
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


def test_film_and_files(make_pipeline, tmp_path):
    settings = TaskSettings(num_cubes=1, first_distance=4.0, step_limit=4)
    env, actor = make_pipeline(1, task=settings)
    frames = list(film_episode(env, actor))
    assert 2 <= len(frames) <= 5
    assert frames[0].shape == (400, 1280, 3)
    assert len({f.tobytes() for f in frames}) == len(frames)
    files = write_video(frames, tmp_path / "sub" / "episode")
    assert [f.suffix for f in files] == [".mp4", ".gif"]
    assert all(f.stat().st_size > 1000 for f in files)


def test_video_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="another folder"):
        write_video([np.zeros((16, 16, 3), np.uint8)], tmp_path / "file" / "episode")
