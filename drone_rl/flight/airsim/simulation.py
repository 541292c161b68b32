"""The world behind the server: vehicles, scene, simulated time, and calls that wait for it."""

import dataclasses
import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.flight.airsim.cameras import make_cameras
from drone_rl.flight.airsim.messages import (
    Pose,
    attitude_to_world,
    nanoseconds,
    ned,
    read_date,
    to_world,
)
from drone_rl.flight.airsim.messages import pose as pose_map
from drone_rl.flight.airsim.recording import Recording
from drone_rl.flight.airsim.settings_file import (
    FLYING,
    POSING,
    AirsimSettings,
    RecordedImage,
    VehicleChoice,
)
from drone_rl.flight.airsim.stage import Stage
from drone_rl.flight.airsim.vehicle import Vehicle
from drone_rl.flight.image_types import ImageType
from drone_rl.flight.settings import ServeSettings
from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.entities import find_camera
from drone_rl.utils.errors import InputError, did_you_mean

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
        chosen: ServeSettings,
        recordings: Path | None = None,
    ) -> None:
        """Create the scene and the vehicles of the settings.

        Args:
            settings: Content of settings.json.
            chosen: Scene, clock, date, seed, channels and renderer.
            recordings: Folder for recordings; None refuses to record.

        Raises:
            InputError: There is no such scene or date, or the date is before 1970.
        """
        self.settings, self.clock, self.seed = settings, chosen.clock, chosen.seed
        self.raw_channels = chosen.raw_channels
        self.stage = Stage(chosen.scene, chosen.seed, renderer=chosen.renderer)
        if settings.segmentation_settings.init_method == "None":
            self.stage.clear_ids()
        wind = settings.wind
        self._dynamics = DynamicsSettings().replace(
            mode="simple_flight", camera_mount="body", wind=to_world((wind.x, wind.y, wind.z))
        )
        self._origin = self.stage.start_height if settings.is_posing else self._dynamics.radius
        """Height at which vehicles start, and z is 0 for clients, metres."""
        self._start = time.time_ns() if self.clock == "wall" else read_date(chosen.date)
        self._ticks = 0
        """Physics ticks that have passed."""
        self.vehicles: dict[str, Vehicle] = {}
        for name, choice in settings.choices.items():
            self.add(name, choice)
        self.is_paused = False
        self.recording: Recording | None = None
        self._recordings = recordings
        self._waits: list[tuple[Wait, Callable[[Any], None]]] = []
        self._until: float | None = None
        """Time at which `simContinueForTime` pauses."""
        self._surplus = 0.0
        """Seconds by which the last such call lasted too long, which the next one lasts less."""
        self._anchor = (time.monotonic(), 0.0)
        """A time of `time.monotonic`, and the simulated seconds then."""
        if settings.recording.enabled:
            self.start_recording()

    @property
    def period_s(self) -> float:
        """Seconds of one control period."""
        return self.find("").period * self._dynamics.tick

    @property
    def time(self) -> float:
        """Simulated seconds since the start; `reset` does not change it."""
        return self._ticks * self._dynamics.tick

    @property
    def stamp(self) -> int:
        """The present time stamp: nanoseconds since 1970."""
        return self._start + nanoseconds(self.time)

    def add(self, name: str, choice: VehicleChoice) -> Vehicle:
        """Create a vehicle; an `InputError` if its name is taken, or there are too many."""
        if name in self.vehicles:
            raise InputError(f"vehicle {name!r} is there already; give another name")
        if len(self.vehicles) >= _MOST_VEHICLES:
            raise InputError(f"there are {_MOST_VEHICLES} vehicles; no more can be added")
        names, home = self.stage.touchable, self.settings.home
        vehicle = Vehicle(
            name,
            choice,
            self._dynamics,
            self.stage.worlds,
            names=names,
            object_id=self.stage.get_id,
            home=home._replace(altitude=home.altitude - self._origin),  # the vehicles' start
            height=self._origin,
            seed=(self.seed + len(self.vehicles)) % 2**31,
        )
        vehicle.epoch = self.stamp
        self.vehicles[name] = vehicle
        vehicle.cameras = make_cameras(self.settings.camera_defaults.captures, choice.cameras)
        return vehicle

    def add_named(self, name: str, kind: str, pose: Pose) -> bool:
        """Add a vehicle as `simAddVehicle` does; return whether its type is known."""
        vehicle_kind = {"simpleflight": FLYING, "computervision": POSING}.get(kind.lower())
        if vehicle_kind is None:
            return False
        angles = Attitude(0.0, 0.0, 0.0)
        if not any(map(math.isnan, pose.attitude)):
            angles = Attitude.of(attitude_to_world(pose.attitude).tolist())
        turn = {"roll": angles.roll, "pitch": angles.pitch, "yaw": angles.yaw}
        place = dict(zip("xyz", pose.position, strict=True))
        self.add(name, VehicleChoice(vehicle_type=vehicle_kind, **place, **turn))
        return True

    def find(self, name: str) -> Vehicle:
        """Return a vehicle; "" is the first one.

        Raises an `InputError` with AirSim's message for an unknown name.
        """
        if name == "":
            return next(iter(self.vehicles.values()))
        if name in self.vehicles:
            return self.vehicles[name]
        raise InputError(
            f"Vehicle API for '{name}' is not available. This could either because this is "
            "simulation-only API or this vehicle does not exist"
            f"{did_you_mean(name, self.vehicles)}"
        )

    def set_wind(self, wind: tuple[float, float, float]) -> None:
        """Set the wind of all vehicles, metres per second in our world."""
        self._dynamics = self._dynamics.replace(wind=wind)
        for vehicle in self.vehicles.values():
            vehicle.change_dynamics(self._dynamics)

    def object_pose(self, name: str) -> dict[str, Any]:
        """Return the Pose of an object or a vehicle in NED, see `place`."""
        if name in self.vehicles:
            body = self.vehicles[name].body
            pose = Pose.of(body.position[0], body.attitude[0])
        else:
            pose = self.stage.object_pose(name)
        x, y, z = pose.position
        return pose_map(pose._replace(position=(x, y, z + self._origin)))

    def place(self, position: Sequence[float]) -> tuple[float, float, float]:
        """Return the position in our world of one in NED from where vehicles start by default."""
        x, y, z = to_world(position)
        return x, y, z + self._origin

    def move_vehicle(self, name: str, pose: Pose, *, ignore_collision: bool) -> None:
        """Set a vehicle's pose in NED, see `place` and `teleport`; NaN components stay."""
        vehicle = self.vehicles[name]
        place = ned(torch.tensor(self.place(pose.position), dtype=torch.float64) - vehicle.home)
        self.teleport(vehicle, pose._replace(position=place), ignore_collision=ignore_collision)

    def teleport(self, vehicle: Vehicle, pose: Pose, *, ignore_collision: bool) -> None:
        """Put a vehicle somewhere, see `Vehicle.set_airsim_pose`; it touches cubes on its way."""
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
            vehicle.epoch = self.stamp
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
        if not (self.is_paused and is_paused):
            self._surplus = 0.0
        self.is_paused, self._until = is_paused, None
        self._hold_anchor()

    def continue_for(self, seconds: float) -> Wait:
        """Let time pass for some seconds, then pause; return the wait for that.

        A call lasts whole physics ticks, and the calls of a loop together as long as they say.
        """
        end = self._until = self.time - self._surplus + seconds
        self.is_paused = False
        self._pause_if_due()
        self._hold_anchor()
        return Wait(lambda: self.is_paused or self.time >= end - 1e-9, lambda: None, blocks=True)

    def _pause_if_due(self) -> None:
        """Pause at the end of `continue_for`."""
        if self._until is not None and self.time >= self._until - 1e-9:
            self._surplus = self.time - self._until
            self.is_paused, self._until = True, None

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
            self._step()
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
            if self._step():
                return True
            if time.monotonic() > end:
                return False
        return not self.is_due

    def _left(self) -> float:
        """Seconds of real time until the end of the next step is due."""
        then, simulated = self._anchor
        end = (self._ticks + self._next_ticks()) * self._dynamics.tick
        return then + (end - simulated) / self.settings.clock_speed - time.monotonic()

    def _next_ticks(self) -> int:
        """Return the ticks of the next step: to the end of a control period, or to a pause."""
        left = self.find("").left
        if self._until is not None:
            due = math.ceil((self._until - self.time) / self._dynamics.tick - 1e-6)
            left = max(1, min(left, due))
        return left

    def _hold_anchor(self) -> None:
        self._anchor = (time.monotonic(), self.time)

    def _step(self) -> bool:
        """Advance all vehicles by a step; return whether a call was answered."""
        ticks = self._next_ticks()
        for vehicle in self.vehicles.values():
            vehicle.run(ticks)
            self.touch(vehicle, vehicle.came_from)
        self._bump()
        self._ticks += ticks
        self._record()
        self._pause_if_due()
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
        choice = self.settings.recording
        folder = Path(choice.folder) if choice.folder else self._recordings
        if folder is None:
            raise InputError("there is no folder for recordings; start the server with one")
        if self.recording is None:
            self.recording = Recording(choice, folder, self.time)
            self._record()

    def _record(self) -> None:
        if self.recording is None or not self.recording.take_turn(self.time):
            return
        poses = {name: vehicle.pose for name, vehicle in self.vehicles.items()}
        if not self.recording.write(self.stamp, poses, self._recorded):
            self.recording = None

    def _recorded(self, name: str, image: RecordedImage) -> Tensor:
        vehicle = self.vehicles[name]
        camera, kind = vehicle.cameras[find_camera(image.label).name], ImageType(image.image_type)
        (shot,) = self.stage.render(vehicle.body, camera, [kind])
        return self.stage.image(kind, shot, as_float=image.as_float)

    def stop_recording(self) -> None:
        """End a recording."""
        if self.recording is not None:
            self.recording.close()
            self.recording = None

    def close(self) -> None:
        """End the recording, and close the renderer."""
        self.stop_recording()
        self.stage.close()
