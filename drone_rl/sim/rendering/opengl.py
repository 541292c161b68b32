"""Appearance of a dm_control simulation rendered with OpenGL.

OpenGL differs from the ray tracer as follows. Fog is composited from depth, because MuJoCo's own
would cover the sky; dm_control's viewer does not show it. Light is clipped at white before the
texture is applied. Shadow edges have the resolution of a shadow map, which covers `_SHADOWS`.
Textures cover boxes, all of a semantic class at the size of the first. The sides of a cube map are
+x, -x, +y, -y, +z, -z.
"""

from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.sim.quiet_dm_control import mjcf
from drone_rl.sim.rendering import textures
from drone_rl.sim.rendering.appearance import Appearance, Mounting, Texture, product
from drone_rl.sim.rendering.scene import Scene, SemanticClass

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_SIDE = 256
"""Texels of all textures, each way."""
_SHADOWS = 70.0
"""Metres around the middle of the scene in which objects cast shadows."""
_TEXTURED = {
    SemanticClass.GROUND: "ground",
    SemanticClass.TARGET: "target",
    SemanticClass.OBSTACLE: "obstacle",
}
"""Classes that can be textured, and the names of their textures and materials."""
RENDER_FLAGS = {"haze": False}
"""MuJoCo's effects that a camera must switch on or off."""
_RIGHT = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]])
_DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]])
_OUT = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])
_TEXTURE_AXES = ((1, 2), (0, 2), (0, 1))
"""By the axis of a side's normal: the coordinates that a texture follows right and up."""


def prepare(root: Any) -> None:
    """Reserve memory for textures in an `mjcf.RootElement` before it is compiled."""
    sky = root.find("texture", "sky")
    sky.width, sky.height = _SIDE, 6 * _SIDE
    root.visual.map.shadowclip = _SHADOWS
    for semantic_class, name in _TEXTURED.items():
        is_flat = semantic_class is SemanticClass.GROUND
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


class OpenGlAppearance:
    """Writes appearances into a simulation's model."""

    def __init__(self, scene: Scene, middle: float) -> None:
        """Take a prepared model; `middle` is x of the middle of the visible area, metres."""
        self._scene, self._middle = scene, middle
        model = scene.model
        self._cameras = model.cam_pos.copy(), model.cam_quat.copy(), model.cam_fovy.copy()
        self._sizes = model.geom_size.copy()

    def apply(self, physics: mjcf.Physics, appearance: Appearance, upload: bool) -> None:
        """Write the appearance of one environment; `upload` sends new textures to OpenGL.

        It must give ambient light, sun, its direction and the sky's color. Other colors, camera
        and distractors stay as written before if it does not give them.
        """
        model: Any = physics.model
        exposure = 1.0 if appearance.exposure is None else float(appearance.exposure)
        self._light(model, appearance, exposure)
        for semantic_class, color in appearance.colors.items():
            if semantic_class is not SemanticClass.SKY:
                model.geom_rgba[self._scene.geoms(semantic_class), :3] = _row(color)
        self._write_distractors(model, appearance)
        if appearance.camera is not None:
            self._mount(model, appearance.camera)
        changed = [self._write_sky(model, appearance, exposure)]
        changed += [self._write_class(model, c, appearance.textures.get(c)) for c in _TEXTURED]
        if upload:
            contexts: Any = physics.contexts
            with contexts.gl.make_current() as call:
                for number in changed:
                    call.call(mujoco.mjr_uploadTexture, model.ptr, contexts.mujoco.ptr, number)

    def _light(self, model: Any, appearance: Appearance, exposure: float) -> None:
        lights = appearance.lights(1)
        model.light_ambient[0] = 0.0  # the headlight's ambient light also reaches shadows
        model.vis.headlight.active = 1
        model.vis.headlight.ambient = _row(lights["ambient"]) * exposure
        model.vis.headlight.diffuse = model.vis.headlight.specular = 0.0
        model.light_diffuse[0] = _row(lights["sun"]) * exposure
        direction = _row(lights["sun_direction"])
        model.light_dir[0] = direction
        model.light_pos[0] = np.array([self._middle, 0.0, 0.0]) - _SHADOWS * direction
        model.light_castshadow[0] = appearance.shadows is not None and bool(appearance.shadows)

    def _write_distractors(self, model: Any, appearance: Appearance) -> None:
        geoms = self._scene.geoms(SemanticClass.DISTRACTOR)
        if appearance.distractors is not None and geoms:
            distractors = appearance.distractors.expand(1)
            model.geom_rgba[geoms, :3] = distractors.colors[0].numpy()
            model.geom_size[geoms] = distractors.sizes[0, :, None].numpy() * self._sizes[geoms]

    def _mount(self, model: Any, mounting: Mounting) -> None:
        place, attitude, angle = self._cameras
        camera = self._scene.camera(mounting.camera)
        turn = torch.as_tensor(mounting.turn, dtype=torch.float64).reshape(4)
        model.cam_pos[camera] = place[camera] + _row(mounting.offset)
        model.cam_quat[camera] = product(turn, torch.from_numpy(attitude[camera])).numpy()
        if mounting.zoom is not None:
            half = np.tan(np.radians(angle[camera]) / 2) / float(mounting.zoom)
            model.cam_fovy[camera] = np.degrees(2 * np.arctan(half))

    def _write_sky(self, model: Any, appearance: Appearance, exposure: float) -> int:
        sky = appearance.colors[SemanticClass.SKY]
        horizon, zenith = _row(sky), _row(sky if appearance.zenith is None else appearance.zenith)
        colors = (np.clip(color * exposure, 0.0, 1.0) for color in (horizon, zenith))
        return self._write(model, "sky", sky_sides(_SIDE, *colors))

    def _write_class(self, model: Any, semantic_class: SemanticClass, cover: Texture | None) -> int:
        name, geoms = _TEXTURED[semantic_class], self._scene.geoms(semantic_class)
        chosen = -1 if cover is None else int(cover.choice)
        image = None if cover is None or chosen < 0 else textures.load(cover.images[chosen])
        tile = 1.0 if cover is None else float(cover.size)
        number = self._scene.model.material(name).id
        model.geom_matid[geoms] = number
        if semantic_class is SemanticClass.GROUND:
            model.mat_texrepeat[number] = 1.0 / tile
            return self._write(model, name, flat(image, _SIDE))
        if image is None or not geoms:
            return self._write(model, name, np.full((6, _SIDE, _SIDE, 3), 255, np.uint8))
        return self._write(model, name, box_sides(_SIDE, image, self._sizes[geoms[0]], tile))

    def _write(self, model: Any, name: str, texels: NDArray[np.uint8]) -> int:
        number = self._scene.model.texture(name).id
        start = model.tex_adr[number]
        model.tex_data[start : start + texels.size] = texels.reshape(-1)
        return number


def apply_fog(
    image: NDArray[np.uint8], depth: NDArray, appearance: Appearance, fovy: float, sky: float
) -> NDArray[np.uint8]:
    """Blend an image in clear air, shape (height, width, 3), with fog; the sky stays clear.

    Depth is in metres along the camera's axis, shape (height, width). `fovy` is the vertical field
    of view in degrees, `sky` the distance in metres at which the sky begins.
    """
    visibility = float(np.inf if appearance.fog_visibility is None else appearance.fog_visibility)
    if visibility == np.inf:
        return image
    height, width = depth.shape
    half = np.tan(np.radians(fovy) / 2)
    down = ((np.arange(height) + 0.5) / height * 2 - 1) * half
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * half * width / height
    distance = depth * np.sqrt(1 + across[None, :] ** 2 + down[:, None] ** 2)
    clear = np.where(distance < sky, 0.05 ** (distance / visibility), 1.0)[..., None]
    exposure = 1.0 if appearance.exposure is None else float(appearance.exposure)
    horizon = 255.0 * np.clip(_row(appearance.colors[SemanticClass.SKY]) * exposure, 0.0, 1.0)
    return (clear * image + (1 - clear) * horizon).astype(np.uint8)


def sky_sides(side: int, horizon: NDArray, zenith: NDArray) -> NDArray[np.uint8]:
    """Return a cube map of a sky that blends two colors by the sine of the elevation; +y is up.

    Colors are in [0, 1], that of the horizon also below it. Shape: (6, side, side, 3).
    """
    points = _points(side)
    up = np.clip(points[..., 1:2] / np.linalg.norm(points, axis=-1, keepdims=True), 0.0, 1.0)
    colors = horizon + up * (zenith - horizon)
    return np.clip(np.round(colors * 255.0), 0, 255).astype(np.uint8)


def box_sides(side: int, image: NDArray[np.uint8], half: NDArray, tile: float) -> NDArray:
    """Return a cube map of a textured box, tiled from the middle of each side as by the ray tracer.

    The texture has shape (texels, texels, 3), a power of 2 of them. The box's half extents and
    the edge of a tile are in metres. Shape: (6, side, side, 3), uint8.
    """
    sides = []
    for number, at in enumerate(_points(side) * half):
        across, upward = _TEXTURE_AXES[number // 2]
        level = _mip_level(image, 2 * max(half[across], half[upward]) / side / tile)
        count = len(level)
        column = np.floor(at[..., across] / tile * count).astype(int) % count
        row = np.floor(-at[..., upward] / tile * count).astype(int) % count
        sides.append(level[row, column])
    return np.stack(sides)


def flat(image: NDArray[np.uint8] | None, side: int) -> NDArray[np.uint8]:
    """Return a texture at another size; white if there is none. Shape: (side, side, 3)."""
    if image is None:
        return np.full((side, side, 3), 255, np.uint8)
    at = np.arange(side) * len(image) // side
    return image[at[:, None], at[None, :]]


def _points(side: int) -> NDArray[np.float64]:
    """Positions of texels on a cube from -1 to 1. Shape: (6, side, side, 3)."""
    at = (np.arange(side) + 0.5) / side * 2 - 1
    across, down = at[None, None, :, None], at[None, :, None, None]
    return _OUT[:, None, None] + across * _RIGHT[:, None, None] + down * _DOWN[:, None, None]


def _mip_level(image: NDArray[np.uint8], size: float) -> NDArray[np.uint8]:
    """The coarsest mip level whose texels are at most `size` tiles large."""
    rows, side = textures.levels(image), len(image)
    start = 0
    while side > 1 and 2.0 / side <= size:
        start, side = start + side * side, side // 2
    return rows[start : start + side * side].reshape(side, side, 3)


def _row(value: Any) -> NDArray[np.float64]:
    """Three numbers of one environment."""
    return torch.as_tensor(value, dtype=torch.float64).reshape(3).numpy()
