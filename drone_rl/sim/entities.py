# pyright: reportReturnType=false
# (dm_control's models of XML are untyped.)
"""The drone's five cameras, by AirSim's names, and the chase camera that films it."""

from typing import NamedTuple

from dm_control import composer, mjcf
from dm_control.composer.observation import observable
from dm_control.mujoco import engine

from drone_rl.config import CameraSettings
from drone_rl.config.camera import FRONT
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.utils.errors import InputError


class CameraSpec(NamedTuple):
    """Where a camera sits on the drone. Metres, drone frame: x forward, y left, z up."""

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

CHASE = CameraSpec("chase", (-7.0, 0, 3.5), (0, -1, 0, 0.34, 0, 0.94))


def find_camera(name: str | int) -> CameraSpec:
    """A camera by AirSim's name or number.

    Args:
        name: Such as "back_center", "4" or 4; "" and "fpv" are the one in front.

    Raises:
        InputError: There is none.
    """
    if name in ("", "fpv"):
        return FRONT_CENTER
    for number, spec in enumerate(DRONE_CAMERAS):
        if str(name) in (spec.name, str(number)):
            return spec
    names = ", ".join(f"{spec.name} ({i})" for i, spec in enumerate(DRONE_CAMERAS))
    raise InputError(f"camera {name!r} is unknown; choose from: {names}")


def add_camera(body: mjcf.Element, spec: CameraSpec, vertical_fov: float) -> mjcf.Element:
    """Adds a camera to a body.

    Args:
        body: The MJCF body that carries it.
        spec: Its name and place.
        vertical_fov: Vertical field of view in degrees.
    """
    return body.add("camera", **spec._asdict(), fovy=vertical_fov)


SKY_COLOR = (0.62, 0.74, 0.92)
"""Red, green, blue of everything that is neither floor, cube nor drone."""
FLOOR_COLOR = (0.5, 0.54, 0.48)
FLOOR_SIZE = (300.0, 300.0, 100.0)
"""Half extents in metres and the spacing of OpenGL's grid: coarse is 20 times faster there."""
DRAW_DISTANCE = 200.0
"""Metres beyond which nothing is drawn."""


class Field(composer.Arena):
    """A flat floor under an even sky, lit by one sun."""

    semantic_class = SemanticClass.GROUND

    def _build(self, name: str = "field") -> None:
        super()._build(name=name)
        root = self._mjcf_root
        root.statistic.extent = 1.0
        root.visual.map.set_attributes(znear=0.05, zfar=DRAW_DISTANCE)
        root.visual.headlight.active = 0
        root.visual.quality.shadowsize = 2048
        root.visual.rgba.haze = (*SKY_COLOR, 1.0)
        sky = {"rgb1": SKY_COLOR, "rgb2": SKY_COLOR, "width": 8, "height": 48}
        root.asset.add("texture", name="sky", type="skybox", builtin="flat", **sky)
        root.worldbody.add(
            "geom", name="floor", type="plane", size=FLOOR_SIZE, rgba=(*FLOOR_COLOR, 1.0)
        )
        root.worldbody.add(
            "light",
            name="sun",
            directional=True,
            pos=(0, 0, 50),
            dir=(0.35, -0.45, -0.82),
            ambient=(0.35,) * 3,
            diffuse=(0.75,) * 3,
            specular=(0, 0, 0),
            castshadow=False,
        )


class Cube(composer.Entity):
    """A cube that is seen but never pushes: touching is a rule, not a contact."""

    semantic_class = SemanticClass.TARGET

    def _build(self, size: float, color: tuple[float, float, float], name: str = "cube") -> None:
        """Makes the cube.

        Args:
            size: Edge in metres.
            color: Red, green, blue in [0, 1].
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type="box",
            size=(size / 2,) * 3,
            rgba=(*color, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """The cube's MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """The visible box."""
        return self._geom


class Pillar(composer.Entity):
    """An upright box that is seen but never pushes back: touching it is a rule, not a contact."""

    semantic_class = SemanticClass.OBSTACLE

    def _build(
        self,
        width: float,
        height: float,
        color: tuple[float, float, float],
        name: str = "pillar",
    ) -> None:
        """Makes the pillar; its frame is in its middle.

        Args:
            width: Edge of its square cross-section, metres.
            height: Metres.
            color: Red, green, blue in [0, 1].
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type="box",
            size=(width / 2, width / 2, height / 2),
            rgba=(*color, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """The pillar's MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """The visible box."""
        return self._geom


KINDS = ("box", "sphere", "cylinder")
"""Of all that there are in a world, in turn."""


class Distractor(composer.Entity):
    """A box, a ball or a cylinder of 1 m, seen but never touched; worlds make it larger."""

    semantic_class = SemanticClass.DISTRACTOR

    def _build(self, kind: str, name: str = "distractor") -> None:
        """Makes one.

        Args:
            kind: One of `KINDS`.
            name: Prefix of its elements in the arena's model.
        """
        self._mjcf_root = mjcf.RootElement(model=name)
        self._geom = self._mjcf_root.worldbody.add(
            "geom",
            name="geom",
            type=kind,
            size=(0.5,) * 3,
            rgba=(0.6, 0.6, 0.6, 1.0),
            contype=0,
            conaffinity=0,
        )

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """Its MJCF root."""
        return self._mjcf_root

    @property
    def geom(self) -> mjcf.Element:
        """What is seen of it."""
        return self._geom


def make_distractors(count: int) -> list[Distractor]:
    """So many, of all kinds in turn."""
    kinds = (KINDS[i % len(KINDS)] for i in range(count))
    return [Distractor(kind, name=f"distractor_{i}") for i, kind in enumerate(kinds)]


BODY_GROUP = 1
"""Geom group of the drone's own body: filmed by the chase camera, unseen by its own cameras."""
_DARK, _LIGHT = (0.12, 0.13, 0.16, 1.0), (0.85, 0.86, 0.9, 1.0)
_MASS_KG = 1.0


class DroneObservables(composer.Observables):
    """What the drone can observe. All are disabled until a task enables them."""

    @composer.observable
    def position(self) -> observable.MJCFFeature:
        """Position in metres, world frame. Shape: (3,)."""
        return observable.MJCFFeature("xpos", self._entity.body)

    @composer.observable
    def orientation(self) -> observable.MJCFFeature:
        """Attitude quaternion (w, x, y, z), world frame. Shape: (4,)."""
        return observable.MJCFFeature("xquat", self._entity.body)

    @composer.observable
    def front_center(self) -> observable.MJCFCamera:
        """RGB picture of the policy's camera. Shape: (height, width, 3), uint8."""
        camera = self._entity.camera_settings
        return observable.MJCFCamera(
            self._entity.front_center,
            height=camera.height,
            width=camera.width,
            scene_option=hide_drone(),
        )


class Drone(composer.Entity):
    """A quadrotor's shape with AirSim's five cameras."""

    semantic_class = SemanticClass.DRONE

    def _build(self, size: float, camera: CameraSettings, name: str = "drone") -> None:
        """Makes the drone.

        Args:
            size: Edge in metres of the box around it.
            camera: Field of view and picture size of its cameras.
            name: Prefix of its elements in the arena's model.
        """
        self.camera_settings = camera
        self._mjcf_root = mjcf.RootElement(model=name)
        self._body = self._mjcf_root.worldbody.add("body", name="body")
        visual = {"group": BODY_GROUP, "contype": 0, "conaffinity": 0, "mass": 0.0}
        hull = (size * 0.3, size * 0.18, size * 0.1)
        self._body.add(
            "geom", name="hull", type="box", size=hull, rgba=_LIGHT, **{**visual, "mass": _MASS_KG}
        )
        for x in (-1, 1):
            for y in (-1, 1):
                self._body.add(
                    "geom",
                    name=f"rotor_{'front' if x > 0 else 'rear'}_{'left' if y > 0 else 'right'}",
                    type="cylinder",
                    pos=(x * size * 0.3, y * size * 0.3, size * 0.12),
                    size=(size * 0.2, size * 0.02),
                    rgba=_DARK,
                    **visual,
                )
        for spec in DRONE_CAMERAS:
            add_camera(self._body, spec, camera.vertical_fov)
        add_camera(self._body, CHASE, vertical_fov=60.0)

    def _build_observables(self) -> DroneObservables:
        return DroneObservables(self)

    @property
    def mjcf_model(self) -> mjcf.RootElement:
        """The drone's MJCF root."""
        return self._mjcf_root

    @property
    def body(self) -> mjcf.Element:
        """The rigid body."""
        return self._body

    @property
    def front_center(self) -> mjcf.Element:
        """The policy's camera."""
        return self._mjcf_root.find("camera", FRONT_CENTER.name)


def hide_drone() -> engine.wrapper.MjvOption:
    """Scene options of the drone's own cameras: its body is left out, as in AirSim's CV mode."""
    option = engine.wrapper.MjvOption()
    option.geomgroup[BODY_GROUP] = 0
    return option
