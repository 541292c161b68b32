"""Complete episodes in order, and the interface of TorchRL's collectors."""

import pytest
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule, probabilistic
from torchrl.data import Binary, Categorical, Composite, Unbounded
from torchrl.envs import EnvBase
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector
from drone_rl.collectors.episodes import SteppingCollector
from drone_rl.config import TaskSettings
from drone_rl.envs import DroneEnv, GrayPixels, with_transforms
from drone_rl.envs.direct_renderer import Reasons
from drone_rl.objectives import RewardToGo
from drone_rl.policies import SmallCNN, make_actor
from drone_rl.policies.baselines import oracle_policy

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)


TRUTH = (("next", "info", "cubes"), ("next", "info", "end_reason"))


class Scripted(EnvBase):
    """Episodes of known lengths; the frame of environment w is 100 w + 10 episode + step."""

    LENGTHS = ((3, 1, 2), (1, 1, 4), (2, 5, 1))

    def __init__(self):
        super().__init__(batch_size=torch.Size([3]))
        self.observation_spec = Composite(frame=Unbounded((3, 1)), shape=(3,))
        self.action_spec = Categorical(1000, shape=(3,), dtype=torch.int64)
        self.reward_spec = Unbounded((3, 1))
        self.full_done_spec = Composite(done=Binary(1, (3, 1), dtype=torch.bool), shape=(3,))
        self.episode, self.step_of = torch.full((3,), -1), torch.zeros(3).long()

    def _frame(self):
        return (100 * torch.arange(3) + 10 * self.episode + self.step_of).float()[:, None]

    def _reset(self, tensordict=None, **kwargs):
        self.episode, self.step_of = self.episode + 1, torch.zeros(3).long()
        return TensorDict({"frame": self._frame(), "done": torch.zeros(3, 1).bool()}, [3])

    def _step(self, tensordict):
        reward = -tensordict["action"].float()[
            :, None
        ]  # reward of the frame to which the action belongs
        self.step_of = self.step_of + 1
        lengths = torch.tensor([self.LENGTHS[w][int(self.episode[w])] for w in range(3)])
        done = (self.step_of >= lengths)[:, None]
        return TensorDict({"frame": self._frame(), "reward": reward, "done": done}, [3])

    def _set_seed(self, seed):
        pass


def scripted(**kwargs):
    """Return a collector whose actor returns the frame number as action."""
    actor = TensorDictModule(lambda f: f[:, 0].long(), in_keys=["frame"], out_keys=["action"])
    return EpisodeCollector(Scripted(), actor, **{"next_keys": (("next", "frame"),), **kwargs})


def test_every_frame_appears_once_in_order_with_its_action():
    collector = scripted()
    for episode, first in ((0, 0), (1, 3), (2, 6)):
        batch = collector.collect()
        lengths = [Scripted.LENGTHS[w][episode] for w in range(3)]
        frames = [100 * w + 10 * episode + t for w in range(3) for t in range(lengths[w])]
        assert batch["frame"][:, 0].tolist() == batch["action"].tolist() == frames
        assert batch["next", "reward"][:, 0].tolist() == [-f for f in frames]
        assert batch["next", "frame"][:, 0].tolist() == [f + 1 for f in frames]
        ends = [t == length - 1 for length in lengths for t in range(length)]
        assert batch["next", "done"][:, 0].tolist() == ends
        ids = [first + w for w in range(3) for _ in range(lengths[w])]
        assert batch["collector", "traj_ids"].tolist() == ids
    assert (collector.frames, collector.episodes) == (20, 9)


def test_collecting_from_the_first_environments():
    collector = scripted()
    batch = collector.collect(2)
    assert batch["frame"][:, 0].tolist() == [0, 1, 2, 100]
    assert (collector.frames, collector.episodes) == (4, 2)
    following = collector.collect(1)
    assert following["frame"][:, 0].tolist() == [10]
    assert following["collector", "traj_ids"].tolist() == [2]


def test_total_frames_stops_before_an_unneeded_batch():
    assert [len(batch) for batch in scripted(total_frames=6)] == [6]
    assert [len(batch) for batch in scripted(total_frames=7)] == [6, 7]
    assert [len(batch) for batch in scripted(total_frames=0)] == []


def test_nested_entries_are_read_and_kept_as_leaves():
    """One actor reads the true state; the other writes an entry in addition to its action."""
    env = DroneEnv(2, SHORT, pixels=False)
    assert EpisodeCollector(env, oracle_policy(SHORT)).collect()["next", "reward"].sum() > 0
    actor = TensorDictModule(
        lambda f: (f[:, 0].long(), f + 1), in_keys=["frame"], out_keys=["action", ("note", "more")]
    )
    batch = EpisodeCollector(Scripted(), actor, next_keys=()).collect()
    assert torch.equal(batch["note", "more"], batch["frame"] + 1)
    assert batch["frame"][:, 0].tolist() == [0, 1, 2, 100, 200, 201]


def test_state_resumes_collection():
    first = scripted()
    first.env.state_dict, first.env.load_state_dict = dict, lambda state: None
    first.collect()
    assert first.state_dict() == {"frames": 6, "episodes": 3, "worlds": {}}
    second = scripted()
    second.env.load_state_dict = lambda state: None
    second.load_state_dict(first.state_dict())
    assert (second.frames, second.episodes) == (6, 3)
    assert second.collect()["collector", "traj_ids"].unique().tolist() == [3, 4, 5]


@pytest.fixture
def collector(make_pipeline):
    return EpisodeCollector(*make_pipeline(5, task=SHORT), next_keys=TRUTH)


def test_batch_contains_complete_episodes(collector):
    batch = collector.collect()
    ids, done = batch["collector", "traj_ids"], batch["next", "done"][:, 0]
    assert ids.unique().tolist() == [0, 1, 2, 3, 4]
    assert torch.equal(ids, ids.sort().values)
    last = torch.cat([ids[1:] != ids[:-1], torch.tensor([True])])
    assert torch.equal(done, last)  # done is exactly the last step of each episode


def test_finished_environments_are_not_rendered(make_pipeline):
    env, actor = make_pipeline(4, task=SHORT)
    num_rendered = []
    render = env.base_env.worlds.render
    env.base_env.worlds.render = lambda s, *view, **look: (
        num_rendered.append(len(s)) or render(s, *view)
    )
    batch = EpisodeCollector(env, actor).collect()
    assert sum(num_rendered) == len(batch)  # exactly the frames with an action


def test_observations_are_optional(make_pipeline):
    env, actor = make_pipeline(2, task=SHORT)
    batch = EpisodeCollector(env, actor, keep_actor_entries=False).collect()
    assert "pixels" not in batch
    assert "action" in batch


@pytest.fixture
def seeing(make_pipeline):
    """Return a collector whose policy reads the true state; three environments, no rendering."""
    return EpisodeCollector(DroneEnv(3, SHORT, pixels=False), oracle_policy(SHORT), next_keys=TRUTH)


def test_policy_inputs_are_available_and_kept(seeing):
    batch = seeing.collect()
    assert len(batch) > 3  # the second step needs the state after the first
    read = set(batch.keys(True, True)) - {"action", ("collector", "traj_ids")}
    assert {key for key in read if key[0] != "next"} == set(oracle_policy(SHORT).in_keys)
    first = batch["collector", "traj_ids"].diff(prepend=torch.tensor([-1])) > 0
    drone, after = batch["info", "drone"], batch["next", "info", "cubes"][:, 0]
    assert drone[first].tolist() == [[0.0, 0.0, SHORT.altitude]] * 3
    steps = drone.diff(dim=0).abs().sum(-1)[~first[1:]]
    torch.testing.assert_close(steps, torch.ones_like(steps))  # one meter per step
    assert after[~first.roll(-1)].max() < 2  # all cubes end an episode


def test_episode_ids_continue_across_batches(seeing):
    ids = [set(seeing.collect()["collector", "traj_ids"].tolist()) for _ in range(3)]
    assert ids == [{0, 1, 2}, {3, 4, 5}, {6, 7, 8}]
    assert seeing.episodes == 9


def test_episodes_of_one_step():
    task = TaskSettings(num_cubes=1, first_distance=2.6, step_limit=1)
    batch = EpisodeCollector(DroneEnv(3, task, pixels=False), oracle_policy(task)).collect()
    assert batch["collector", "traj_ids"].tolist() == [0, 1, 2]
    assert batch["next", "done"].all()


def test_steps_are_masked_once_an_episode_has_ended(seeing):
    masked, step = [], seeing.env._step
    seeing.env._step = lambda state: masked.append("_step" in state) or step(state)
    batch = EpisodeCollector(seeing.env, seeing.actor, acceleration="none").collect()
    lengths = batch["collector", "traj_ids"].bincount()
    assert len(masked) == int(lengths.max())  # no step after the last episode
    assert masked.index(True) == int(lengths.min())
    assert all(masked[int(lengths.min()) :])


def test_postproc_receives_each_batch():
    collector = scripted(postproc=RewardToGo(0.5), total_frames=7)
    for batch in collector:
        expected = RewardToGo(0.5)(batch.exclude("return_to_go"))["return_to_go"]
        assert torch.equal(batch["return_to_go"], expected)


TASK = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
KEPT = [("next", name) for name in ("reward", "done", "terminated", "truncated")]


def make(num_envs=5, **settings):
    env = with_transforms(DroneEnv(num_envs, TASK), [GrayPixels()])
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    return SteppingCollector(env, actor, Reasons(["a reason"]), next_keys=KEPT, **settings), env


def test_construction_starts_no_episode():
    env = DroneEnv(5, TASK)
    assert torch.equal(make()[0].collect(5)["pixels"][0], GrayPixels()(env.reset())["pixels"][0])


@pytest.mark.parametrize("num_envs", [5, 2])
def test_every_episode_is_complete_and_starts_once(num_envs):
    collector, env = make()
    started, start = [], env.base_env.start
    env.base_env.start = lambda rows=None: started.append(len(rows)) or start(rows)
    for _ in range(2):
        batch = collector.collect(num_envs)
        ids, done = batch["collector", "traj_ids"], batch["next", "done"][:, 0]
        assert ids.unique().tolist() == list(range(num_envs))
        assert torch.equal(done, ids != torch.cat([ids[1:], torch.tensor([-1])]))
    assert started == [5, 5]


def test_outer_exploration_type_is_respected():
    collector, _ = make()
    with set_exploration_type(ExplorationType.DETERMINISTIC):
        batch = collector.collect(5)
    assert torch.equal(batch["action"], batch["logits"].argmax(-1))
    batch = collector.collect(5)
    assert not torch.equal(batch["action"], batch["logits"].argmax(-1))


def test_no_exploration_type_is_set_for_other_threads(monkeypatch):
    """TorchRL's own collector sets one for the whole process."""
    collector, _ = make()
    kinds = []
    monkeypatch.setattr(probabilistic._interaction_type, "set_mode", kinds.append)
    collector.collect(5)
    assert not kinds
