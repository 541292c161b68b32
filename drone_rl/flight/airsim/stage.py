"""The scene of the server: objects by name, what they do when touched, and what cameras show."""

import copy
import dataclasses
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco as _mujoco
import numpy as np
import torch
from PIL import Image
from torch import Tensor

from drone_rl.config import CameraSettings
from drone_rl.flight.airsim.cameras import CameraState
from drone_rl.flight.airsim.collisions import nearest
from drone_rl.flight.airsim.messages import NO_POSE, Pose, known, ned, to_world
from drone_rl.flight.airsim.patterns import matching
from drone_rl.flight.airsim.scenes import make_task
from drone_rl.flight.airsim.settings_file import Capture
from drone_rl.flight.image_types import ImageType, encode, pixels, segmentation_ids
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.entities import KINDS
from drone_rl.sim.rendering import Appearance, Distractors
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.rendering.view import Modality
from drone_rl.sim.scenes.compiling import UNNAMED, pose_in_file
from drone_rl.sim.tasks import ObjectTask
from drone_rl.sim.tasks.common import HIDDEN_DEPTH
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco  # its stubs lack what is used here

SKY = "SkySphere"
SPARE = 12
"""Objects that can be spawned: boxes, balls and cylinders in turn."""

_PLAIN = Appearance()
_MOST_SHOWN = 100
"""Appearances that are kept."""


class Shot(NamedTuple):
    """A rendered image of one type."""

    values: Tensor
    """As the renderer returns them. Shape: (1, *)."""
    focal: float
    """Focal length, pixels."""
    capture: Capture


@dataclasses.dataclass(frozen=True)
class _Spawned:
    """An object that a client made."""

    number: int
    """Index of the spare object that it is."""
    place: tuple[float, float, float]
    size: float


class Stage:
    """One world: its task's objects and rules, spawned objects, weather, and a renderer.

    All positions are in our world: metres, x forward, y left, z up.
    """

    def __init__(self, scene: str, seed: int, *, renderer: str | None = None) -> None:
        """Make a scene; by default the ray tracer renders it."""
        self.task = make_task(scene)
        self.scene_name = scene
        self._is_file = bool(getattr(self.task, "scenes", ()))
        usual = Capture()
        camera = CameraSettings(width=usual.width, height=usual.height, horizontal_fov=usual.fov)
        self.worlds = Worlds(
            1, self.task, camera, renderer=renderer or "raytrace", distractors=SPARE
        )
        self._random = np.random.RandomState(np.random.PCG64(seed))
        self._names = [self._name_of(entity) for entity in self.task.make_props()]
        self._spawned: dict[str, _Spawned] = {}
        self._weather = _PLAIN
        self._fog, self._has_weather = 0.0, False
        self._shown: tuple[
            Appearance, tuple[_Spawned, ...], dict[Any, tuple[CameraState, Appearance | None]]
        ] = (_PLAIN, (), {})
        """Weather, spawned objects, and the appearances that were made for them, by camera."""
        self._ids = self._first_ids = segmentation_ids(self.worlds.scene)
        """Segmentation ids of all geoms and the sky, and those without the clients' own."""
        self._own_ids: dict[str, int] = {}
        self._of_file = self._read_file()
        """Poses in NED of the geoms and named bodies of a file, relative to its model."""
        self.reset()

    @staticmethod
    def _name_of(entity: Any) -> str:
        return entity.mjcf_model.model

    def reset(self) -> None:
        """Put all objects where an episode begins; cubes get new places."""
        self.worlds.reset(torch.arange(1), [self._random])

    @property
    def start_height(self) -> float:
        """Height at which a vehicle without dynamics starts, metres."""
        return float(self.task.origin[2])

    def touch(
        self, position: Tensor, before: Tensor | None = None
    ) -> list[tuple[str, Tensor, Tensor]]:
        """Apply the task's rules to a vehicle: the chapter's cubes vanish when touched.

        Args:
            position: Of the vehicle. Shape: (3,).
            before: Where it comes from, if it touches what is on the straight path. Shape: (3,).

        Returns:
            Names of what it touches, with its position there, and the point nearest to that.
        """
        start = None if before is None else before[None]
        contacts = None
        if isinstance(self.task, ObjectTask):
            state: Any = self.worlds.state
            contacts = self.task.touch(state, position[None], start)
        if contacts is None:
            return []
        touches, ways = [], contacts[0].tolist()
        for index in sorted(range(len(ways)), key=ways.__getitem__):
            if ways[index] < math.inf:
                there = position if before is None else torch.lerp(before, position, ways[index])
                name, center = self._names[index], self._placed[0, index]
                half = center.new_tensor(self.worlds.scene.model.geom_size[self._geoms(name)[0]])
                touches.append((name, there, nearest(there, center, half)))
        return touches

    @property
    def _placed(self) -> Tensor:
        """Where the scene's objects stand, or stood before they vanished. Shape: (1, *, 3)."""
        state: Any = self.worlds.state
        return state.places if isinstance(self.task, ObjectTask) else state.sampled

    # Objects

    @property
    def names(self) -> list[str]:
        """Names of all objects: the ground, the scene's, spawned ones, and the sky."""
        return ["Ground", *self._names, *self._of_file, *self._spawned, SKY]

    @property
    def touchable(self) -> list[str]:
        """Names of what the task's obstacles are, in their order."""
        solids = getattr(self.task, "solids", ()) if self._is_file else ()
        return [solids.name(i) for i in range(len(solids))] if solids else self.names[1:]

    def _read_file(self) -> dict[str, Pose]:
        """Return the poses of a file's geoms and bodies, by their names; geoms precede bodies."""
        if not self._is_file:
            return {}
        model = self.worlds.scene.model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        poses = {}
        for geom in self._geoms(self._names[0]):
            name = model.geom(geom).name.partition("/")[2]
            attitude = np.zeros(4)
            mujoco.mju_mat2Quat(attitude, data.geom_xmat[geom])
            if name:
                pose = pose_in_file(model, geom, data.geom_xpos[geom], attitude)
                poses[name] = Pose.of(*map(torch.tensor, pose))
        for body in range(model.nbody):
            whole, _, name = model.body(body).name.partition("/")
            if whole == self._names[0] and name and not name.startswith(UNNAMED):
                attitude = torch.tensor(data.xquat[body])
                poses.setdefault(name, Pose.of(torch.tensor(data.xpos[body]), attitude))
        return poses

    def find(self, pattern: str) -> list[str]:
        """Return the names that match a regular expression; see `matching`."""
        return matching(pattern, self.names)

    def object_pose(self, name: str) -> Pose:
        """Return the pose in NED, of the world; NaN if there is no such object, or it vanished."""
        level = (1.0, 0.0, 0.0, 0.0)
        if name in ("Ground", SKY):
            return Pose((0.0, 0.0, 0.0), level)
        if name in self._of_file:
            pose, by = self._of_file[name], ned(self.task.places(self.worlds.state)[0, 0])
            whole = [a + b for a, b in zip(pose.position, by, strict=True)]
            return Pose(whole, pose.attitude)
        if name in self._spawned:
            return Pose(to_world(self._spawned[name].place), level)
        if name in self._names:
            place = self.task.places(self.worlds.state)[0, self._names.index(name)]
            if float(place[2]) >= -HIDDEN_DEPTH / 2:
                return Pose(ned(place), level)
        return NO_POSE

    def move_object(self, name: str, place: Sequence[float]) -> bool:
        """Move an object, NaN coordinates excepted; return whether that is possible."""
        now = to_world(self.object_pose(name).position)
        if any(map(math.isnan, now)) or name in ("Ground", SKY, *self._of_file):
            return False
        x, y, z = known(place, now)
        if name in self._spawned:
            self._spawned[name] = dataclasses.replace(self._spawned[name], place=(x, y, z))
        else:
            self._placed[0, self._names.index(name)] = self._placed.new_tensor((x, y, z))
        return True

    def spawn(self, name: str, asset: str, place: Sequence[float], size: float) -> str:
        """Make a box, ball or cylinder, which cameras show and vehicles pass through.

        Returns:
            Its name, with a number if the given one is taken.

        Raises:
            InputError: There is no such shape, or no spare object of it.
        """
        kinds = {"cube": 0, "box": 0, "sphere": 1, "ball": 1, "cylinder": 2}
        kind = kinds.get(asset.lower().removeprefix("1m_").removesuffix("_chamfer"))
        if kind is None:
            raise InputError(f"asset {asset!r} is unknown; give cube, sphere or cylinder")
        taken = {one.number for one in self._spawned.values()}
        free = [i for i in range(kind, SPARE, len(KINDS)) if i not in taken]
        if not free:
            raise InputError(
                f"no {asset} is left of {SPARE // len(KINDS)}; call simDestroyObject first"
            )
        chosen, count = name, 1
        while chosen in self.names:
            chosen, count = f"{name}_{count}", count + 1
        x, y, z = place
        self._spawned[chosen] = _Spawned(free[0], (x, y, z), size)
        return chosen

    def scale(self, name: str) -> float | None:
        """Return the size of an object; None if there is none of that name."""
        if name in self._spawned:
            return self._spawned[name].size
        return 1.0 if name in self.names else None

    def set_scale(self, name: str, size: float) -> bool:
        """Set the size of a spawned object; return whether there is one."""
        if name not in self._spawned:
            return False
        self._spawned[name] = dataclasses.replace(self._spawned[name], size=size)
        return True

    def radius(self, name: str) -> float:
        """Return the radius of a ball around an object, metres."""
        bounds = self.worlds.scene.model.geom_rbound
        largest = max((float(bounds[geom]) for geom in self._geoms(name)), default=0.0)
        return largest * (self.scale(name) or 1.0)

    def destroy(self, name: str) -> bool:
        """Remove a spawned object; return whether there was one."""
        if self._spawned.pop(name, None) is None:
            return False
        self._own_ids.pop(name, None)
        self._ids = self._segmentation()
        return True

    # Weather and light

    def set_fog(self, density: float) -> None:
        """Set the density of fog, from 0 for none to 1 for a visibility of 20 m.

        It is shown while the weather is enabled.
        """
        self._fog = density
        self.enable_weather(self._has_weather)

    def enable_weather(self, enable: bool) -> None:
        """Show the fog that is set, or none; at the start none is shown."""
        self._has_weather = enable
        is_shown = enable and self._fog > 0.0
        self._change_weather(fog_visibility=20.0 / self._fog if is_shown else None)

    def set_sun(self, elevation: float, azimuth: float = 127.9) -> None:
        """Set the sun's elevation, and its direction to the left of the world's x axis, degrees."""
        up, aside = math.radians(max(elevation, 1.0)), math.radians(azimuth)
        level = math.cos(up)
        towards = (-level * math.cos(aside), -level * math.sin(aside), -math.sin(up))
        light = max(0.0, min(1.0, elevation / 10.0))
        self._change_weather(sun_direction=towards, sun=(0.75 * light,) * 3)

    def clear_sun(self) -> None:
        """Return to the scene's own light."""
        self._change_weather(sun_direction=None, sun=None)

    def _change_weather(self, **changes: Any) -> None:
        changed = dataclasses.replace(self._weather, **changes)
        self._weather = _PLAIN if changed == _PLAIN else changed

    # Segmentation

    def set_id(self, name: str, number: int, *, is_pattern: bool) -> bool:
        """Set the segmentation id of all objects that match; return whether any does.

        A negative id counts as 0.
        """
        matches = self.find(name) if is_pattern else [n for n in self.names if n == name]
        kept = {one: id_ for one, id_ in self._own_ids.items() if one not in matches}
        self._own_ids = kept | dict.fromkeys(matches, number)  # the last one wins
        self._ids = self._segmentation()
        return bool(matches)

    def get_id(self, name: str) -> int:
        """Return the segmentation id of an object; -1 if there is none of that name."""
        geoms = self._geoms(name)
        return int(self._ids[geoms[0]]) if geoms else -1

    def clear_ids(self) -> None:
        """Give every object the id 0."""
        self._own_ids = {}
        self._ids = self._first_ids = torch.zeros_like(self._ids)

    def _segmentation(self) -> Tensor:
        ids = self._first_ids.clone()
        for name, number in self._own_ids.items():
            ids[self._geoms(name)] = max(number, 0)
        return ids

    def _geoms(self, name: str) -> list[int]:
        scene = self.worlds.scene
        if name == "Ground":
            return scene.geoms(SemanticClass.GROUND)
        if name == SKY:
            return [-1]
        if name in self._names:
            index = self._names.index(name)
        elif name in self._spawned:
            index = len(self._names) + self._spawned[name].number
        elif name in self._of_file:
            model, whole = scene.model, f"{self._names[0]}/{name}"
            geoms = range(model.ngeom)
            named = [i for i in geoms if model.geom(i).name == whole]
            return named or [i for i in geoms if whole in _bodies_around(model, i)]
        else:
            return []
        return [i for i, of in enumerate(scene.props) if of == index]

    # Cameras

    def render(
        self, body: BodyState, camera: CameraState, kinds: Sequence[ImageType]
    ) -> list[Shot]:
        """Render images of one camera, of several types.

        Raises an `InputError` if the renderer does not support a type.
        """
        shots: dict[ImageType, Shot] = {}
        groups: dict[Capture, list[ImageType]] = {}
        for kind in dict.fromkeys(kinds):
            groups.setdefault(camera.capture(kind), []).append(kind)
        for capture, some in groups.items():
            wanted: list[Modality] = list(dict.fromkeys(kind.modality for kind in some))
            view = self.worlds.view(camera.name, wanted, capture.height, capture.width)
            world = copy.copy(self.worlds.state)
            world.body = body
            appearance = self._appearance(camera, capture)
            rendered = self.worlds.render_all(world, view, appearance)
            focal = capture.width / 2 / math.tan(math.radians(capture.fov) / 2)
            for kind in some:
                values = rendered[kind.modality][:, 0]
                shots[kind] = Shot(values, focal, capture)
        return [shots[kind] for kind in kinds]

    def _appearance(self, camera: CameraState, capture: Capture) -> Appearance | None:
        """Return the appearance in a camera, the same object as long as nothing changes.

        Renderers reuse what they have prepared for an object; None is the scene's own appearance.
        """
        spawned = tuple(self._spawned.values())
        weather, earlier, appearances = self._shown
        if weather is not self._weather or earlier != spawned or len(appearances) > _MOST_SHOWN:
            appearances = {}
            self._shown = (self._weather, spawned, appearances)
        key = (id(camera), capture)
        if key not in appearances:
            mounting = camera.mounting(capture, self.worlds.camera.vertical_fov)
            look = dataclasses.replace(self._weather, camera=mounting, distractors=self._spares())
            is_own = self._weather is _PLAIN and mounting is None and not spawned
            # keeping the camera keeps its id unique
            appearances[key] = camera, None if is_own else look
        return appearances[key][1]

    @property
    def appearance(self) -> Appearance:
        """Weather, light and spawned objects, in no camera of a vehicle."""
        return dataclasses.replace(self._weather, distractors=self._spares())

    def image(self, kind: ImageType, shot: Shot, *, as_float: bool) -> Tensor:
        """Return the pixels of a rendered image: (H, W) float32, or (H, W, 3) uint8."""
        return pixels(kind, shot.values, as_float=as_float, focal=shot.focal, ids=self._ids)[0]

    def box(self, shot: Shot, name: str) -> tuple[int, int, int, int] | None:
        """Return left, top, right and bottom of an object in a segmentation image, in pixels."""
        geoms = torch.tensor(self._geoms(name), dtype=torch.int64)
        rows, columns = torch.isin(shot.values[0].long(), geoms).nonzero(as_tuple=True)
        if not len(rows):
            return None
        return int(columns.min()), int(rows.min()), int(columns.max()), int(rows.max())

    def _spares(self) -> Distractors | None:
        if not self._spawned:
            return None
        places = torch.tensor([0.0, 0.0, -HIDDEN_DEPTH], dtype=torch.float64).repeat(SPARE, 1)
        sizes, colors = torch.ones(SPARE), torch.full((SPARE, 3), 0.6)
        for one in self._spawned.values():
            places[one.number] = torch.tensor(one.place, dtype=torch.float64)
            sizes[one.number] = one.size
        return Distractors(places=places, sizes=sizes.double(), colors=colors.double())

    def close(self) -> None:
        """Close the renderer."""
        self.worlds.close()


def _bodies_around(model: Any, geom: int) -> list[str]:
    """Return the names of the bodies that a geom belongs to."""
    body, names = int(model.geom_bodyid[geom]), []
    while body:
        names.append(model.body(body).name)
        body = int(model.body_parentid[body])
    return names


def png(image: Tensor) -> bytes:
    """Return red, green, blue (H, W, 3), uint8, as PNG with an opaque fourth channel."""
    return encode(Image.fromarray(image.numpy()).convert("RGBA"), "png", compress_level=1)
