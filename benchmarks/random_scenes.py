# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Scenes that nobody has arranged: solids of all kinds, sizes and attitudes, seen from anywhere."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.rendering import Scene
from drone_rl.sim.rendering.scene import SemanticClass

CAMERA = "camera"
NUDGED = ("left", "right", "up", "down")
"""Cameras in the same place, turned a little."""
_TURNS = ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
NEAR, FAR = 0.02, 60.0
"""Metres along the axis within which OpenGL draws."""
SLICES = 400
"""Of OpenGL's round solids: of 1.5 m radius, they are flatter than 0.05 mm."""
_XML = f"""<mujoco>
<statistic extent="1"/>
<visual>
  <headlight active="0"/>
  <map znear="{NEAR}" zfar="{FAR}"/>
  <quality offsamples="0" shadowsize="0" numslices="{SLICES}" numstacks="{SLICES}"/>
  <global offwidth="1024" offheight="1024"/>
</visual>
<worldbody>
  <light directional="true" dir="0 0 -1" ambient=".3 .3 .3" diffuse=".7 .7 .7" specular="0 0 0"
    castshadow="false"/>
  <geom type="plane" size="25 25 10" pos="0 0 -3.5"/>
  <geom type="plane" size="8 8 10" pos="1 2 3" euler="10 20 30"/>
  <geom type="plane" size="0.9 0.5 10" pos="1 2 3" euler="10 20 30"/>
  {'<geom type="sphere" size="1 1 1" pos="1 2 3" euler="10 20 30"/>' * 8}
  {"".join(f'<camera name="{name}" pos="1 2 3"/>' for name in (CAMERA, *NUDGED))}
</worldbody></mujoco>"""
_PLANES = 3
"""The first geoms, of which OpenGL keeps the sizes that it was given first: the ground, a large
plane, a small one."""
_SOLIDS = tuple(
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX")
)


class RandomScenes:
    """One model that becomes one scene after the other."""

    def __init__(self, seed: int, nudge: float = 0.0) -> None:
        """Compiles it.

        Args:
            seed: Of the scenes.
            nudge: By how much of a picture's height other cameras see its middle elsewhere.
        """
        self.model = mujoco.MjModel.from_xml_string(_XML)
        self._nudge = nudge
        self._random = np.random.RandomState(seed)

    def draw(self) -> Scene:
        """Makes the next scene.

        In a box of 6 m eight solids and a small plane stand in and before each other, and the
        camera among them, in one of them or with one behind it. The ground lies below them, and a
        large plane passes 3 cm to 2.7 m from the camera, so that it is seen at grazing angles.
        Planes are turned so that they are seen from above: OpenGL shows them from below, too.

        Returns:
            It; the next one takes its place.
        """
        model, random = self.model, self._random
        count, solids = model.ngeom, slice(_PLANES, None)
        number = count - _PLANES
        model.geom_type[solids] = random.choice(_SOLIDS, number)
        model.geom_size[solids] = np.exp(random.uniform(np.log(0.1), np.log(1.5), (number, 3)))
        model.geom_rgba[:, :3] = random.uniform(0.0, 1.0, (count, 3))
        model.geom_pos[1:] = random.uniform(-3.0, 3.0, (count - 1, 3))
        model.geom_quat[1:] = _attitudes(random, count - 1)
        model.cam_pos[:] = random.uniform(-3.0, 3.0, 3)
        model.cam_quat[0] = _looking(model.cam_pos[0] - random.uniform(-2.0, 2.0, 3), random)
        model.cam_fovy[:] = random.uniform(30.0, 120.0)
        angle = 2 * self._nudge * np.tan(np.radians(model.cam_fovy[0]) / 2)
        for i, axis in enumerate(_TURNS, 1):
            turn = np.zeros(4)
            mujoco.mju_axisAngle2Quat(turn, np.array(axis), angle)
            mujoco.mju_mulQuat(model.cam_quat[i], model.cam_quat[0], turn)
        toward = random.normal(size=3)
        model.light_dir[0] = toward / np.linalg.norm(toward)
        model.geom_pos[1] = model.cam_pos[0] - np.exp(random.uniform(-3.5, 1.0)) * _normal(model, 1)
        if (model.cam_pos[0] - model.geom_pos[2]) @ _normal(model, 2) < 0:
            model.geom_quat[2] = model.geom_quat[2][[1, 0, 3, 2]] * [-1, 1, 1, -1]
        return Scene(model, (SemanticClass.OBSTACLE,) * count, (-1,) * count, (0.0, 0.0, 0.0))


def _attitudes(random: np.random.RandomState, count: int) -> NDArray[np.float64]:
    """Quaternions, all attitudes alike. Shape: (count, 4)."""
    drawn = random.normal(size=(count, 4))
    return drawn / np.linalg.norm(drawn, axis=1, keepdims=True)


def _looking(back: NDArray[np.float64], random: np.random.RandomState) -> NDArray[np.float64]:
    """The attitude, however rolled, of a camera that has a vector behind it. Shape: (4,)."""
    back = back / np.linalg.norm(back)
    side = np.cross(random.normal(size=3), back)
    side /= np.linalg.norm(side)
    attitude = np.zeros(4)
    axes = np.stack([side, np.cross(back, side), back], axis=1)
    mujoco.mju_mat2Quat(attitude, axes.flatten())
    return attitude


def _normal(model: mujoco.MjModel, plane: int) -> NDArray[np.float64]:
    """Of a plane, world frame."""
    normal = np.zeros(3)
    mujoco.mju_rotVecQuat(normal, np.array([0.0, 0.0, 1.0]), model.geom_quat[plane])
    return normal
