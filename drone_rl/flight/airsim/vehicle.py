"""A vehicle of the server: a pilot with AirSim's frames, collisions and permissions."""

import copy
import math
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.config.sensors import SensorSettings
from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.cameras import CameraState
from drone_rl.flight.airsim.collisions import (
    CollisionRecord,
    Solids,
    VehicleCollision,
    collision_info,
)
from drone_rl.flight.airsim.messages import Map, Pose, nanoseconds, to_world
from drone_rl.flight.airsim.settings_file import POSING, VehicleChoice
from drone_rl.flight.commands.command import Command, FlightFuture, PilotError
from drone_rl.flight.commands.pilot import Pilot
from drone_rl.flight.commands.state import LandedState
from drone_rl.sim.coordinates import GeoPoint, geo_from_world, world_from_geo
from drone_rl.sim.dynamics import FlightState, Obstacles, SingleQuadrotor
from drone_rl.sim.dynamics.state import (
    ATTITUDE,
    DEPTH,
    GROUND,
    NORMAL,
    NOTHING,
    POINT,
    POSITION,
    RATES,
    THING,
    TICKS,
    TIME,
    VELOCITY,
)
from drone_rl.sim.rendering.appearance import rotate
from drone_rl.sim.scenes.solids import PlacedSolids
from drone_rl.sim.sensors import Sensors
from drone_rl.sim.tasks.common import first_contact
from drone_rl.sim.worlds import Worlds

RECENT = 16
"""Control periods that sensors look back, a third of a second: longer than any latency."""
_EARTH = 1e6
"""Half the height of the box that is the ground, metres."""
_STANDS = 0.01
"""Metres above the ground up to which a vehicle stands on it."""
_FAST = 50.0
"""Speed up to which no vehicle passes a cube within one step, metres per second."""
_FASTEST = 668.0
"""Speed of a rotor at full thrust, radians per second."""


class Vehicle(Pilot):
    """One vehicle. Commands are those of `Pilot`, in its frames and units, and never wait.

    All other positions are in NED, relative to the start position, metres; attitudes are those of
    FRD bodies in NED.
    """

    lifts_off, kept_states = True, 1  # a server runs for days

    def __init__(
        self,
        name: str,
        choice: VehicleChoice,
        dynamics: DynamicsSettings,
        worlds: Worlds | None,
        *,
        obstacles: Obstacles | None = None,
        names: Sequence[str] = (),
        object_id: Callable[[str], int] = lambda name: -1,
        home: GeoPoint,
        height: float = 0.0,
        seed: int = 0,
    ) -> None:
        """Create a vehicle of the settings file.

        Args:
            name: Its name for clients.
            choice: Its kind, start pose and cameras.
            dynamics: Vehicle and wind.
            worlds: A single world that the cameras render; None for nothing to see.
            obstacles: What it can touch; by default the objects of `worlds`, where they stand.
            names: Names of the obstacles.
            object_id: Returns the segmentation id of an object by its name.
            home: Place on Earth of the world's origin.
            height: Height in metres at which Z is 0 in start poses.
            seed: Of gusts and sensor noise.
        """
        self.name, self.choice, self.geo_home, self.names = name, choice, home, tuple(names)
        self._object_id = object_id
        x, y, up = to_world(messages.known(choice.position, (0.0,) * 3))
        roll, pitch, yaw = messages.known(choice.angles, (0.0,) * 3)
        posed = choice.vehicle_type == POSING
        up = max(dynamics.radius, height + up)
        super().__init__(
            SingleQuadrotor(dynamics),
            mode="computer_vision" if posed else "simple_flight",
            start=(x, y, up) if posed else (x, y),
            yaw=yaw,
            seed=seed,
            obstacles=obstacles,
            worlds=worlds,
            sensors=None,
        )
        if posed and (roll or pitch):
            self.set_pose((x, y, up), roll=roll, pitch=pitch, yaw=yaw)
        self.body = self.body.moved(self.body.position.new_tensor([[x, y, up]]))
        self.home = self.body.position[0].clone()
        self._home = self.home.tolist()
        self._initial = (copy.deepcopy(self.body), None, None)  # the scene resets itself
        self.cameras: dict[str, CameraState] = {}
        """By our names of cameras."""
        self.epoch = 0
        """Time stamp of the vehicle's time 0: of its creation or last reset."""
        self.begin()

    def begin(self) -> None:
        """Take the state in which AirSim creates and resets vehicles."""
        self.has_api_control = self.choice.has_api_control
        self.collisions = CollisionRecord()
        self._before = self.body
        self.came_from: torch.Tensor | None = None
        """Where the last step began, if it was faster than `_FAST`. Shape: (3,)."""
        is_armed = self.choice.default_vehicle_state != "Disarmed"
        self._is_armed = is_armed and not self.is_computer_vision
        self._hover()
        self._unseen: deque[tuple[FlightState, float]] = deque()
        """States that the sensors have not been updated to, and their seconds."""
        self.trajectory.append(self.time, self.body)

    def reset(self) -> Any:
        """Put it back to the start pose, with the API control and arming of its settings."""
        state = super().reset()
        self.begin()
        return state

    def set_armed(self, arm: bool) -> bool:
        """Arm or disarm; return whether it is in that state, False if API control is off.

        A vehicle that falls can't be armed. Without dynamics there is nothing to arm.
        """
        if not self.has_api_control or self.is_computer_vision:
            return self.has_api_control
        if not arm:
            self.disarm(force=True)
        elif not self._is_flying:
            self.arm()
        return self._is_armed == arm

    def _require_armed(self, name: str) -> None:
        """Raise a `PilotError` with the remedies of AirSim's clients."""
        if self.is_computer_vision:
            raise PilotError(
                f"{name} needs a vehicle with dynamics, but this one is in ComputerVision mode; "
                "use simSetVehiclePose"
            )
        if self._is_lost:
            raise PilotError("the simulation of this vehicle has diverged; call reset")
        if not self._is_armed:
            raise PilotError("this vehicle is not armed; call armDisarm(True)")

    def _start(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        return super()._start(name, command, wait=False)

    def run(self, ticks: int) -> None:
        """Advance simulated time by physics ticks."""
        self._before = self.body
        was_flying = self._is_flying
        self._advance(ticks)
        row = self.body.numbers.numpy()[0]
        vx, vy, vz = row[VELOCITY : VELOCITY + 3].tolist()
        is_fast = vx * vx + vy * vy + vz * vz > _FAST * _FAST
        self.came_from = self._before.position[0] if is_fast else None
        if row[THING] != NOTHING and row[TIME] > (row[TICKS] - ticks + 0.5) * self.settings.tick:
            self._note_contact(row.tolist())
        if self._is_flying and not was_flying:
            self.collisions.forget()

    def _note_contact(self, row: Sequence[float]) -> None:
        """Note the last contact of the dynamics; `row` is from `FlightState.numbers`."""
        thing = int(row[THING])
        name = "Ground" if thing == GROUND else self.names[thing]
        normal, point = row[NORMAL : NORMAL + 3], row[POINT : POINT + 3]
        place = [p + self.settings.radius * n for p, n in zip(point, normal, strict=True)]
        self.collisions.add(VehicleCollision(name, place, point, normal, row[DEPTH], row[TIME]))

    def _hover(self) -> None:
        """Let an armed vehicle that was put into the air fly: it holds its place there."""
        if self._is_armed and not self._is_flying and not self._stands():
            self._settle()
            self._landed = LandedState.FLYING
            self.collisions.forget()

    def _stands(self) -> bool:
        """Return whether the ground, or a solid of a scene file, is right below it."""
        scene, radius = self._scene_solids, self.settings.radius
        if scene is None:
            return float(self.body.position[0, 2]) - radius <= _STANDS
        here = self.body.position
        below = here - here.new_tensor([0.0, 0.0, _STANDS])
        return float(scene.solids.sweep_at(here, below, radius, scene.places).fraction) <= 1.0

    @property
    def sensors(self) -> Sensors:
        """See `Drone`; they run from the start, but are only computed when they are read.

        After a long silence they are updated to the last `RECENT` states, and to the first of these
        in one step.
        """
        if self._sensors is None:
            body = self._initial[0]
            self._sensors = Sensors(body, SensorSettings(), self._seed, self.geo_home)
        for body, seconds in self._unseen:
            self._sensors.update(body, seconds)
        self._unseen.clear()
        return self._sensors

    def _record(self, ticks: int) -> None:
        self.trajectory.append(self.time, self.body)
        seconds = ticks * self.settings.tick
        if len(self._unseen) == RECENT:
            _, earlier = self._unseen.popleft()
            body, duration = self._unseen[0]
            self._unseen[0] = (body, duration + earlier)
        self._unseen.append((self.body, seconds))

    def change_dynamics(self, dynamics: DynamicsSettings) -> None:
        """Take other dynamics, such as another wind, from now on."""
        self._quadrotor = SingleQuadrotor(dynamics)
        self.settings = dynamics

    @property
    def period(self) -> int:
        """Ticks of one control period."""
        return self._period

    @property
    def left(self) -> int:
        """Ticks to the end of the present control period."""
        return self._left or self._period

    # Frames

    def world(self, position: Sequence[float]) -> tuple[float, float, float]:
        """Convert a position to our world; below bare ground counts as on it."""
        x, y, z = to_world(position)
        home = self.home.tolist()
        lowest = 0.0 if self._scene_solids is None else -math.inf
        return home[0] + x, home[1] + y, max(lowest, home[2] + z)

    def height(self, z: float | None) -> float | None:
        """Convert a z coordinate, if there is one, to a height in our world."""
        return None if z is None else self.world((0.0, 0.0, z))[2]

    def turned(self, forward: float, left: float, up: float) -> tuple[float, float, float]:
        """Convert a vector ahead of the vehicle, to its left and up to our world."""
        heading = float(self.body.heading[0])
        cos, sin = math.cos(heading), math.sin(heading)
        return cos * forward - sin * left, sin * forward + cos * left, up

    @property
    def pose(self) -> Pose:
        """Pose in NED, relative to the start position."""
        row, home = self.body.numbers[0].tolist(), self._home
        w, i, j, k = row[ATTITUDE : ATTITUDE + 4]
        x, y, z = (row[POSITION + axis] - home[axis] for axis in range(3))
        return Pose((x, 0.0 - y, 0.0 - z), (w, i, 0.0 - j, 0.0 - k))

    # State

    def kinematics(self) -> Map:
        """Return a KinematicsState; accelerations are means of the last step."""
        now, before = self.body.numbers[0].tolist(), self._before.numbers[0].tolist()
        seconds = (now[TICKS] - before[TICKS]) * self.settings.tick
        rate, pose = 1.0 / seconds if seconds > 0 else 0.0, self.pose
        velocity, turning = now[VELOCITY : VELOCITY + 3], now[RATES : RATES + 3]
        pushed, twisted = (
            [(now[first + axis] - before[first + axis]) * rate for axis in range(3)]
            for first in (VELOCITY, RATES)
        )
        return {
            "position": messages.vector(pose.position),
            "orientation": messages.quaternion(pose.attitude),
            "linear_velocity": messages.vector(to_world(velocity)),
            "angular_velocity": messages.vector(to_world(turning)),
            "linear_acceleration": messages.vector(to_world(pushed)),
            "angular_acceleration": messages.vector(to_world(twisted)),
        }

    def _stamp(self, seconds: float) -> int:
        """Return the time stamp of a time of this vehicle."""
        return self.epoch + nanoseconds(seconds)

    def rotor_states(self) -> Map:
        """Return RotorStates: thrust in newtons; speed in radians per second."""
        most = self.settings.rotor_thrust
        rotors = [
            {
                "thrust": share * most,
                "torque_scaler": 1.0,
                "speed": _FASTEST * max(share, 0.0) ** 0.5,
            }
            for share in self.body.rotors[0].tolist()
        ]
        return {"rotors": rotors, "timestamp": self._stamp(self.time)}

    def sees(self, place: GeoPoint, start: GeoPoint | None = None) -> bool:
        """Return whether no obstacle stands between a place on Earth and another one.

        `start` is that other place; None for the vehicle's own position.
        """
        here = self.body.position[0] if start is None else self.from_geo(start)
        there, around = self.from_geo(place), self._around
        if (scene := self._scene_solids) is not None:
            sweep = scene.solids.sweep_at(here[None], there[None], 0.0, scene.places)
            return float(sweep.fraction) > 1.0
        if min(float(there[2]), float(here[2])) < 0.0:
            return False
        if around is None:
            return True
        half = there.new_tensor(around.half_sizes)
        hits = first_contact(half, here[None], there[None], around.centers)
        return not bool(hits.isfinite().any())

    def from_geo(self, place: GeoPoint) -> torch.Tensor:
        """Return the position in our world of a place on Earth, metres. Shape: (3,)."""
        return world_from_geo(torch.tensor(place, dtype=torch.float64), self.geo_home)

    def place_of(self, camera: CameraState) -> torch.Tensor:
        """Return the position of one of its cameras in our world, metres. Shape: (3,)."""
        attitude = self.body.attitude[0].double()
        return self.body.position[0] + rotate(attitude, attitude.new_tensor(camera.position))

    def geo_point(self) -> Map:
        """Return its GeoPoint."""
        return messages.geo_point(geo_from_world(self.body.position[0], self.geo_home).tolist())

    def multirotor_state(self) -> Map:
        """Return a MultirotorState; it does not clear the collision."""
        sticks = self.sticks
        return {
            "collision": self.collision(read=False),
            "kinematics_estimated": self.kinematics(),
            "gps_location": self.geo_point(),
            "timestamp": self._stamp(self.time),
            "landed_state": int(self._landed == LandedState.FLYING),
            "rc_data": {
                "timestamp": 0,
                "pitch": sticks.pitch,
                "roll": sticks.roll,
                "throttle": sticks.throttle,
                "yaw": sticks.yaw,
                "left_z": 0.0,
                "right_z": 0.0,
                "switches": 0,
                "vendor_id": "",
                "is_initialized": False,
                "is_valid": False,
            },
        }

    def collision(self, *, read: bool = True, is_legacy: bool = False) -> Map:
        """Return a CollisionInfo; `read` clears `has_collided` until the next collision.

        With `is_legacy` it is that of AirSim 1.1, see `CollisionRecord.read_current`.
        """
        record = self.collisions
        collision, is_new = record.read_current(self.time) if is_legacy else record.read(clear=read)
        return collision_info(
            collision,
            has_collided=is_new,
            home=self._home,
            time_stamp=self._stamp(collision.time) if collision else 0,
            number=self._object_id(collision.name) if collision else -1,
        )

    def set_kinematics(self, pose: Pose, velocity: Sequence[float], rates: Sequence[float]) -> None:
        """Set pose, velocity, and rates about the axes of the FRD body; see `set_airsim_pose`."""
        self.set_airsim_pose(pose, ignore_collision=True)
        self.body.numbers[0, VELOCITY : VELOCITY + 3] = torch.tensor(to_world(velocity))
        self.body.numbers[0, RATES : RATES + 3] = torch.tensor(to_world(rates))
        self._before = self.body  # the jump is no acceleration

    def set_airsim_pose(
        self, pose: Pose, *, ignore_collision: bool, others: Iterable["Vehicle"] = ()
    ) -> None:
        """Put it somewhere at once; NaN components stay. Velocities are kept.

        Without `ignore_collision` it collides with the first obstacle on the straight line there,
        one of the `others` included, and stops before it.
        """
        pose = pose.merged(self.pose)
        there = self.home + torch.tensor(to_world(pose.position), dtype=torch.float64)
        hit, radius = None, self.settings.radius
        solids = self._solids(others := [*others])
        if not ignore_collision:
            there, hit = solids.sweep(self.body.position[0], there, radius)
            there, first = self._sweep_scene(there)
            hit = first or hit
        self.body = self.body.moved(there[None], messages.attitude_to_world(pose.attitude)[None])
        self._place, self._coasting = None, 0
        self.trajectory.append(self.time, self.body)
        gaps = [*zip(solids.names, solids.gaps(there, radius).tolist(), strict=True)]
        if self._scene_solids is not None:
            name, distance, _ = self._nearest_of_scene(there)
            gaps.append((name, distance - radius))
        self.collisions.move([name for name, gap in gaps if gap <= _STANDS], self.time)
        self._hover()
        if hit is not None:
            self.collide(hit[0], there, hit[1])
            for other in others:
                if other.name == hit[0]:
                    other.collide(self.name, other.body.position[0], hit[1])

    def collide(self, name: str, position: torch.Tensor, point: torch.Tensor) -> None:
        """Note a collision, at a position, with the nearest point of an object. Shapes: (3,)."""
        radius = self.settings.radius
        self.collisions.add(VehicleCollision.event(name, position, point, radius, self.time))

    def bump(self, other: "Vehicle") -> None:
        """Let it and another vehicle of the same mass, which overlap, bounce off each other."""
        apart = self.body.position[0] - other.body.position[0]
        distance = float(apart.norm())
        normal = apart / distance if distance > 0.0 else apart.new_tensor((0.0, 1.0, 0.0))
        into = float((other.body.velocity[0] - self.body.velocity[0]) @ normal)
        push = 0.5 * (1.0 + self.settings.restitution) * max(0.0, into)
        point = 0.5 * (self.body.position[0] + other.body.position[0])
        depth = 2.0 * self.settings.radius - distance
        for one, met, way in ((self, other, normal), (other, self, -normal)):
            contact = (one.body.position[0].tolist(), point.tolist(), way.tolist())
            one.collisions.add(VehicleCollision(met.name, *contact, depth, one.time))
            one.body.position[0] += 0.5 * depth * way
            one.body.velocity[0] += push * way

    def _solids(self, others: Iterable["Vehicle"]) -> Solids:
        """Return what stops a teleport: the scene's obstacles, other vehicles and the ground."""
        below = -_EARTH if self._scene_solids is None else -3 * _EARTH  # a scene has its own
        rows = [("Ground", [0.0, 0.0, below], (math.inf, math.inf, _EARTH), 0.0)]
        if self._around is not None and self._scene_solids is None:
            centers, half = self._around.centers[0].tolist(), self._around.half_sizes
            rows += [(name, at, half, 0.0) for name, at in zip(self.names, centers, strict=False)]
        for other in others:
            at, radius = other.body.position[0].tolist(), other.settings.radius
            rows.append((other.name, at, (0.0, 0.0, 0.0), radius))
        names, *parts = zip(*rows, strict=True)
        return Solids(names, *(torch.tensor(part, dtype=torch.float64) for part in parts))

    @property
    def _scene_solids(self) -> PlacedSolids | None:
        around = self._around
        return None if around is None else around.scene

    def _sweep_scene(
        self, there: torch.Tensor
    ) -> tuple[torch.Tensor, tuple[str, torch.Tensor] | None]:
        """Move to a place up to the first solid of a scene file; see `Solids.sweep`."""
        if (scene := self._scene_solids) is None:
            return there, None
        here, radius = self.body.position[:1], self.settings.radius
        sweep = scene.solids.sweep_at(here, there[None], radius, scene.places)
        fraction = float(sweep.fraction)
        if fraction > 1.0:
            return there, None
        there = torch.lerp(here[0], there, fraction)
        _, distance, normal = self._nearest_of_scene(there)
        return there, (self.names[int(sweep.solid)], there - distance * normal)

    def _nearest_of_scene(self, place: torch.Tensor) -> tuple[str, float, torch.Tensor]:
        """Return name, distance and outer normal of a file's solid that is nearest to a place."""
        scene: Any = self._scene_solids
        found = scene.solids.nearest_at(place[None], scene.places)
        name = self.names[int(found.solid)] if int(found.solid) >= 0 else ""
        return name, float(found.distance), found.normal[0]
