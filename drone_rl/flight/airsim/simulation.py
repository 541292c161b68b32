"""The world behind the server: vehicles, scene, simulated time, and calls that wait for it."""

import contextlib
import dataclasses
import logging
import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.airsim.cameras import CameraState, make_cameras
from drone_rl.flight.airsim.messages import (
    Pose,
    attitude_to_world,
    ned,
    ned_attitude,
    read_pose,
)
from drone_rl.flight.airsim.messages import pose as pose_map
from drone_rl.flight.airsim.recording import Recording
from drone_rl.flight.airsim.settings_file import (
    FLYING,
    POSING,
    AirsimSettings,
    Offset,
    VehicleChoice,
)
from drone_rl.flight.airsim.stage import Stage
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.commands.state import Attitude
from drone_rl.sim.image_types import ImageType
from drone_rl.utils.errors import InputError, did_you_mean

_log = logging.getLogger(__name__)

CLOCKS = ("wall", "lockstep")
_MOST_VEHICLES = 100


@dataclasses.dataclass(frozen=True)
class Wait:
    """A call that is answered later, when simulated time has passed."""

    is_done: Callable[[], bool]
    result: Callable[[], Any]
    blocks: bool = False
    """Whether clients do nothing until it is answered: they make this call synchronously."""


class Simulation:
    """Vehicles in one scene. Time advances for all of them together.

    With the clock "wall", `follow` makes it follow real time, times `clock_speed`; with
    "lockstep", `advance` advances it as fast as possible, while a call waits.
    """

    def __init__(
        self,
        settings: AirsimSettings,
        scene: str = "cubes",
        *,
        clock: str = "wall",
        seed: int = 0,
        renderer: str | None = None,
        recordings: Path | None = None,
    ) -> None:
        """Create the scene and the vehicles of the settings.

        Args:
            settings: Content of settings.json.
            scene: See `scenes.make_task`.
            clock: "wall" or "lockstep".
            seed: Of placements, gusts and sensor noise.
            renderer: Name of a renderer; by default the one that fits the scene.
            recordings: Folder for recordings; None refuses to record.
        """
        self.settings, self.clock, self.seed = settings, clock, seed
        self.stage = Stage(scene, seed, renderer=renderer)
        if settings.segmentation == "None":
            self.stage.clear_ids()
        x, y, z = settings.wind
        self._dynamics = DynamicsSettings().replace(
            mode="simple_flight", camera_mount="body", wind=(x, -y, -z)
        )
        self._periods = 0
        """Control periods that have passed."""
        self.vehicles: dict[str, Vehicle] = {}
        self.cameras: dict[str, dict[str, CameraState]] = {}
        """Of each vehicle, by our names of cameras."""
        for choice in settings.vehicles:
            self.add(choice)
        self.is_paused = False
        self.recording: Recording | None = None
        self._recordings = recordings
        self._waits: list[tuple[Wait, Callable[[Any], None]]] = []
        self._until: float | None = None
        """Time at which `simContinueForTime` pauses."""
        self._anchor = (time.monotonic(), 0.0)
        """A time of `time.monotonic`, and the simulated seconds then."""

    @property
    def period_s(self) -> float:
        """Seconds of one control period."""
        first = next(iter(self.vehicles.values()))
        return first.period * first.settings.tick

    @property
    def time(self) -> float:
        """Simulated seconds since the start; `reset` does not change it."""
        return self._periods * self.period_s

    def add(self, choice: VehicleChoice) -> Vehicle:
        """Create a vehicle; an `InputError` if its name is taken, or there are too many."""
        if choice.name in self.vehicles:
            raise InputError(f"vehicle {choice.name!r} is there already; give another name")
        if len(self.vehicles) >= _MOST_VEHICLES:
            raise InputError(f"there are {_MOST_VEHICLES} vehicles; no more can be added")
        names = self.stage.names[1:]
        vehicle = Vehicle(
            choice,
            self._dynamics,
            self.stage.worlds,
            names=names,
            object_id=self.stage.get_id,
            home=self.settings.home,
            height=self.stage.start_height,
            seed=(self.seed + len(self.vehicles)) % 2**31,
        )
        vehicle.epoch = self.time if self.vehicles else 0.0
        self.vehicles[choice.name] = vehicle
        self.cameras[choice.name] = make_cameras(self.settings.captures, choice.cameras)
        return vehicle

    def add_named(self, name: str, kind: str, pose: Any) -> bool:
        """Add a vehicle as `simAddVehicle` does; return whether its type is known."""
        found = {"simpleflight": FLYING, "computervision": POSING}.get(kind.lower())
        if found is None:
            return False
        position, attitude = read_pose(pose)
        angles = Attitude(0.0, 0.0, 0.0)
        if not any(map(math.isnan, attitude)):
            angles = Attitude.of(attitude_to_world(attitude)[0].tolist())
        start = Offset(*position, angles.roll, angles.pitch, angles.yaw)
        self.add(VehicleChoice(name, found, start))
        return True

    def find(self, name: str, *, is_sim_api: bool = False) -> Vehicle:
        """Return a vehicle; "" is the first one.

        Raises an `InputError` with AirSim's message for an unknown name, for its Sim-API if
        `is_sim_api`.
        """
        if name == "":
            return next(iter(self.vehicles.values()))
        if name in self.vehicles:
            return self.vehicles[name]
        meant = did_you_mean(name, self.vehicles)
        if is_sim_api:
            raise InputError(
                f"Vehicle Sim-API for '{name}' is not available. This could either because this "
                f"is not a simulation or this vehicle does not exist{meant}"
            )
        raise InputError(
            f"Vehicle API for '{name}' is not available. This could either because this is "
            f"simulation-only API or this vehicle does not exist{meant}"
        )

    def set_wind(self, wind: tuple[float, float, float]) -> None:
        """Set the wind of all vehicles, metres per second in our world."""
        self._dynamics = self._dynamics.replace(wind=wind)
        for vehicle in self.vehicles.values():
            vehicle.change_dynamics(self._dynamics)

    def object_pose(self, name: str) -> dict[str, Any]:
        """Return the Pose of an object or a vehicle in the world's NED frame."""
        if name in self.vehicles:
            body = self.vehicles[name].body
            x, y, z = ned(body.position)
            w, i, j, k = ned_attitude(body.attitude)
            return pose_map(Pose((x, y, z), (w, i, j, k)))
        return pose_map(self.stage.object_pose(name))

    def move_vehicle(self, name: str, pose: Pose) -> None:
        """Set a vehicle's pose in the world's NED frame; NaN components stay."""
        vehicle = self.vehicles[name]
        start = ned(vehicle.home[None])
        x, y, z = (there - here for there, here in zip(pose.position, start, strict=True))
        self.teleport(vehicle, Pose((x, y, z), pose.attitude), ignore_collision=True)

    def teleport(self, vehicle: Vehicle, pose: Pose, *, ignore_collision: bool) -> None:
        """Put a vehicle somewhere, see `Airframe.set_airsim_pose`; it touches cubes on its way."""
        before = None if ignore_collision else vehicle.body.position[0].clone()
        others = (one for one in self._flying() if one is not vehicle)
        vehicle.set_airsim_pose(pose, ignore_collision=ignore_collision, others=others)
        self.touch(vehicle, before)

    def touch(self, vehicle: Vehicle, before: torch.Tensor | None = None) -> None:
        """Apply the scene's rules of contact to a vehicle; see `Stage.touch`."""
        for contact in self.stage.touch(vehicle.body.position[0], before):
            vehicle.collide(*contact)

    def _flying(self) -> list[Vehicle]:
        """Return the vehicles that collide with each other: those with dynamics."""
        return [one for one in self.vehicles.values() if not one.is_computer_vision]

    def _bump(self) -> None:
        """Let vehicles that overlap bounce off each other."""
        flying = self._flying()
        if len(flying) < 2:
            return
        places = torch.cat([vehicle.body.position for vehicle in flying])
        overlaps = torch.cdist(places, places) < 2.0 * self._dynamics.radius
        for i, j in overlaps.triu(1).nonzero().tolist():
            flying[i].bump(flying[j])

    def reset(self) -> None:
        """Reset vehicles and scene; running movements are cancelled."""
        self.stage.reset()
        for vehicle in self.vehicles.values():
            vehicle.reset()
            vehicle.epoch = self.time
        self.settle()

    # Time

    def wait_for(self, wait: Wait, reply: Callable[[Any], None]) -> None:
        """Call `reply` with the result once a call is done, perhaps at once."""
        self._waits.append((wait, reply))
        self.settle()

    def forget(self, reply: Callable[[Any], None]) -> None:
        """Drop the call with this reply."""
        self._waits = [(w, r) for w, r in self._waits if r is not reply]

    @property
    def is_due(self) -> bool:
        """Whether a call waits for time to pass, and time is not paused."""
        return bool(self._waits) and not self.is_paused

    @property
    def is_blocked(self) -> bool:
        """Whether time is not paused, and a waiting call keeps its client from asking more."""
        return self.is_due and any(wait.blocks for wait, _ in self._waits)

    def pause(self, is_paused: bool) -> None:
        """Stop or continue simulated time."""
        self.is_paused, self._until = is_paused, None
        self._hold_anchor()

    def continue_for(self, seconds: float) -> Wait:
        """Let time pass for some seconds, then pause; return the wait for that."""
        self.pause(seconds <= 0.0)
        end = self._until = self.time + seconds
        return Wait(lambda: self.is_paused or self.time >= end - 1e-9, lambda: None, blocks=True)

    def follow(self, budget: float) -> float:
        """Catch up with real time, in at most `budget` seconds of it.

        Returns:
            Seconds after which there is more to do; infinite if only a call can change that.
        """
        end = time.monotonic() + budget
        if self.is_paused:
            self._hold_anchor()
            return math.inf
        while (left := self._left()) <= 0.0:
            self._period()
            if self.is_paused:
                return math.inf
            if time.monotonic() > end:
                if self._left() < -1.0:  # the machine is too slow: time falls behind
                    self._hold_anchor()
                return 0.0
        return left

    def advance(self, budget: float, until: float) -> bool:
        """Advance time up to `until`, for at most `budget` seconds of real time.

        Returns:
            Whether a call was answered, or none waits: clients may have something to ask.
        """
        end = time.monotonic() + budget
        while self.is_due and self.time < until - 1e-9:
            if self._period():
                return True
            if time.monotonic() > end:
                return False
        return not self.is_due

    def _left(self) -> float:
        """Seconds of real time until the next control period is due."""
        then, simulated = self._anchor
        due = then + (self.time + self.period_s - simulated) / self.settings.clock_speed
        return due - time.monotonic()

    def _hold_anchor(self) -> None:
        self._anchor = (time.monotonic(), self.time)

    def _period(self) -> bool:
        """Advance all vehicles by a control period; return whether a call was answered."""
        for vehicle in self.vehicles.values():
            vehicle.run(vehicle.period)
            self.touch(vehicle)
        self._bump()
        self._periods += 1
        self._record()
        if self._until is not None and self.time >= self._until - 1e-9:
            self.is_paused, self._until = True, None
        return self.settle()

    def settle(self) -> bool:
        """Answer the calls that are done, in the order they came in; return whether any was."""
        if not self._waits:
            return False
        done = [(wait, reply) for wait, reply in self._waits if wait.is_done()]
        if done:
            self._waits = [pair for pair in self._waits if pair not in done]
            for wait, reply in done:
                reply(wait.result())
        return bool(done)

    # Recording

    def start_recording(self) -> None:
        """Record states and images to a new folder; do nothing if that goes on already."""
        if self._recordings is None:
            raise InputError("there is no folder for recordings; start the server with one")
        if self.recording is None:
            self.recording = Recording(self._recordings, self.time)
            self._record()

    def _record(self) -> None:
        if self.recording is None or not self.recording.take_turn(self.time):
            return
        for name, vehicle in self.vehicles.items():
            camera = self.cameras[name]["front_center"]
            (shot,) = self.stage.render(vehicle.body, camera, [ImageType.SCENE])
            image = self.stage.image(ImageType.SCENE, shot, as_float=False)
            try:
                self.recording.write(self.time, name, vehicle.pose, image)
            except OSError as error:
                _log.error("the recording ends: it can't be written (%s)", error.strerror)
                with contextlib.suppress(OSError):
                    self.stop_recording()
                self.recording = None
                return

    def stop_recording(self) -> None:
        """End a recording."""
        if self.recording is not None:
            self.recording.close()
            self.recording = None

    def close(self) -> None:
        """End the recording, and close the renderer."""
        self.stop_recording()
        self.stage.close()
