"""Vehicle dynamics: states of drones, and the next state after an action."""

from drone_rl.sim.dynamics.control import FlightGoals as FlightGoals
from drone_rl.sim.dynamics.control import Mode as Mode
from drone_rl.sim.dynamics.dynamics import ComputerVision as ComputerVision
from drone_rl.sim.dynamics.dynamics import Dynamics as Dynamics
from drone_rl.sim.dynamics.dynamics import Kinematic as Kinematic
from drone_rl.sim.dynamics.dynamics import draw_seeds as draw_seeds
from drone_rl.sim.dynamics.dynamics import make_dynamics as make_dynamics
from drone_rl.sim.dynamics.quadrotor import Quadrotor as Quadrotor
from drone_rl.sim.dynamics.single_quadrotor import SingleQuadrotor as SingleQuadrotor
from drone_rl.sim.dynamics.state import BodyState as BodyState
from drone_rl.sim.dynamics.state import Contact as Contact
from drone_rl.sim.dynamics.state import FlightState as FlightState
from drone_rl.sim.dynamics.state import Obstacles as Obstacles
