"""How a drone moves: the state of its body, and what an action makes of that."""

from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.dynamics.computer_vision import ComputerVision
from drone_rl.sim.dynamics.dynamics import Dynamics

__all__ = ["BodyState", "ComputerVision", "Dynamics"]
