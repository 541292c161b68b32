"""Films of a policy's flights, and the viewer that needs a display."""

import numpy as np
import pytest

import drone_rl
from drone_rl.trust import video
from drone_rl.trust.video import film, view
from drone_rl.utils.errors import InputError


def test_one_mp4_and_one_gif_each(tmp_path):
    policy = drone_rl.load_policy("good").in_task(num_cubes=1, first_distance=4.0)
    flying = policy.in_dynamics(mode="simple_flight")  # its video has instruments, too
    files = film(flying, tmp_path, 1)
    assert [file.name for file in files] == ["episode_0.mp4", "episode_0.gif"]
    assert all(file.stat().st_size > 0 for file in files)


def test_every_episode_has_a_single_environment(tmp_path, monkeypatch):
    sizes = []

    def film_episode(env, actor, *, greedy):
        sizes.append(env.batch_size)
        yield np.zeros((720, 1280, 3), np.uint8)

    monkeypatch.setattr(video, "film_episode", film_episode)
    film(drone_rl.load_policy("good"), tmp_path, 2)
    assert sizes == [(1,), (1,)]


def test_no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match="needs a display"):
        view(drone_rl.load_policy("good"))


@pytest.mark.parametrize("name", ["good", "flight_velocity", "pillars_good"])
def test_viewer_runs_a_policy_in_dm_control(name, monkeypatch):
    """A viewer calls the policy with each time step of some episodes; the last stacks frames."""
    policy, actions = drone_rl.load_policy(name), []

    def launch(env, act, title):
        for _ in range(2):
            timestep = env.reset()
            for _ in range(5):
                actions.append(act(timestep))
                timestep = env.step(actions[-1])

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("dm_control.viewer.launch", launch)
    view(policy)
    assert len(actions) == 10
    assert actions[0].shape == ((3,) if name == "flight_velocity" else ())
