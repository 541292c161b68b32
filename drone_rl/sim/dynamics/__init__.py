"""How a drone moves: the state of its body, and what an action makes of that."""

from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.dynamics.computer_vision import ComputerVision
from drone_rl.sim.dynamics.dynamics import Dynamics
from drone_rl.sim.dynamics.flight_state import Contact, FlightState
from drone_rl.sim.dynamics.goals import Goals, Mode
from drone_rl.sim.dynamics.kinematic import Kinematic
from drone_rl.sim.dynamics.making import draw_seeds, make_dynamics
from drone_rl.sim.dynamics.obstacles import Obstacles
from drone_rl.sim.dynamics.quadrotor import Quadrotor

__all__ = [
    "BodyState",
    "ComputerVision",
    "Contact",
    "Dynamics",
    "FlightState",
    "Goals",
    "Kinematic",
    "Mode",
    "Obstacles",
    "Quadrotor",
    "draw_seeds",
    "make_dynamics",
]
