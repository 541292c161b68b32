"""Films of an episode: what the drone sees beside the drone itself, and what it makes of it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import imageio.v3 as iio
import numpy as np
import torch
from PIL import Image, ImageDraw, ImageFont
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type

from drone_rl.envs import DroneEnv, worlds_of
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.sim.entities.cameras import CHASE
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError

PANEL_HEIGHT, PANEL_WIDTH = 360, 640
FRAMES_PER_SECOND = 10
_BACKGROUND, _TEXT, _CHOSEN, _BAR = (24, 26, 31), (235, 235, 240), (226, 74, 51), (120, 130, 150)


@torch.no_grad()
def film_episode(
    env: TransformedEnv, actor: TensorDictModuleBase, *, greedy: bool = True
) -> Iterator[np.ndarray]:
    """Flies one episode in the first world of `env` and yields its pictures.

    Args:
        env: One world.
        actor: The policy; its "logits", if it has any, are drawn as probabilities.
        greedy: Whether to take the most probable action instead of drawing one.

    Yields:
        RGB pictures, uint8. Shape: (360 + 40, 2 * 640, 3).
    """
    worlds, base = worlds_of(env), cast(DroneEnv, env.base_env)
    actions = worlds.dynamics.actions
    chase = worlds.view(CHASE.name, height=PANEL_HEIGHT, width=PANEL_WIDTH, show_drone=True)
    kind = ExplorationType.DETERMINISTIC if greedy else ExplorationType.RANDOM
    state, earned = env.reset(), 0.0
    with set_exploration_type(kind):
        while True:
            outside = worlds.render(worlds.state, chase)[0]
            acted = actor(state.clone(False))
            inside = base.last_pixels[0]
            yield _compose(inside, outside, _caption(worlds.task, state, earned), acted, actions)
            state = env.step(state.set("action", acted["action"]))["next"]
            earned += float(state["reward"][0])
            if bool(state["done"].all()):
                outside = worlds.render(worlds.state, chase)[0]
                inside = base.last_pixels[0]
                yield _compose(inside, outside, _caption(worlds.task, state, earned))
                return


def write_video(frames: list[np.ndarray], path: Path) -> list[Path]:
    """Writes an MP4 and, at half the size, a GIF.

    Args:
        frames: RGB pictures of one size.
        path: Where to, without an ending.

    Returns:
        The two files.

    Raises:
        InputError: They can't be written.
    """
    files = [path.with_suffix(".mp4"), path.with_suffix(".gif")]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        iio.imwrite(files[0], np.stack(frames), fps=FRAMES_PER_SECOND, codec="libx264")
        half = [Image.fromarray(f).resize((f.shape[1] // 2, f.shape[0] // 2)) for f in frames]
        palette = [image.quantize(64, dither=Image.Dither.NONE) for image in half]
        palette[0].save(
            files[1],
            save_all=True,
            append_images=palette[1:],
            duration=1000 // FRAMES_PER_SECOND,
            loop=0,
        )
    except OSError as error:
        raise InputError(
            f"video {path} can't be written ({error}); choose another folder"
        ) from error
    return files


def _caption(task: Task[Any], state: TensorDictBase, earned: float) -> str:
    end = task.ends(int(state["info", "end_reason"][0]))
    ended = "" if end == 0 else f"   ended: {end.name.lower()}"
    return f"{task.terms.goals} {earned:g}" + ended.replace("_", " ")


def _compose(
    inside: Tensor,
    outside: Tensor,
    caption: str,
    acted: TensorDictBase | None = None,
    actions: Actions = MOVES,
) -> np.ndarray:
    """The drone's view, enlarged, left; the chase view right; words and bars below."""
    canvas = Image.new("RGB", (2 * PANEL_WIDTH, PANEL_HEIGHT + 40), _BACKGROUND)
    view = Image.fromarray(inside.cpu().numpy())
    height = min(PANEL_HEIGHT, PANEL_WIDTH * view.height // view.width)
    view = view.resize((PANEL_WIDTH, height), Image.Resampling.NEAREST)
    canvas.paste(view, (0, (PANEL_HEIGHT - height) // 2))
    canvas.paste(Image.fromarray(outside.cpu().numpy()), (PANEL_WIDTH, 0))
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(16)
    draw.text((12, 10), "what the policy's camera sees", _TEXT, font)
    draw.text((12, PANEL_HEIGHT + 10), caption, _TEXT, font)
    if acted is not None:
        _draw_bars(draw, font, acted, actions)
    return np.asarray(canvas)


Font = ImageFont.FreeTypeFont | ImageFont.ImageFont


def _draw_bars(
    draw: ImageDraw.ImageDraw, font: Font, acted: TensorDictBase, actions: Actions
) -> None:
    """One bar an action, as long as it is wished for; the chosen one in red (as in Fig. 13)."""
    chosen, names = int(acted["action"][0]), actions.names
    logits = acted.get("logits", None)
    wish = torch.eye(len(names))[chosen] if logits is None else actions.wish(logits[0])
    room = 960 // len(names)
    for i, action in enumerate(actions.order):
        x, y = 300 + room * i, PANEL_HEIGHT + 10
        share = float(wish[action])
        draw.text((x, y), f"{names[action]} {share:.2f}", _TEXT, font)
        color = _CHOSEN if action == chosen else _BAR
        most = room - 140
        draw.rectangle((x + 120, y + 2, x + 120 + max(1, int(most * share)), y + 18), color)
