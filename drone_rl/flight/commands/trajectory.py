"""Where a drone has been."""

import numpy as np

from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.dynamics.state import ATTITUDE, POSITION, ROTORS, VELOCITY, Slot


class Trajectory:
    """Grows with every control period. World frame, SI units."""

    def __init__(self) -> None:
        """Starts empty."""
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def __len__(self) -> int:
        """Returns how many moments are known."""
        return len(self._times)

    def note(self, time: float, body: FlightState) -> None:
        """Adds a moment.

        Args:
            time: Seconds.
            body: One drone.
        """
        self._times.append(time)
        self._rows.append(body.numbers[0, : ROTORS.last].numpy().astype(np.float64))

    @property
    def times(self) -> np.ndarray:
        """Simulated seconds. Shape: (T,)."""
        return np.array(self._times)

    @property
    def positions(self) -> np.ndarray:
        """Metres. Shape: (T, 3)."""
        return self._part(POSITION)

    @property
    def attitudes(self) -> np.ndarray:
        """Unit quaternions (w, x, y, z). Shape: (T, 4)."""
        return self._part(ATTITUDE)

    @property
    def velocities(self) -> np.ndarray:
        """Metres a second. Shape: (T, 3)."""
        return self._part(VELOCITY)

    @property
    def rotors(self) -> np.ndarray:
        """Shares of their most thrust, in the order of `FlightState.rotors`. Shape: (T, 4)."""
        return self._part(ROTORS)

    def _part(self, slot: Slot) -> np.ndarray:
        return np.array(self._rows).reshape(len(self), ROTORS.last)[:, slot.first : slot.last]
