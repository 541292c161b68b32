# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# (dm_control's models of XML and MuJoCo's bindings are untyped.)
"""How a dm_control simulation looks through OpenGL, by the same description as our own ray tracer.

OpenGL shows all of it, some of it otherwise. MuJoCo's own fog would cover the sky, too, so fog is
laid over pictures by their depth: the camera's observations have it, dm_control's viewer does not.
Light is cut off at white before a texture is laid over it, ours after. Shadows have the edges of a
shadow map's texels and reach as far as `_SHADOWS`. Textures lie on boxes, all of a meaning as large
as the first; that of the ground need not begin where ours does.
"""

from typing import Any

import mujoco
import numpy as np
import torch
from dm_control import mjcf
from numpy.typing import NDArray

from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.appearance import Appearance, Mounting, Texture, product
from drone_rl.sim.rendering.scene import Meaning, Scene

_RIGHT = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]])
_DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]])
_OUT = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_LAID = ((1, 2), (0, 2), (0, 1))
"""By the axis that a side looks along: the coordinates that a texture follows to the right, and
upwards."""


def sky_sides(side: int, horizon: NDArray, zenith: NDArray) -> NDArray[np.uint8]:
    """A sky that goes from one colour to the other with the sine of the elevation; +y is up.

    Args:
        side: Texels each way.
        horizon: Colour there and below, from 0 to 1. Shape: (3,).
        zenith: Colour overhead. Shape: (3,).

    Returns:
        Shape: (6, side, side, 3).
    """
    points = _points(side)
    up = np.clip(points[..., 1:2] / np.linalg.norm(points, axis=-1, keepdims=True), 0.0, 1.0)
    return _bytes(horizon + up * (zenith - horizon))


def box_sides(side: int, picture: NDArray[np.uint8], half: NDArray, tile: float) -> NDArray:
    """What covers a box: tiles that begin in the middle of each side, as our ray tracer lays them.

    Args:
        side: Texels each way.
        picture: The texture. Shape: (texels, texels, 3), a power of 2 of them.
        half: Half extents of the box, metres. Shape: (3,).
        tile: Edge of a tile, metres.

    Returns:
        Shape: (6, side, side, 3), uint8.
    """
    points = _points(side) * half
    sides = []
    for number, at in enumerate(points):
        across, upward = _LAID[number // 2]
        level = _fitting(picture, 2 * max(half[across], half[upward]) / side / tile)
        count = len(level)
        column = np.floor(at[..., across] / tile * count).astype(int) % count
        row = np.floor(-at[..., upward] / tile * count).astype(int) % count
        sides.append(level[row, column])
    return np.stack(sides)


def flat(picture: NDArray[np.uint8] | None, side: int) -> NDArray[np.uint8]:
    """A texture at another size; white without one. Shape: (side, side, 3)."""
    if picture is None:
        return np.full((side, side, 3), 255, np.uint8)
    at = np.arange(side) * len(picture) // side
    return picture[at[:, None], at[None, :]]


def _points(side: int) -> NDArray[np.float64]:
    """Where texels are on a cube from -1 to 1. Shape: (6, side, side, 3)."""
    at = (np.arange(side) + 0.5) / side * 2 - 1
    across, down = at[None, None, :, None], at[None, :, None, None]
    return _OUT[:, None, None] + across * _RIGHT[:, None, None] + down * _DOWN[:, None, None]


def _fitting(picture: NDArray[np.uint8], share: float) -> NDArray[np.uint8]:
    """The mip level whose texels are as large as so large a share of a tile, or finer."""
    rows, side = textures.levels(picture), len(picture)
    start = 0
    while side > 1 and 2.0 / side <= share:
        start, side = start + side * side, side // 2
    return rows[start : start + side * side].reshape(side, side, 3)


def _bytes(colors: NDArray) -> NDArray[np.uint8]:
    return np.clip(np.round(colors * 255.0), 0, 255).astype(np.uint8)


_SIDE = 256
"""Texels of all textures, each way."""
_SHADOWS = 70.0
"""Metres around the middle of the world in which things cast shadows."""
_COVERED = {Meaning.GROUND: "ground", Meaning.TARGET: "target", Meaning.OBSTACLE: "obstacle"}
"""What textures lie on, and what they are called."""
RENDER_FLAGS = {"haze": False}
"""Which of MuJoCo's effects a camera must have or not have."""


def prepare(root: mjcf.RootElement) -> None:
    """Makes room for textures, before an arena's model is compiled."""
    sky = root.find("texture", "sky")
    sky.width, sky.height = _SIDE, 6 * _SIDE
    root.visual.map.shadowclip = _SHADOWS
    for meaning, name in _COVERED.items():
        is_flat = meaning is Meaning.GROUND
        root.asset.add(
            "texture",
            name=name,
            type="2d" if is_flat else "cube",
            builtin="flat",
            rgb1=(1, 1, 1),
            rgb2=(1, 1, 1),
            width=_SIDE,
            height=_SIDE * (1 if is_flat else 6),
        )
        root.asset.add("material", name=name, texture=name, texuniform=is_flat, specular=0.0)


class OpenGlLooks:
    """Writes appearances into a simulation."""

    def __init__(self, scene: Scene, middle: float) -> None:
        """Notes how it looks by itself.

        Args:
            scene: Of a prepared model.
            middle: x of the middle of what there is to see, metres.
        """
        self._scene, self._middle = scene, middle
        model = scene.model
        self._cameras = model.cam_pos.copy(), model.cam_quat.copy(), model.cam_fovy.copy()
        self._sizes = model.geom_size.copy()

    def wear(self, physics: mjcf.Physics, look: Appearance, draws: bool) -> None:
        """Makes one world look so.

        Args:
            physics: The simulation.
            look: Of one world.
            draws: Whether OpenGL draws, and must be told of new textures.
        """
        exposure = 1.0 if look.exposure is None else float(look.exposure)
        self._light(physics.model, look, exposure)
        for meaning, color in look.colors.items():
            if meaning is not Meaning.SKY:
                physics.model.geom_rgba[self._scene.geoms(meaning), :3] = _row(color)
        self._put_beside(physics.model, look)
        if look.camera is not None:
            self._mount(physics.model, look.camera)
        changed = [self._paint_sky(physics.model, look, exposure)]
        changed += [self._cover(physics.model, m, look.textures.get(m)) for m in _COVERED]
        if draws:
            for number in changed:
                _upload(physics, number)

    def _light(self, model: Any, look: Appearance, exposure: float) -> None:
        lights = look.lights(1)
        model.light_ambient[0] = 0.0  # or shadows would be black
        model.vis.headlight.active = 1
        model.vis.headlight.ambient = _row(lights["ambient"]) * exposure
        model.vis.headlight.diffuse = model.vis.headlight.specular = 0.0
        model.light_diffuse[0] = _row(lights["sun"]) * exposure
        direction = _row(lights["sun_direction"])
        model.light_dir[0] = direction
        model.light_pos[0] = np.array([self._middle, 0.0, 0.0]) - _SHADOWS * direction
        model.light_castshadow[0] = look.shadows is not None and bool(look.shadows)

    def _put_beside(self, model: Any, look: Appearance) -> None:
        geoms = self._scene.geoms(Meaning.DISTRACTOR)
        if look.beside is not None and geoms:
            beside = look.beside.of(1)
            model.geom_rgba[geoms, :3] = beside.colors[0].numpy()
            model.geom_size[geoms] = beside.sizes[0, :, None].numpy() * self._sizes[geoms]

    def _mount(self, model: Any, mounting: Mounting) -> None:
        place, attitude, angle = self._cameras
        camera = self._scene.camera(mounting.camera)
        turn = torch.as_tensor(mounting.turn, dtype=torch.float64).reshape(4)
        model.cam_pos[camera] = place[camera] + _row(mounting.offset)
        model.cam_quat[camera] = product(turn, torch.from_numpy(attitude[camera])).numpy()
        if mounting.zoom is not None:
            half = np.tan(np.radians(angle[camera]) / 2) / float(mounting.zoom)
            model.cam_fovy[camera] = np.degrees(2 * np.arctan(half))

    def _paint_sky(self, model: Any, look: Appearance, exposure: float) -> int:
        horizon = _row(look.colors[Meaning.SKY])
        zenith = horizon if look.zenith is None else _row(look.zenith)
        colors = (np.clip(color * exposure, 0.0, 1.0) for color in (horizon, zenith))
        return self._write(model, "sky", sky_sides(_SIDE, *colors))

    def _cover(self, model: Any, meaning: Meaning, texture: Texture | None) -> int:
        name, geoms = _COVERED[meaning], self._scene.geoms(meaning)
        chosen = -1 if texture is None else int(texture.choice)
        picture = None
        if texture is not None and chosen >= 0:
            picture = textures.load(texture.pictures[chosen])
        tile = 1.0 if texture is None else float(texture.size)
        number = mujoco.mj_name2id(self._scene.model, mujoco.mjtObj.mjOBJ_MATERIAL, name)
        model.geom_matid[geoms] = number
        if meaning is Meaning.GROUND:
            model.mat_texrepeat[number] = 1.0 / tile
            return self._write(model, name, flat(picture, _SIDE))
        if picture is None or not geoms:
            return self._write(model, name, np.full((6, _SIDE, _SIDE, 3), 255, np.uint8))
        half = self._sizes[geoms[0]]
        return self._write(model, name, box_sides(_SIDE, picture, half, tile))

    def _write(self, model: Any, name: str, texels: NDArray[np.uint8]) -> int:
        number = mujoco.mj_name2id(self._scene.model, mujoco.mjtObj.mjOBJ_TEXTURE, name)
        start = model.tex_adr[number]
        model.tex_data[start : start + texels.size] = texels.reshape(-1)
        return number


def _upload(physics: mjcf.Physics, texture: int) -> None:
    contexts = physics.contexts
    with contexts.gl.make_current() as call:
        call.call(mujoco.mjr_uploadTexture, physics.model.ptr, contexts.mujoco.ptr, texture)


def _row(value: Any) -> NDArray[np.float64]:
    """Three numbers of one world."""
    return torch.as_tensor(value, dtype=torch.float64).reshape(3).numpy()


def in_fog(
    picture: NDArray[np.uint8], depth: NDArray, look: Appearance, fovy: float, sky: float
) -> NDArray[np.uint8]:
    """A picture with its look's fog, but for the sky.

    Args:
        picture: In clear air. Shape: (height, width, 3).
        depth: Metres along the camera's axis. Shape: (height, width).
        look: Of one world.
        fovy: Vertical field of view, degrees.
        sky: Metres from the camera at which the sky begins.
    """
    visibility = np.inf if look.fog is None else float(look.fog)
    if visibility == np.inf:
        return picture
    height, width = depth.shape
    half = np.tan(np.radians(fovy) / 2)
    down = ((np.arange(height) + 0.5) / height * 2 - 1) * half
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
    distance = depth * np.sqrt(1 + across[None, :] ** 2 + down[:, None] ** 2)
    clear = np.where(distance < sky, 0.05 ** (distance / visibility), 1.0)[..., None]
    exposure = 1.0 if look.exposure is None else float(look.exposure)
    horizon = 255.0 * np.clip(_row(look.colors[Meaning.SKY]) * exposure, 0.0, 1.0)
    return (clear * picture + (1 - clear) * horizon).astype(np.uint8)
