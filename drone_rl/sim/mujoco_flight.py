"""A flight that MuJoCo integrates from a drone's forces at every tick, and its contacts.

Contacts are MuJoCo's springs, with about the restitution and friction of the settings. A ball
touches obstacles; four feet at its lowest height touch the ground, so that a drone rests level.
"""

import math
from collections.abc import Sequence
from typing import Any

import mujoco as mujoco_module
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.sim.dynamics import BodyState, FlightState, Goals, Quadrotor
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.forces_kernel import forces
from drone_rl.sim.dynamics.state import twist_about_z
from drone_rl.sim.entities import DRONE_CAMERAS, Drone
from drone_rl.sim.quiet_dm_control import mjcf

mujoco: Any = mujoco_module
"""Its compiled functions have no types."""
_GROUND, _OBSTACLE = 2, 4
"""Bits of `contype` and `conaffinity`: what can touch the ground, and what obstacles."""
_UNSEEN = 5
"""A group of geoms that no camera shows."""
_STIFFNESS = 0.3
"""Of contacts: radians of their swing in a tick, so that a bounce takes ten of them."""
_CALM = 0.5
"""Fraction of its spin that a drone on the ground loses in a tick if rotors can't carry it."""


class MujocoFlight:
    """Flies one drone of a dm_control model, whose geoms it prepares; see also `timesteps`."""

    def __init__(
        self,
        quadrotor: Quadrotor,
        arena: Any,
        drone: Drone,
        obstacles: Sequence[mjcf.RootElement],
    ) -> None:
        """Give a model with an attached drone mass, gravity and contacts, before it is compiled."""
        self.quadrotor, self.drone = quadrotor, drone
        self._settings = settings = quadrotor.settings
        self.timesteps = (settings.control_timestep, settings.tick)
        """Seconds from action to action, and of a tick."""
        option = arena.mjcf_model.option
        option.set_attributes(gravity=(0.0, 0.0, -GRAVITY), integrator="Euler", cone="elliptic")
        option.flag.eulerdamp = "disable"
        drone.body.add("inertial", pos=(0, 0, 0), mass=settings.mass, diaginertia=settings.inertia)
        touch = _contact(settings)
        sphere = {"group": _UNSEEN, "rgba": (0, 0, 0, 0), "type": "sphere", "conaffinity": 0}
        sphere |= touch
        small, place = 0.1 * settings.radius, 0.8 * settings.radius
        drone.body.add("geom", name="ball", size=(settings.radius,), contype=_OBSTACLE, **sphere)
        for name, x, y in (("a", 1, 1), ("b", 1, -1), ("c", -1, 1), ("d", -1, -1)):
            pos = (x * place, y * place, small - settings.radius)
            foot = {"name": f"foot_{name}", "size": (small,), "pos": pos, "contype": _GROUND}
            drone.body.add("geom", **foot, **sphere)
        floor = arena.mjcf_model.find("geom", "floor")
        floor.set_attributes(contype=0, conaffinity=_GROUND)
        self._things = {floor.full_identifier: fs.GROUND}
        for number, prop in enumerate(obstacles):
            for geom in prop.find_all("geom"):
                geom.set_attributes(contype=0, conaffinity=_OBSTACLE)
                self._things[geom.full_identifier] = number
        self._mounted: tuple[NDArray, NDArray] | None = None

    def begin(self, physics: mjcf.Physics, body: BodyState) -> None:
        """Set the drone's pose and motion at the start of an episode."""
        assert isinstance(body, FlightState)
        model = physics.model.ptr
        joint = mjcf.get_attachment_frame(self.drone.mjcf_model).freejoint.full_identifier
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
        place, speed = model.jnt_qposadr[number], model.jnt_dofadr[number]
        self._pose, self._motion = slice(place, place + 7), slice(speed, speed + 6)
        self._body = physics.bind(self.drone.body).element_id
        self._names = {
            mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name): thing
            for name, thing in self._things.items()
        }
        cameras = [self.drone.mjcf_model.find("camera", spec.name) for spec in DRONE_CAMERAS]
        self._cameras = physics.bind(cameras).element_id
        if self._mounted is None:
            places, turns = model.cam_pos[self._cameras], model.cam_quat[self._cameras]
            self._mounted = places.copy(), turns.copy()
        self._state, self._goals, self._tick = body, None, 0
        self._is_grounded = False
        numbers = body.numbers[0].numpy()
        physics.data.qpos[self._pose] = numbers[fs.POSITION : fs.VELOCITY]
        physics.data.qvel[self._motion] = numbers[fs.VELOCITY : fs.ROTORS]
        physics.data.xfrc_applied[self._body] = 0.0
        self._last_pose = physics.data.qpos[self._pose].copy()
        self.level_cameras(physics)

    def found(self, physics: mjcf.Physics) -> FlightState:
        """Return the drone at MuJoCo's pose; one moved by the user holds its position."""
        now = self._state.numbers.clone()
        now[0, fs.POSITION : fs.VELOCITY] = torch.from_numpy(physics.data.qpos[self._pose])
        now[0, fs.VELOCITY : fs.ROTORS] = torch.from_numpy(physics.data.qvel[self._motion])
        state = FlightState(now)
        is_moved = not np.array_equal(physics.data.qpos[self._pose], self._last_pose)
        return state.settled() if is_moved else state

    def command(self, physics: mjcf.Physics, action: Tensor) -> FlightState:
        """Begin an action, shape (1,), then the entry's; return the drone."""
        body = self.found(physics)
        self.set_goals(physics, body, self.quadrotor.steering.goals(body, action))
        return body

    def set_goals(self, physics: mjcf.Physics, body: FlightState, goals: Goals) -> None:
        """Begin goals for a drone whose motion MuJoCo already has."""
        self._state, self._goals, self._tick = body, goals, 0
        self._last_pose = physics.data.qpos[self._pose].copy()

    def push(self, physics: mjcf.Physics) -> None:
        """Apply a tick's forces, before MuJoCo's step."""
        if self._goals is None:
            return
        self._last_pose = physics.data.qpos[self._pose].copy()
        body, pushes = forces(self.quadrotor.frame, self.found(physics), self._goals, self._tick)
        physics.data.xfrc_applied[self._body] = pushes[0].numpy()
        if self._is_grounded and pushes[0, 2] < self._settings.mass * GRAVITY:
            physics.data.xfrc_applied[self._body, 3:] -= self._rocking(physics)
        self._state, self._tick = body, self._tick + 1

    def record_contacts(self, physics: mjcf.Physics) -> None:
        """Record contacts after MuJoCo's step; obstacles count more than the ground."""
        self._last_pose = physics.data.qpos[self._pose].copy()
        data, row = physics.data, self._state.numbers[0]
        self._is_grounded = False
        for contact in data.contact[: data.ncon]:
            things = [self._names.get(int(geom)) for geom in contact.geom]
            known = [thing for thing in things if thing is not None]
            if not known or contact.dist > 0.0:
                continue
            now = self._state.ticks.item() * self._settings.tick
            self._is_grounded |= known[0] == fs.GROUND
            if known[0] < 0 <= row[fs.THING] and row[fs.TIME] > now - self.timesteps[0]:
                continue
            sign = 1.0 if things[0] is not None else -1.0
            row[fs.THING] = known[0]
            row[fs.NORMAL : fs.NORMAL + 3] = torch.tensor(sign * contact.frame[:3])
            row[fs.POINT : fs.POINT + 3] = torch.tensor(contact.pos)
            row[fs.DEPTH] = -float(contact.dist)
            row[fs.TIME] = now

    def finished(self, physics: mjcf.Physics) -> FlightState:
        """Return the drone at the end of a command."""
        assert self._goals is not None
        self._state = body = self.found(physics)
        seconds = self._tick * self._settings.tick
        body.reference[:] = self._goals.reference_after(seconds, body)
        self.level_cameras(physics)
        return self._state

    def level_cameras(self, physics: mjcf.Physics) -> None:
        """Level cameras on a gimbal; they follow the drone's heading."""
        if self.quadrotor.mount != "gimbal" or self._mounted is None:
            return
        attitude = physics.data.qpos[self._pose][3:]
        level = twist_about_z(torch.tensor(attitude)).numpy()
        turn, place, quat = np.empty(4), np.empty(3), np.empty(4)
        mujoco.mju_mulQuat(turn, attitude * (1.0, -1.0, -1.0, -1.0), level)
        model = physics.model.ptr
        for camera, at, turned in zip(self._cameras, *self._mounted, strict=True):
            mujoco.mju_rotVecQuat(place, at, turn)
            mujoco.mju_mulQuat(quat, turn, turned)
            model.cam_pos[camera], model.cam_quat[camera] = place, quat

    def _rocking(self, physics: mjcf.Physics) -> NDArray:
        """Return the torque, world frame, whose opposite brakes the spin, see `_CALM`."""
        data, share = physics.data, _CALM / self._settings.tick
        turn = data.xmat[self._body].reshape(3, 3)
        return turn @ (share * np.array(self._settings.inertia) * data.qvel[self._motion][3:])


def _contact(settings: DynamicsSettings) -> dict[str, Any]:
    """Return MuJoCo's parameters of a contact with the restitution of the settings.

    A damped spring has restitution exp(-pi z / sqrt(1 - z^2)), where z is its damping ratio.
    """
    loss = -math.log(max(settings.restitution, 1e-3))
    ratio, swing = loss / math.hypot(math.pi, loss), _STIFFNESS / settings.tick
    return {
        "solref": (-(swing**2), -2.0 * ratio * swing),
        "solimp": (0.99, 0.99, 0.001, 0.5, 2),
        "friction": (settings.friction, 0.0, 0.0),
        "priority": 1,
    }
