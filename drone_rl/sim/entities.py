"""Entities of a dm_control scene: the field, the drone, and what tasks add to them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from drone_rl.config import CameraSettings
from drone_rl.config.camera import FRONT
from drone_rl.sim.quiet_dm_control import composer, engine, mjcf
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.scenes import SceneFile
from drone_rl.utils.errors import InputError

SKY_COLOR = (0.62, 0.74, 0.92)
"""Red, green, blue of the background."""
FLOOR_COLOR = (0.5, 0.54, 0.48)
FLOOR_SIZE = (300.0, 300.0, 100.0)
"""Half extents in metres, and the spacing of OpenGL's grid: coarse is 20 times faster there."""
DRAW_DISTANCE = 200.0
"""Metres beyond which nothing is rendered."""
KINDS = ("box", "sphere", "cylinder")
"""Shapes of distractors, in turn."""
BODY_GROUP = 1
"""Geom group of the drone's body: the chase camera shows it, the drone's own cameras do not."""
_DARK, _LIGHT = (0.12, 0.13, 0.16, 1.0), (0.85, 0.86, 0.9, 1.0)
_MASS_KG = 1.0


class CameraSpec(NamedTuple):
    """Mounting of a camera on the drone. Metres, drone frame: x forward, y left, z up."""

    name: str
    pos: tuple[float, float, float]
    xyaxes: tuple[float, float, float, float, float, float]
    """The image's right and up axes; the camera looks along their negative cross product."""


_FORWARD = (0, -1, 0, 0, 0, 1)
FRONT_CENTER = CameraSpec("front_center", FRONT, _FORWARD)
FRONT_RIGHT = CameraSpec("front_right", (0.4, -0.25, 0), _FORWARD)
FRONT_LEFT = CameraSpec("front_left", (0.4, 0.25, 0), _FORWARD)
BOTTOM_CENTER = CameraSpec("bottom_center", (0, 0, -0.1), (0, -1, 0, 1, 0, 0))
BACK_CENTER = CameraSpec("back_center", (-0.4, 0, 0), (0, 1, 0, 0, 0, 1))
DRONE_CAMERAS = (FRONT_CENTER, FRONT_RIGHT, FRONT_LEFT, BOTTOM_CENTER, BACK_CENTER)
"""In the order of AirSim's camera numbers 0 to 4."""
CARRIER = 4 * FRONT_CENTER.pos[0]
"""Size in metres of a drone within whose ball all cameras are, the front one half way."""
CHASE = CameraSpec("chase", (-7.0, 0, 3.5), (0, -1, 0, 0.34, 0, 0.94))


def find_camera(name: str | int) -> CameraSpec:
    """Return a camera by AirSim's name or number; "" and "fpv" mean the front camera.

    Raises an `InputError` if there is no such camera.
    """
    if name in ("", "fpv"):
        return FRONT_CENTER
    for number, spec in enumerate(DRONE_CAMERAS):
        if str(name) in (spec.name, str(number)):
            return spec
    names = ", ".join(f"{spec.name} ({i})" for i, spec in enumerate(DRONE_CAMERAS))
    raise InputError(f"camera {name!r} is unknown; choose from: {names}")


def add_camera(body: Any, spec: CameraSpec, vertical_fov: float) -> Any:
    """Add a camera to an MJCF body; the vertical field of view is in degrees."""
    return body.add("camera", **spec._asdict(), fovy=vertical_fov)


class Field(composer.Arena):
    """A flat floor under a uniform sky and one sun, or what scene files put there instead."""

    semantic_class = SemanticClass.GROUND

    def _build(self, scenes: Sequence[SceneFile] = (), name: str = "field") -> None:
        """Make the arena; that of scene files has a headlight and a draw distance alone.

        The headlight is the first one's, which OpenGL shows in all; see `Scene.headlights`.
        """
        super()._build(name=name)
        root: Any = self._mjcf_root
        root.statistic.extent = 1.0
        if scenes:
            vis = scenes[0].model.vis
            near, far = (
                [float(getattr(of.model.vis.map, name) * of.model.stat.extent) for of in scenes]
                for name in ("znear", "zfar")
            )
            root.visual.map.set_attributes(znear=min(0.05, *near), zfar=max(far))
            root.visual.headlight.set_attributes(
                active=vis.headlight.active,
                ambient=vis.headlight.ambient,
                diffuse=vis.headlight.diffuse,
                specular=vis.headlight.specular,
            )
            return
        root.visual.map.set_attributes(znear=0.05, zfar=DRAW_DISTANCE)
        root.visual.headlight.active = 0
        root.visual.quality.shadowsize = 2048
        root.visual.rgba.haze = (*SKY_COLOR, 1.0)
        sky = {"rgb1": SKY_COLOR, "rgb2": SKY_COLOR, "width": 8, "height": 48}
        root.asset.add("texture", name="sky", type="skybox", builtin="flat", **sky)
        floor = {"type": "plane", "size": FLOOR_SIZE, "rgba": (*FLOOR_COLOR, 1.0)}
        root.worldbody.add("geom", name="floor", **floor)
        sun = {"directional": True, "pos": (0, 0, 50), "dir": (0.35, -0.45, -0.82)}
        light = {"ambient": (0.35,) * 3, "diffuse": (0.75,) * 3, "specular": (0, 0, 0)}
        root.worldbody.add("light", name="sun", castshadow=False, **sun, **light)


class SceneEntity(composer.Entity):
    """A scene file, or a body of it; its frame is the file's."""

    semantic_class: SemanticClass

    def _build(
        self,
        scene: SceneFile,
        name: str = "scene",
        semantic_class: SemanticClass = SemanticClass.OBSTACLE,
    ) -> None:
        self.semantic_class = semantic_class
        root: Any = mjcf.from_xml_string(
            scene.mjcf, escape_separators=True, assets=dict(scene.assets)
        )
        root.model, self.file = name, scene.model
        for section in ("option", "statistic", "visual", "size"):  # those of the field apply
            getattr(root, section).remove()
        self._mjcf_root = root

    @property
    def mjcf_model(self) -> Any:
        """The `mjcf.RootElement`."""
        return self._mjcf_root


class VisualEntity(composer.Entity):
    """One geom, by default without contacts; `_build` of a subclass adds it."""

    semantic_class: SemanticClass

    def _add_geom(
        self, kind: str, size: tuple[float, ...], color: tuple[float, float, float], name: str
    ) -> None:
        self._mjcf_root: Any = mjcf.RootElement(model=name)
        shape = {"type": kind, "size": size, "rgba": (*color, 1.0)}
        self.geom: Any = self._mjcf_root.worldbody.add(
            "geom", name="geom", contype=0, conaffinity=0, **shape
        )

    @property
    def mjcf_model(self) -> Any:
        """The `mjcf.RootElement`."""
        return self._mjcf_root


class Cube(VisualEntity):
    """A cube to collect, with an edge in metres."""

    semantic_class = SemanticClass.TARGET

    def _build(self, size: float, color: tuple[float, float, float], name: str = "cube") -> None:
        self._add_geom("box", (size / 2,) * 3, color, name)


class Pillar(VisualEntity):
    """An upright box to avoid, with a square cross-section; its frame is at its centre. Metres."""

    semantic_class = SemanticClass.OBSTACLE

    def _build(
        self, width: float, height: float, color: tuple[float, float, float], name: str = "pillar"
    ) -> None:
        self._add_geom("box", (width / 2, width / 2, height / 2), color, name)


class Distractor(VisualEntity):
    """A box, ball or cylinder of 1 m, which appearances scale and color; one of `KINDS`."""

    semantic_class = SemanticClass.DISTRACTOR

    def _build(self, kind: str, name: str = "distractor") -> None:
        self._add_geom(kind, (0.5,) * 3, (0.6, 0.6, 0.6), name)


def make_distractors(count: int) -> list[Distractor]:
    """Return distractors of all kinds in turn."""
    kinds = (KINDS[i % len(KINDS)] for i in range(count))
    return [Distractor(kind, name=f"distractor_{i}") for i, kind in enumerate(kinds)]


class DroneEntity(composer.Entity):
    """A quadrotor's shape with AirSim's five cameras and a chase camera; dynamics move it."""

    semantic_class = SemanticClass.DRONE

    def _build(
        self, size: float, camera: CameraSettings, mount: float = 1.0, name: str = "drone"
    ) -> None:
        """Make the drone, with a bounding box of so many metres, and its cameras.

        The cameras are at `mount` times their distances from the centre.
        """
        self._mjcf_root: Any = mjcf.RootElement(model=name)
        self.body: Any = self._mjcf_root.worldbody.add("body", name="body")
        visual = {"group": BODY_GROUP, "contype": 0, "conaffinity": 0}
        hull = {"size": (size * 0.3, size * 0.18, size * 0.1), "mass": _MASS_KG, **visual}
        self.body.add("geom", name="hull", type="box", rgba=_LIGHT, **hull)
        rotor = {"size": (size * 0.2, size * 0.02), "mass": 0.0, **visual}
        for x, end in ((-1, "rear"), (1, "front")):
            for y, side in ((-1, "right"), (1, "left")):
                place = (x * size * 0.3, y * size * 0.3, size * 0.12)
                rotor_place = {"name": f"rotor_{end}_{side}", "pos": place, "rgba": _DARK, **rotor}
                self.body.add("geom", type="cylinder", **rotor_place)
        fields = dict.fromkeys(DRONE_CAMERAS, camera.vertical_fov)
        for spec, vertical_fov in {**fields, CHASE: 60.0}.items():
            x, y, z = spec.pos
            place = spec._replace(pos=(mount * x, mount * y, mount * z))
            add_camera(self.body, place, vertical_fov)

    @property
    def mjcf_model(self) -> Any:
        """The `mjcf.RootElement`."""
        return self._mjcf_root

    @property
    def front_center(self) -> Any:
        """The policy's camera, an `mjcf.Element`."""
        return self._mjcf_root.find("camera", FRONT_CENTER.name)


def hide_drone() -> engine.wrapper.MjvOption:
    """Return scene options that hide the drone's body, as in AirSim's computer-vision mode."""
    option: Any = engine.wrapper.MjvOption()
    option.geomgroup[BODY_GROUP] = 0
    return option
