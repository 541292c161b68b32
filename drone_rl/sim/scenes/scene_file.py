"""A scene file, read and normalized: fixed bodies, geoms, lights and sites in the world's frame."""

import dataclasses
import functools
import logging
import math
import warnings
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Self

import mujoco as _mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.scenes.assets import Folder, version_of
from drone_rl.sim.scenes.compiling import compile_scene, freeze
from drone_rl.sim.scenes.elements import parse, write
from drone_rl.sim.scenes.meshes import ENDINGS, read_mesh
from drone_rl.sim.scenes.reader import Reader, Reading
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.files import as_path

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_GEOM = mujoco.mjtGeom
_log = logging.getLogger(__name__)
_SMALLEST, _LARGEST = 0.1, 1000.0
"""Longest edges of worlds, metres; outside of this range the units are wrong."""
_HUGE = 1e6
"""Metres."""
_MOST_LIGHTS = 8
"""Of OpenGL, and so of the ray tracer, with the headlight."""
_NOT_DRAWN = {
    "flex": "flexes are",
    "flexcomp": "flexes are",
    "skin": "skins are",
    "composite": "composites are",
    "sdf": "signed distance shapes are",
    "reflectance": "reflections are",
    "haze": "haze is",
}


@dataclasses.dataclass(frozen=True)
class Site:
    """A place that a scene marks. Metres, world frame."""

    name: str
    position: tuple[float, float, float]
    half_size: tuple[float, float, float]
    """Of the region around it; zero for a point (a site that is not a box)."""
    heading: float
    """Of its x axis, degrees to the left of the world's x."""

    @property
    def axes(self) -> NDArray[np.float64]:
        """Its x, y and z axis as rows, in the world frame. Shape: (3, 3)."""
        angle = math.radians(self.heading)
        cos, sin = math.cos(angle), math.sin(angle)
        return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])

    @property
    def corners(self) -> NDArray[np.float64]:
        """Places (x, y) of the region's corners, counterclockwise. Metres. Shape: (4, 2)."""
        signs = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
        return (self.position + signs * self.half_size @ self.axes)[:, :2]


@dataclasses.dataclass(frozen=True, eq=False)
class SceneFile:
    """A scene: what is left of a file once nothing in it moves by itself.

    Hinged parts stay as the file's first key frame has them. Bodies stay a tree, so that a body
    with all that is fixed to it can be named.
    """

    path: Path
    sha256: str
    """Hash of the file and of all files that it names."""
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

    def without(self, geoms: Collection[str]) -> Self:
        """Return the scene without some geoms, by name."""
        root = parse(self.mjcf.encode(), self.path)
        kept = [self.model.geom(i).name not in geoms for i in range(self.model.ngeom)]
        for element in (root, *root.every()):
            element.children = [
                of for of in element.children if of.tag != "geom" or of.get("name") not in geoms
            ]
        solid = tuple(
            is_solid for is_solid, is_kept in zip(self.solid, kept, strict=True) if is_kept
        )
        return dataclasses.replace(self, mjcf=write(root)[0], solid=solid)

    @functools.cached_property
    def model(self) -> Any:
        """The compiled scene alone, a `mujoco.MjModel`; geoms are numbered as in `mjcf`."""
        with warnings.catch_warnings(action="ignore"):  # which `warnings` has
            return mujoco.MjModel.from_xml_string(self.mjcf, dict(self.assets))

    @functools.cached_property
    def data(self) -> Any:
        """Where everything in `model` is, a `mujoco.MjData`."""
        data = mujoco.MjData(self.model)
        _find_places(self.model, data)
        return data

    @functools.cached_property
    def boxes(self) -> NDArray[np.float64]:
        """Least and largest coordinates of each geom, metres; a plane's are infinite, but for z.

        Shape: (geoms, 2, 3).
        """
        model, data = self.model, self.data
        boxes = np.empty((model.ngeom, 2, 3))
        for geom, box in enumerate(boxes):
            turn = data.geom_xmat[geom].reshape(3, 3)
            box[:] = data.geom_xpos[geom] + _reach(model, geom, turn)
        return boxes

    @functools.cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and largest coordinates of all geoms but planes, metres. Shapes: (3,)."""
        boxes = self.boxes[self.model.geom_type != _GEOM.mjGEOM_PLANE]
        if not len(boxes):
            return np.full(3, -10.0), np.full(3, 10.0)
        return boxes[:, 0].min(0), boxes[:, 1].max(0)

    @property
    def sun(self) -> NDArray[np.float64] | None:
        """Where the first directional light shines, world frame; None without one. Shape: (3,)."""
        model = self.model
        is_directional = model.light_type == mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        return next(iter(self.data.light_xdir[is_directional & (model.light_active != 0)]), None)


def _reach(model: Any, geom: int, turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the box around a turned geom, parallel to the world's axes, from the geom's place."""
    size, upright = model.geom_size[geom], np.abs(turn[:, 2])
    match model.geom_type[geom]:
        case _GEOM.mjGEOM_MESH:  # its frame is that of its inertia, in which it is askew
            mesh = model.geom_dataid[geom]
            first = model.mesh_vertadr[mesh]
            corners = model.mesh_vert[first : first + model.mesh_vertnum[mesh]] @ turn.T
            return np.stack([corners.min(0), corners.max(0)])
        case _GEOM.mjGEOM_PLANE:
            half = np.array([np.inf, np.inf, 0.0])
        case _GEOM.mjGEOM_SPHERE:
            half = size[[0, 0, 0]]
        case _GEOM.mjGEOM_CAPSULE:
            half = size[0] + size[1] * upright
        case _GEOM.mjGEOM_CYLINDER:
            half = size[0] * np.linalg.norm(turn[:, :2], axis=1) + size[1] * upright
        case _GEOM.mjGEOM_ELLIPSOID:
            half = np.linalg.norm(turn * size, axis=1)
        case _:
            half = np.abs(turn) @ model.geom_aabb[geom, 3:]
            return turn @ model.geom_aabb[geom, :3] + np.stack([-half, half])
    return np.stack([-half, half])


FILES = Path(__file__).parent / "files"
"""The shipped scenes, which have names: those of the files here, without .xml."""

_loaded: dict[tuple[Path, str, float], tuple[dict[Path, tuple[int, int]], SceneFile]] = {}
"""Scenes that were read, with the versions of their files."""


def scene_names() -> list[str]:
    """Return the names of the shipped scenes."""
    return sorted(file.stem for file in FILES.glob("*.xml"))


def find_scene(scene: str | Path) -> Path:
    """Return the path of a scene's file, of a shipped one if no file has that path.

    Raises:
        InputError: There is none.
    """
    path = as_path(scene, "scene")
    if path.exists() or path.is_symlink():
        return path
    if str(scene) in scene_names():
        return FILES / f"{scene}.xml"
    raise InputError(
        f"it does not exist; give {', '.join(scene_names())}, or the path of an MJCF file or mesh"
        f"{did_you_mean(scene, scene_names())}"
    )


def load_scene(path: str | Path, up: str = "z", scale: float = 1.0) -> SceneFile:
    """Read a scene; return the same one again while its files do not change.

    Nothing outside of the file's folder is read, and nothing large before its size is checked.

    Args:
        path: An MJCF file, a mesh, or the name of a shipped scene.
        up: Axis of a mesh that points up, "y" or "z".
        scale: Metres of one unit of a mesh.

    Raises:
        InputError: The file can't be read; the message names the element and the remedy.
    """
    try:
        file = find_scene(path).resolve()
        versions, scene = _loaded.get((file, up, scale), ({}, None))
        if scene is None or any(version_of(of) != version for of, version in versions.items()):
            folder = Folder(file.parent)
            scene = _load(file, folder, up, scale)
            _loaded[file, up, scale] = folder.versions, scene
        return scene
    except (InputError, OSError, RuntimeError) as error:  # the last are loops of links
        text = str(error).replace(f"{path} ", "it ") if isinstance(error, InputError) else error
        raise InputError(f"scene={path}: {text}") from error


def _load(file: Path, folder: Folder, up: str, scale: float) -> SceneFile:
    reading = Reading(folder)
    is_mesh = file.suffix.lower() in ENDINGS
    root = read_mesh(file, reading, up, scale) if is_mesh else Reader(file, reading).root
    model, text, solid = compile_scene(root, reading)
    if not model.ngeom:
        raise InputError(f"it has no geoms{''.join(f'; {of}' for of in _warnings(reading.notes))}")
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    _find_places(model, data)
    _check_numbers(model, data)
    frozen = freeze(text, file, model, data)
    used = {value for element in frozen.every() for value in element.attributes.values()}
    scene = SceneFile(
        file,
        folder.hash.hexdigest(),
        write(frozen)[0],
        {name: content for name, content in reading.files.items() if name in used},
        _sites(model, data),
        solid,
        (*_warnings(reading.notes), *_dark_lights(model)),
    )
    del model, data  # of large meshes hundreds of megabytes
    size = _check_size(scene)
    if is_mesh:
        _log.info("scene=%s: its longest edge is %.3g m", file.name, size)
    return scene


def _find_places(model: Any, data: Any) -> None:
    """Write places of geoms, sites and lights into a `mujoco.MjData`."""
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)  # some lights follow it
    mujoco.mj_camlight(model, data)


def _check_numbers(model: Any, data: Any) -> None:
    """Raise an `InputError` about the first place or size that is no number, or far too large."""
    parts = {
        "geom": np.hstack([data.geom_xpos, data.geom_xmat, model.geom_size]),
        "site": np.hstack([data.site_xpos, data.site_xmat, model.site_size]),
        "light": np.hstack([data.light_xpos, data.light_xdir]),
        "mesh": model.mesh_vert,
        "hfield": model.hfield_data[:, None],
    }
    for tag, numbers in parts.items():
        for number in np.flatnonzero(~(np.abs(numbers) < _HUGE).all(1))[:1]:
            name = getattr(model, tag)(number).name if tag in ("geom", "site", "light") else ""
            raise InputError(
                f"{tag} {name or number} has a place or size that is no number, or beyond "
                f"{_HUGE:g} m; correct it"
            )


def _check_size(scene: SceneFile) -> float:
    """Return the longest edge; raise an `InputError` if the world is too small or too large."""
    low, high = scene.bounds
    model = scene.model
    planes = model.geom_size[model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE, :2]
    size = max(float((high - low).max()), 2 * float(planes.max(initial=0.0)))
    if not _SMALLEST <= size <= _LARGEST:
        raise InputError(
            f"the world's longest edge is {size:.3g} m; give one of {_SMALLEST:g} to "
            f"{_LARGEST:g} m (scale of meshes, or task.scene_scale for a mesh file)"
        )
    if max(abs(low).max(), abs(high).max()) > _LARGEST:
        far = f"[{', '.join(f'{value:.3g}' for value in (low + high) / 2)}]"
        raise InputError(f"the world's middle is {far} m; move it within {_LARGEST:g} m of 0")
    return size


def _warnings(notes: Mapping[str, list[str]]) -> list[str]:
    lines = [
        f"{what} not drawn: {_some(notes[kind])}"
        for kind, what in _NOT_DRAWN.items()
        if notes[kind]
    ]
    if notes["plugin"]:
        lines.append(f"plugins do not run: {_some(notes['plugin'])}")
    lines += dict.fromkeys(notes["remarks"])
    joints = notes["joint"] + notes["freejoint"]
    if joints:
        where = f"key frame {notes['key'][0]} has them" if notes["key"] else "they begin"
        lines.append(f"joints do not move; they stay where {where}: {_some(joints)}")
    return lines


def _dark_lights(model: Any) -> list[str]:
    """Return a line about lights that are not drawn, because OpenGL has eight."""
    most = _MOST_LIGHTS - bool(model.vis.headlight.active)
    dark = np.flatnonzero(model.light_active).tolist()[most:]
    names = [model.light(number).name or str(number) for number in dark]
    return [f"lights after the first {most} are not drawn: {_some(names)}"] if dark else []


def _some(names: list[str]) -> str:
    """Return the first names, and how many more there are."""
    distinct = list(dict.fromkeys(names))
    rest = f" and {len(distinct) - 5} more" if len(distinct) > 5 else ""
    return ", ".join(name[:40] for name in distinct[:5]) + rest


def _sites(model: Any, data: Any) -> tuple[Site, ...]:
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
