"""Appearance of scenes of any geoms for the kernels: materials, textures, lights and sky."""

import copy
import fnmatch
import functools
import math
from collections.abc import Iterator
from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.rendering.appearance import (
    AMBIENT,
    SUN,
    Appearance,
    Colors,
    Texture,
    expand_color,
    expand_scalar,
)
from drone_rl.sim.rendering.raytrace import light_kernel as kernel
from drone_rl.sim.rendering.raytrace.materials import EXTINCTION
from drone_rl.sim.rendering.raytrace.scene import Frames
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME
from drone_rl.sim.rendering.raytrace.surfaces import make_surfaces
from drone_rl.sim.rendering.raytrace.surfaces_kernel import TILED
from drone_rl.sim.rendering.raytrace.texels import make_textures
from drone_rl.sim.rendering.raytrace.texels_kernel import Textures
from drone_rl.sim.rendering.scene import Headlight, Scene, SemanticClass
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_ALL_AROUND = -2.0
"""Cosine below that of any angle."""
_OWN_SKY = (-1.0, 0.0, 0.0)
"""Color that stands for the skybox."""
_HAZE = (0.62, 0.74, 0.92)
"""Color of fog in front of a skybox: that of the tasks' own sky."""
_COVER = ("texture", "mapping", "scale")
"""Fields of `Surfaces` that an appearance changes, next to colors."""

_CORNERS = 1024
"""Corners whose colors are kept while an image is made: a power of 2."""


class LookEncoder:
    """Encodes a scene's own materials and lights, and appearances that differ from them.

    The last appearance is cached by identity; each set of textures is read once.
    """

    def __init__(self, scene: Scene, frames: Frames, workers: int) -> None:
        """Read a scene for up to `workers` images at the same time."""
        self._scene = scene
        self._lights, self._lamps = _make_lights(scene, frames)
        self._skies = _skies(scene.model, frames)
        self._own = kernel.Look()
        self._surfaces = make_surfaces(scene)
        self._values = {
            "color": torch.tensor(scene.colors)[None],
            **{name: wp.to_torch(getattr(self._surfaces, name)) for name in _COVER},
        }
        kind: Any = kernel.PlacedLight
        self._placed: Any = wp.empty((workers, len(self._lights)), dtype=kind, device="cpu")
        groups = 1 + int(kernel.MOST_LIGHTS)
        sizes = {
            "keys": (_CORNERS, wp.vec4i),
            "known": (_CORNERS * groups, wp.vec3),
            "lit": (groups, wp.vec3),
            "slopes": (2 * 6 * groups, wp.vec3),
        }
        self._corners = {
            name: wp.empty((workers, size), dtype=kind, device="cpu")
            for name, (size, kind) in sizes.items()
        }
        self._textures = functools.cache(functools.partial(_load_textures, scene))
        plain = self._encode(Appearance(), 1)
        self._last: tuple[Appearance | None, int, kernel.Look] = (None, 0, plain)
        self._own = plain

    def encode(self, appearance: Appearance | None, num_envs: int) -> kernel.Look:
        """Return what the kernels need to shade a batch."""
        if appearance is None:
            return self._own
        if self._last[0] is not appearance or self._last[1] != num_envs:
            self._last = (appearance, num_envs, self._encode(appearance, num_envs))
        return self._last[2]

    def _encode(self, appearance: Appearance, num_envs: int) -> kernel.Look:
        look: Any = kernel.Look()
        covers = [*appearance.textures.values()]
        covers += [one.texture for one in appearance.objects.values() if one.texture is not None]
        names = tuple({name: 0 for cover in covers for name in cover.images})
        look.lighting = self._lighting(appearance, num_envs)
        look.surfaces = self._paint(appearance, num_envs, names)
        look.textures, look.placed = self._textures(names), self._placed
        for name, values in self._corners.items():
            setattr(look, name, values)
        return look

    def _paint(
        self, appearance: Appearance, num_envs: int, names: tuple[str, ...]
    ) -> kernel.Surfaces:
        """Return the surfaces with the colors and textures of an appearance."""
        values = {n: v.repeat(num_envs, *[1] * (v.dim() - 1)) for n, v in self._values.items()}
        first = self._scene.model.ntex
        for geoms, color, texture in self._changes(appearance):
            if color is not None:
                values["color"][:, geoms, :3] = expand_color(color, num_envs).cpu()[:, None].float()
            if texture is not None:
                number = torch.tensor([first + names.index(name) for name in texture.images] + [-1])
                choice = number[expand_scalar(texture.choice, num_envs).long().cpu()]
                tiles = 1.0 / expand_scalar(texture.size, num_envs).cpu().float()
                values["texture"][:, geoms] = choice[:, None].int()
                values["mapping"][:, geoms] = int(TILED)
                values["scale"][:, geoms] = tiles[:, None, None].expand(-1, len(geoms), 3)
        if appearance.distractors is not None:
            colors = appearance.distractors.expand(num_envs).colors.float().cpu()
            values["color"][:, self._scene.geoms(SemanticClass.DISTRACTOR), :3] = colors
        made: Any = copy.copy(self._surfaces)
        for name, value in values.items():
            kinds: dict[str, Any] = {"color": wp.vec4, "scale": wp.vec3}
            setattr(made, name, wp.from_torch(value.contiguous(), dtype=kinds.get(name)))
        return made

    def _changes(
        self, appearance: Appearance
    ) -> Iterator[tuple[list[int], Colors | None, Texture | None]]:
        """Yield geoms with the colors and textures that they get, one after the other."""
        for of, color in appearance.colors.items():
            if of is not SemanticClass.SKY:
                yield self._scene.geoms(of), color, None
        for of, texture in appearance.textures.items():
            yield self._scene.geoms(of), None, texture
        for name, one in appearance.objects.items():
            yield find_objects(self._scene, name), one.color, one.texture

    def _lighting(self, appearance: Appearance, num_envs: int) -> kernel.Lighting:
        """Return lights, fog and sky in an appearance."""
        lamps = {n: v.repeat(num_envs, 1, 1) for n, v in self._lamps.items()}
        given = appearance.lights(num_envs)
        if "ambient" in given:
            lamps["ambient"] *= given["ambient"].cpu()[:, None] / AMBIENT
        for name in ("diffuse", "specular"):
            if "sun" in given:
                lamps[name] *= given["sun"].cpu()[:, None] / SUN
        for name, lamp in appearance.lamps.items():
            factor = expand_color(lamp.color, num_envs).cpu()[:, None]
            for values in lamps.values():
                values[:, find_lights(self._scene, name)] *= factor
        sky = appearance.colors.get(SemanticClass.SKY)
        own = self._scene.sky if any(self._scene.sky) else _OWN_SKY
        horizon = expand_color(own if sky is None else sky, num_envs).cpu()
        zenith = appearance.zenith
        visibility = math.inf if appearance.fog_visibility is None else appearance.fog_visibility
        haze = horizon if horizon[0, 0] >= 0 else expand_color(_HAZE, num_envs)
        shadows = 1.0 if appearance.shadows is None else appearance.shadows
        exposure = 1.0 if appearance.exposure is None else appearance.exposure
        vectors = {
            **lamps,
            "horizon": horizon,
            "zenith": horizon if zenith is None else expand_color(zenith, num_envs).cpu(),
            "sun": given.get("sun_direction", torch.zeros(1, 3)).cpu(),
            "haze": haze,
        }
        numbers = {
            "shadows": expand_scalar(shadows, num_envs).int(),
            "extinction": (EXTINCTION / expand_scalar(visibility, num_envs)).float(),
            "exposure": expand_scalar(exposure, num_envs).float(),
        }
        made: Any = kernel.Lighting()
        made.lights, made.skies = self._lights, self._skies
        for name, value in vectors.items():
            setattr(made, name, wp.from_torch(value.float().contiguous(), dtype=wp.vec3))
        for name, value in numbers.items():
            setattr(made, name, wp.from_torch(value.cpu().contiguous()))
        return made


def find_objects(scene: Scene, pattern: str) -> list[int]:
    """Return the geoms of a scene file whose name, body or material fits a pattern with *.

    Raises:
        InputError: There are none.
    """
    model = scene.model
    names: dict[str, list[int]] = {}
    drone = scene.geoms(SemanticClass.DRONE)
    for geom in {*range(model.ngeom)}.difference(drone):
        body = model.geom_bodyid[geom]
        own = [model.geom(geom).name]
        if model.geom_matid[geom] >= 0:
            own.append(model.mat(model.geom_matid[geom]).name)
        while body > 0:
            own.append(model.body(body).name)
            body = model.body_parentid[body]
        for name in own:
            names.setdefault(_short(name), []).append(geom)
    return _matching(pattern, names, "objects")


def find_lights(scene: Scene, pattern: str) -> list[int]:
    """Return the lights of a scene file, as encoded, whose names fit; see `find_objects`.

    Headlights have the name headlight.
    """
    model = scene.model
    names: dict[str, list[int]] = {}
    for number, light in enumerate(_light_numbers(scene)):
        name = "headlight" if light < 0 else _short(model.light(light).name)
        names.setdefault(name, []).append(number)
    return _matching(pattern, names, "lights")


def _short(name: str) -> str:
    """Return a name without that of the scene before it."""
    return name.rpartition("/")[2]


def _matching(pattern: str, names: dict[str, list[int]], kind: str) -> list[int]:
    found = sorted({i for name in fnmatch.filter(names, pattern) if name for i in names[name]})
    if not found:
        known = ", ".join(sorted(filter(None, names))) or "none"
        raise InputError(
            f"appearance.{kind}: {pattern!r} names nothing in the scene; names there: {known}"
        )
    return found


def _load_textures(scene: Scene, names: tuple[str, ...]) -> Textures:
    return make_textures(scene, names)


def _light_numbers(scene: Scene) -> list[int]:
    """Return the lights that are on, and before them -1 - k for headlight k."""
    model = scene.model
    on = (model.light_active != 0) & (model.light_type != mujoco.mjtLightType.mjLIGHT_IMAGE)
    return [~k for k in range(len(scene.headlights))] + np.flatnonzero(on).tolist()


def _make_lights(scene: Scene, frames: Frames) -> tuple[Any, dict[str, Tensor]]:
    """Return the lights for the kernels, and their colors, (1, num_lights, 3), by name."""
    numbers, suns, lights = _light_numbers(scene), set[int](), []
    model, heads = scene.model, scene.headlights
    for number in numbers:
        light = _headlight(heads[~number]) if number < 0 else _make_light(model, number, frames)
        if number >= 0 and light.kind == kernel.DIRECTIONAL and light.frame not in suns:
            suns.add(light.frame)
            light.is_sun = 1
        lights.append(light)
    colors = {}
    for name in ("ambient", "diffuse", "specular"):
        stored, own = getattr(model, f"light_{name}"), [getattr(head, name) for head in heads]
        rows = [own[~number] if number < 0 else stored[number] for number in numbers]
        colors[name] = torch.tensor(np.array(rows, float).reshape(1, -1, 3))
    kind: Any = kernel.Light
    return wp.array(lights, dtype=kind, device="cpu"), colors


def _headlight(head: Headlight) -> Any:
    light: Any = kernel.Light()
    light.kind, light.is_head = kernel.DIRECTIONAL, 1
    light.frame = kernel.CAMERA_FRAME if head.prop < 0 else DRONE_FRAME + 1 + head.prop
    light.direction, light.range = wp.vec3(0.0, 0.0, -1.0), math.inf
    return light


def _skies(model: Any, frames: Frames) -> Any:
    """Return each skybox, and the frame of the scene file that it belongs to."""
    skies = []
    for texture in np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX).tolist():
        scene, slash, _ = model.tex(texture).name.rpartition("/")
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, scene + slash) if slash else 0
        skies.append((texture, frames.frame_of(max(body, 0))))
    return wp.array(skies, dtype=wp.vec2i, device="cpu")


def _make_light(model: Any, number: int, frames: Frames) -> Any:
    light: Any = kernel.Light()
    frame, position, direction = frames.place_light(number)
    light.kind, light.frame = int(model.light_type[number]), frame
    light.position, light.direction = wp.vec3(position), wp.vec3(direction)
    light.attenuation = wp.vec3(model.light_attenuation[number])
    cutoff = float(model.light_cutoff[number])
    is_spot = light.kind == kernel.SPOT and cutoff <= 90.0
    light.least_cosine = math.cos(math.radians(cutoff)) if is_spot else _ALL_AROUND
    light.exponent = float(model.light_exponent[number])
    is_point = light.kind == kernel.POINT
    light.range = float(model.light_range[number]) if is_point else math.inf
    light.casts = int(model.light_castshadow[number])
    return light
