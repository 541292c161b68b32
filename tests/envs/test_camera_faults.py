"""Camera faults: their effect on frames, seeds, batches, resets, partial steps, saved states."""

import pytest
import torch
from torchrl.envs import Compose, TransformedEnv
from torchrl.envs.utils import check_env_specs

from drone_rl.collectors import EpisodeCollector, RolloutCollector
from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import (
    Blur,
    CameraFault,
    DeadRows,
    DroneEnv,
    FrozenFrames,
    GrayPixels,
    HeldFrames,
    LateFrames,
    Noise,
    Shift,
    StandardizePixels,
)
from drone_rl.envs.fault_models import FaultModel
from drone_rl.policies import SmallCNN, make_actor
from drone_rl.utils.errors import InputError

SHORT = TaskSettings(num_cubes=2, first_distance=3.0, spacing=3.0, step_limit=12, front_margin=3.0)


SMALL = CameraSettings(width=16, height=8)


LONG = 14
"""Steps after which every environment is in its second episode."""
KINDS = {
    "noise": lambda: [Noise(0.1)],
    "correlated": lambda: [Noise(0.1, 5.0)],
    "dead": lambda: [DeadRows(2, rows=(0,), level=0.5)],
    "frozen": lambda: [FrozenFrames(0.5)],
    "held": lambda: [HeldFrames(3)],
    "late": lambda: [LateFrames(2)],
    "all": lambda: [Blur(), Noise(), Noise(0.1, 3.0), DeadRows(), FrozenFrames(0.3), LateFrames()],
    "shift": lambda: [Shift()],
}


def make_env(kind="all", num_envs=4, **options):
    transforms = [GrayPixels(), *KINDS[kind](), StandardizePixels()]
    return DroneEnv(num_envs, SHORT, SMALL, transforms=transforms, **options)


def fly(env, steps=6, worlds=4):
    """Return the images of all steps; ended episodes restart. Shape: (N, T, C, H, W)."""
    moves = torch.arange(steps)[None] + torch.arange(worlds)[:, None]  # distinct actions
    state, seen = env.reset(), []
    for t in range(steps):
        seen.append(state["pixels"])
        state = env.step_and_maybe_reset(state.set("action", moves[:, t] % 3))[1]
    return torch.stack(seen, 1)


@pytest.mark.parametrize("kind", KINDS)
def test_specs_agree_with_data(kind):
    env = make_env(kind, 2)
    check_env_specs(env, break_when_any_done="both")
    env.close()


@pytest.mark.parametrize("kind", KINDS)
def test_seed_determines_faults(kind):
    first, second = fly(make_env(kind, seed=3), LONG), fly(make_env(kind, seed=3), LONG)
    assert torch.equal(first, second)
    env = make_env(kind, seed=5)
    assert not torch.equal(first, fly(env, LONG))
    env.set_seed(3)
    assert torch.equal(first, fly(env, LONG))
    assert not torch.equal(first, fly(env, LONG))  # the random streams have advanced


@pytest.mark.parametrize("kind", KINDS)
def test_first_environments_do_not_depend_on_batch_size(kind):
    whole = fly(make_env(kind, 4, seed=1), LONG)
    assert torch.equal(fly(make_env(kind, 2, seed=1), LONG, 2), whole[:2])
    env = make_env(kind, 2, seed=1, first_world=2)
    moves = torch.arange(LONG)[None] + torch.arange(2, 4)[:, None]
    state, seen = env.reset(), []
    for t in range(LONG):
        seen.append(state["pixels"])
        state = env.step_and_maybe_reset(state.set("action", moves[:, t] % 3))[1]
    assert torch.equal(torch.stack(seen, 1), whole[2:])


class OtherNoise(Noise):
    """A second fault class with the same behavior."""


def test_noise_is_independent_across_environments_episodes_and_faults():
    pipeline = [GrayPixels(), Noise(1.0), Noise(1.0), OtherNoise(1.0)]
    env, memories = DroneEnv(2, SHORT, SMALL, transforms=pipeline), []
    for _ in range(2):
        env.reset()
        memories += [s.memory[w] for s in env.observer.image.pipeline.stages for w in (0, 1)]
    for i in range(len(memories)):
        for j in range(i):
            both = torch.stack([memories[i].flatten(), memories[j].flatten()])
            assert both.corrcoef()[0, 1].abs() < 0.4  # images have 128 pixels


def test_faults_do_not_change_episodes():
    clean = DroneEnv(4, SHORT, SMALL, seed=2, transforms=[GrayPixels()])
    faulty = make_env(seed=2)
    for _ in range(3):
        cubes = [env.reset()["info", "cube_positions"] for env in (clean, faulty)]
        assert torch.equal(*cubes)


@pytest.mark.parametrize("kind", KINDS)
def test_partial_reset_keeps_the_other_environments(kind):
    env, moves = make_env(kind, seed=1), torch.tensor([0, 1, 2, 0])
    state = env.reset()
    for _ in range(3):
        state = env.step(state.set("action", moves))["next"]
    other = make_env(kind, seed=1)  # without a partial reset
    goes_on = other.reset()
    for _ in range(3):
        goes_on = other.step(goes_on.set("action", moves))["next"]
    mask = torch.tensor([[False], [True], [False], [False]])
    begun = env.reset(state.clone().set("_reset", mask))
    stayed = torch.tensor([0, 2, 3])
    assert torch.equal(begun["pixels"][stayed], goes_on["pixels"][stayed])
    step = env.step(begun.set("action", moves))["next"]["pixels"]
    expected = other.step(goes_on.set("action", moves))["next"]["pixels"]
    assert torch.equal(step[stayed], expected[stayed])
    fresh = make_env(kind, seed=1)
    fresh.reset()
    assert torch.equal(fresh.reset()["pixels"][1], begun["pixels"][1])  # its second episode


@pytest.mark.parametrize("kind", KINDS)
def test_masked_environments_keep_their_faults(kind):
    env, moves = make_env(kind, seed=1), torch.zeros(4, dtype=torch.int64)
    state = env.step(env.reset().set("action", moves))["next"]
    shown = state["pixels"]
    going = torch.tensor([True, False, True, False])
    after = env.step(state.set("action", moves).set("_step", going))["next"]
    assert torch.equal(after["pixels"][~going], shown[~going])
    whole = make_env(kind, seed=1)
    expected = whole.step(whole.reset().set("action", moves))["next"]
    expected = whole.step(expected.set("action", moves))["next"]["pixels"]
    assert torch.equal(after["pixels"][going], expected[going])
    now = env.step(after.set("action", moves).set("_step", ~going))["next"]["pixels"]
    assert torch.equal(now, expected)


@pytest.mark.parametrize("fault", [Noise(), DeadRows(), FrozenFrames(0.5), LateFrames(2), Shift()])
def test_returned_images_are_not_modified(fault):
    env = DroneEnv(3, SHORT, SMALL, transforms=[GrayPixels(), fault])
    state, shown = env.reset(), []
    for t in range(6):
        shown.append((state["pixels"], state["pixels"].clone()))
        going = torch.arange(3) != t % 3
        state = env.step(state.set("action", torch.zeros(3).long()).set("_step", going))["next"]
    for images, before in shown:
        assert torch.equal(images, before)


def collector(kind, how, seed=0):
    env = make_env(kind, seed=seed)
    generator = torch.Generator().manual_seed(0)
    network = SmallCNN((1, 8, 16), 3, channels=(4,), hidden=(8,), generator=generator)
    actor = make_actor(network, env.action_spec, generator)
    if how is RolloutCollector:
        return RolloutCollector(env, actor, 5), generator
    return EpisodeCollector(env, actor, compiled=True), generator


@pytest.mark.parametrize("how", [EpisodeCollector, RolloutCollector])
@pytest.mark.parametrize("kind", ["correlated", "all"])
def test_collectors_resume_bit_for_bit(how, kind, tmp_path):
    first, drawn = collector(kind, how)
    for _ in range(2):
        first.collect()
    torch.save({"collector": first.state_dict(), "drawn": drawn.get_state()}, tmp_path / "state")
    expected = [first.collect() for _ in range(2)]
    saved = torch.load(tmp_path / "state", weights_only=True)
    second, drawn = collector(kind, how)
    second.load_state_dict(saved["collector"])
    drawn.set_state(saved["drawn"])
    for one in expected:
        other = second.collect()
        for key in one.keys(True, True):
            assert torch.equal(one[key], other[key]), key


def test_images_outside_0_to_1_raise():
    for kind in (Noise, DeadRows, FrozenFrames, LateFrames, Shift):
        with pytest.raises(
            InputError, match=rf"{kind.__name__} got torch.uint8 .* after gray or rgb"
        ):
            DroneEnv(1, SHORT, SMALL, transforms=[kind()]).reset()
        standard = StandardizePixels(0.0, 0.5)
        with pytest.raises(InputError, match=r"got images from .* before standardize"):
            DroneEnv(1, SHORT, SMALL, transforms=[GrayPixels(), standard, kind()]).reset()


def test_torchrl_transforms_do_not_apply_faults():
    env = TransformedEnv(DroneEnv(2, SHORT, SMALL), Compose(GrayPixels(), LateFrames()))
    with pytest.raises(InputError, match=r"LateFrames has a memory .* give it to make_env"):
        env.reset()
    images = torch.rand(2, 1, 4, 4)
    assert Noise(1.0)._apply_transform(images) is images


class Inverted(CameraFault):
    """A user-defined fault without memory."""

    def __init__(self):
        super().__init__(FaultModel(lambda images, memory, blank: 1 - images))


def test_user_defined_faults_work():
    env = DroneEnv(2, SHORT, SMALL, transforms=[GrayPixels(), Inverted()])
    pixels = env.reset()["pixels"]
    gray = GrayPixels()._apply_transform(env.base_env.last_pixels)
    assert torch.equal(pixels, 1 - gray)


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_samples_equal_cpu():
    one, other = make_env(num_envs=2), make_env(num_envs=2, device="cuda")
    for env in (one, other):
        env.reset()
    memories = [env.observer.image.pipeline.stages[0].memory for env in (one, other)]
    assert memories[1].is_cuda and torch.equal(memories[0], memories[1].cpu())
    check_env_specs(other, break_when_any_done="both")


LONG_TASK = TaskSettings(num_cubes=30, first_distance=3.0, spacing=3.0, step_limit=90)


N = 3


def delayed(frames, count):
    """Return delayed frames; the first frame is repeated until the delay is over."""
    return frames[(torch.arange(len(frames)) - count).clamp(min=0)]


def film(*transforms, steps=10, episodes=1):
    """Return frames with and without faults. Shapes: (T, N, 1, H, W)."""
    env = DroneEnv(N, LONG_TASK, SMALL, transforms=[GrayPixels(), *transforms])
    gray, shown, clean = GrayPixels(), [], []
    for _ in range(episodes):
        state = env.reset()
        for t in range(steps):
            shown.append(state["pixels"])
            clean.append(gray._apply_transform(env.base_env.last_pixels))
            action = torch.full((N,), t % 3)
            state = env.step(state.set("action", action))["next"]
    env.close()
    return torch.stack(shown), torch.stack(clean)


@pytest.mark.parametrize("frames", [0, 1, 3])
def test_late_frames_are_delayed_by_the_number_of_frames(frames):
    shown, clean = film(LateFrames(frames))
    assert torch.equal(shown, delayed(clean, frames))
    assert all(not torch.equal(clean[t], clean[t + 1]) for t in range(9))  # frames do change


@pytest.mark.parametrize("every", [1, 2, 4])
def test_held_frames_are_renewed_every_few_steps(every):
    shown, clean = film(HeldFrames(every), episodes=2)
    step = torch.arange(20)
    assert torch.equal(shown, clean[step - step % 10 % every])  # ten steps an episode


def test_fraction_of_frames_is_frozen():
    shown, clean = film(FrozenFrames(0.25), steps=80, episodes=5)
    first = torch.arange(len(shown)) % 80 == 0
    assert torch.equal(shown[first], clean[first])
    frozen = 0
    for t in range(1, len(shown)):
        for world in range(N):
            if t % 80 and not torch.equal(shown[t, world], clean[t, world]):
                assert torch.equal(shown[t, world], shown[t - 1, world])
                frozen += 1
    assert frozen / (5 * 79 * N) == pytest.approx(0.25, abs=0.04)  # three standard deviations


def test_dead_rows_last_for_one_episode():
    shown, clean = film(DeadRows(2, level=0.125), steps=4, episodes=6)
    drawn = set()
    for t in range(0, len(shown), 4):
        for world in range(N):
            dead = (shown[t, world, 0] == 0.125).all(-1)
            assert dead.sum() == 2
            for later in range(t, t + 4):
                expected = torch.where(dead[..., None], 0.125, clean[later, world])
                assert torch.equal(shown[later, world], expected)
            drawn.add(tuple(dead.nonzero().flatten().tolist()))
    assert len(drawn) > 8  # of 18 samples of 28 possible pairs


def test_noise_has_the_configured_strength_and_correlation():
    shown, clean = film(Noise(0.05, correlation_time=2.0), steps=80)
    noise, inside = shown - clean, (clean > 0.25) & (clean < 0.75)  # where no value is clipped
    assert inside.sum() > 5000
    assert noise[inside].std() == pytest.approx(0.05, rel=0.05)
    both = inside[1:] & inside[:-1]
    product = (noise[1:] * noise[:-1])[both].mean()
    assert product / 0.05**2 == pytest.approx(0.6065, abs=0.05)  # exp(-1/2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Noise(1.5), r"^strength=1\.5: it must be a number from 0 to 1"),
        (lambda: DeadRows(rows=(1, 1)), r"^rows=\[1, 1\] names a row twice; name each once"),
        (lambda: film(DeadRows(9), steps=1), r"^count=9 .*; give at most 8"),
        (lambda: film(DeadRows(0, (8,)), steps=1), r"^rows=\[8\] .* give at most 7"),
        (lambda: Blur()._apply_transform(torch.zeros(2, 2, 3, dtype=torch.uint8)), "^Blur got"),
    ],
)
def test_invalid_values_raise(make, message):
    with pytest.raises(InputError, match=message):
        make()
