"""Ratios of the speed benchmarks, with given rates."""

from types import SimpleNamespace

import pytest
import yaml

from benchmarks import speed
from drone_rl.config import AppearanceSettings
from drone_rl.config.configuration import from_config
from drone_rl.sim.rendering import View
from drone_rl.utils.settings import conf_dir


def view(modality=("rgb",), **size):
    return View(cameras=("front",), modalities=modality, **size)


@pytest.fixture
def envs(monkeypatch):
    """Replace environments by stubs that render nothing; return those that were created."""
    created = []

    def make_drone_env(num_envs, device, renderer="raytrace", appearance=None):
        env = SimpleNamespace(closed=False, renderer=renderer)
        env.appearances = SimpleNamespace(current=lambda worlds: [appearance] * len(worlds))
        env.worlds = SimpleNamespace(state=None, policy_view=None, view=view, num_envs=num_envs)
        env.worlds.render_all = lambda state, view: {"rgb": "frames", "depth": "frames"}
        env.worlds.render = lambda state, view, looks: looks
        env.reset = lambda: None
        env.close = lambda: setattr(env, "closed", True)
        created.append(env)
        return env

    monkeypatch.setattr(speed, "make_drone_env", make_drone_env)
    monkeypatch.setattr(speed, "random_walk", lambda env, steps: 2 * steps)
    return created


def test_rendering_rates(envs, monkeypatch):
    monkeypatch.setattr(speed, "rate", lambda work, seconds: work() * seconds)
    calls = []

    def paired(first, second, seconds, rounds):
        calls.append((first.args[1], second.args[1]))
        return first(), second(), 11.0 + rounds

    monkeypatch.setattr(speed, "paired", paired)
    assert speed.bench_render(2, "cpu", quick=True) == {
        "raw_render_fps": 3.0,
        "raw_render_fps_64": 3.0,
        "raw_render_blocks_fps_64": 1.0,
        "render_over_warp": {"25x64": 14.0, "64x64": 14.0, "100x256": 14.0},
        "render_all_over_rgb": 20.0,
    }
    assert calls[2] == (view(height=100, width=256),) * 2
    rgb, all_modalities = calls[3]
    assert (rgb.modalities, len(all_modalities.modalities)) == (("rgb",), 6)
    assert [env.renderer for env in envs[2:]] == [*["raytrace", "mujoco_warp"] * 3, "raytrace"]
    assert all(env.closed for env in envs)


def test_the_measured_blocks_are_those_of_the_configuration():
    settings = yaml.safe_load((conf_dir() / "appearance" / "blocks.yaml").read_text())
    del settings["defaults"]
    assert from_config(AppearanceSettings, settings) == speed.BLOCKS


def test_the_collector_is_compared_with_rendering(envs, monkeypatch):
    events, calls = [], []

    def default_collector(num_envs, device):
        events.append(num_envs)
        return SimpleNamespace(
            collect=lambda: "b" * num_envs, shutdown=lambda: events.append("shutdown")
        )

    monkeypatch.setattr(speed, "default_collector", default_collector)
    monkeypatch.setattr(speed, "rate", lambda work, seconds: seconds * (100 - abs(work() - 65)))

    def paired(first, second, seconds, rounds):
        calls.append((first(), second(), seconds, rounds))
        return 6.0, 8.0, 0.7

    monkeypatch.setattr(speed, "paired", paired)
    assert speed.bench_collector(2, "cpu", quick=False) == {
        "collector_fps": 6.0,
        "collector_worlds": 64,
        "collector_fps_16": 4.0 * 51,
        "raw_render_beside_collector_fps": 8.0,
        "collector_over_raw": 0.7,
    }
    assert calls == [(64, 6, 4.0, 9)]  # frames of a batch, and the length of "frames"
    assert events[::2] == [16, 32, 64, 128, 256, 64] and events[1::2] == ["shutdown"] * 6
    assert envs[0].closed and envs[0].renderer == "mujoco_warp"


@pytest.mark.parametrize(("single", "ratio"), [(4.0, 5.0), (None, None)])
def test_batched_over_dm_control(envs, monkeypatch, single, ratio):
    monkeypatch.setattr(speed, "rate", lambda work, seconds: float(work()))
    monkeypatch.setattr(speed, "_dm_control_rate", lambda quality, seconds: single)
    found = speed.bench_dm_control(2, "cpu", quick=True)
    assert found == {
        "dm_control_fps": single,
        "batched_over_dm_control": ratio,
        "dm_control_tuned_fps": single,
        "batched_over_dm_control_tuned": ratio,
        "batched_env_fps": 20.0,
    }


@pytest.mark.parametrize(
    ("status", "printed", "frames"),
    [(0, 'noise\n{"frames_per_second": 7.5}\n', 7.5), (1, "", None)],
)
def test_the_rate_of_dm_control_comes_from_a_separate_process(monkeypatch, status, printed, frames):
    calls = []

    def run(command, **kwargs):
        calls.append((command[-2:], kwargs["env"]["MUJOCO_GL"]))
        return SimpleNamespace(returncode=status, stdout=printed)

    monkeypatch.setattr(speed.subprocess, "run", run)
    assert speed._dm_control_rate("tuned", 0.5) == frames
    assert calls == [(["tuned", "0.5"], "egl")]
