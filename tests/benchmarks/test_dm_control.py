from types import SimpleNamespace

import pytest

from benchmarks import dm_control


def test_steps_and_resets_are_counted_with_one_image_each(monkeypatch):
    now, rendered, done = [0.0], [], []
    monkeypatch.setattr(dm_control.time, "perf_counter", lambda: now[0])

    def render():
        rendered.append(now[0])
        now[0] += 0.5

    def step(action):
        done.append(action)
        return SimpleNamespace(last=lambda: len(done) == 3)

    env = SimpleNamespace(step=step, reset=lambda: SimpleNamespace(last=lambda: False))
    assert dm_control._rate(env, render, seconds=2.0) == 2.0
    assert len(rendered) == 1 + 4  # the first is a warm-up
    assert len(done) < 5  # one of them was a reset
    assert set(done) <= {0, 1, 2}


@pytest.mark.render
@pytest.mark.parametrize("quality", ["default", "tuned"])
def test_both_qualities_render(egl, quality):
    rate = {"default": dm_control.default_rate, "tuned": dm_control.tuned_rate}[quality]
    assert rate(0.1) > 0
