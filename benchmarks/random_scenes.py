# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled bindings are untyped.)
"""Random scenes: solids of all kinds, sizes and orientations, and a random camera."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.rendering import Scene
from drone_rl.sim.rendering.scene import SemanticClass

CAMERA = "camera"
NUDGED = ("left", "right", "up", "down")
"""Cameras at the same position, slightly rotated."""
_TURNS = ((0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
NEAR, FAR = 0.02, 60.0
"""Near and far plane of OpenGL, metres."""
SLICES = 400
"""Slices of OpenGL's round solids; with a radius of 1.5 m their facets are within 0.05 mm."""
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
"""The first geoms: the ground, a large plane and a small one. OpenGL keeps their initial sizes."""
_SOLIDS = tuple(
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX")
)


class RandomScenes:
    """A model that is changed into one random scene after the other."""

    def __init__(self, seed: int, nudge: float = 0.0) -> None:
        """Compile the model.

        Args:
            seed: Seed of the scenes.
            nudge: Image shift of the rotated cameras as a fraction of the image height.
        """
        self.model = mujoco.MjModel.from_xml_string(_XML)
        self._nudge = nudge
        self._random = np.random.RandomState(seed)

    def sample(self) -> Scene:
        """Sample the next scene, which replaces the previous one.

        Eight solids and a small plane are in a cube of 6 m and can intersect and occlude each
        other. The camera is among them and can be inside one. The ground is below them. A large
        plane is 3 cm to 2.7 m from the camera, so that it appears at grazing angles. Planes are
        oriented so that the camera sees their front, because OpenGL renders the back, too.
        """
        model, random = self.model, self._random
        count, solids = model.ngeom, slice(_PLANES, None)
        number = count - _PLANES
        model.geom_type[solids] = random.choice(_SOLIDS, number)
        model.geom_size[solids] = np.exp(random.uniform(np.log(0.1), np.log(1.5), (number, 3)))
        model.geom_rgba[:, :3] = random.uniform(0.0, 1.0, (count, 3))
        model.geom_pos[1:] = random.uniform(-3.0, 3.0, (count - 1, 3))
        model.geom_quat[1:] = _orientations(random, count - 1)
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


def _orientations(random: np.random.RandomState, count: int) -> NDArray[np.float64]:
    """Sample uniform unit quaternions. Shape: (count, 4)."""
    normal = random.normal(size=(count, 4))
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _looking(back: NDArray[np.float64], random: np.random.RandomState) -> NDArray[np.float64]:
    """Sample the orientation of a camera with a given backward axis. Shape: (4,)."""
    back = back / np.linalg.norm(back)
    side = np.cross(random.normal(size=3), back)
    side /= np.linalg.norm(side)
    quaternion = np.zeros(4)
    axes = np.stack([side, np.cross(back, side), back], axis=1)
    mujoco.mju_mat2Quat(quaternion, axes.flatten())
    return quaternion


def _normal(model: mujoco.MjModel, plane: int) -> NDArray[np.float64]:
    """Return the normal of a plane, world frame."""
    normal = np.zeros(3)
    mujoco.mju_rotVecQuat(normal, np.array([0.0, 0.0, 1.0]), model.geom_quat[plane])
    return normal
