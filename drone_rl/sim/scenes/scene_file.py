"""A scene file, read and normalized: fixed bodies, geoms, lights and sites in the world's frame."""

import dataclasses
import functools
import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco as _mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""


@dataclasses.dataclass(frozen=True)
class Site:
    """A place that a scene marks. Metres, world frame."""

    name: str
    position: tuple[float, float, float]
    half_size: tuple[float, float, float]
    """Of the region around it; zero for a point (a site that is not a box)."""
    heading: float
    """Of its x axis, degrees to the left of the world's x."""


@dataclasses.dataclass(frozen=True)
class SceneFile:
    """A scene: what is left of a file once nothing in it moves by itself.

    Hinged parts stay as the file's first key frame has them. Bodies stay a tree, so that a body
    with all that is fixed to it can be named.
    """

    path: Path
    sha256: str
    """Hash of the file and of all that it includes."""
    mjcf: str
    """The normalized model, in radians, without joints, actuators and contacts."""
    assets: Mapping[str, bytes]
    """Contents of the files that `mjcf` names."""
    sites: tuple[Site, ...]
    solid: tuple[bool, ...]
    """Whether each geom of `model` can be touched: contype or conaffinity is not 0."""
    warnings: tuple[str, ...] = ()
    """What is not drawn or looks like a mistake, one line each."""

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem

    @functools.cached_property
    def model(self) -> Any:
        """The compiled scene alone, a `mujoco.MjModel`; geoms are numbered as in `mjcf`."""
        return mujoco.MjModel.from_xml_string(self.mjcf, dict(self.assets))

    @functools.cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and largest coordinates of all geoms but planes, metres. Shapes: (3,)."""
        model, data = self.model, mujoco.MjData(self.model)
        mujoco.mj_kinematics(model, data)
        lows, highs = [], []
        for geom in np.flatnonzero(model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE):
            center, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            turn = data.geom_xmat[geom].reshape(3, 3)
            middle, reach = data.geom_xpos[geom] + turn @ center, np.abs(turn) @ half
            lows.append(middle - reach)
            highs.append(middle + reach)
        if not lows:
            return np.full(3, -10.0), np.full(3, 10.0)
        return np.min(lows, 0), np.max(highs, 0)


def load_scene(path: str | Path, up: str = "z", scale: float = 1.0) -> SceneFile:
    """Read a scene.

    Args:
        path: An MJCF file, or a mesh.
        up: Axis of a mesh that points up, "y" or "z".
        scale: Metres of one unit of a mesh.

    Raises:
        InputError: The file can't be read; the message names the element and the remedy.
    """
    file = Path(path)
    try:
        content = file.read_bytes()
    except OSError as error:
        reason = error.strerror
        raise InputError(f"scene={path} can't be read ({reason}); give an MJCF file") from error
    return _load(file.resolve(), hashlib.sha256(content).hexdigest(), up, scale)


@functools.lru_cache(16)
def _load(path: Path, sha256: str, up: str, scale: float) -> SceneFile:
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        model = spec.compile()
    except ValueError as error:
        raise InputError(f"scene={path}: {str(error).splitlines()[0]}; correct it") from error
    _freeze(spec, model)
    assets: dict[str, bytes] = {}
    for kind in (spec.meshes, spec.textures, spec.hfields):
        for one in kind:
            if getattr(one, "file", ""):
                assets[one.file] = (path.parent / one.file).read_bytes()
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return SceneFile(path, sha256, spec.to_xml(), assets, _sites(model), tuple(solid.tolist()))


def _freeze(spec: Any, model: Any) -> None:
    """Leave bodies where the first key frame has them, without joints and all that acts on them."""
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    for number, body in enumerate(spec.bodies[1:], start=1):
        parent = model.body_parentid[number]
        back, place, turn = np.empty(4), np.empty(3), np.empty(4)
        mujoco.mju_negQuat(back, data.xquat[parent])
        mujoco.mju_rotVecQuat(place, data.xpos[number] - data.xpos[parent], back)
        mujoco.mju_mulQuat(turn, back, data.xquat[number])
        body.pos, body.quat, body.mocap = place, turn, False
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        for joint in list(body.joints):
            spec.delete(joint)
    names = ("keys", "actuators", "sensors", "tendons", "equalities", "excludes", "pairs")
    for kind in (*names, "skins", "flexes", "cameras"):
        for one in list(getattr(spec, kind)):
            spec.delete(one)


def _sites(model: Any) -> tuple[Site, ...]:
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    found = []
    for i in range(model.nsite):
        turn = data.site_xmat[i].reshape(3, 3)
        is_box = model.site_type[i] == mujoco.mjtGeom.mjGEOM_BOX
        half = model.site_size[i] if is_box else np.zeros(3)
        heading = float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0])))
        x, y, z = data.site_xpos[i].tolist()
        wide, deep, high = half.tolist()
        found.append(Site(model.site(i).name, (x, y, z), (wide, deep, high), heading))
    return tuple(found)
