import math

import numpy as np
import pytest
import torch
from torchrl.envs.utils import exploration_type

import drone_rl
from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    DynamicsSettings,
    PillarsSettings,
    ReachSettings,
    TaskSettings,
)
from drone_rl.config.networks import Lstm
from drone_rl.config.reach import ReachStartSettings
from drone_rl.envs import GrayPixels
from drone_rl.envs.rollout import Act
from drone_rl.sim.actions import MOVE_SETS, MOVES
from drone_rl.sim.entities import CHASE
from drone_rl.sim.rendering.appearance import product, rotate, turned
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.video import (
    _draw_bars,
    film,
    film_episode,
    level,
    render_chase,
    render_step,
    view,
    write_video,
)
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS
from tests.five_actions import FIVE
from tests.second_task import Posts
from tests.untrained import untrained


class Canvas:
    """Notes what is drawn."""

    def __init__(self):
        self.texts, self.bars = [], []

    def text(self, place, text, *_):
        self.texts.append((place[0], text))

    def rectangle(self, box, color):
        self.bars.append((box[0], box[2] - box[0], color))


def test_film_is_written_as_mp4_and_gif(make_pipeline, tmp_path):
    settings = TaskSettings(num_cubes=1, first_distance=4.0, step_limit=4)
    env, actor = make_pipeline(1, task=settings)
    frames = list(film_episode(env, actor))
    assert 2 <= len(frames) <= 5
    assert frames[0].shape == (720, 1280, 3)
    assert len({f.tobytes() for f in frames}) == len(frames)
    files = write_video(frames, tmp_path / "sub" / "wind_0.5")
    assert [f.name for f in files] == ["wind_0.5.mp4", "wind_0.5.gif"]
    assert all(f.stat().st_size > 1000 for f in files)


def test_a_suspended_film_keeps_the_exploration_type(make_pipeline):
    film = film_episode(*make_pipeline(1, task=TaskSettings(num_cubes=1)))
    next(film)
    assert exploration_type() is None


def test_a_film_shows_the_appearance_of_the_environment(make_pipeline):
    look = AppearanceSettings(ground_color=((0.9, 0.0, 0.0), (1.0, 0.1, 0.1)))
    env, _ = make_pipeline(1, appearance=look)
    env.reset()
    seen = render_step(env.base_env)
    assert seen.chase.shape == (532, 1280, 3) and seen.strip.shape == (5, 144, 252, 3)
    own = env.base_env.appearances.current().colors[SemanticClass.GROUND][0]
    below = seen.strip[4, -1, 0].double()  # the ground, in full light
    sun = 0.35 + 0.75 * 0.82
    assert below.tolist() == pytest.approx((255 * sun * own).tolist(), abs=3)
    assert torch.equal(seen.camera, env.base_env.last_pixels[0])


def test_video_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="another folder"):
        write_video([np.zeros((16, 16, 3), np.uint8)], tmp_path / "file" / "episode")


def test_film_of_another_task(make_pipeline):
    frames = list(film_episode(*make_pipeline(1, task=Posts())))
    assert 2 <= len(frames) <= 13 and frames[0].shape == (720, 1280, 3)


def test_bars_of_many_actions_are_in_two_rows():
    canvas, actions = Canvas(), MOVE_SETS["moves_full"]
    _draw_bars(canvas, None, Act(torch.tensor([0])), actions)
    places = [x for x, _ in canvas.texts]
    assert places == [300, 540, 780, 1020] * 2
    assert max(length for _, length, _ in canvas.bars) == 100


@pytest.mark.parametrize("actions", [MOVES, FIVE])
def test_bars_of_action_probabilities(actions):
    canvas, count = Canvas(), len(actions)
    logits = torch.zeros(1, count)
    logits[0, actions.left] = 50.0
    _draw_bars(canvas, None, Act(torch.tensor([actions.left]), logits), actions)
    assert [text.split()[0] for _, text in canvas.texts] == [
        actions.names[i] for i in actions.order
    ]
    places = [x for x, _ in canvas.texts]
    assert places == sorted(places) and places[-1] + 960 // count <= 1280
    (chosen,) = [b for b in canvas.bars if b[2] != canvas.bars[-1][2]]
    assert chosen[1] == 960 // count - 140 and all(
        b[1] == 1 for b in canvas.bars if b is not chosen
    )


def test_bars_without_logits():
    canvas = Canvas()
    _draw_bars(canvas, None, Act(torch.tensor([2])), MOVES)
    assert [text for _, text in canvas.texts] == ["left 0.00", "forward 0.00", "right 1.00"]


@pytest.mark.parametrize(
    "task", [TaskSettings(num_cubes=1, first_distance=4.0), PillarsSettings(num_rows=1)]
)
@pytest.mark.parametrize("actions", [ActionSettings(), SETTINGS])
def test_instruments_are_shown_in_flight(make_pipeline, task, actions):
    flying = DynamicsSettings(mode="simple_flight")
    pipeline = make_pipeline(1, task=task, dynamics=flying, actions=actions)
    films = film_episode(*pipeline), film_episode(*make_pipeline(1, task=task))
    shown, other = (next(film)[12:202, 792:1268] for film in films)
    assert tuple(shown[0, 0]) == (24, 26, 31) != tuple(other[0, 0])


SIZE = {"height": 60, "width": 90}


def worlds(mode="simple_flight", mount="gimbal"):
    return Worlds(1, dynamics=DynamicsSettings(mode=mode, camera_mount=mount))


def roll(drones, degrees):
    drones.state.body.attitude[:] = turned("roll", degrees)


def test_chase_view_in_computer_vision_mode():
    still = worlds("computer_vision")
    view = still.view(CHASE.name, **SIZE, show_drone=True)
    assert torch.equal(render_chase(still, None, **SIZE), still.render(still.state, view))


@pytest.mark.parametrize("mount", ["gimbal", "body"])
def test_chase_view_stays_level_while_the_drone_rolls(mount):
    flying = worlds(mount=mount)
    view = flying.view(CHASE.name, "segmentation", **SIZE, show_drone=True)
    drone = flying.scene.geoms(SemanticClass.DRONE)
    is_drone = torch.isin(flying.render(flying.state, view)[0], torch.tensor(drone))
    level_picture = render_chase(flying, None, **SIZE)[0]
    roll(flying, 30.0)
    tilted = render_chase(flying, None, **SIZE)[0]
    differs = (tilted != level_picture).any(-1)
    assert differs.any()
    rows, columns = torch.nonzero(is_drone, as_tuple=True)
    near = torch.zeros_like(is_drone)
    near[rows.min() - 6 : rows.max() + 7, columns.min() - 6 : columns.max() + 7] = True
    assert not (differs & ~near).any()


@pytest.mark.parametrize("mode", ["computer_vision", "simple_flight"])
def test_chase_camera_is_in_front_of_a_wall_behind_the_drone(tmp_path, mode):
    """The red wall is half a metre behind the drone, the camera usually 2.6 m."""
    wall = '<geom type="box" size="0.1 9 9" pos="-0.6 0 0" rgba="1 0 0 1"/>'
    sites = '<site name="start"/><site name="goal" pos="3 0 0"/>'
    (tmp_path / "wall.xml").write_text(f"<mujoco><worldbody>{wall}{sites}</worldbody></mujoco>")
    walled = Worlds(
        1,
        ReachSettings(scene=(str(tmp_path / "wall.xml"),), start=ReachStartSettings(heading=0.0)),
        dynamics=DynamicsSettings(mode=mode),
    )
    walled.reset(torch.arange(1), [np.random.RandomState(0)])
    shown = render_chase(walled, None, **SIZE)[0]
    assert not ((shown[..., 0] > 30) & (shown[..., 1] == 0)).any()


def test_mounting_of_a_level_chase_camera():
    tilt, heading = turned("pitch", 20.0), turned("yaw", 40.0)
    body = product(heading, tilt)
    place = torch.tensor(CHASE.pos, dtype=torch.float64)
    mounted = level(body[None], "drone/chase", place, 0.5 * place[None])
    found = rotate(body, place + mounted.offset[0])
    assert found.tolist() == pytest.approx(rotate(heading, 0.5 * place).tolist())
    assert product(body, mounted.turn[0]).tolist() == pytest.approx(heading.tolist())
    assert math.isclose(float(mounted.turn.norm()), 1.0)


def test_film_writes_one_mp4_and_one_gif_per_episode(tmp_path):
    policy = drone_rl.load_policy("good").in_task(num_cubes=1, first_distance=4.0)
    flying = policy.in_dynamics(mode="simple_flight")  # its video has instruments, too
    files = film(flying, tmp_path, 1)
    assert [file.name for file in files] == ["episode_0.mp4", "episode_0.gif"]
    assert all(file.stat().st_size > 0 for file in files)


def test_viewer_needs_a_display(monkeypatch):
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


@torch.no_grad()
def test_a_recurrent_policy_remembers_in_the_viewer(monkeypatch):
    """It acts as its network evaluated step by step from the start of each episode."""
    policy = untrained(Lstm(channels=(2,), hidden=(4,), memory=8), seed=7)
    network, taken, memoryless = policy.make_network(), [], []

    def launch(env, act, title):
        for _ in range(2):
            timestep, memory = env.reset(), network.start(1)
            for _ in range(12):
                task = env.task
                gray = GrayPixels()._apply_transform(task.worlds.render(task.state))
                outputs, memory = network.step(gray, memory)
                memoryless.append(int(network(gray).argmax()))
                taken.append(int(act(timestep)))
                assert taken[-1] == int(outputs.argmax())
                timestep = env.step(taken[-1])

    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr("dm_control.viewer.launch", launch)
    view(policy)
    assert len(taken) == 24 and taken != memoryless
