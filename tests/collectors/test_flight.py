"""Episodes flown by the kernel are episodes: replayed step by step they are the same."""

import threading

import pytest
import torch
from torchrl.envs import RewardSum
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.collectors import EpisodeCollector
from drone_rl.collectors import flight as flight_module
from drone_rl.config import AppearanceSettings, DynamicsSettings, PillarsSettings, TaskSettings
from drone_rl.envs import CropRows, DroneEnv, GrayPixels, StandardizePixels, with_transforms
from drone_rl.policies import MLP, SmallCNN, make_actor
from drone_rl.policies.learning_network import LearningNetwork
from drone_rl.sim.dynamics import Quadrotor
from drone_rl.sim.dynamics.state import LOST
from drone_rl.sim.tasks.collect_cubes import EndReason

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)
REASON = ("next", "info", "end_reason")
DETERMINISTIC = ExplorationType.DETERMINISTIC


FLYING = DynamicsSettings(mode="simple_flight", wind=(0.5, -1.0, 0.2))


def make(
    task=SHORT,
    transforms=(GrayPixels, StandardizePixels),
    num_envs=5,
    network=None,
    dynamics=None,
    **how,
):
    env = DroneEnv(num_envs, task, dynamics=dynamics)
    env = with_transforms(env, [transform() for transform in transforms])
    generator = torch.Generator().manual_seed(0)
    if network is None:
        shape = tuple(env.observation_spec["pixels"].shape[1:])
        network = SmallCNN(shape, 3, channels=(4,), hidden=(8,), generator=generator)
        with torch.no_grad():
            network.layers.logits.weight.mul_(100)
    actor = make_actor(network, env.action_spec, generator)
    return EpisodeCollector(env, actor, **{"is_compiled": True, **how})


GIMBAL = FLYING.replace(camera_mount="gimbal")


@pytest.mark.parametrize("dynamics", [None, Quadrotor(FLYING), Quadrotor(GIMBAL)])
def test_replayed_by_torchrls_steps_they_are_the_same_bit_for_bit(dynamics):
    kept = [REASON, ("next", "info", "collected"), ("next", "info", "drone")]
    collector = make(keep=kept, dynamics=dynamics)
    assert collector._flight is not None
    env = DroneEnv(5, SHORT, dynamics=dynamics)
    env = with_transforms(env, [GrayPixels(), StandardizePixels()])
    for _ in range(3):
        batch, state = collector.collect(), env.reset()
        ids = batch["collector", "traj_ids"]
        episodes = [batch[ids == i] for i in ids.unique()]
        assert len(episodes) == 5 and ids.tolist() == sorted(ids.tolist())
        for t in range(max(map(len, episodes))):
            is_on = torch.tensor([t < len(episode) for episode in episodes])
            rows = [episode[t] for episode in episodes if t < len(episode)]
            assert torch.equal(torch.stack([r["pixels"] for r in rows]), state["pixels"][is_on])
            action = torch.zeros(5, dtype=torch.int64)
            action[is_on] = torch.stack([row["action"] for row in rows])
            state = env.step(state.set("action", action).set("_step", is_on))
            for key in (("next", "reward"), ("next", "done"), ("next", "truncated"), REASON):
                assert torch.equal(torch.stack([row[key] for row in rows]), state[key][is_on])
            for name in ("collected", "drone"):
                told = torch.stack([row["next", "info", name] for row in rows])
                assert torch.equal(told, state["next", "info", name][is_on])
            state = state["next"]
        assert batch["next", "done"].sum() == 5
        network = collector.actor.module[0].module
        assert torch.allclose(network(batch["pixels"]), batch["logits"], atol=1e-5)
    assert collector.episodes == 15 and collector.frames > 15


def test_what_is_told_by_the_kernel_is_what_a_replay_tells():
    brief, replayed = make(), make(keep=[REASON, ("next", "info", "drone")])
    for _ in range(2):
        one, other = brief.collect(), replayed.collect()
        for key in one.keys(True, True):
            assert torch.equal(one[key], other[key]) and one[key].dtype == other[key].dtype, key
        assert {*other.keys(True, True)} == {*one.keys(True, True), ("next", "info", "drone")}


def test_the_step_by_step_way_gives_entries_of_the_same_kinds():
    one, other = make().collect(), make(is_compiled=False).collect()
    assert {*one.keys(True, True)} == {*other.keys(True, True)}
    for key in one.keys(True, True):
        assert one[key].dtype == other[key].dtype and one[key].shape[1:] == other[key].shape[1:]


@pytest.mark.parametrize("how", [{"num_cores": 2}, {"num_cores": 3}])
def test_nothing_depends_on_how_many_cores_fly(how):
    one, other = make(num_envs=35), make(num_envs=35, **how)
    for _ in range(2):
        first, second = one.collect(), other.collect()
        assert all(torch.equal(first[key], second[key]) for key in first.keys(True, True))


def test_in_parts_greedy_flights_are_the_same(monkeypatch):
    with set_exploration_type(DETERMINISTIC):
        whole = make()
        monkeypatch.setattr(flight_module, "_LONGEST", 2)
        parts = make()
        assert parts._flight._length == 2
        for _ in range(2):
            expected, found = whole.collect(), parts.collect()
            assert torch.bincount(found["collector", "traj_ids"]).max() > 4
            for key in expected.keys(True, True):
                assert torch.equal(expected[key], found[key])


def test_the_most_probable_actions_are_taken_when_asked_for():
    with set_exploration_type(DETERMINISTIC):
        batch = make().collect()
    assert torch.equal(batch["logits"].argmax(-1), batch["action"])
    drawn = make().collect()
    assert not torch.equal(drawn["logits"].argmax(-1), drawn["action"])


def test_actions_are_drawn_by_their_probabilities():
    task = TaskSettings(num_cubes=1, step_limit=20)
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=())
    with torch.no_grad():
        network.layers.logits.weight.zero_()
        network.layers.logits.bias.copy_(torch.tensor([0.5, 0.3, 0.2]).log())
    actions = make(task, num_envs=500, network=network).collect()["action"]
    shares = actions.bincount(minlength=3) / len(actions)
    # of about 10,000: four standard errors are 0.02
    assert shares.tolist() == pytest.approx([0.5, 0.3, 0.2], abs=0.02)


def test_what_has_been_learned_is_flown():
    collector = make()
    collector.collect()
    with torch.no_grad():
        collector.actor.module[0].module.layers.logits.bias.copy_(torch.tensor([0.0, 50.0, 0.0]))
    assert (collector.collect()["action"] == 1).all()


def test_fewer_worlds_than_there_are():
    batch = make().collect(3)
    assert batch["collector", "traj_ids"].unique().tolist() == [0, 1, 2]


def test_observations_may_be_left_out():
    batch = make(keep_observations=False).collect()
    assert "pixels" not in batch and "logits" not in batch and "action" in batch


def learned(network, by, batch):
    """Logits of a batch, and the gradients of a sum of them."""
    network.zero_grad()
    logits = by(batch["pixels"])
    (logits * torch.linspace(-1, 1, logits.numel()).view(logits.shape)).sum().backward()
    return [logits.detach(), *(p.grad.clone() for p in network.parameters())]


@pytest.mark.parametrize("longest", [64, 2])
@pytest.mark.parametrize("is_greedy", [True, False])
def test_what_the_layers_made_is_what_they_would_make_again(longest, is_greedy, monkeypatch):
    monkeypatch.setattr(flight_module, "_LONGEST", longest)
    collector = make(num_envs=35, num_cores=2)
    network = collector.actor.module[0].module
    quick, plain = LearningNetwork(network, 2), LearningNetwork(network, 2)
    quick.known = known = collector.keep_outputs()
    weights = collector._flight._network.weights
    for _ in range(2):
        kind = DETERMINISTIC if is_greedy else ExplorationType.RANDOM
        with set_exploration_type(kind):
            batch = collector.collect()
        assert known.find(batch["pixels"].flatten(1), weights) is not None
        half = batch[len(batch) // 2 :]
        for part in (batch, half):
            found, expected = learned(network, quick, part), learned(network, plain, part)
            assert all(torch.equal(*pair) for pair in zip(found, expected, strict=True))
            assert torch.equal(found[0], part["logits"])
            quick(torch.zeros_like(batch["pixels"]))  # makes its own, in memory of its own
        with torch.no_grad():
            network.layers.fc1.weight.add_(0.1)  # no longer what made them
        quick_logits, logits = quick(batch["pixels"]), plain(batch["pixels"])
        assert torch.equal(quick_logits, logits) and not torch.equal(logits, batch["logits"])


def test_another_flight_writes_over_what_was_made():
    collector = make()
    network = LearningNetwork(collector.actor.module[0].module)
    network.known = collector.keep_outputs()
    batch = collector.collect()
    logits = network(batch["pixels"])
    other = collector.collect()
    with pytest.raises(RuntimeError, match="flown through"):
        logits.sum().backward()
    again = network(batch["pixels"])
    assert torch.allclose(again, batch["logits"], atol=1e-5)
    again.sum().backward()
    assert torch.equal(network(other["pixels"]), other["logits"])


@pytest.mark.parametrize(("parts", "is_known"), [(0, False), (2, False), (6, True)])
def test_what_the_layers_made_is_kept_as_far_as_there_is_room(parts, is_known, monkeypatch):
    size = make().keep_outputs().outputs.shape[1]
    monkeypatch.setattr(flight_module, "_LONGEST", 2)
    monkeypatch.setattr(flight_module, "_MOST_OUTPUTS", parts * 5 * 2 * size)
    collector = make()
    known = collector.keep_outputs()
    batch = collector.collect()
    assert 4 < batch["collector", "traj_ids"].bincount().max() <= 12
    assert (known is None) is (parts == 0)
    if known is not None:
        rows = known.find(batch["pixels"].flatten(1), collector._flight._network.weights)
        assert (rows is not None) is is_known
    network = LearningNetwork(collector.actor.module[0].module)
    network.known = known
    assert torch.equal(network(batch["pixels"]), batch["logits"])


def test_nothing_is_kept_that_nobody_asked_for_or_that_has_no_pictures():
    assert make()._flight._known is None
    assert make(is_compiled=False).keep_outputs() is None
    collector = make(keep_observations=False)
    known = collector.keep_outputs()
    assert known is not None and collector.keep_outputs() is known
    assert "pixels" not in collector.collect()


def test_goes_on_from_a_state_as_if_it_had_never_stopped():
    collector, other = make(), make()
    collector.collect()
    state = collector.state_dict()
    source = collector.actor.module[1].distribution_kwargs["source"].generator
    actions = source.get_state()
    expected = collector.collect()
    other.load_state_dict(state)
    other.actor.module[1].distribution_kwargs["source"].generator.set_state(actions)
    found = other.collect()
    assert all(torch.equal(found[key], expected[key]) for key in found.keys(True, True))


@pytest.mark.parametrize(
    "what",
    [
        {"is_compiled": False},
        {"transforms": (GrayPixels, StandardizePixels, RewardSum)},
        {"transforms": (GrayPixels, lambda: CropRows(2, 20))},
        {"transforms": (GrayPixels, StandardizePixels, StandardizePixels)},
        {"task": PillarsSettings(num_rows=1)},
        {"network": MLP((1, 25, 64), 3)},
    ],
)
def test_whatever_it_does_not_know_is_flown_step_by_step(what):
    collector = make(**what)
    assert collector._flight is None
    assert len(collector.collect())


def test_another_renderer_draws_step_by_step():
    env = with_transforms(DroneEnv(2, SHORT, renderer="mujoco_warp"), [GrayPixels()])
    actor = make_actor(SmallCNN((1, 25, 64), 3), env.action_spec)
    assert EpisodeCollector(env, actor, is_compiled=True)._flight is None
    env.close()


def test_a_way_of_exploring_that_it_does_not_know_is_taken_step_by_step():
    collector = make()
    with set_exploration_type(ExplorationType.MODE):
        assert not collector._flight.can_act()
        assert len(collector.collect())


def test_its_threads_end_with_the_collector():
    before = {*threading.enumerate()}
    collector = make(num_cores=3)
    collector.collect()
    begun = {*threading.enumerate()} - before
    assert begun  # no more than it needs: one that is idle again takes the next part
    collector.shutdown()
    assert not any(thread.is_alive() for thread in begun)


@pytest.mark.parametrize("visibility", [30.0, (10.0, 30.0)])
def test_worlds_of_another_look_are_flown_step_by_step(visibility):
    look = AppearanceSettings(fog_visibility=visibility)
    env = with_transforms(DroneEnv(3, SHORT, appearance=look), [GrayPixels(), StandardizePixels()])
    network = SmallCNN((1, 25, 64), 3, channels=(4,), hidden=(8,))
    actor = make_actor(network, env.action_spec, torch.Generator().manual_seed(0))
    collector = EpisodeCollector(env, actor, is_compiled=True)
    assert collector._flight is None
    batch, plain = collector.collect(), make(num_envs=3).collect()
    assert batch["next", "done"].sum() == 3
    assert batch["pixels"][0].mean() > plain["pixels"][0].mean()  # the fog is bright


def test_a_lost_drone_ends_its_episode_in_the_kernel_too():
    """Of five drones one is lost from the start."""
    collector = make(dynamics=Quadrotor(FLYING))
    begin = collector._flight._worlds.begin

    def lose(state):
        state.body.numbers[2, LOST.first] = 1.0
        begin(state)

    collector._flight._worlds.begin = lose
    batch = collector.collect()
    lengths = batch["collector", "traj_ids"].bincount()
    assert lengths[2] == 1 and (lengths[[0, 1, 3, 4]] > 1).all()
    assert batch[REASON].flatten().tolist().count(EndReason.LOST_CONTROL) == 1


def test_pictures_that_are_not_standardised_are_as_they_are_drawn():
    collector = make(transforms=(GrayPixels,))
    assert collector._flight is not None
    batch = collector.collect()
    first = torch.stack([batch[batch["collector", "traj_ids"] == i][0]["pixels"] for i in range(5)])
    env = with_transforms(DroneEnv(5, SHORT), [GrayPixels()])
    assert torch.equal(first, env.reset()["pixels"])
    assert 0.0 <= first.min() < first.max() <= 1.0
