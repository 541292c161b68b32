"""Training with a critic, from settings to exported policies."""

import copy
import shutil

import pytest
import torch
from tensordict.nn import TensorDictSequential
from torchrl.collectors import Collector
from torchrl.objectives.value import GAE

import drone_rl
from drone_rl.acceleration.fused_network import FusedNetwork
from drone_rl.config import TaskSettings
from drone_rl.config.inputs import Goal, GrayImage
from drone_rl.config.learning import A2c, Episodes, Ppo, Rollouts, Sgd
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.config.transforms import EpisodeReward, Gray, Stack
from drone_rl.training.train import make_collector
from drone_rl.utils.checkpoint import load_checkpoint, save_checkpoint
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent

TASK = TaskSettings(num_cubes=2, first_distance=4.0, spacing=4.0, front_margin=2.0, step_limit=29)
TINY = TrainSettings(task=TASK, trainer=TrainerSettings(total_frames=180)).replace(
    objective=Ppo(num_steps=12, minibatch_size=30),
    collector=Rollouts(num_envs=5, num_threads=2),
)
STACKED = {"transforms": (Gray(), Stack(), EpisodeReward())}
KINDS = {
    "ppo": TINY,
    "a2c of its own trunk": TINY.replace(objective=A2c(num_steps=12, shares_trunk=False)),
    "stacked": TINY.replace(**STACKED),
}


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    return drone_rl.train(TINY, folder=tmp_path_factory.mktemp("run") / "mine", progress=silent)


def checkpoint(training):
    return load_checkpoint(training.folder / "checkpoints" / "last.pt")


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"objective": A2c(entropy_coeff=0.01)},
        {"objective": A2c(shares_trunk=False), "inputs": {"gray": GrayImage(), "goal": Goal()}},
    ],
)
def test_kernel_gradients_give_the_same_updates_as_torch(more):
    learned = {}
    for is_compiled in (True, False):
        limits = TrainerSettings(compiled=is_compiled, chunk_frames=40)
        settings = TrainSettings(task=TASK, trainer=limits, optimizer=Sgd(lr=1.0)).replace(**more)
        made = make_collector(settings)
        learner = settings.objective.make(settings, made)
        learns = [made.network, *([learner.model.critic] if more else [])]
        module = (learner.model.trunk if more else learner.loss.actor_network.module[0]).module
        assert isinstance(module, FusedNetwork) is is_compiled
        weights = [p for network in learns for p in network.parameters()]
        before = [p.detach().clone() for p in weights]
        batch = next(iter(made.collector))
        assert batch.numel() > 2 * limits.chunk_frames
        learner.update(batch)
        made.collector.shutdown()
        learned[is_compiled] = [p.detach() - b for p, b in zip(weights, before, strict=True)]
    for by_kernel, by_torch in zip(learned[True], learned[False], strict=True):
        assert by_torch.any()
        assert (by_kernel - by_torch).norm() < 0.01 * by_torch.norm()  # ReLU inputs near 0


@pytest.mark.parametrize("shares", [True, False])
def test_critic_is_seeded_and_does_not_change_the_policy(shares):
    settings = TINY.replace(objective=Ppo(shares_trunk=shares))
    states = []
    for seed in (0, 0, 1):
        made = make_collector(settings.replace(seed=seed))
        states.append(
            copy.deepcopy(settings.objective.make(settings.replace(seed=seed), made).state_dict())
        )
        made.collector.shutdown()
    one, two, other = (state["critic"] for state in states)
    assert all(torch.equal(one[name], two[name]) for name in one)
    weights = [name for name in one if name.endswith("weight")]
    assert not any(torch.equal(one[name], other[name]) for name in weights)
    assert len(one) == (2 if shares else len(states[0]["policy"]))
    alone = make_collector(TrainSettings(task=TASK))
    assert all(
        torch.equal(states[0]["policy"][name], value)
        for name, value in alone.network.state_dict().items()
    )
    alone.collector.shutdown()


def assert_same(one, two):
    if isinstance(one, dict | list):
        assert len(one) == len(two)
        for key in one if isinstance(one, dict) else range(len(one)):
            assert_same(one[key], two[key])
    elif isinstance(one, torch.Tensor):
        assert one.numpy().tobytes() == two.numpy().tobytes()
    else:
        assert one == two


@pytest.mark.parametrize("settings", KINDS.values(), ids=KINDS)
def test_resuming_within_episodes_equals_an_uninterrupted_run(settings, tmp_path):
    longer = settings.trainer.replace(total_frames=420)
    whole = drone_rl.train(settings, folder=tmp_path / "whole", trainer=longer, progress=silent)
    half = drone_rl.train(settings, folder=tmp_path / "half", progress=silent)
    assert half.result.frames == 180
    counts = [c["step_count"] for c in checkpoint(half)["collector"]["collectors"]]
    assert torch.cat(counts).count_nonzero() > 0  # episodes are running
    again = drone_rl.train(folder=half.folder, resume=True, trainer=longer, progress=silent)
    one, two = checkpoint(whole), checkpoint(again)
    for key in ("policy", "critic", "optimizer", "minibatches", "generators", "collector"):
        assert_same(one[key], two[key])
    progress = [
        {k: v for k, v in state["progress"].items() if k != "seconds"} for state in (one, two)
    ]
    assert progress[0] == progress[1] and progress[0]["episodes"] > 10


def test_episodes_are_counted_once_when_complete(trained):
    """Frames of completed and of running episodes sum to all frames."""
    columns = trained.metrics()
    ended = [
        length * (episodes - before)
        for length, episodes, before in zip(
            columns["train/length"],
            columns["episodes"],
            [0.0, *columns["episodes"]],
            strict=False,
        )
        if episodes > before
    ]
    parts = checkpoint(trained)["collector"]["collectors"]
    under_way = sum(int(part["step_count"].sum()) for part in parts)
    assert sum(ended) + under_way == pytest.approx(trained.result.frames)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("critic", {}, "critic has other names"),
        ("minibatches", torch.zeros(5056, dtype=torch.uint8), "does not fit this run"),
        ("minibatches", 3, "minibatches is not of shape"),
        ("collector", {"collectors": []}, "is not a list of 2"),
    ],
)
def test_other_invalid_checkpoint_parts_raise(trained, tmp_path, key, value, message):
    refused(trained, tmp_path, {**checkpoint(trained), key: value}, message)


def refused(trained, folder, state, message):
    shutil.copytree(trained.folder, folder / "run")
    save_checkpoint(folder / "run" / "checkpoints" / "last.pt", state)
    with pytest.raises(InputError, match=message):
        drone_rl.train(folder=folder / "run", resume=True, progress=silent)


@pytest.mark.parametrize("is_ours", [True, False])
def test_advantages_equal_torchrls_gae(is_ours):
    """TorchRL evaluates every next observation as well; batches of its collector are accepted."""
    objective = TINY.objective.replace(num_steps=80)
    collecting = {"collector": Rollouts(num_envs=5, num_threads=1), "objective": objective}
    made = make_collector(TINY.replace(**collecting))
    learner, (ours,) = TINY.objective.make(TINY, made), made.collector.collectors
    torch.nn.init.normal_(learner.model.critic.module.weight)
    collector = Collector(
        ours.env,
        ours.actor,
        frames_per_batch=400,
        total_frames=-1,
        auto_register_policy_transforms=False,
    )
    batch = ours.collect() if is_ours else next(iter(collector))
    assert batch["next", "terminated"].any() and batch["next", "truncated"].any()
    both = TensorDictSequential(learner.model.trunk, learner.model.critic)
    rates = {"gamma": TINY.returns.gamma, "lmbda": TINY.returns.lmbda}
    gae = GAE(**rates, value_network=both, average_gae=True, deactivate_vmap=True)
    found = learner.estimate(batch)
    following = [("next", key) for key in ("pixels", "reward", "done", "terminated")]
    wanted = gae(batch.select("pixels", "action", *following))
    for key in ("advantage", "value_target"):
        torch.testing.assert_close(found[key], wanted[key], rtol=1e-4, atol=1e-5)
    assert learner.update(found)["loss/grad_norm"] > 0
    collector.shutdown()


def test_collector_without_next_observations_raises(monkeypatch, tmp_path):
    """It is user-defined, so the settings cannot detect it."""
    collector = type("Mine", (Episodes,), {"is_known": False})
    settings = TINY.replace(collector=collector(num_envs=2))
    with pytest.raises(InputError, match=r"no entry \('next', 'pixels'\).*collector=rollouts$"):
        drone_rl.train(settings, folder=tmp_path, progress=silent)
