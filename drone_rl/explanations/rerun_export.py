"""`drone-rl play format=rerun`: episodes as Rerun recordings, with heat maps.

A recording has one timeline of steps, and one of simulated seconds. At step t it holds what the
environment shows before action t, the action and its probabilities, and the reward of action t - 1.
"""

import contextlib
import logging
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.config import RendererName
from drone_rl.envs import base_env
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.explanations.attribution import first_heat, shown_methods
from drone_rl.explanations.heat_maps import Explainer
from drone_rl.explanations.hooks import of_input
from drone_rl.explanations.scenes import Scenes
from drone_rl.policies import ImageNetwork
from drone_rl.policies.policy import BasePolicy
from drone_rl.sim.composer_task import seconds_per_step
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.appearance import product
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.trust.plots.images import heated, shown_picture
from drone_rl.trust.video import CAMERAS, probabilities, render_step, run_episode
from drone_rl.utils import palette
from drone_rl.utils.errors import InputError, extra

_log = logging.getLogger(__name__)
APPLICATION = "drone-rl"
"""Recordings of one application share the layout of the viewer."""
JPEG_QUALITY = 90
"""Of images that the policy does not observe; PNGs of textured scenes would be slow and large."""
CLASS_COLORS: Mapping[SemanticClass, palette.Rgb] = {
    SemanticClass.SKY: palette.SKY,
    SemanticClass.GROUND: palette.GROUND,
    SemanticClass.TARGET: palette.NEXT_CUBE,
    SemanticClass.OBSTACLE: palette.DOWN,
    SemanticClass.DRONE: palette.FAINT,
    SemanticClass.DISTRACTOR: palette.MUTED,
}
"""Colors of the segmentation image and of the boxes."""
_CAMERA = "world/drone/camera"
"""Path of the policy's camera, whose pose is relative to the drone's."""


def record(
    policy: BasePolicy,
    folder: Path,
    episodes: int,
    *,
    greedy: bool = True,
    seed: int = 0,
    device: str = "cpu",
    renderer: RendererName = "raytrace",
) -> list[Path]:
    """Record episodes in held-out environments as Rerun files, and return the files.

    The episodes are those of `drone_rl.trust.video.film`. Heat maps are those that a report
    shows by default, see `drone_rl.explanations.attribution`; policies without gradients have none.

    Args:
        policy: The policy.
        folder: Folder of the files `episode_0.rrd`, `episode_1.rrd`, ...
        episodes: Number of episodes, one file each.
        greedy: Whether the policy takes the most probable action, or samples it.
        seed: Root of the environments' random streams.
        device: Device of the environments and the policy.
        renderer: Renderer of the environments.

    Raises:
        InputError: The extra `rerun` is missing, or a file can't be written.
    """
    rerun = extra("rerun", "rerun", "format=rerun")
    files = [folder / f"episode_{number}.rrd" for number in range(episodes)]
    with policy.flying(1, seed=seed, device=device, renderer=renderer) as (env, actor):
        network = policy.make_network(device)
        for number, path in enumerate(files):
            with _open(rerun, path, f"{policy.name}, seed {seed}, episode {number}") as stream:
                record_episode(env, actor, network, EpisodeLog(rerun, stream, env), greedy=greedy)
            _log.info("written: %s", path)
    return files


def record_episode(
    env: EnvBase,
    actor: TensorDictModuleBase,
    network: ImageNetwork,
    log: "EpisodeLog",
    *,
    greedy: bool = True,
) -> None:
    """Run one episode in a single environment and log it."""
    for context, act, reward in run_episode(env, actor, greedy=greedy):
        log.state(context, reward)
        if act is not None:
            log.action(act)
    log.observations(network)


@contextlib.contextmanager
def _open(rerun: Any, path: Path, name: str) -> Iterator[Any]:
    """Yield a stream to a new file; close the file afterwards."""
    stream = rerun.RecordingStream(APPLICATION)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"")  # Rerun's own error says neither which file nor why
        stream.save(path)
    except OSError as error:
        raise InputError(
            f"recording {path} can't be written ({error}); choose another folder"
        ) from error
    try:
        stream.set_log_time_enabled(False)
        stream.send_recording_name(name)
        yield stream
    finally:
        stream.disconnect()


def _layout(rerun: Any, timestep: float) -> Any:
    """Return the arrangement of a recording's parts in the viewer, which plays in real time."""
    views = rerun.blueprint
    cameras = [f"cameras/{name}" for name in ("chase", *CAMERAS)]
    observed = [_CAMERA, "segmentation", "observation", "heat_map"]
    scene, *images = (views.Spatial2DView(origin=path) for path in (*cameras, *observed))
    return views.Blueprint(
        views.Horizontal(
            views.Vertical(views.Spatial3DView(origin="world"), scene),
            views.Vertical(
                views.Grid(*images),
                views.TimeSeriesView(origin="action/probabilities"),
                views.TimeSeriesView(origin="reward"),
                views.TextLogView(contents=["action/taken", "heat_map/method", "end"]),
                row_shares=[3, 1, 1, 1],
            ),
        ),
        views.TimePanel(timeline="step", fps=1 / timestep, state="collapsed"),
        collapse_panels=True,
    )


class EpisodeLog:
    """Logs one episode of a single environment to a stream of Rerun."""

    def __init__(self, rerun: Any, stream: Any, env: EnvBase) -> None:
        """Log what does not change: classes, axes, the drone's size, names of the actions."""
        self._rr, self._log = rerun, stream.log
        self._set_time = stream.set_time
        self._base = base_env(env)
        self._worlds, self._scenes = self._base.worlds, Scenes(env)
        self._actions = self._worlds.dynamics.actions
        self._timestep = seconds_per_step(self._worlds.dynamics)
        self._path: list[list[float]] = []
        """The drone's positions."""
        self._observed: list[Tensor] = []
        self._parts: list[int] = []
        """The parts of the actions taken."""
        self._rest: list[Tensor] = []
        """What else the policy read, see `hooks`."""
        self._return = 0.0
        stream.send_blueprint(_layout(rerun, self._timestep))
        half = self._worlds.task.drone_size / 2
        lines = rerun.SeriesLines(names=self._actions.names, colors=self._actions.colors)
        classes = [(kind.value, kind.name.lower(), color) for kind, color in CLASS_COLORS.items()]
        self._log("/", rerun.AnnotationContext(classes), static=True)
        self._log("world", rerun.ViewCoordinates.FLU, static=True)
        drone = self._box(SemanticClass.DRONE, half_sizes=[[half] * 3])
        self._log("world/drone", drone, static=True)
        self._log("action/probabilities", lines, static=True)

    def state(self, context: StepContext, reward: float) -> None:
        """Log the environment as it is now, and the reward of the action before, if any."""
        self._return += reward
        self._set_step(len(self._path))
        self._log_images()
        self._log_poses()
        self._observed.append(context.observe(self._scenes.name)[0].cpu())
        if len(self._path) > 1:
            self._log("reward/step", self._rr.Scalars(reward))
        self._log("reward/return", self._rr.Scalars(self._return))
        end = self._worlds.task.ends(int(context.state.end_reason[0]))
        if end:
            self._log("end", self._rr.TextLog(f"end: {end.name.lower()}"))

    def action(self, act: Act) -> None:
        """Log the action that the policy takes now, and the probabilities of all."""
        part = int(self._actions.part(act.action[0]))
        self._parts.append(part)
        if (rest := self._scenes.rest_of(act.entries)) is not None:
            self._rest.append(rest)
        probs = probabilities(act, self._actions).cpu().numpy()
        self._log("action/probabilities", self._rr.Scalars(probs))
        self._log("action/taken", self._rr.TextLog(self._actions.names[part]))

    def observations(self, network: ImageNetwork) -> None:
        """Log all observations, and heat maps of the actions taken laid over them.

        Policies without images have none.
        """
        if self._scenes.image is None:
            return
        observed = torch.stack(self._observed)
        low, high, channels = float(observed.min()), float(observed.max()), self._scenes.channels
        images = [shown_picture(one.numpy(), low, high, channels) for one in observed]
        for step, image in enumerate(images):
            self._set_step(step)
            self._log("observation", self._rr.Image(image))
        if not network.is_differentiable:
            return
        # the methods that are shown for a policy with gradients do not read the baseline
        view = of_input(network, self._scenes.name)
        maps = Explainer(view, absent=observed[0]).methods()
        device = self._base.device
        rest = torch.cat(self._rest) if self._rest else None
        inputs = observed[:-1].to(device), torch.tensor(self._parts, device=device), rest
        heat, by = first_heat({name: maps[name](*inputs) for name in shown_methods(maps)})
        for step, (one, method) in enumerate(zip(heat.cpu().numpy(), by, strict=True)):
            self._set_step(step)
            self._log("heat_map", self._rr.Image(heated(images[step], one)))
            if method is not None:
                self._log("heat_map/method", self._rr.TextLog(f"heat map: {method}"))
        self._set_step(len(by))  # the last step, at which no action is taken
        self._log("heat_map", self._rr.Clear(recursive=False))

    def _set_step(self, step: int) -> None:
        self._set_time("step", sequence=step)
        self._set_time("seconds", duration=step * self._timestep)

    def _log_images(self) -> None:
        rr, images, worlds = self._rr, render_step(self._base), self._worlds
        look = self._base.appearances.current()
        geoms = worlds.render(worlds.state, worlds.view(modality="segmentation"), look)[0]
        kinds = torch.tensor([*worlds.scene.semantic_classes, SemanticClass.SKY])
        classes = kinds.to(torch.uint8)[geoms.long().cpu()].numpy()  # -1 (the sky) reads the last
        self._log(_CAMERA, rr.Image(images.camera.cpu().numpy()))
        self._log("segmentation", rr.SegmentationImage(classes))
        for name, image in zip(("chase", *CAMERAS), (images.chase, *images.strip), strict=True):
            encoded = rr.Image(image.cpu().numpy()).compress(jpeg_quality=JPEG_QUALITY)
            self._log(f"cameras/{name}", encoded)

    def _log_poses(self) -> None:
        worlds = self._worlds
        appearance = (self._base.appearances.current() or Appearance()).over(worlds.appearance)
        body, poses = worlds.state.body, worlds.poses(worlds.state, appearance)
        if not self._path:
            self._log_camera(appearance)
        self._path.append(body.position[0].tolist())
        self._log_pose("world/drone", body.position[0], body.attitude[0])
        self._log("world/trajectory", self._rr.LineStrips3D([self._path]))
        boxes = worlds.scene.prop_boxes()
        sizes = [1.0] * len(boxes)
        if appearance.distractors is not None:  # the last of the props
            scaled = appearance.distractors.expand(1).sizes[0].tolist()
            sizes[len(sizes) - len(scaled) :] = scaled
        for box, place, size in zip(boxes, poses.props[0].cpu().numpy(), sizes, strict=True):
            center, half = place + size * box.center, size * box.half_size
            drawn = self._rr.Clear(recursive=False)
            if center[2] + half[2] > 0.0:  # tasks hide props under the ground
                drawn = self._box(box.semantic_class, centers=[center], half_sizes=[half])
            self._log(["world", "objects", box.name], drawn)

    def _box(self, kind: SemanticClass, **shape: Any) -> Any:
        """Return a box in the color of its class."""
        return self._rr.Boxes3D(
            class_ids=[kind.value], fill_mode="solid", show_labels=False, **shape
        )

    def _log_camera(self, appearance: Appearance) -> None:
        """Log pose and projection of the policy's camera, which are those of the whole episode."""
        view, model = self._worlds.policy_view, self._worlds.scene.model
        number, mounting = self._worlds.scene.camera(view.cameras[0]), appearance.camera
        place, turn = (torch.tensor(values[number]) for values in (model.cam_pos, model.cam_quat))
        zoom = 1.0
        if mounting is not None and mounting.camera == view.cameras[0]:
            place = place + torch.as_tensor(mounting.offset).cpu().reshape(3)
            turn = product(torch.as_tensor(mounting.turn, dtype=turn.dtype).cpu().reshape(4), turn)
            zoom = 1.0 if mounting.zoom is None else float(mounting.zoom)
        self._log_pose(_CAMERA, place, turn)
        half_angle = math.radians(float(model.cam_fovy[number])) / 2
        lens = self._rr.Pinhole(
            focal_length=zoom * view.height / 2 / math.tan(half_angle),
            camera_xyz=self._rr.ViewCoordinates.RUB,
            width=view.width,
            height=view.height,
        )
        self._log(_CAMERA, lens)

    def _log_pose(self, path: str, position: Tensor, attitude: Tensor) -> None:
        w, *xyz = attitude.tolist()
        turn = self._rr.Quaternion(xyzw=[*xyz, w])
        self._log(path, self._rr.Transform3D(translation=position.tolist(), quaternion=turn))
