"""Computer-vision mode (Table 1): poses without dynamics, and the objects of the scene."""

import dataclasses
import math
from collections.abc import Mapping, Sequence

import torch

from drone_rl.flight.commands import checks
from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.state import PilotState
from drone_rl.sim.coordinates import attitude_of, to_simulator
from drone_rl.sim.tasks.common import PropTask
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.schema import Whole

STEP = 0.25
"""Metres that a key moves the drone."""
TURN = 5.0
"""Degrees that a key turns the drone."""
_AXES = {
    "forward backward": STEP,
    "left right": STEP,
    "up down": STEP,
    "roll_right roll_left": TURN,
    "pitch_up pitch_down": TURN,
    "yaw_right yaw_left": TURN,
}
KEYS: Mapping[str, tuple[int, float]] = {
    key: (axis, sign * step)
    for axis, (pair, step) in enumerate(_AXES.items())
    for key, sign in zip(pair.split(), (1.0, -1.0), strict=True)
}
"""Which number each key changes, and by how much: metres forward, left and up in the drone's
heading; degrees of roll, pitch and yaw."""


class SceneDrone(Drone):
    """Base of `Pilot`: poses in computer-vision mode; the scene's objects in any mode."""

    def set_pose(
        self, position: Sequence[float], *, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
    ) -> PilotState:
        """Put the drone somewhere, in computer-vision mode; no time passes.

        Args:
            position: Metres, world frame.
            roll: Degrees; for the signs of angles see `conventions`.
            pitch: Degrees.
            yaw: Degrees.

        Raises:
            InputError: A number is not finite or out of range.
            PilotError: The mode is not computer_vision.
        """
        if not self.is_computer_vision:
            raise PilotError("set_pose: the drone has dynamics; make Pilot(mode='computer_vision')")
        place = checks.numbers(position, "position", 3)
        named = ((roll, "roll"), (pitch, "pitch"), (yaw, "yaw"))
        attitude = attitude_of(*(checks.degrees(value, name) for value, name in named))[None]
        self.body = self.body.moved(torch.tensor([place], dtype=torch.float64), attitude)
        self.trajectory.append(self.time, self.body)
        return self.state

    def press(self, key: str, times: int = 1) -> PilotState:
        """Move or turn the drone by the steps of a key, one of `KEYS`; see `set_pose` for errors.

        A key moves in the heading of the drone, level, by `STEP`, or changes an angle by `TURN`.
        """
        if key not in KEYS:
            raise InputError(
                f"key={key!r} is unknown; give one of: {', '.join(KEYS)}{did_you_mean(key, KEYS)}"
            )
        count, state = Whole(1, 100_000).read(times, "times"), self.state
        axis, step = KEYS[key]
        change = [0.0] * 6
        change[axis] = count * step
        forward, left, up = change[:3]
        *_, heading = to_simulator(0.0, 0.0, math.radians(state.attitude.yaw))
        cos, sin = math.cos(heading), math.sin(heading)
        x, y, z = state.position
        there = (x + cos * forward - sin * left, y + sin * forward + cos * left, z + up)
        now = dataclasses.astuple(state.attitude)
        after = (old + part for old, part in zip(now, change[3:], strict=True))
        roll, pitch, yaw = (math.remainder(angle, 360.0) for angle in after)
        return self.set_pose(there, roll=roll, pitch=pitch, yaw=yaw)

    @property
    def object_names(self) -> tuple[str, ...]:
        """Names of the scene's objects, such as "cube_0"; none without worlds."""
        if self.worlds is None:
            return ()
        return tuple(prop.mjcf_model.model for prop in self.worlds.task.make_props())

    def object_position(self, name: str) -> tuple[float, float, float]:
        """Return the position of an object, metres, world frame; NaN if it has vanished.

        An unknown name is an `InputError`; a drone without worlds raises `PilotError`.
        """
        worlds, index = self._object(name)
        x, y, z = worlds.task.places(worlds.state)[0, index].tolist()
        present = getattr(worlds.state, "present", None)
        return (x, y, z) if present is None or bool(present[0, index]) else _GONE

    def set_object_position(self, name: str, position: Sequence[float]) -> None:
        """Move an object to a position, metres, world frame.

        Raises:
            InputError: The name is unknown or a number is invalid.
            PilotError: The drone has no worlds, or their task does not let objects move.
        """
        worlds, index = self._object(name)
        place = checks.numbers(position, "position", 3)
        task = worlds.task
        if not isinstance(task, PropTask):
            raise PilotError(f"set_object_position: task {task.name} does not let objects move")
        getattr(worlds.state, task.props)[0, index] = torch.tensor(place, dtype=torch.float64)

    def _object(self, name: str) -> tuple[Worlds, int]:
        if self.worlds is None:
            raise PilotError("there are no objects; give worlds=Worlds(1, ...)")
        names = self.object_names
        if name not in names:
            options = f"{', '.join(names)}{did_you_mean(name, names)}"
            raise InputError(f"object {name!r} is unknown; give one of: {options}")
        return self.worlds, names.index(name)


_GONE = (math.nan, math.nan, math.nan)
