"""How a drone moves: the state of its body, and what an action makes of that."""

from drone_rl.sim.dynamics.control import Goals, Mode
from drone_rl.sim.dynamics.dynamics import (
    ComputerVision,
    Dynamics,
    Kinematic,
    draw_seeds,
    make_dynamics,
)
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.dynamics.state import BodyState, Contact, FlightState, Obstacles

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
