"""`drone-rl play`: videos of the drone, its cameras and its action probabilities."""

import contextlib
import dataclasses
import logging
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import imageio.v3 as iio
import numpy as np
import torch
from PIL import Image, ImageDraw, ImageFont
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.config.inputs import ImageInput
from drone_rl.envs import DroneEnv, Observer, base_env
from drone_rl.envs.observer import ImageSource, frames_of
from drone_rl.envs.rollout import Act, ActorAgent, Agent, StepContext, as_agent, steps
from drone_rl.policies.actor import Exploring
from drone_rl.policies.policy import Policy
from drone_rl.sim.actions import MOVES, Actions
from drone_rl.sim.composer_task import make_environment
from drone_rl.sim.coordinates import inverse
from drone_rl.sim.dynamics import FlightState, Quadrotor
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.entities import (
    BACK_CENTER,
    BOTTOM_CENTER,
    CHASE,
    FRONT_CENTER,
    FRONT_LEFT,
    FRONT_RIGHT,
)
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import Mounting, product, rotate
from drone_rl.sim.tasks import State, Task
from drone_rl.sim.worlds import Worlds
from drone_rl.trust import instruments
from drone_rl.trust.plots.images import shown_picture
from drone_rl.utils.errors import InputError
from drone_rl.utils.palette import MUTED, PAPER
from drone_rl.utils.seeding import legacy_seed

_log = logging.getLogger(__name__)
WIDTH, HEIGHT = 1280, 720
CHASE_HEIGHT, STRIP_HEIGHT, GAP = 532, 144, 5
INSET_WIDTH = 320
"""Pixels of the image of the policy's camera, enlarged."""
FRAMES_PER_SECOND = 10
_CHASE_RADIUS = 0.1
"""Metres that the chase camera keeps away from solids."""
_STRIP = CHASE_HEIGHT + GAP
_BOTTOM = _STRIP + STRIP_HEIGHT + 9
CAMERAS = tuple(c.name for c in (FRONT_LEFT, FRONT_CENTER, FRONT_RIGHT, BACK_CENTER, BOTTOM_CENTER))
"""The drone's cameras, as a film shows them from left to right."""
Font = ImageFont.FreeTypeFont | ImageFont.ImageFont
_BACKGROUND, _TEXT, _CHOSEN, _BAR = (24, 26, 31), (235, 235, 240), PAPER, MUTED


def film(
    policy: Policy,
    folder: Path,
    episodes: int,
    *,
    greedy: bool = True,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
) -> list[Path]:
    """Film episodes in held-out environments as MP4 and GIF files, and return the files.

    The policy takes the most probable action, or samples it. For the other arguments see
    `Policy.make_env`.
    """
    files: list[Path] = []
    with policy.flying(1, seed=seed, device=device, renderer=renderer) as (env, actor):
        for episode in range(episodes):
            frames = list(film_episode(env, actor, greedy=greedy))
            written = write_video(frames, folder / f"episode_{episode}")
            _log.info("written: %s and %s", *written)
            files += written
    return files


def has_display() -> bool:
    """Return whether this process can open windows."""
    names = ("DISPLAY", "WAYLAND_DISPLAY")
    return sys.platform in ("darwin", "win32") or any(os.environ.get(name) for name in names)


def view(
    policy: Policy,
    *,
    greedy: bool = True,
    seed: int = 0,
    device: str = "cpu",
    renderer: str = "raytrace",
) -> None:
    """Open dm_control's viewer on the composer task, controlled by a policy; see `film`.

    The viewer shows the dm_control simulation; observations are rendered as in training.

    Raises:
        InputError: There is no display.
    """
    if not has_display():
        raise InputError("viewer=true needs a display, and there is none; leave it false to film")
    import dm_env
    from dm_control import viewer

    env = policy.make_env(1, seed=seed, device=device, renderer=renderer)
    base = base_env(env)
    agent = Exploring(ActorAgent(policy.make_actor(env, seed=seed)), greedy=greedy)
    worlds = base.worlds
    shown = make_environment(
        worlds.task,
        worlds.camera,
        dynamics=worlds.dynamics,
        pixels=False,
        random_state=legacy_seed(seed),
        appearance=base.appearances.settings,
    )
    observer = Observer(worlds, base.observer.inputs, appearance=lambda rows: shown.task.appearance)

    @torch.no_grad()
    def act(timestep: dm_env.TimeStep) -> np.ndarray:
        state, starts = shown.task.state.to(worlds.device), torch.tensor([timestep.first()])
        rows = torch.zeros(1, dtype=torch.int64, device=worlds.device)
        context = StepContext(observer, state, rows, starts.to(worlds.device))
        return agent.act(context).action[0].cpu().numpy()

    with contextlib.closing(env):
        viewer.launch(shown, act, title="drone-rl play")


class StepImages(NamedTuple):
    """Images of one step. Shapes: (height, width, 3); of the strip: (5, height, width, 3)."""

    camera: Tensor
    """The policy's camera, before transforms; of several images, one below the other."""
    chase: Tensor
    strip: Tensor
    """The cameras `CAMERAS`."""
    panel: Image.Image | None = None
    """Instruments, if the drone has flight dynamics."""


@torch.no_grad()
def film_episode(
    env: EnvBase, actor: TensorDictModuleBase | Agent, *, greedy: bool = True
) -> Iterator[np.ndarray]:
    """Run one episode in a single environment and yield its video frames.

    The policy takes the most probable action, or samples it; "logits" are shown as probabilities.

    Yields:
        RGB frames, uint8. Shape: (720, 1280, 3).
    """
    base, earned, step = base_env(env), 0.0, None
    agent = Exploring(as_agent(actor), greedy=greedy)
    for step in steps(agent, base.observer, base.start()):
        base.worlds.state = step.context.state
        caption = _caption(base.worlds.task, base.worlds.state, earned)
        yield _compose(render_step(base), caption, step.act, step.context.actions)
        earned += float(step.reward)
    assert step is not None
    base.worlds.state = step.after
    caption = _caption(base.worlds.task, step.after, earned)
    yield _compose(render_step(base), caption)


def write_video(frames: list[np.ndarray], path: Path) -> list[Path]:
    """Write RGB frames of one size as MP4 and, at half the size, as GIF; return the two files.

    The path is without suffix.

    Raises:
        InputError: A file can't be written.
    """
    files = [path.with_name(path.name + suffix) for suffix in (".mp4", ".gif")]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        iio.imwrite(files[0], np.stack(frames), fps=FRAMES_PER_SECOND, codec="libx264")
        half = [Image.fromarray(f).resize((f.shape[1] // 2, f.shape[0] // 2)) for f in frames]
        first, *rest = (
            image.quantize(128, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
            for image in half
        )
        duration = 1000 // FRAMES_PER_SECOND
        first.save(files[1], save_all=True, append_images=rest, duration=duration, loop=0)
    except OSError as error:
        raise InputError(
            f"video {path} can't be written ({error}); choose another folder"
        ) from error
    return files


def _caption(task: Task[Any], state: State, earned: float) -> str:
    end = task.ends(int(state.end_reason[0]))
    ended = "" if end == 0 else f"   ended: {end.name.lower()}"
    return f"return {earned:.3g}" + ended.replace("_", " ")


def render_step(base: DroneEnv) -> StepImages:
    """Render what a film shows of the first environment."""
    worlds, look = base.worlds, base.appearances.current()
    five = worlds.view(CAMERAS, height=STRIP_HEIGHT, width=(WIDTH + GAP) // len(CAMERAS) - GAP)
    chase = render_chase(worlds, look, CHASE_HEIGHT, WIDTH)[0]
    strip = worlds.render_all(worlds.state, five, look)["rgb"][0]
    body, dynamics, panel = worlds.state.body, worlds.dynamics, None
    if isinstance(body, FlightState) and isinstance(dynamics, Quadrotor):
        panel = instruments.panel(instruments.read(body), dynamics.settings.hover_throttle)
    seen = worlds.render(worlds.state, appearance=look)[0]
    if not base.observer.sees_pixels and base.observer.images:
        seen = _stacked(
            [_shown(image, worlds.state, look) for image in base.observer.images.values()]
        )
    return StepImages(seen, chase, strip, panel)


def _shown(image: ImageSource, state: State, look: Appearance | None) -> Tensor:
    """Return what an input's camera gives in the first environment. (H, W, 3), uint8."""
    reading, seen = image.read(state, torch.empty(0), look), image.seen
    if not isinstance(seen, ImageInput) or seen.modality == "rgb":
        return reading[0].cpu()
    channels = {"normals": "rgb", "segmentation": "classes"}.get(seen.modality, "gray")
    frame = frames_of(seen, reading)[0].cpu().numpy()
    return torch.from_numpy(shown_picture(frame, 0.0, 1.0, channels))


def _stacked(pictures: list[Tensor]) -> Tensor:
    """Join pictures, one below the other, black at the right of narrower ones."""
    width = max(picture.shape[1] for picture in pictures)
    pad = torch.nn.functional.pad
    return torch.cat([pad(one, (0, 0, 0, width - one.shape[1])) for one in pictures])


def _compose(
    seen: StepImages, caption: str, act: Act | None = None, actions: Actions = MOVES
) -> np.ndarray:
    """Chase view with the camera image as inset; below all five cameras, a caption and bars."""
    canvas = Image.new("RGB", (WIDTH, HEIGHT), _BACKGROUND)
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(16)
    canvas.paste(Image.fromarray(seen.chase.cpu().numpy()), (0, 0))
    inside = Image.fromarray(seen.camera.cpu().numpy())
    height = INSET_WIDTH * inside.height // inside.width
    size = (INSET_WIDTH, max(1, min(CHASE_HEIGHT // 2, height)))
    draw.rectangle((12, 12, 17 + size[0], 41 + size[1]), _BACKGROUND)
    draw.text((20, 16), "camera image", _TEXT, font)
    canvas.paste(inside.resize(size, Image.Resampling.NEAREST), (15, 39))
    if seen.panel is not None:
        canvas.paste(seen.panel, (WIDTH - 12 - instruments.WIDTH, 12))
    for i, (name, picture) in enumerate(zip(CAMERAS, seen.strip.cpu().numpy(), strict=True)):
        x = i * (WIDTH + GAP) // len(CAMERAS)
        canvas.paste(Image.fromarray(picture), (x, _STRIP))
        label = name.replace("_", " ")
        width = draw.textlength(label, font)
        draw.rectangle((x, _STRIP, x + width + 12, _STRIP + 23), _BACKGROUND)
        draw.text((x + 6, _STRIP + 2), label, _TEXT, font)
    draw.text((12, _BOTTOM), caption, _TEXT, font)
    if act is not None:
        _draw_bars(draw, font, act, actions)
    return np.asarray(canvas)


def probabilities(act: Act, actions: Actions) -> Tensor:
    """Return the probabilities of the parts in the first environment. Shape: (K,).

    Without a distribution, that of the chosen part is 1.
    """
    if act.distribution is None:
        return torch.eye(len(actions))[int(actions.part(act.action[0]))]
    return actions.probabilities(act.distribution[0])


def _draw_bars(draw: ImageDraw.ImageDraw, font: Font, act: Act, actions: Actions) -> None:
    """Draw a bar for each action; its length is the probability. The chosen action's is white.

    More than five are in two rows.
    """
    chosen, names = int(actions.part(act.action[0])), actions.names
    probs = probabilities(act, actions)
    rows = 1 if len(names) <= 5 else 2
    columns, tall = -(-len(names) // rows), 20 // rows + 5 * (rows - 1)
    room, font = 960 // columns, font if rows == 1 else ImageFont.load_default(12)
    for i, action in enumerate(actions.order):
        x, y = 300 + room * (i % columns), _BOTTOM + tall * (i // columns)
        share = float(probs[action])
        draw.text((x, y), f"{names[action]} {share:.2f}", _TEXT, font)
        color = _CHOSEN if action == chosen else _BAR
        most = room - 140
        draw.rectangle((x + 120, y + 2, x + 120 + max(1, int(most * share)), y + tall - 2), color)


def render_chase(worlds: Worlds, look: Appearance | None, height: int, width: int) -> Tensor:
    """Render the drones from behind, in an appearance that all environments share.

    With flight dynamics the chase camera follows the heading only, so that tilt is visible. What is
    solid in a scene file is behind the camera, which comes nearer; next to the drone it hides it.

    Returns:
        Colors. Shape: (num_envs, height, width, 3), uint8.
    """
    view = worlds.view(CHASE.name, height=height, width=width, show_drone=True)
    state = worlds.state
    attitude, around = state.body.attitude, worlds.task.obstacles(state)
    scene = None if around is None else around.scene
    if not isinstance(state.body, FlightState) and scene is None:
        return worlds.render(state, view, look)
    (camera,) = view.cameras
    place = attitude.new_tensor(worlds.scene.model.camera(camera).pos)
    near = place.expand(len(attitude), 3)
    if scene is not None:
        here, away = state.body.position, rotate(twist_about_z(attitude), place)
        sweep = scene.solids.sweep_at(here, here + away, _CHASE_RADIUS, scene.places)
        near = sweep.fraction.clamp(max=1.0)[:, None] * place
        is_apart = bool((near.norm(dim=1) > worlds.task.drone_size).all())
        view = dataclasses.replace(view, show_drone=is_apart)
    whole = (look or Appearance()).over(worlds.appearance)
    tilted = dataclasses.replace(worlds.poses(state, whole), attitude=attitude)
    held = dataclasses.replace(whole, camera=level(attitude, camera, place, near))
    return worlds.renderer.render(view, tilted, held)["rgb"][:, 0]


def level(attitude: Tensor, camera: str, place: Tensor, near: Tensor) -> Mounting:
    """Return the mounting that moves a camera and keeps it level on tilted bodies.

    Args:
        attitude: Quaternions (w, x, y, z). Shape: (num_envs, 4).
        camera: Its name in the model.
        place: Where the model has it, metres, in the drone's frame. Shape: (3,).
        near: Where it is instead, in the frame of the heading. Shape: (num_envs, 3).
    """
    back = product(inverse(attitude), twist_about_z(attitude))
    return Mounting(camera=camera, offset=rotate(back, near) - place, turn=back)
