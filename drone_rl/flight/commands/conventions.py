"""Angles as Fig. 4 of the chapter and AirSim have them, and as the simulator has them.

To a pilot, positive roll lowers the right side, positive pitch raises the nose, and positive yaw
turns to the right, clockwise from above. The simulator's drone frame has x forward, y left and z
up, where rotations about y and z have the other sign. Positions and velocities are in the
simulator's frames everywhere; AirSim's own have y to the right and z down.
"""

Angles = tuple[float, float, float]


def to_simulator(roll: float, pitch: float, yaw: float) -> Angles:
    """Convert a pilot's angles or rates about the drone's axes to the simulator's; units kept."""
    return roll, 0.0 - pitch, 0.0 - yaw  # not -0.0


def to_pilot(roll: float, pitch: float, yaw: float) -> Angles:
    """Convert the simulator's angles or rates about the drone's axes to a pilot's; units kept."""
    return roll, 0.0 - pitch, 0.0 - yaw  # not -0.0
