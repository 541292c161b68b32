"""The scene of the server: objects by name, what they do when touched, and what cameras show."""

import copy
import dataclasses
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from dm_control import mjcf
from PIL import Image
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.flight.airsim.messages import NO_POSE, Pose, ned, to_world
from drone_rl.flight.airsim.settings_file import Capture
from drone_rl.sim.dynamics import BodyState, Obstacles
from drone_rl.sim.entities import DRONE_CAMERAS, KINDS, Pillar, VisualEntity, find_camera
from drone_rl.sim.image_types import ImageType, palette, pixels, segmentation_ids
from drone_rl.sim.rendering import Appearance, Distractors, Mounting
from drone_rl.sim.rendering.appearance import product, turned, zoom_for_fov
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.tasks import CollectCubes, Task, as_task
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError, did_you_mean

SCENES = ("cubes", "blocks", "pillars", "empty")
SPARE = 12
"""Objects that can be spawned: boxes, balls and cylinders in turn."""
_BASES = {"back_center": turned("yaw", 180.0), "bottom_center": turned("pitch", 90.0)}
"""Attitudes of cameras that do not look ahead, drone frame."""
_LEVEL = (1.0, 0.0, 0.0, 0.0)
_DEFAULT = Capture()
_BLOCK = (4.0, 4.0)
"""Width and height of a block, metres."""


class _Fixed(Task[Any]):
    """A scene without rules: entities at fixed places."""

    name = "scene"

    def __init__(
        self, entities: Sequence[Any], places: Tensor, solid: Sequence[float] | None
    ) -> None:
        self._entities, self._places, self._solid = entities, places, solid

    def make_props(self) -> Sequence[Any]:
        """Return the entities."""
        return self._entities

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Return the places. Shape: (P, 3)."""
        return self._places.clone()

    def places(self, state: Any) -> Tensor:
        """Return the places. Shape: (N, P, 3)."""
        return state.sampled

    def obstacles(self, state: Any) -> Obstacles | None:
        """Return the boxes that can be touched."""
        if self._solid is None:
            return None
        x, y, z = self._solid
        return Obstacles(state.sampled, (x, y, z))

    def step(self, state: Any, body: BodyState) -> tuple[Any, Tensor]:
        """Apply no rule."""
        reward = torch.zeros(len(state), dtype=torch.float64)
        return dataclasses.replace(state, body=body), reward


class _File(VisualEntity):
    """A model from a file of MuJoCo's."""

    semantic_class = SemanticClass.OBSTACLE

    def _build(self, path: Path) -> None:
        try:
            self._mjcf_root = mjcf.from_path(str(path), escape_separators=True)
        except (OSError, SyntaxError, ValueError, KeyError, AttributeError, TypeError) as error:
            reason = str(error).strip().splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"scene={path} can't be read as a MuJoCo model ({reason}); give a valid MJCF file"
            ) from error
        if self._mjcf_root.model in ("", "unnamed_model"):
            self._mjcf_root.model = "scene"


def make_task(scene: str) -> Task[Any]:
    """Return the task that a name, or the path of an MJCF file, means.

    Raises:
        InputError: There is no such scene, or the file can't be read.
    """
    if scene == "cubes":
        return CollectCubes(TaskSettings())
    if scene == "pillars":
        return as_task("pillars")
    if scene == "empty":
        return _Fixed([], torch.zeros(0, 3, dtype=torch.float64), None)
    if scene == "blocks":
        return _blocks()
    path = Path(scene)
    if path.suffix == ".xml" and path.is_file():
        return _Fixed([_File(path)], torch.zeros(1, 3, dtype=torch.float64), None)
    raise InputError(
        f"scene={scene} is unknown; give {', '.join(SCENES)}, or the path of an MJCF file, *.xml"
        f"{did_you_mean(scene, SCENES)}"
    )


def _blocks() -> Task[Any]:
    """Blocks in a grid around the start, with streets between them."""
    width, height = _BLOCK
    grid = [(x, y) for x in range(-24, 49, 12) for y in range(-24, 25, 12) if (x, y) != (0, 0)]
    places = torch.tensor([(x, y, height / 2) for x, y in grid], dtype=torch.float64)
    shades = ((0.62, 0.6, 0.56), (0.55, 0.57, 0.62), (0.66, 0.58, 0.5))
    blocks = [
        Pillar(width, height, shades[i % len(shades)], name=f"block_{i}") for i in range(len(grid))
    ]
    return _Fixed(blocks, places, (width / 2, width / 2, height / 2))


@dataclasses.dataclass
class CameraState:
    """A camera of a vehicle: where it is, and its images by type."""

    captures: Mapping[ImageType, Capture]
    position: tuple[float, float, float]
    """Metres, drone frame: x forward, y left, z up."""
    attitude: Tensor
    """Drone frame, quaternion (w, x, y, z). Shape: (4,)."""
    fov: float | None = None
    """Horizontal, degrees, where it was set; of all types."""

    def capture(self, kind: ImageType) -> Capture:
        """Return size and field of view of a type."""
        found = self.captures.get(kind, _DEFAULT)
        return found if self.fov is None else dataclasses.replace(found, fov=self.fov)


@dataclasses.dataclass
class _Spawned:
    """An object that a client made, in one of the spare places."""

    place: list[float]
    size: float
    color: tuple[float, float, float] = (0.6, 0.6, 0.6)


class Stage:
    """One world: its task's objects and rules, spawned objects, weather, and a renderer.

    All positions are in our world: metres, x forward, y left, z up.
    """

    def __init__(self, scene: str, seed: int, *, renderer: str | None = None) -> None:
        """Make a scene; by default the ray tracer renders it, or MuJoCo Warp's a file's meshes."""
        self.task = make_task(scene)
        self.scene_name = scene
        chosen = renderer or ("mujoco_warp" if scene.endswith(".xml") else "raytrace")
        camera = CameraSettings(width=_DEFAULT.width, height=_DEFAULT.height, horizontal_fov=90.0)
        self.worlds = Worlds(1, self.task, camera, renderer=chosen, distractors=SPARE)
        self._random = np.random.RandomState(np.random.PCG64(seed))
        self._names = [self._name_of(entity) for entity in self.task.make_props()]
        self._spawned: dict[str, tuple[int, _Spawned]] = {}
        self._weather = Appearance()
        self._ids = segmentation_ids(self.worlds.scene)
        self._own_ids: dict[str, int] = {}
        self.reset()

    @staticmethod
    def _name_of(entity: Any) -> str:
        return entity.mjcf_model.model

    def reset(self) -> None:
        """Put all objects where an episode begins; cubes are placed anew."""
        self.worlds.reset(torch.arange(1), [self._random])

    @property
    def start_height(self) -> float:
        """Height at which a vehicle without dynamics starts, metres."""
        return float(self.task.origin[2])

    def touch(self, position: Tensor) -> None:
        """Apply the chapter's rule to a vehicle: cubes vanish when it touches them. (3,)."""
        state: Any = self.worlds.state
        task = self.task
        if not isinstance(task, CollectCubes):
            return
        near = (position - state.cubes[0]).abs().amax(-1) <= task.settings.touch_distance
        if bool((near & ~state.collected[0]).any()):
            state.collected[0] |= near & state.present[0]

    # Objects

    @property
    def names(self) -> list[str]:
        """Names of all objects: the ground, the scene's, and spawned ones."""
        return ["Ground", *self._names, *self._geoms_of_file(), *self._spawned]

    def _geoms_of_file(self) -> list[str]:
        if not self.scene_name.endswith(".xml"):
            return []
        model = self.worlds.scene.model
        geoms = (model.geom(i) for i, of in enumerate(self.worlds.scene.props) if of == 0)
        return [geom.name.partition("/")[2] for geom in geoms if geom.name]

    def find(self, pattern: str) -> list[str]:
        """Return the names that match a regular expression, ignoring case, as a whole."""
        try:
            compiled = re.compile(pattern, re.IGNORECASE)
        except re.error as error:
            raise InputError(f"name={pattern!r} is no regular expression ({error})") from error
        return [name for name in self.names if compiled.fullmatch(name)]

    def object_pose(self, name: str) -> Pose:
        """Return the pose in NED, of the world; NaN if there is no such object, or it vanished."""
        level = (1.0, 0.0, 0.0, 0.0)
        if name == "Ground":
            return Pose((0.0, 0.0, 0.0), level)
        if name in self._spawned:
            x, y, z = to_world(self._spawned[name][1].place)
            return Pose((x, y, z), level)
        if name in self._names:
            place = self.task.places(self.worlds.state)[:, self._names.index(name)]
            if float(place[0, 2]) < -HIDDEN_DEPTH / 2:
                return NO_POSE
            x, y, z = ned(place)
            return Pose((x, y, z), level)
        return NO_POSE

    def move_object(self, name: str, place: Sequence[float]) -> bool:
        """Move an object, NaN coordinates excepted; return whether that is possible."""
        if any(map(math.isnan, self.object_pose(name).position)) or name == "Ground":
            return False
        now = to_world(self.object_pose(name).position)
        there = [n if math.isnan(v) else v for v, n in zip(place, now, strict=True)]
        if name in self._spawned:
            self._spawned[name][1].place[:] = there
            return True
        state = self.worlds.state
        field = getattr(self.task, "props", "sampled")
        known = getattr(state, field)
        if known.shape[-2] != len(self._names):
            return False
        known[0, self._names.index(name)] = torch.tensor(there, dtype=known.dtype)
        return True

    def spawn(self, name: str, asset: str, place: Sequence[float], size: float) -> str:
        """Make a box, ball or cylinder, which cameras show and vehicles pass through.

        Returns:
            Its name, with a number if the given one is taken.

        Raises:
            InputError: There is no such shape, or no spare object of it.
        """
        kinds = {"cube": 0, "box": 0, "sphere": 1, "ball": 1, "cylinder": 2}
        kind = kinds.get(asset.lower().removeprefix("1m_"))
        if kind is None:
            raise InputError(f"asset {asset!r} is unknown; give cube, sphere or cylinder")
        taken = {number for number, _ in self._spawned.values()}
        free = [i for i in range(kind, SPARE, len(KINDS)) if i not in taken]
        if not free:
            raise InputError(
                f"no {asset} is left of {SPARE // len(KINDS)}; call simDestroyObject first"
            )
        chosen, count = name, 1
        while chosen in self.names:
            chosen, count = f"{name}_{count}", count + 1
        self._spawned[chosen] = (free[0], _Spawned([*place], size))
        return chosen

    def destroy(self, name: str) -> bool:
        """Remove a spawned object; return whether there was one."""
        return self._spawned.pop(name, None) is not None

    # Weather and light

    def set_fog(self, share: float) -> None:
        """Set the density of fog, 0 to 1: at 1 one sees 20 m far."""
        visibility = None if share <= 0.0 else 20.0 / share
        self._weather = dataclasses.replace(self._weather, fog_visibility=visibility)

    def set_sun(self, elevation: float, azimuth: float = 127.9) -> None:
        """Set the sun's height, and its direction to the left of straight ahead, degrees."""
        up, aside = math.radians(max(elevation, 1.0)), math.radians(azimuth)
        level = math.cos(up)
        towards = (-level * math.cos(aside), -level * math.sin(aside), -math.sin(up))
        light = max(0.0, min(1.0, elevation / 10.0))
        self._weather = dataclasses.replace(
            self._weather, sun_direction=towards, sun=(0.75 * light,) * 3
        )

    def clear_weather(self) -> None:
        """Return to the scene's own light and air."""
        self._weather = Appearance()

    # Segmentation

    def set_id(self, name: str, number: int, *, is_pattern: bool) -> bool:
        """Set the segmentation id of an object, or of all that match; return whether any does."""
        found = self.find(name) if is_pattern else [n for n in self.names if n == name]
        for one in found:
            self._own_ids[one] = number
        self._ids = self._segmentation()
        return bool(found)

    def get_id(self, name: str) -> int:
        """Return the segmentation id of an object; -1 if there is none of that name."""
        geoms = self._geoms(name)
        return int(self._ids[geoms[0]]) if geoms else -1

    def clear_ids(self) -> None:
        """Give every object the id 0."""
        self._own_ids = dict.fromkeys(self.names, 0)
        self._ids = torch.zeros_like(self._ids)

    def _segmentation(self) -> Tensor:
        ids = segmentation_ids(self.worlds.scene)
        if all(number == 0 for number in self._own_ids.values()) and self._own_ids:
            ids = torch.zeros_like(ids)
        for name, number in self._own_ids.items():
            ids[self._geoms(name)] = max(number, 0)
        return ids

    def _geoms(self, name: str) -> list[int]:
        scene = self.worlds.scene
        if name == "Ground":
            return scene.geoms(SemanticClass.GROUND)
        if name in self._names:
            index = self._names.index(name)
        elif name in self._spawned:
            index = len(self._names) + self._spawned[name][0]
        else:
            names = [scene.model.geom(i).name.partition("/")[2] for i in range(scene.model.ngeom)]
            return [i for i, of in enumerate(names) if of and of == name]
        return [i for i, of in enumerate(scene.props) if of == index]

    # Cameras

    def make_cameras(
        self, captures: Mapping[ImageType, Capture], chosen: Mapping[str, Any]
    ) -> dict[str, CameraState]:
        """Return the cameras of a vehicle, by our names."""
        cameras = {}
        for spec in DRONE_CAMERAS:
            own = chosen.get(spec.name)
            base = _BASES.get(spec.name, torch.tensor(_LEVEL, dtype=torch.float64))
            state = CameraState(dict(captures), spec.pos, base)
            if own is not None:
                state.captures = {**captures, **own.captures}
                offset = own.offset
                place = to_world((offset.x, offset.y, offset.z))
                x, y, z = (
                    old if math.isnan(new) else new
                    for old, new in zip(spec.pos, place, strict=True)
                )
                state.position = (x, y, z)
                angles = (offset.yaw, offset.pitch, offset.roll)
                if not all(map(math.isnan, angles)):
                    state.attitude = _attitude(*(0.0 if math.isnan(a) else a for a in angles))
            cameras[spec.name] = state
        return cameras

    def render(
        self, body: BodyState, camera: str, state: CameraState, kinds: Sequence[ImageType]
    ) -> list[dict[str, Any]]:
        """Render images of one camera; each as "pixels" (1, *), and "capture".

        Raises an `InputError` if the renderer does not support a type.
        """
        found: dict[ImageType, dict[str, Any]] = {}
        groups: dict[Capture, list[ImageType]] = {}
        for kind in dict.fromkeys(kinds):
            groups.setdefault(state.capture(kind), []).append(kind)
        for capture, some in groups.items():
            wanted: list[Modality] = list(dict.fromkeys(kind.modality for kind in some))
            view = self.worlds.view(camera, wanted, capture.height, capture.width)
            world = copy.copy(self.worlds.state)
            world.body = body
            appearance = self._appearance(camera, state, capture)
            rendered = self.worlds.render_all(world, view, appearance)
            focal = capture.width / 2 / math.tan(math.radians(capture.fov) / 2)
            for kind in some:
                values = rendered[kind.modality][:, 0]
                found[kind] = {"values": values, "focal": focal, "capture": capture}
        return [found[kind] for kind in kinds]

    def image(self, kind: ImageType, found: Mapping[str, Any], *, as_float: bool) -> Tensor:
        """Return the pixels of a rendered image: (H, W) float32, or (H, W, 3) uint8."""
        given = {"focal": found["focal"], "ids": self._ids}
        return pixels(kind, found["values"], as_float=as_float, **given)[0]

    def _appearance(self, camera: str, state: CameraState, capture: Capture) -> Appearance:
        spec = find_camera(camera)
        own = math.degrees(
            2 * math.atan(math.tan(math.radians(self._fovy) / 2) * capture.width / capture.height)
        )
        base = _BASES.get(spec.name, torch.tensor(_LEVEL, dtype=torch.float64))
        inverse = base * base.new_tensor([1.0, -1.0, -1.0, -1.0])
        zoom = zoom_for_fov(own, torch.tensor(capture.fov, dtype=torch.float64))
        offset = tuple(a - b for a, b in zip(state.position, spec.pos, strict=True))
        turn = product(state.attitude, inverse)
        is_own = not any(offset) and torch.allclose(turn.abs(), turn.new_tensor(_LEVEL))
        mounting = Mounting(
            camera=f"drone/{camera}",
            offset=offset,
            turn=tuple(turn.tolist()),
            zoom=None if abs(float(zoom) - 1) < 1e-9 else zoom,
        )
        same = is_own and mounting.zoom is None
        return dataclasses.replace(
            self._weather, camera=None if same else mounting, distractors=self._spares()
        )

    @property
    def _fovy(self) -> float:
        return self.worlds.camera.vertical_fov

    def _spares(self) -> Distractors | None:
        if not self._spawned:
            return None
        places = torch.tensor([0.0, 0.0, -HIDDEN_DEPTH], dtype=torch.float64).repeat(SPARE, 1)
        sizes, colors = torch.ones(SPARE), torch.full((SPARE, 3), 0.6)
        for number, thing in self._spawned.values():
            places[number] = torch.tensor(thing.place, dtype=torch.float64)
            sizes[number] = thing.size
            colors[number] = torch.tensor(thing.color)
        return Distractors(places=places, sizes=sizes.double(), colors=colors.double())

    def close(self) -> None:
        """Close the renderer."""
        self.worlds.close()


def png(image: Tensor) -> bytes:
    """Return red, green, blue (H, W, 3), uint8, as PNG with an opaque fourth channel."""
    buffer = io.BytesIO()
    Image.fromarray(image.numpy()).convert("RGBA").save(buffer, "png", compress_level=1)
    return buffer.getvalue()


def id_color(number: int) -> list[int]:
    """Return the colour of a segmentation id: red, green, blue."""
    return palette()[number].tolist()


def _attitude(yaw: float, pitch: float, roll: float) -> Tensor:
    """Return the attitude of AirSim's angles, degrees, in the drone's frame. Shape: (4,)."""
    parts = (turned("yaw", -yaw), turned("pitch", -pitch), turned("roll", roll))
    return product(product(parts[0], parts[1]), parts[2])
