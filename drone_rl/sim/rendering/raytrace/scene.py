"""Encode a scene for the kernels, in reference frames: 0 world, 1 drone, props from 2."""

import math
from collections.abc import Callable
from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering.appearance import Distractors, Mounting, product
from drone_rl.sim.rendering.raytrace import intersection_kernel as solids
from drone_rl.sim.rendering.raytrace import structs_kernel as structs
from drone_rl.sim.rendering.renderer import Poses
from drone_rl.sim.rendering.scene import Scene, SemanticClass
from drone_rl.sim.rendering.view import View
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""

HALF_EXTENTS: dict[int, Callable[[NDArray], NDArray]] = {
    **dict.fromkeys((solids.PLANE, solids.ELLIPSOID, solids.BOX), lambda size: size),
    solids.SPHERE: lambda size: size[[0, 0, 0]],
    solids.CAPSULE: lambda size: size[[0, 0, 1]] + [0.0, 0.0, size[0]],
    solids.CYLINDER: lambda size: size[[0, 0, 1]],
}
"""Half extents of the bounding box of each supported kind of geom, from MuJoCo's size; for a plane
the size itself."""


_TRIANGLES = (
    int(mujoco.mjtGeom.mjGEOM_MESH),
    int(mujoco.mjtGeom.mjGEOM_SDF),
    int(mujoco.mjtGeom.mjGEOM_HFIELD),
)
"""Kinds of geoms that are rendered as triangles."""


def why_not_simple(scene: Scene) -> str | None:
    """Return a geom or light that only `SceneRaytracer` renders; None if `Raytracer` can."""
    model = scene.model
    if scene.is_file:
        return "the scene is from a file"
    for geom in range(model.ngeom):
        if model.geom_type[geom] not in HALF_EXTENTS:
            kind = mujoco.mjtGeom(model.geom_type[geom]).name.removeprefix("mjGEOM_").lower()
            return f"geom {model.geom(geom).name!r} is a {kind}"
    if model.nflex:
        return "the scene has soft bodies"
    if not model.nlight:
        return "the scene has no light"
    is_distant = model.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    is_fixed = model.light_bodyid == 0
    if not (is_distant & is_fixed & (model.light_castshadow == 0)).all():
        return (
            "a light of the scene is not directional, is attached to a body or has castshadow=true"
        )
    if model.vis.headlight.active:
        return "the scene's headlight is on"
    return None


def kind_of(model: Any, geom: int) -> int:
    """Return the kind of a geom as it is rendered: height fields are meshes, too."""
    kind = int(model.geom_type[geom])
    return _TRIANGLES[0] if kind in _TRIANGLES else kind


class Frames:
    """Which frame each body is fixed to, and poses relative to frames."""

    def __init__(self, scene: Scene) -> None:
        self._model = model = scene.model
        self._data = mujoco.MjData(model)
        mujoco.mj_forward(model, self._data)
        self._of_body = np.zeros(model.nbody, int)
        for geom, (semantic_class, prop) in enumerate(
            zip(scene.semantic_classes, scene.props, strict=True)
        ):
            root = model.body_rootid[model.geom_bodyid[geom]]
            if semantic_class is SemanticClass.DRONE:
                self._of_body[model.body_rootid == root] = structs.DRONE_FRAME
            elif prop >= 0:
                self._of_body[model.body_rootid == root] = structs.DRONE_FRAME + 1 + prop

    def place(
        self, body: int, position: NDArray, attitude: NDArray
    ) -> tuple[int, NDArray, NDArray]:
        """Return the reference frame that a body is fixed to, and the pose in it.

        The given pose is relative to the body. Positions are in metres, attitudes quaternions
        (w, x, y, z).
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

    def frame_of(self, body: int) -> int:
        """Return the frame that a body is fixed to."""
        return int(self._of_body[body])

    def place_light(self, light: int) -> tuple[int, NDArray, NDArray]:
        """Return the frame of a light, and its position and direction in it.

        A light that follows something, or points at it, stays as it is at the start.
        """
        data, body = self._data, int(self._model.light_bodyid[light])
        frame = self.frame_of(body)
        root = self._model.body_rootid[body] if frame else 0
        back = data.xmat[root].reshape(3, 3).T
        position = data.light_xpos[light] - data.xpos[root]
        return frame, back @ position, back @ data.light_xdir[light]


def make_view(scene: Scene, frames: Frames, view: View, device: str) -> structs.ViewArrays:
    """Return a view for the kernels; the caller sets its modalities, `what`."""
    model: Any = scene.model
    made: Any = structs.ViewArrays()
    aspect, fov = view.width / view.height, view.horizontal_fov
    cameras = [make_camera(scene, frames, name, aspect, fov) for name in view.cameras]
    rays = np.stack([make_rays(camera, view.height, view.width) for camera in cameras])
    rays = rays.reshape(len(cameras), -1, 3)
    made.cameras = wp.array(cameras, dtype=structs.Camera, device=device)
    made.rays = wp.array(rays, dtype=wp.vec3, device=device)
    made.cosines = wp.array(-rays[..., 2], dtype=float, device=device)
    made.count, made.width, made.height = len(cameras), view.width, view.height
    made.far = float(model.vis.map.zfar * model.stat.extent)
    return made


def make_camera(
    scene: Scene, frames: Frames, name: str, aspect: float, horizontal_fov: float | None = None
) -> structs.Camera:
    """Return a camera for the kernels.

    `aspect` is the width of its image over the height, `horizontal_fov` its field of view in
    degrees if it is not the model's.
    """
    model = scene.model
    number = scene.camera(name)
    camera = model.camera(number)
    is_plain = model.cam_projection[number] == mujoco.mjtProjection.mjPROJ_PERSPECTIVE
    if not (is_plain and camera.mode[0] == 0 and model.cam_sensorsize[number, 1] == 0):
        raise InputError(
            f"camera {name!r} is not supported: Raytracer needs mode=fixed, perspective and fovy; "
            "give renderer=mujoco_warp"
        )
    made: Any = structs.Camera()
    made.frame, position, attitude = frames.place(camera.bodyid[0], camera.pos, camera.quat)
    made.position, made.attitude = wp.vec3(position), wp.vec4(attitude)
    half_angle = np.float32(0.5) * np.float32(camera.fovy[0]) * np.float32(np.pi / 180.0)
    made.half_height = float(np.tan(half_angle))
    made.half_width = made.half_height * aspect
    if horizontal_fov is not None:
        made.half_width = math.tan(math.radians(horizontal_fov) / 2)
        made.half_height = made.half_width / aspect
    return made


def make_rays(camera: structs.Camera, height: int, width: int) -> NDArray:
    """Return unit vectors through all pixels, camera frame. Shape: (height, width, 3), float32."""
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * camera.half_width
    down = ((np.arange(height) + 0.5) / height * 2 - 1) * camera.half_height
    rays = np.stack(np.broadcast_arrays(across[None, :], -down[:, None], -1.0), -1)
    return (rays / np.linalg.norm(rays, axis=-1, keepdims=True)).astype(np.float32)


def make_geoms(scene: Scene, frames: Frames, show_drone: bool, device: str) -> structs.Geoms:
    """Return the rendered geoms for the kernels."""
    model, seen = scene.model, scene.shown(show_drone)
    bodies, positions, attitudes = model.geom_bodyid, model.geom_pos, model.geom_quat
    places = [frames.place(bodies[i], positions[i], attitudes[i]) for i in seen]
    values = {
        "kind": ([kind_of(model, i) for i in seen], int),
        "number": (seen, int),
        "frame": ([place[0] for place in places], int),
        "position": ([place[1] for place in places], wp.vec3),
        "attitude": ([place[2] for place in places], wp.vec4),
        "size": (model.geom_size[seen], wp.vec3),
        "reach": ([_reach(model, i) for i in seen], wp.vec3),
    }
    geoms: Any = structs.Geoms()
    for name, (value, dtype) in values.items():
        setattr(geoms, name, wp.array(value, dtype=dtype, device=device))
    return geoms


def _reach(model: Any, geom: int) -> NDArray:
    """Half extents of a geom's bounding box around its position."""
    if (kind := int(model.geom_type[geom])) in HALF_EXTENTS:
        return HALF_EXTENTS[kind](model.geom_size[geom])
    return np.abs(model.geom_aabb[geom, :3]) + model.geom_aabb[geom, 3:]


class Cameras:
    """Cameras of a view, with the model's mounting or another one per environment."""

    def __init__(self, view: View, encoded: structs.ViewArrays, device: torch.device) -> None:
        self._view, self._encoded, self._device = view, encoded, device
        arrays: Any = encoded
        self._cameras = arrays.cameras.numpy()
        self._rays, self._cosines = wp.to_torch(arrays.rays), wp.to_torch(arrays.cosines)
        self._last: tuple[Mounting | None, int, structs.ViewArrays] = (None, 0, encoded)

    def encode(self, mounting: Mounting | None, num_envs: int) -> structs.ViewArrays:
        """Return the view for the kernels; the last mounting is cached by identity."""
        if mounting is None or mounting.camera not in self._view.cameras:
            return self._encoded
        if self._last[0] is not mounting or self._last[1] != num_envs:
            self._last = (mounting, num_envs, self._mount(mounting, num_envs))
        return self._last[2]

    def _mount(self, mounting: Mounting, num_envs: int) -> structs.ViewArrays:
        which = self._view.cameras.index(mounting.camera)
        cameras: Any = np.tile(self._cameras, (num_envs, 1))
        one = cameras[:, which]
        one["position"] += _array(mounting.offset)
        attitude = torch.tensor(one["attitude"]).double()
        turn = torch.as_tensor(mounting.turn, dtype=torch.float64).cpu()
        one["attitude"] = product(turn, attitude).numpy()
        rays, cosines = (
            v.expand(num_envs, *v.shape[1:]) if len(v) == 1 else torch.cat([v] * num_envs)
            for v in (self._rays, self._cosines)
        )
        if mounting.zoom is not None:
            for name in ("half_width", "half_height"):
                one[name] /= _array(mounting.zoom)
            rays = rays.clone()
            rays[which :: len(self._view.cameras)] = self._zoomed_rays(which, mounting.zoom)
            cosines = -rays[..., 2].contiguous()
        encoded: Any = structs.ViewArrays()
        for name in ("count", "width", "height", "far", "what"):
            setattr(encoded, name, getattr(self._encoded, name))
        device = str(self._device)
        encoded.cameras = wp.array(cameras.reshape(-1), dtype=structs.Camera, device=device)
        encoded.rays = wp.from_torch(rays, dtype=wp.vec3)
        encoded.cosines = wp.from_torch(cosines)
        return encoded

    def _zoomed_rays(self, which: int, zoom: float | Tensor) -> Tensor:
        """Directions through the same pixels. Shape: (num_envs or 1, pixels, 3)."""
        rays = self._rays[which]
        flat = rays / -rays[:, 2:]
        factor = torch.as_tensor(zoom, dtype=torch.float32).to(self._device).reshape(-1, 1)
        wide = torch.stack([flat[:, 0] / factor, flat[:, 1] / factor], -1)
        wide = torch.nn.functional.pad(wide, (0, 1), value=-1.0)
        return wide / wide.norm(dim=-1, keepdim=True)


class PoseBuffers:
    """Poses of frames in arrays that are reused: new Warp arrays would take longer to make."""

    def __init__(self, device: torch.device) -> None:
        self._device = device
        self._allocate(0, 0)

    def write(self, poses: Poses, distractors: Distractors | None = None) -> structs.PoseArrays:
        """Return poses for the kernels; the next call overwrites them.

        Distractors are the last of the props, and are scaled by their sizes.
        """
        count, frames = len(poses), 2 + poses.props.shape[1]
        if len(self._positions) < count or self._positions.shape[1] != frames:
            self._allocate(count, frames)
        self._positions[:count, 1] = poses.position
        self._positions[:count, 2:] = poses.props
        self._attitudes[:count] = poses.attitude
        if distractors is not None or self._is_scaled:
            self._scales.fill_(1.0)
        if distractors is not None:
            sizes = distractors.sizes
            self._scales[:count, frames - sizes.shape[-1] :] = sizes
            self._encoded.scales, self._is_scaled = self._encoded_scales, True
        return self._encoded

    def _allocate(self, count: int, frames: int) -> None:
        self._positions = torch.zeros(count, frames, 3, device=self._device)
        self._attitudes = torch.zeros(count, 4, device=self._device)
        self._scales = torch.ones(count, frames, device=self._device)
        self._encoded_scales: Any = wp.from_torch(self._scales)
        self._encoded: Any = structs.PoseArrays()
        self._encoded.positions = wp.from_torch(self._positions, dtype=wp.vec3)
        self._encoded.attitudes = wp.from_torch(self._attitudes, dtype=wp.vec4)
        self._is_scaled = False


def _array(value: object) -> np.ndarray:
    return torch.as_tensor(value).cpu().numpy()
