"""The effect of each camera fault on frames."""

import pytest
import torch

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.envs import (
    Blur,
    DeadRows,
    DroneEnv,
    FrozenFrames,
    GrayPixels,
    LateFrames,
    Noise,
    Shift,
    fault_models,
    with_transforms,
)
from drone_rl.utils.errors import InputError

LONG = TaskSettings(num_cubes=30, first_distance=3.0, spacing=3.0, step_limit=90)
SMALL = CameraSettings(width=16, height=8)
N = 3


def delayed(frames, count):
    """Return delayed frames; the first frame is repeated until the delay is over."""
    return frames[(torch.arange(len(frames)) - count).clamp(min=0)]


def film(*transforms, steps=10, episodes=1):
    """Return frames with and without faults. Shapes: (T, N, 1, H, W)."""
    env = with_transforms(DroneEnv(N, LONG, SMALL), [GrayPixels(), *transforms])
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


def test_late_frames_do_not_cross_episodes():
    shown, clean = film(LateFrames(2), steps=5, episodes=2)
    assert torch.equal(shown[5:], delayed(clean[5:], 2))


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


@pytest.mark.parametrize(("share", "same_as"), [(0.0, slice(None)), (1.0, slice(0, 1))])
def test_extreme_fractions_freeze_no_or_all_frames(share, same_as):
    shown, clean = film(FrozenFrames(share))
    assert torch.equal(shown, clean[same_as].expand_as(shown))


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


def test_fixed_dead_rows_are_added_to_random_ones():
    rows = film(DeadRows(1, rows=(2, 5), level=1.0), steps=1, episodes=20)[0][:, :, 0, :, 0] == 1.0
    assert rows[..., [2, 5]].all()
    assert (rows.sum(-1) == 3).all()
    assert rows[..., [0, 1, 3, 4, 6, 7]].any(0).any(0).all()
    always = film(DeadRows(0, rows=(2,)), steps=1)[0][:, :, 0, :, 0] == 0.0
    assert always.sum(-1).tolist() == [[1, 1, 1]]


def test_noise_has_the_configured_strength_and_correlation():
    shown, clean = film(Noise(0.05, correlation_time=2.0), steps=80)
    noise, inside = shown - clean, (clean > 0.25) & (clean < 0.75)  # where no value is clipped
    assert inside.sum() > 5000
    assert noise[inside].std() == pytest.approx(0.05, rel=0.05)
    both = inside[1:] & inside[:-1]
    product = (noise[1:] * noise[:-1])[both].mean()
    assert product / 0.05**2 == pytest.approx(0.6065, abs=0.05)  # exp(-1/2)


def test_blur_equals_the_function():
    shown, clean = film(Blur(1.0))
    assert torch.equal(shown, fault_models.blur(clean, 1.0))


def test_shift_lasts_for_an_episode_and_takes_all_values():
    shown, clean = film(Shift(1, 1), steps=2, episodes=30)
    offsets = torch.cartesian_prod(torch.arange(-1, 2), torch.arange(-1, 2))
    drawn = set()
    for t in range(0, 60, 2):
        for world in range(N):
            fits = [
                {
                    i
                    for i, offset in enumerate(offsets)
                    if torch.equal(
                        shown[step, world], fault_models.shift(clean[step, world], offset)
                    )
                }
                for step in (t, t + 1)
            ]
            assert fits[0] & fits[1]
            drawn |= fits[0] if len(fits[0]) == 1 else set()
    assert drawn == set(range(9))


def test_repr_shows_parameters():
    assert repr(Blur(0.5)) == "Blur(width=0.5)"
    assert repr(Noise(0.1, 3)) == "Noise(strength=0.1, correlation_time=3)"
    assert repr(DeadRows(2, (1,), 0.5)) == "DeadRows(count=2, rows=(1,), level=0.5)"
    assert repr(FrozenFrames(0.1)) == "FrozenFrames(share=0.1)"
    assert repr(LateFrames(3)) == "LateFrames(frames=3)"
    assert repr(Shift(1, 2)) == "Shift(down=1, across=2)"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Blur(-1.0), r"^width=-1\.0 is out of range; give a number from 0 to 16"),
        (lambda: Noise(1.5), r"^strength=1\.5 is out of range; give a number from 0 to 1"),
        (lambda: Noise(float("nan")), r"^strength=nan is out of range"),
        (lambda: Noise(0.1, -1.0), r"^correlation_time=-1\.0 is out of range"),
        (lambda: DeadRows(-1), r"^count=-1 is out of range"),
        (lambda: DeadRows(rows=(1, 1)), r"^rows=\[1, 1\] names a row twice; name each once"),
        (lambda: DeadRows(rows=(-1,)), r"^rows\[0\]=-1 is out of range"),
        (lambda: DeadRows(level=2.0), r"^level=2\.0 is out of range"),
        (lambda: FrozenFrames(1.1), r"^share=1\.1 is out of range; give a number from 0 to 1"),
        (lambda: LateFrames(17), r"^frames=17 is out of range; give a whole number from 0 to 16"),
        (lambda: Shift(-1), r"^down=-1 is out of range; give a whole number from 0 to 1023"),
        (lambda: Shift(0, 2000), r"^across=2000 is out of range"),
        (
            lambda: film(DeadRows(9), steps=1),
            r"^count=9: the image has 8 rows.*; give at most 8",
        ),
        (lambda: film(DeadRows(7, (0, 1)), steps=1), r"of which 2 are always dead; .* at most 6"),
        (lambda: film(DeadRows(0, (8,)), steps=1), r"^rows=\[8\]: the image .* give at most 7"),
        (
            lambda: Blur()._apply_transform(torch.zeros(2, 2, 3, dtype=torch.uint8)),
            "Blur got torch.uint8 images; put it after gray or rgb",
        ),
    ],
)
def test_invalid_values_raise(make, message):
    with pytest.raises(InputError, match=message):
        make()
