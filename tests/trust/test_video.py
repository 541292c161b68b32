import numpy as np
import pytest
import torch
from tensordict import TensorDict
from torchrl.envs.utils import exploration_type

from drone_rl.config import (
    ActionSettings,
    AppearanceSettings,
    DynamicsSettings,
    PillarsSettings,
    TaskSettings,
)
from drone_rl.sim.actions import MOVES
from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.trust.video import (
    StepImages,
    _caption,
    _compose,
    _draw_bars,
    film_episode,
    render_step,
    write_video,
)
from drone_rl.utils.errors import InputError
from tests.continuous import SETTINGS
from tests.five_actions import FIVE
from tests.second_task import Posts


class Canvas:
    """Notes what is drawn."""

    def __init__(self):
        self.texts, self.bars = [], []

    def text(self, place, text, *_):
        self.texts.append((place[0], text))

    def rectangle(self, box, color):
        self.bars.append((box[0], box[2] - box[0], color))


def test_film_and_files(make_pipeline, tmp_path):
    settings = TaskSettings(num_cubes=1, first_distance=4.0, step_limit=4)
    env, actor = make_pipeline(1, task=settings)
    frames = list(film_episode(env, actor))
    assert 2 <= len(frames) <= 5
    assert frames[0].shape == (720, 1280, 3)
    assert len({f.tobytes() for f in frames}) == len(frames)
    files = write_video(frames, tmp_path / "sub" / "wind_0.5")
    assert [f.name for f in files] == ["wind_0.5.mp4", "wind_0.5.gif"]
    assert all(f.stat().st_size > 1000 for f in files)


def test_a_suspended_film_leaves_the_exploration_type_as_it_was(make_pipeline):
    film = film_episode(*make_pipeline(1, task=TaskSettings(num_cubes=1)))
    next(film)
    assert exploration_type() is None


def test_a_film_shows_the_world_as_it_was_drawn(make_pipeline):
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


def test_another_task_is_filmed_too(make_pipeline):
    frames = list(film_episode(*make_pipeline(1, task=Posts())))
    assert 2 <= len(frames) <= 13 and frames[0].shape == (720, 1280, 3)


@pytest.mark.parametrize("actions", [MOVES, FIVE])
def test_there_is_a_bar_for_each_action_from_left_to_right_as_long_as_it_is_probable(actions):
    canvas, count = Canvas(), len(actions)
    logits = torch.zeros(1, count)
    logits[0, actions.left] = 50.0
    acted = TensorDict({"action": torch.tensor([actions.left]), "logits": logits}, [1])
    _draw_bars(canvas, None, acted, actions)
    assert [text.split()[0] for _, text in canvas.texts] == [
        actions.names[i] for i in actions.order
    ]
    places = [x for x, _ in canvas.texts]
    assert places == sorted(places) and places[-1] + 960 // count <= 1280
    (chosen,) = [b for b in canvas.bars if b[2] != canvas.bars[-1][2]]
    assert chosen[1] == 960 // count - 140 and all(
        b[1] == 1 for b in canvas.bars if b is not chosen
    )


def test_of_speeds_there_is_a_bar_for_each_part():
    canvas, actions = Canvas(), ContinuousActions.of(SETTINGS)
    acted = {"action": torch.tensor([[0.0, 0.9, 0.0]]), "logits": torch.zeros(1, 6)}
    _draw_bars(canvas, None, TensorDict(acted, [1]), actions)
    assert len({color for *_, color in canvas.bars[:1] + canvas.bars[2:]}) == 1
    assert canvas.texts[1][1].startswith("left 0.") and canvas.bars[1][2] != canvas.bars[0][2]


def test_who_has_no_logits_is_sure():
    canvas = Canvas()
    _draw_bars(canvas, None, TensorDict({"action": torch.tensor([2])}, [1]), MOVES)
    assert [text for _, text in canvas.texts] == ["left 0.00", "forward 0.00", "right 1.00"]


@pytest.mark.parametrize(
    "task", [TaskSettings(num_cubes=1, first_distance=4.0), PillarsSettings(num_rows=1)]
)
@pytest.mark.parametrize("actions", [ActionSettings(), SETTINGS])
def test_in_flight_there_are_instruments(make_pipeline, task, actions):
    flying = DynamicsSettings(mode="simple_flight")
    pipeline = make_pipeline(1, task=task, dynamics=flying, actions=actions)
    films = film_episode(*pipeline), film_episode(*make_pipeline(1, task=task))
    shown, other = (next(film)[12:202, 792:1268] for film in films)
    assert tuple(shown[0, 0]) == (24, 26, 31) != tuple(other[0, 0])


def test_pictures_of_one_moment_by_the_pixel():
    red, green, blue = (
        torch.tensor(c, dtype=torch.uint8) for c in ((200, 0, 0), (0, 200, 0), (0, 0, 200))
    )
    seen = StepImages(
        camera=blue.expand(10, 20, 3),
        chase=red.expand(532, 1280, 3),
        strip=green.expand(5, 144, 252, 3),
    )
    shown = _compose(seen, "")
    of = {name: (shown == color.numpy()).all(-1) for name, color in
          (("red", red), ("green", green), ("blue", blue))}  # fmt: skip
    assert shown.shape == (720, 1280, 3)
    rows, columns = of["blue"].nonzero()  # 320 pixels across and half as high
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (39, 198, 15, 334)
    assert of["red"][0].all() and of["red"][531].all() and not of["red"][532:].any()
    around = ~of["red"][:532]
    assert around[12:202, 12:338].all() and around.sum() == 190 * 326
    below = of["green"]
    assert not below[:537].any() and not below[681:].any()
    assert below[680].tolist() == [x % 257 < 252 for x in range(1280)]
    label = ~below[537]  # from a camera's left edge on, behind its name
    assert label[0] and label[257] and below[537, 251] and below[560 + 1, 0] and not below[560, 0]


def test_a_tall_picture_of_the_policys_is_cut_to_half_the_height():
    red, blue = (torch.tensor(c, dtype=torch.uint8) for c in ((200, 0, 0), (0, 0, 200)))
    five = torch.zeros(5, 144, 252, 3, dtype=torch.uint8)
    shown = _compose(StepImages(blue.expand(40, 20, 3), red.expand(532, 1280, 3), five), "")
    rows, _ = (shown == blue.numpy()).all(-1).nonzero()
    assert (rows.min(), rows.max()) == (39, 39 + 266 - 1)


def test_bars_by_the_pixel():
    canvas, acted = Canvas(), {"action": torch.tensor([0]), "logits": torch.zeros(1, 3)}
    acted["logits"][0] = torch.tensor([0.5, 0.25, 0.25]).log()
    _draw_bars(canvas, None, TensorDict(acted, [1]), MOVES)
    assert [(x, width) for x, width, _ in canvas.bars] == [(420, 45), (740, 90), (1060, 45)]
    assert [x for x, _ in canvas.texts] == [300, 620, 940]
    assert [text for _, text in canvas.texts] == ["left 0.25", "forward 0.50", "right 0.25"]


def test_a_caption_names_the_end_once_there_is_one(make_pipeline):
    env, _ = make_pipeline(1, task=TaskSettings(num_cubes=1, first_distance=4.0))
    state, task = env.reset(), env.base_env.worlds.task
    assert _caption(task, state, 0.0).endswith(" 0")
    state["info", "end_reason"][0] = 1
    assert _caption(task, state, 1.0).endswith(" 1   ended: all cubes")
