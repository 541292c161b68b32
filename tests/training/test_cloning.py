"""Cloning against hand-computed losses, and on flights whose images state the action."""

import math

import numpy as np
import pytest
import torch
from torch.nn.functional import cross_entropy

from drone_rl.config import CameraSettings
from drone_rl.config.inputs import ImageInput
from drone_rl.config.networks import Mlp
from drone_rl.config.training import CloningSettings, TrainSettings
from drone_rl.config.transforms import Gray, Stack, Standardize
from drone_rl.envs import DroneEnv
from drone_rl.envs.readings import Readings
from drone_rl.policies.zoo import describe
from drone_rl.training import Callback
from drone_rl.training.cloning import (
    Cloning,
    RecordedFrames,
    clone,
    hold_out,
    imitation_loss,
)
from drone_rl.training.demonstrations import Demonstration, FlightConditions
from drone_rl.utils.errors import InputError

SETTINGS = TrainSettings(
    camera=CameraSettings(width=4, height=2),
    transforms=(Gray(), Standardize()),
    network=Mlp(hidden=(8,)),
    cloning=CloningSettings(epochs=60, lr=0.02, minibatch_size=8),
)
LEVELS = np.array([30, 130, 230], np.uint8)
"""Brightness of the images in which actions 0, 1 and 2 are taken."""
SPEEDS = np.array([[-0.5, 0.6, 0.0], [0.0, 0.0, 0.6], [0.5, -0.6, -0.2]], np.float32)
"""Continuous actions in their place."""


def flight(seed, steps=12, settings=SETTINGS):
    """Return a flight whose action is stated by the brightness of the image."""
    action = np.random.default_rng(seed).integers(0, 3, steps)
    images = np.broadcast_to(LEVELS[action][:, None, None, None], (steps, 2, 4, 3)).copy()
    return Demonstration(
        FlightConditions.of(settings),
        images=images,
        actions=action if settings.actions.kind == "moves" else SPEEDS[action],
        rewards=np.zeros(steps, np.float32),
        done=np.arange(steps) == steps - 1,
    )


FLIGHTS = [flight(seed) for seed in range(5)]


def network(settings=SETTINGS, seed=0):
    return describe(settings).build_network(torch.Generator().manual_seed(seed))


def test_the_loss_of_discrete_actions_is_the_cross_entropy():
    outputs = torch.tensor([[0.0, 0.0, 0.0], [math.log(2), 0.0, 0.0], [math.log(2), 0.0, 0.0]])
    actions = torch.tensor([1, 0, 2])
    loss = imitation_loss(outputs, actions)
    torch.testing.assert_close(loss, torch.tensor([math.log(3), math.log(2), math.log(4)]))
    torch.testing.assert_close(loss.mean(), cross_entropy(outputs, actions))


def test_the_loss_of_continuous_actions_is_the_negative_log_likelihood():
    """Outputs of 0 are means of 0 and deviations of exp(-0.5); tanh has slope 1 at 0."""
    outputs = torch.zeros(3, 6)
    middle = 3 * (0.5 * math.log(2 * math.pi) - 0.5)
    half = math.atanh(0.5)
    aside = 0.5 * half**2 * math.e + math.log(1 - 0.25)
    full = 0.5 * 9 * math.e + math.log(1 - math.tanh(3) ** 2)  # 1 counts as tanh(3)
    actions = torch.tensor([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, -1.0, 1.0]])
    expected = torch.tensor([middle, middle + aside, middle + 2 * full])
    torch.testing.assert_close(imitation_loss(outputs, actions), expected, rtol=1e-5, atol=1e-5)


def reader(*transforms):
    return Readings({"pixels": ImageInput.of(SETTINGS.camera, transforms)})


def test_frames_are_joined_and_stacked_within_their_flight():
    frames = RecordedFrames.of([flight(0, 2), flight(1, 3)], "cpu")
    assert frames.starts.tolist() == [0, 0, 2, 2, 2]
    assert frames.actions.tolist() == [*flight(0, 2).actions, *flight(1, 3).actions]
    level = [float(image[0, 0, 0]) / 255 for image in frames.readings["pixels"]]
    seen = frames.observe(torch.tensor([0, 1, 2, 3, 4]), reader(Gray(), Stack(N=3)))["pixels"]
    expected = [(0, 0, 0), (0, 0, 1), (2, 2, 2), (2, 2, 3), (2, 3, 4)]
    assert seen.shape == (5, 3, 2, 4)
    torch.testing.assert_close(
        seen[:, :, 0, 0], torch.tensor([[level[i] for i in row] for row in expected])
    )


@pytest.mark.parametrize("more", [(), (Stack(N=2),)])
def test_observations_are_those_of_an_environment(more):
    steps = [t.make() for t in (*SETTINGS.transforms, *more)]
    env = DroneEnv(1, camera=SETTINGS.camera, seed=3, transforms=steps)
    raw = DroneEnv(1, camera=SETTINGS.camera, seed=3)
    state, image = env.reset(), raw.reset()
    images, seen = [], []
    for action in (0, 1, 0):
        images.append(image["pixels"])
        seen.append(state["pixels"])
        state = env.step(state.set("action", torch.tensor([action])))["next"]
        image = raw.step(image.set("action", torch.tensor([action])))["next"]
    starts = torch.zeros(3, dtype=torch.int64)
    frames = RecordedFrames({"pixels": torch.cat(images)}, torch.zeros(3), starts)
    found = frames.observe(torch.arange(3), reader(*SETTINGS.transforms, *more))
    torch.testing.assert_close(found["pixels"], torch.cat(seen))
    env.close()
    raw.close()


@pytest.mark.parametrize(
    ("count", "share", "held"),
    [(1, 0.5, 0), (2, 0.1, 1), (2, 0.99, 1), (30, 0.1, 3), (30, 0.0, 0), (10, 0.99, 9)],
)
def test_some_flights_are_held_out_and_some_are_left(count, share, held):
    generator = torch.Generator().manual_seed(0)
    learned, others = hold_out(range(count), share, generator)
    assert len(others) == held and sorted(learned + others) == list(range(count))


class Note(Callback):
    def __init__(self):
        self.rows = []

    def on_clone(self, epoch, epochs, metrics):
        self.rows.append((epoch, epochs, dict(metrics)))


def test_a_network_learns_the_actions_of_the_flights():
    own, note = network(), Note()
    done = clone(SETTINGS.replace(demonstrations="x"), own, FLIGHTS, [note])["cloning"]
    assert done["accuracy"] == done["held_out_accuracy"] == 1.0
    assert max(done["loss"], done["held_out_loss"]) < 0.2
    assert (done["demonstrations"], done["frames"]) == (4, 48)
    assert (done["held_out_demonstrations"], done["held_out_frames"]) == (1, 12)
    assert (done["folder"], done["epochs"]) == ("x", 60) and done["seconds"] > 0
    assert Cloning.read(done, "cloning").model_dump() == done
    frames = RecordedFrames.of(FLIGHTS, "cpu")
    observed = frames.observe(torch.arange(60), reader(*SETTINGS.transforms))["pixels"]
    taken = torch.cat([torch.from_numpy(one.actions) for one in FLIGHTS])
    assert torch.equal(own(observed).argmax(-1), taken)
    assert all(parameter.grad is None for parameter in own.parameters())
    assert [row[:2] for row in note.rows] == [(epoch, 60) for epoch in range(1, 61)]
    names = ("loss", "accuracy", "held_out_loss", "held_out_accuracy")
    assert note.rows[-1][2] == {f"cloning/{name}": done[name] for name in names}


def test_one_epoch_is_one_step_of_adam_for_each_minibatch():
    """With one minibatch, and against PyTorch's own cross-entropy."""
    settings = SETTINGS.replace(
        cloning=CloningSettings(epochs=1, lr=0.01, minibatch_size=1000, held_out_share=0.0)
    )
    own, other = network(), network()
    done = clone(settings, own, FLIGHTS)["cloning"]
    optimizer = torch.optim.Adam(other.parameters(), lr=0.01)
    frames = RecordedFrames.of(FLIGHTS, "cpu")
    observed = frames.observe(torch.arange(60), reader(*SETTINGS.transforms))["pixels"]
    loss = cross_entropy(other(observed), frames.actions)
    loss.backward()
    optimizer.step()
    for name, value in other.state_dict().items():
        torch.testing.assert_close(own.state_dict()[name], value)
    assert done["loss"] == pytest.approx(float(loss.detach()), rel=1e-5)
    assert done["held_out_loss"] is done["held_out_accuracy"] is None
    assert done["held_out_demonstrations"] == done["held_out_frames"] == 0


def test_a_loss_that_is_not_finite_is_one_line():
    own = network()
    with torch.no_grad():
        own.layers.logits.weight.fill_(torch.nan)
    with pytest.raises(InputError, match=r"^loss_cloning is NaN .* in epoch 1 of cloning; lower"):
        clone(SETTINGS, own, FLIGHTS)
