# pyright: reportAttributeAccessIssue=false
# pyright: reportGeneralTypeIssues=false
# (MuJoCo's compiled bindings and Warp's structures are untyped.)
"""A scene as the ray tracer's kernel knows it: cameras, rays and geoms, each in its frame.

Frame 0 is the world's, frame 1 the drone's, and one follows for each of the task's props.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering.appearance import Beside, Mounting, product
from drone_rl.sim.rendering.raytrace import intersection_kernel, structs_kernel
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Meaning, Scene
from drone_rl.sim.rendering.view import View
from drone_rl.utils.errors import InputError

REACH: Mapping[int, Callable[[NDArray], NDArray]] = MappingProxyType(
    {
        intersection_kernel.PLANE: lambda size: size,
        intersection_kernel.SPHERE: lambda size: size[[0, 0, 0]],
        intersection_kernel.CAPSULE: lambda size: size[[0, 0, 1]] + [0.0, 0.0, size[0]],
        intersection_kernel.ELLIPSOID: lambda size: size,
        intersection_kernel.CYLINDER: lambda size: size[[0, 0, 1]],
        intersection_kernel.BOX: lambda size: size,
    }
)
"""Half extents of the box around each kind of geom, from its size as MuJoCo keeps it."""


def check_scene(scene: Scene) -> None:
    """Refuses what the kernel can't draw.

    Raises:
        InputError: There is a geom or a light of another kind.
    """
    model = scene.model
    for geom in range(model.ngeom):
        if model.geom_type[geom] not in REACH:
            kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            raise InputError(
                f"geom {model.geom(geom).name!r} is a {kind}, which Raytracer can't draw; give "
                "renderer=mujoco_warp"
            )
    if model.nflex:
        raise InputError(
            "the scene has soft bodies, which Raytracer can't draw; give renderer=mujoco_warp"
        )
    if not model.nlight:
        raise InputError("the scene has no light, so nothing could be seen; add one")
    is_distant = model.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    is_fixed = model.light_bodyid == 0
    if not (is_distant & is_fixed & (model.light_castshadow == 0)).all():
        raise InputError(
            "a light of the scene is near, moves or casts shadows, which Raytracer can't draw; "
            "give renderer=mujoco_warp"
        )
    if model.vis.headlight.active:
        raise InputError("the scene's headlight is on; switch it off or give renderer=mujoco_warp")


class Frames:
    """Which frame everything is fixed to, and its place and attitude there."""

    def __init__(self, scene: Scene) -> None:
        """Looks at the model's first pose, in which nothing that a frame carries has moved."""
        self._model = model = scene.model
        self._data = mujoco.MjData(model)
        mujoco.mj_forward(model, self._data)
        self._of_body = np.zeros(model.nbody, int)
        for geom, (meaning, prop) in enumerate(zip(scene.meanings, scene.props, strict=True)):
            root = model.body_rootid[model.geom_bodyid[geom]]
            if meaning is Meaning.DRONE:
                self._of_body[model.body_rootid == root] = structs_kernel.DRONE_FRAME
            elif prop >= 0:
                self._of_body[model.body_rootid == root] = structs_kernel.DRONE_FRAME + 1 + prop

    def place(
        self, body: int, position: NDArray, attitude: NDArray
    ) -> tuple[int, NDArray, NDArray]:
        """Where something that is fixed to a body is.

        Args:
            body: Its number.
            position: In the body's frame.
            attitude: The same, (w, x, y, z).

        Returns:
            The frame's number, and position and attitude there.
        """
        data, frame = self._data, int(self._of_body[body])
        root = self._model.body_rootid[body] if frame else 0
        back, turned, whole = np.empty(4), np.empty(3), np.empty(4)
        mujoco.mju_negQuat(back, data.xquat[root])
        mujoco.mju_mulQuat(whole, data.xquat[body], attitude)
        mujoco.mju_rotVecQuat(turned, position, data.xquat[body])
        there, relative = np.empty(3), np.empty(4)
        mujoco.mju_rotVecQuat(there, turned + data.xpos[body] - data.xpos[root], back)
        mujoco.mju_mulQuat(relative, back, whole)
        return frame, there, relative


def make_view(scene: Scene, frames: Frames, view: View, device: str) -> structs_kernel.View:
    """A view, but for what it shows.

    Raises:
        InputError: A camera is not in the model, or of another kind.
    """
    made, model = structs_kernel.View(), scene.model
    cameras = [make_camera(scene, frames, name, view.width / view.height) for name in view.cameras]
    rays = np.stack([make_rays(camera, view.height, view.width) for camera in cameras])
    rays = rays.reshape(len(cameras), -1, 3)
    made.cameras = wp.array(cameras, dtype=structs_kernel.Camera, device=device)
    made.rays = wp.array(rays, dtype=wp.vec3, device=device)
    made.cosines = wp.array(-rays[..., 2], dtype=float, device=device)
    made.count, made.width, made.height = len(cameras), view.width, view.height
    made.far = float(model.vis.map.zfar * model.stat.extent)
    return made


def make_camera(scene: Scene, frames: Frames, name: str, aspect: float) -> structs_kernel.Camera:
    """A camera.

    Args:
        scene: Where it is.
        frames: Of the scene.
        name: In the model.
        aspect: Width of its picture over the height.

    Raises:
        InputError: There is none of that name, or it is of another kind.
    """
    model = scene.model
    number = scene.camera(name)
    camera = model.camera(number)
    is_plain = model.cam_projection[number] == mujoco.mjtProjection.mjPROJ_PERSPECTIVE
    if not (is_plain and camera.mode[0] == 0 and model.cam_sensorsize[number, 1] == 0):
        raise InputError(
            f"camera {name!r} is not a fixed one with an angle of view, which is all that "
            "Raytracer knows; give renderer=mujoco_warp"
        )
    made = structs_kernel.Camera()
    made.frame, position, attitude = frames.place(camera.bodyid[0], camera.pos, camera.quat)
    made.position, made.attitude = wp.vec3(position), wp.vec4(attitude)
    half_angle = np.float32(0.5) * np.float32(camera.fovy[0]) * np.float32(np.pi / 180.0)
    made.half_height = float(np.tan(half_angle))
    made.half_width = made.half_height * aspect
    return made


def make_rays(camera: structs_kernel.Camera, height: int, width: int) -> NDArray:
    """Directions through the middles of all pixels in the camera's frame.

    Returns:
        Of length 1. Shape: (height, width, 3), float32.
    """
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * camera.half_width
    down = ((np.arange(height) + 0.5) / height * 2 - 1) * camera.half_height
    rays = np.stack(np.broadcast_arrays(across[None, :], -down[:, None], -1.0), -1)
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).astype(np.float32)


def make_geoms(scene: Scene, frames: Frames, show_drone: bool, device: str) -> structs_kernel.Geoms:
    """What is drawn.

    Args:
        scene: Where it is.
        frames: Of the scene.
        show_drone: Whether the drone is, too.
        device: Where it is wanted.
    """
    model = scene.model
    seen = scene.seen(show_drone)
    places = [
        frames.place(model.geom_bodyid[i], model.geom_pos[i], model.geom_quat[i]) for i in seen
    ]
    values = {
        "kind": (model.geom_type[seen], int),
        "number": (seen, int),
        "frame": ([frame for frame, _, _ in places], int),
        "position": ([position for _, position, _ in places], wp.vec3),
        "attitude": ([attitude for _, _, attitude in places], wp.vec4),
        "size": (model.geom_size[seen], wp.vec3),
        "reach": ([REACH[model.geom_type[i]](model.geom_size[i]) for i in seen], wp.vec3),
    }
    geoms = structs_kernel.Geoms()
    for name, (value, dtype) in values.items():
        setattr(geoms, name, wp.array(value, dtype=dtype, device=device))
    return geoms


class Cameras:
    """Those of a view, as they are in the model and as they are mounted otherwise."""

    def __init__(self, view: View, made: structs_kernel.View, device: torch.device) -> None:
        """Takes the model's.

        Args:
            view: What is asked for.
            made: The same for the kernels.
            device: Of the kernels.
        """
        self._view, self._made, self._device = view, made, device
        self._cameras = made.cameras.numpy()
        self._rays, self._cosines = wp.to_torch(made.rays), wp.to_torch(made.cosines)
        self._last: tuple[Mounting | None, int, structs_kernel.View] = (None, 0, made)

    def of(self, mounting: Mounting | None, num_worlds: int) -> structs_kernel.View:
        """The view for the kernels.

        Args:
            mounting: As in the model by default; one that was given before is not read again.
            num_worlds: As many as it has.
        """
        if mounting is None or mounting.camera not in self._view.cameras:
            return self._made
        if self._last[0] is not mounting or self._last[1] != num_worlds:
            self._last = (mounting, num_worlds, self._mounted(mounting, num_worlds))
        return self._last[2]

    def _mounted(self, mounting: Mounting, num_worlds: int) -> structs_kernel.View:
        which = self._view.cameras.index(mounting.camera)
        cameras = np.tile(self._cameras, (num_worlds, 1))
        one = cameras[:, which]
        one["position"] += _array(mounting.offset)
        attitude = torch.tensor(one["attitude"]).double()
        turn = torch.as_tensor(mounting.turn, dtype=torch.float64).cpu()
        one["attitude"] = product(turn, attitude).numpy()
        made = structs_kernel.View()
        for name in ("count", "width", "height", "far", "what"):
            setattr(made, name, getattr(self._made, name))
        rays, cosines = (
            self._of_each(values, num_worlds) for values in (self._rays, self._cosines)
        )
        if mounting.zoom is not None:
            for name in ("half_width", "half_height"):
                one[name] /= _array(mounting.zoom)
            rays = rays.clone()
            rays[which :: len(self._view.cameras)] = self._rays_of(which, mounting.zoom)
            cosines = -rays[..., 2].contiguous()
        where = str(self._device)
        made.cameras = wp.array(cameras.reshape(-1), dtype=structs_kernel.Camera, device=where)
        made.rays = wp.from_torch(rays, dtype=wp.vec3)
        made.cosines = wp.from_torch(cosines)
        return made

    def _of_each(self, values: Tensor, num_worlds: int) -> Tensor:
        """The same for every world, without a copy where there is one camera."""
        if len(values) == 1:
            return values.expand(num_worlds, *values.shape[1:])
        return values.repeat(num_worlds, *[1] * (values.dim() - 1))

    def _rays_of(self, which: int, zoom: float | Tensor) -> Tensor:
        """Directions through the same pixels. Shape: (num_worlds or 1, pixels, 3)."""
        rays = self._rays[which]
        flat = rays / -rays[:, 2:]
        much = torch.as_tensor(zoom, dtype=torch.float32).to(self._device).reshape(-1, 1)
        wide = torch.stack([flat[:, 0] / much, flat[:, 1] / much], -1)
        wide = torch.nn.functional.pad(wide, (0, 1), value=-1.0)
        return wide / wide.norm(dim=-1, keepdim=True)


def _array(value: object) -> np.ndarray:
    return torch.as_tensor(value).cpu().numpy()


class Places:
    """Frames of as many worlds as were drawn at a time: the world's, the drones', the props'."""

    def __init__(self, device: torch.device) -> None:
        """Makes room when poses come.

        Args:
            device: Of the kernels.
        """
        self._device = device
        self._places: Tensor = torch.empty(0, 0, 3)
        self._attitudes: Tensor = torch.empty(0, 4)
        self._scales: Tensor = torch.empty(0, 0)
        self._scaled: Any = None
        self._made = structs_kernel.Poses()

    def of(self, poses: Poses, beside: Beside | None = None) -> structs_kernel.Poses:
        """The same for the kernels; what it returned before is overwritten.

        Args:
            poses: Of any number of worlds.
            beside: The last of the props, whose sizes are not those of the model.
        """
        count, frames = len(poses), 2 + poses.props.shape[1]
        if len(self._places) < count or self._places.shape[1] != frames:
            self._make(count, frames)
        self._places[:count, 1] = poses.position
        self._places[:count, 2:] = poses.props
        self._attitudes[:count] = poses.attitude
        if beside is not None:
            sizes = beside.sizes
            self._scales[:count, frames - sizes.shape[-1] :] = sizes
            self._made.scales = self._scaled
        return self._made

    def _make(self, count: int, frames: int) -> None:
        self._places = torch.zeros(count, frames, 3, device=self._device)
        self._attitudes = torch.zeros(count, 4, device=self._device)
        self._scales = torch.ones(count, frames, device=self._device)
        self._scaled = wp.from_torch(self._scales)
        self._made = structs_kernel.Poses()
        self._made.places = wp.from_torch(self._places, dtype=wp.vec3)
        self._made.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4)
