# pyright: reportAttributeAccessIssue=false
# pyright: reportOptionalMemberAccess=false
# pyright: reportReturnType=false
# (dm_control's models of XML are untyped.)
"""The drone: a body with five cameras. How it moves is not its business."""

from dm_control import composer, mjcf
from dm_control.composer.observation import observable
from dm_control.mujoco import engine

from drone_rl.config import CameraSettings
from drone_rl.sim.entities import cameras
from drone_rl.sim.rendering.semantics import Meaning

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

    meaning = Meaning.DRONE

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
        for spec in cameras.DRONE_CAMERAS:
            cameras.add_camera(self._body, spec, camera.vertical_fov)
        cameras.add_camera(self._body, cameras.CHASE, vertical_fov=60.0)

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
        return self._mjcf_root.find("camera", cameras.FRONT_CENTER.name)


def hide_drone() -> engine.wrapper.MjvOption:
    """Scene options of the drone's own cameras: its body is left out, as in AirSim's CV mode."""
    option = engine.wrapper.MjvOption()
    option.geomgroup[BODY_GROUP] = 0
    return option
