"""Complete episodes in order, and what a batch of them holds."""

import pytest
import torch
from tensordict.nn import TensorDictModule
from torchrl.envs import CatFrames, Compose, TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels
from drone_rl.envs.rollout import Act
from drone_rl.objectives import RewardToGo
from drone_rl.policies.baselines import ConstantAgent, OracleAgent
from drone_rl.utils.errors import InputError
from tests.continuous import make_env as make_continuous_env
from tests.continuous import make_policy

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
FOG = AppearanceSettings(fog_visibility=(5.0, 50.0))


@pytest.mark.parametrize(
    ("task", "look"), [(SHORT, None), (SHORT, FOG), (PillarsSettings(num_rows=1), None)]
)
def test_batches_equal_stepping_by_torchrl(make_pipeline, task, look):
    """The observations, rewards and ends of each episode, in two batches."""
    env, actor = make_pipeline(3, task=task, appearance=look)
    other, _ = make_pipeline(3, task=task, appearance=look)
    collector = EpisodeCollector(env, actor, info=("drone",))
    for number in range(2):
        batch, state = collector.collect(), other.reset()
        ids = batch["collector", "traj_ids"] - 3 * number
        episodes = [batch[ids == i] for i in range(3)]
        for t in range(max(map(len, episodes))):
            on = torch.tensor([t < len(episode) for episode in episodes])
            rows = torch.stack([episode[t] for episode in episodes if t < len(episode)])
            assert torch.equal(rows["pixels"], state["pixels"][on])
            action = torch.zeros(3, dtype=torch.int64)
            action[on] = rows["action"]
            state = other.step(state.set("action", action).set("_step", on))
            for key in ("reward", "done", "truncated", ("info", "end_reason"), ("info", "drone")):
                assert torch.equal(rows["next"][key], state["next"][key][on])
            state = state["next"]
        assert batch["next", "done"].sum() == 3


def test_continuous_actions_are_collected():
    env = make_continuous_env(5)
    batch = EpisodeCollector(env, make_policy(env)[1]).collect()
    assert batch["action"].shape == (len(batch), 3) and batch["action"].dtype == torch.float32


def test_collecting_from_the_first_environments(make_pipeline):
    collector = EpisodeCollector(*make_pipeline(4, task=SHORT))
    assert collector.collect(2)["collector", "traj_ids"].unique().tolist() == [0, 1]
    assert collector.collect()["collector", "traj_ids"].unique().tolist() == [2, 3, 4, 5]
    assert collector.episodes == 6


def test_finished_environments_are_not_rendered(make_pipeline):
    env, actor = make_pipeline(4, task=SHORT)
    num_rendered = []
    render = env.worlds.render
    env.worlds.render = lambda state, *view: num_rendered.append(len(state)) or render(state, *view)
    batch = EpisodeCollector(env, actor).collect()
    assert sum(num_rendered) == len(batch)  # exactly the frames with an action


def test_observations_are_optional(make_pipeline):
    env, actor = make_pipeline(2, task=SHORT)
    batch = EpisodeCollector(env, actor, keep_actor_entries=False).collect()
    assert "pixels" not in batch
    assert "action" in batch


def test_actors_read_the_true_state():
    def straight(drone):
        return torch.zeros(len(drone), dtype=torch.int64)

    actor = TensorDictModule(straight, in_keys=[("info", "drone")], out_keys=["action"])
    batch = EpisodeCollector(DroneEnv(3, SHORT, pixels=False), actor).collect()
    read = {key for key in batch.keys(True, True) if key[0] not in ("next", "collector")}
    assert read == {"action", ("info", "drone")}
    first = batch["collector", "traj_ids"].diff(prepend=torch.tensor([-1])) > 0
    drone = batch["info", "drone"]
    assert drone[first].tolist() == [[0.0, 0.0, SHORT.altitude]] * 3
    steps = drone.diff(dim=0).abs().sum(-1)[~first[1:]]
    torch.testing.assert_close(steps, torch.ones_like(steps))  # one meter per step


def test_agents_may_remember_each_environment():
    """An agent that counts its steps in each environment, from 0 where an episode starts."""

    class Counting:
        def __init__(self):
            self.count, self.seen = torch.zeros(3, dtype=torch.int64), []

        def act(self, context):
            self.count[context.rows[context.starts]] = 0
            self.seen.append(self.count[context.rows].tolist())
            self.count[context.rows] += 1
            return Act(torch.zeros_like(context.rows))

    agent = Counting()
    collector = EpisodeCollector(DroneEnv(3, SHORT, pixels=False), agent)
    for _ in range(2):
        batch = collector.collect()
    assert agent.seen[0] == [0, 0, 0] and agent.seen[1] == [1, 1, 1]
    assert [0, 0, 0] in agent.seen[2:]
    assert batch.keys() == {"action", "next", "collector"}


def test_episodes_of_one_step():
    task = TaskSettings(num_cubes=1, first_distance=2.6, step_limit=1)
    batch = EpisodeCollector(DroneEnv(3, task, pixels=False), OracleAgent()).collect()
    assert batch["collector", "traj_ids"].tolist() == [0, 1, 2]
    assert batch["next", "done"].all()


def test_postproc_receives_each_batch(make_pipeline):
    env, actor = make_pipeline(2, task=SHORT)
    for batch in EpisodeCollector(env, actor, postproc=RewardToGo(0.5), total_frames=7):
        expected = RewardToGo(0.5)(batch.exclude("return_to_go"))["return_to_go"]
        assert torch.equal(batch["return_to_go"], expected)


def test_outer_exploration_type_is_respected(make_pipeline):
    collector = EpisodeCollector(*make_pipeline(5, task=SHORT))
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        batch = collector.collect()
    assert torch.equal(batch["action"], batch["logits"].argmax(-1))
    batch = collector.collect()
    assert not torch.equal(batch["action"], batch["logits"].argmax(-1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda env: EpisodeCollector(
                TransformedEnv(env, Compose(GrayPixels(), CatFrames(2, -3, ["pixels"]))),
                ConstantAgent(0),
            ),
            r"env has GrayPixels in a TransformedEnv; give transforms .* make_env\(transforms=",
        ),
        (
            lambda env: EpisodeCollector(env, ConstantAgent(0), info=("fuel",)),
            "info=fuel is not known of these drones; choose from cubes, collected",
        ),
    ],
)
def test_unusable_arguments_raise(make, message):
    with pytest.raises(InputError, match=message):
        make(DroneEnv(2, SHORT))
