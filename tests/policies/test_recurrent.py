"""The LSTM: by hand, step by step and whole episodes at once, in a policy's file, and refusals."""

import math

import numpy as np
import pytest
import torch
from torchrl.modules import set_recurrent_mode

import drone_rl
from drone_rl.collectors import EpisodeCollector
from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.config.commands import HeldOutSettings
from drone_rl.config.networks import Lstm
from drone_rl.config.training import TrainSettings
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.rollouts import collect, render_frames, run_from
from drone_rl.explanations.scenes import Scenes
from drone_rl.objectives import LeaveOneOut, ReinforceLoss
from drone_rl.policies import RecurrentNetwork, make_actor
from drone_rl.policies.actor import exploring
from drone_rl.policies.policy import load_policy
from drone_rl.policies.recurrent import CELL, HIDDEN, Memory
from drone_rl.policies.zoo import describe
from drone_rl.training.learners import ReinforceLearner, episode_chunks
from drone_rl.trust.export import export
from drone_rl.trust.video import film
from drone_rl.utils.errors import InputError

TASK = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=9, front_margin=3.0)
SETTINGS = TrainSettings(
    task=TASK,
    camera=CameraSettings(width=16, height=8),
    network=Lstm(channels=(4,), hidden=(8,), memory=6),
    trainer=drone_rl.TrainerSettings(total_frames=150),
    collector=drone_rl.config.learning.Episodes(num_envs=4, num_threads=1),
)


def make_network(seed=0, **changes):
    sizes = {"channels": (4,), "hidden": (8,), "memory": 6, **changes}
    generator = torch.Generator().manual_seed(seed)
    return RecurrentNetwork((1, 8, 16), 3, **sizes, generator=generator)


def make_collector(seed=0, num_envs=4):
    described = describe(SETTINGS)
    env = described.build_env(num_envs, seed=seed, device="cpu")
    generator = torch.Generator().manual_seed(seed)
    network = described.build_network(generator)
    actor = make_actor(network, env.action_spec, generator)
    return EpisodeCollector(env, actor, postproc=LeaveOneOut(0.9)), network


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lstm")
    return drone_rl.train(SETTINGS, folder=folder, progress=lambda *_: None)


def test_state_by_hand():
    """Without weights the gates are those of the biases: i = o = 1/2, f = sigmoid(1), g = tanh(1).

    So c_1 = g / 2 = 0.3808, c_2 = f c_1 + g / 2 = 0.6592, and h = tanh(c) / 2.
    """
    network = make_network(memory=1)
    biases = torch.tensor([0.0, 1.0, 1.0, 0.0])  # input, forget, cell, output
    with torch.no_grad():
        for name, weight in network.lstm.lstm.named_parameters():
            weight.copy_(biases if name == "bias_ih_l0" else torch.zeros(()))
    memory, seen = network.start(2), torch.rand(2, 1, 8, 16)
    cells = [math.tanh(1) / 2]
    cells.append(cells[0] / (1 + math.exp(-1)) + cells[0])
    for cell in cells:
        with torch.no_grad():
            logits, memory = network.step(seen, memory)
        torch.testing.assert_close(memory.cell, torch.full((2, 1, 1), cell))
        torch.testing.assert_close(memory.hidden, torch.full((2, 1, 1), math.tanh(cell) / 2))
        expected = network.logits.weight[:, 0] * math.tanh(cell) / 2 + network.logits.bias
        torch.testing.assert_close(logits, expected.expand(2, 3).detach())


@torch.no_grad()
def test_steps_equal_whole_episodes():
    """Two episodes of three and two steps: the state of the first must not reach the second."""
    network = make_network()
    frames = torch.rand(5, 1, 8, 16)
    is_init = torch.tensor([[True], [False], [False], [True], [False]])
    zeros = torch.zeros(5, 1, 6)
    with set_recurrent_mode(True):
        whole, *_ = network(frames, is_init, zeros, zeros)
    outputs, forwarded, memory = [], [], network.start(1)
    state = [*network.start(1)]
    for frame, starts in zip(frames, is_init, strict=True):
        memory = network.start(1) if starts else memory
        logits, memory = network.step(frame[None], memory)
        outputs.append(logits)
        logits, *state = network(frame[None], starts[None], *state)
        forwarded.append(logits)
    torch.testing.assert_close(torch.cat(outputs), whole)
    torch.testing.assert_close(torch.cat(forwarded), whole)
    alone, _ = network.step(frames[4:], network.start(1))
    assert not torch.allclose(alone, whole[4:], atol=1e-6)  # the state counts


def test_gradient_reaches_the_first_frame():
    network = make_network()
    draws = torch.Generator().manual_seed(0)
    frames = torch.rand(4, 1, 8, 16, generator=draws, requires_grad=True)
    is_init = torch.tensor([[True], [False], [False], [False]])
    zeros = torch.zeros(4, 1, 6)
    with set_recurrent_mode(True):
        logits, *_ = network(frames, is_init, zeros, zeros)
    logits[-1, 0].backward()
    assert (frames.grad.flatten(1).norm(dim=1) > 0).all()


def test_a_frame_alone_is_the_first_of_an_episode():
    network, frames = make_network(), torch.rand(2, 1, 8, 16)
    with torch.no_grad():
        torch.testing.assert_close(network(frames), network.step(frames, network.start(2))[0])
    zeros = torch.zeros(2, 1, 6)
    with pytest.raises(InputError, match=r"images of shape \(1, 8, 16\), not \(1, 9, 16\)"):
        network(torch.zeros(2, 1, 9, 16), torch.ones(2, 1, dtype=torch.bool), zeros, zeros)
    with pytest.raises(InputError, match=r"not \(1, 9, 16\)"):
        network.step(torch.zeros(2, 1, 9, 16), network.start(2))


def test_batch_holds_the_states_of_its_steps():
    collector, network = make_collector()
    batch = collector.collect()
    is_init, done = batch["is_init"][:, 0], batch["next", "done"][:, 0]
    assert is_init.tolist() == [True, *done[:-1].tolist()]
    assert is_init.sum() == 4
    assert (batch[HIDDEN][is_init] == 0).all()
    following = ~done[:-1]
    assert torch.equal(batch[HIDDEN][1:][following], batch["next", HIDDEN][:-1][following])
    assert torch.equal(batch[CELL][1:][following], batch["next", CELL][:-1][following])
    with torch.no_grad():
        seen = batch["pixels"], Memory(batch[HIDDEN], batch[CELL])
        torch.testing.assert_close(network.step(*seen)[0], batch["logits"])
    assert collector.name.startswith("stepping collector: ")
    collector.shutdown()


def test_loss_evaluates_whole_episodes():
    """The log-probabilities of the loss are those with which the actions were drawn."""
    collector, _ = make_collector()
    batch = collector.collect()
    loss = ReinforceLoss(collector.actor, entropy_coeff=0.0, reduction="none")
    of_actions = batch["logits"].log_softmax(-1).gather(1, batch["action"][:, None])[:, 0]
    expected = -of_actions * batch["return_to_go"][:, 0]
    torch.testing.assert_close(loss(batch)["loss_actor"].detach(), expected)
    collector.shutdown()


@pytest.mark.parametrize("reduction", ["mean", "sum", "episode_mean"])
def test_chunks_of_episodes_give_the_gradient_of_the_batch(reduction):
    gradients = []
    for size in (10_000, 1):
        collector, network = make_collector()
        learner = ReinforceLearner(
            network=network,
            loss=ReinforceLoss(collector.actor, reduction=reduction),
            optimizer=torch.optim.SGD(network.parameters(), lr=0.0),
            chunk_frames=size,
            whole_episodes=True,
        )
        learner.update(collector.collect())
        gradients.append(torch.cat([p.grad.flatten() for p in network.parameters()]))
        collector.shutdown()
    assert gradients[0].norm() > 0
    torch.testing.assert_close(*gradients, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(
    ("size", "expected"),
    [(1, [2, 1, 4, 1]), (3, [3, 4, 1]), (7, [7, 1]), (99, [8])],
)
def test_chunks_end_where_episodes_end(size, expected):
    """Episodes of 2, 1 and 4 steps, and one that has not ended after 1."""
    done = torch.tensor([0, 1, 1, 0, 0, 0, 1, 0], dtype=torch.bool)
    assert episode_chunks(done, size) == expected


def test_resumed_training_equals_an_uninterrupted_one(trained, tmp_path):
    half = SETTINGS.trainer.replace(total_frames=60)
    silent = {"progress": lambda *_: None}
    drone_rl.train(SETTINGS, trainer=half, folder=tmp_path, **silent)
    again = drone_rl.train(folder=tmp_path, resume=True, trainer=SETTINGS.trainer, **silent)
    one, other = (load_policy(t.folder).state.weights for t in (trained, again))
    assert one.keys() == other.keys()
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_act_remembers_until_reset(trained):
    """`act` takes the actions of an episode, and others if it is reset before each."""
    policy = load_policy(trained.folder)
    with torch.no_grad():  # so that actions depend on the state
        policy.state.weights["logits.weight"].mul_(300)
    with policy.flying(1) as (env, actor), exploring(greedy=True):
        state, images, logits = env.reset(), [], []
        while not state["done"].all() and len(images) < 6:
            images.append(env.base_env.last_pixels.clone())
            acted = actor(state)
            logits.append(acted["logits"])
            state = env.step(acted)["next"]
    network = policy.make_network()
    transforms = policy.description.make_transforms()
    memory = network.start(1)
    for image, expected in zip(images, logits, strict=True):
        assert policy.act(image[0]) == int(expected.argmax())
        gray = image
        for transform in transforms[:-2]:
            gray = transform._apply_transform(gray)
        with torch.no_grad():
            found, memory = network.step(gray, memory)
        torch.testing.assert_close(found, expected, rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(policy._memory[0].hidden, memory.hidden)
    with pytest.raises(InputError, match=r"^2 images follow 1; call reset\(\)"):
        policy.act_batch(torch.cat([images[0]] * 2))
    policy.reset()
    assert policy._memory == []
    assert policy.act_batch(torch.cat([images[0]] * 2)).shape == (2,)


def test_file_holds_the_policy(trained, tmp_path):
    settings = HeldOutSettings(episodes=20, num_envs=20, seed=0)
    export(load_policy(trained.folder), tmp_path / "mine.safetensors", settings)
    one, other = load_policy(trained.folder), load_policy(tmp_path / "mine.safetensors")
    assert other.description == one.description
    assert other.description.model_dump(mode="json")["network"] == {
        **{"name": "lstm", "patch": 4, "channels": [4], "hidden": [8], "memory": 6},
    }
    first, second = (policy.make_network() for policy in (one, other))
    frame, memory = torch.rand(3, *first.in_shape), first.start(3)
    with torch.no_grad():
        torch.testing.assert_close(first.step(frame, memory)[0], second.step(frame, memory)[0])


def test_onnx_model_agrees_at_every_step(trained, tmp_path):
    pytest.importorskip("onnxruntime")
    found = drone_rl.export_onnx(trained.folder, tmp_path / "mine.onnx", seed=0)
    assert found.frames == 10_000
    assert found.difference <= 1e-5


def test_every_command_runs_it(trained, tmp_path):
    policy, silent = load_policy(trained.folder), {"progress": lambda *_: None}
    few = {"episodes": 20, "seed": 0, **silent}
    assert drone_rl.judge(policy, **few).kind
    assert drone_rl.evaluate(policy, **few).success <= 1.0
    shifted = drone_rl.shifts(policy, axes=["noise"], strengths=[3], domain_episodes=20, **few)
    assert 0.0 <= shifted.domain.plain.success <= 1.0
    sizes = {"frames": 40, "data_episodes": 30, "perplexity": 5}
    explained = drone_rl.explain(policy, folder=tmp_path / "explained", **sizes, **few)
    (results,) = explained.policies.values()
    assert "contradictions" in results.left_out and results.dataset.remembers
    assert "remembers earlier frames" in explained.report.read_text()
    drone_rl.class_models(policy, steps=2, episodes=2, gallery=False, seed=0)
    film(policy, tmp_path / "film", 1)
    assert (tmp_path / "film" / "episode_0.mp4").is_file()


def test_recorded_frames_are_analysed_with_what_it_remembered():
    collector, network = make_collector()
    flights, scenes = collect(collector.env, collector.actor, num_episodes=2), Scenes(collector.env)
    data = render_frames(flights, np.flatnonzero(flights.episode == 0), scenes, network)
    x, actions, memory = data.tensor("observations"), data.tensor("actions"), network.start(1)
    for pixels, expected in zip(x, data.tensor("probabilities"), strict=True):
        before = memory
        outputs, memory = network.step(pixels[None].requires_grad_(), before)
        torch.testing.assert_close(outputs.softmax(-1)[0], expected)
    last = x[-1:].clone().requires_grad_()
    network.step(last, before)[0].softmax(-1)[0, actions[-1]].backward()
    methods = Explainer(network, scenes.absent).methods()
    assert len(methods) == 5
    for name, method in methods.items():
        maps = method(x, actions, data.memory)
        expected = method(x[-1:], actions[-1:], torch.stack(before, 1).detach())
        torch.testing.assert_close(maps[-1:], expected, rtol=1e-4, atol=1e-7)
        assert not torch.allclose(maps[-1:], method(x[-1:], actions[-1:]), rtol=1e-3), name
        if name == "saliency":
            torch.testing.assert_close(maps[-1], last.grad[0].abs().sum(0))
    steps = []

    def once(step):
        steps.append(step)
        return torch.zeros(len(x), dtype=torch.bool)

    run_from(scenes, network, data.state(scenes.worlds), once, memory=data.memory)
    outputs = steps[0].act.distribution.softmax(-1)
    torch.testing.assert_close(outputs, data.tensor("probabilities"))
    collector.shutdown()


def test_proofs_are_refused(trained, tmp_path):
    with pytest.raises(InputError, match="remembers earlier ones"):
        drone_rl.prove(trained.policy, folder=tmp_path)
