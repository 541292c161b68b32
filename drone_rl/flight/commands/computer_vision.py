"""Computer-vision mode (Table 1): poses without dynamics, and the objects of the scene."""

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
KEYS: Mapping[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "forward": ((STEP, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "backward": ((-STEP, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "left": ((0.0, STEP, 0.0), (0.0, 0.0, 0.0)),
    "right": ((0.0, -STEP, 0.0), (0.0, 0.0, 0.0)),
    "up": ((0.0, 0.0, STEP), (0.0, 0.0, 0.0)),
    "down": ((0.0, 0.0, -STEP), (0.0, 0.0, 0.0)),
    "roll_left": ((0.0, 0.0, 0.0), (-TURN, 0.0, 0.0)),
    "roll_right": ((0.0, 0.0, 0.0), (TURN, 0.0, 0.0)),
    "pitch_up": ((0.0, 0.0, 0.0), (0.0, TURN, 0.0)),
    "pitch_down": ((0.0, 0.0, 0.0), (0.0, -TURN, 0.0)),
    "yaw_left": ((0.0, 0.0, 0.0), (0.0, 0.0, -TURN)),
    "yaw_right": ((0.0, 0.0, 0.0), (0.0, 0.0, TURN)),
}
"""What each key adds: metres forward, left and up in the drone's heading; degrees of roll, pitch
and yaw."""


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
        count, state = Whole(1, 100_000, "times").read(times, "times"), self.state
        move, turn = KEYS[key]
        *_, heading = to_simulator(0.0, 0.0, math.radians(state.attitude.yaw))
        cos, sin = math.cos(heading), math.sin(heading)
        forward, left, up = (count * part for part in move)
        x, y, z = state.position
        there = (x + cos * forward - sin * left, y + sin * forward + cos * left, z + up)
        now = (state.attitude.roll, state.attitude.pitch, state.attitude.yaw)
        after = (old + count * part for old, part in zip(now, turn, strict=True))
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
            known = f"{', '.join(names)}{did_you_mean(name, names)}"
            raise InputError(f"object {name!r} is unknown; give one of: {known}")
        return self.worlds, names.index(name)


_GONE = (math.nan, math.nan, math.nan)
