"""A stand-in for drones in flight: random air, obstacles, tilt, and a motion that diverges."""

import dataclasses

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.dynamics import BodyState

FLIGHT = DynamicsSettings(mode="simple_flight")
"""What makes one of it, where `floating` is in force."""


@dataclasses.dataclass
class FloatingState(BodyState):
    """A body, its episode's seed, whether it is lost, and what it was told of obstacles."""

    seed: torch.Tensor
    lost: torch.Tensor
    near: torch.Tensor

    @property
    def is_lost(self):
        """See `BodyState`."""
        return self.lost


class Floating:
    """Moves as told and is blown along by the wind; lost where it comes beyond 5 m to the left."""

    actions = MOVES

    def __init__(self, settings, actions, *, needs_obstacles=True):
        """Takes what `Quadrotor` takes."""
        self.settings, self.asked = settings, actions
        self.mount = settings.camera_mount
        self.is_random = settings.gusts > 0
        self.needs_obstacles = needs_obstacles

    def start(self, position, seeds=None):
        """Tilted by 0.2 radians to the right, heading 90 degrees to the left."""
        body = BodyState.at_rest(position)
        count = len(position)
        roll, half = torch.tensor([0.1]).double(), torch.tensor([0.5]).double().sqrt()
        c, s = roll.cos() * half, roll.sin() * half
        body.attitude = torch.cat([c, s, s, c]).expand(count, 4).clone()
        seeds = torch.zeros(count, dtype=torch.int64) if seeds is None else seeds
        nothing = torch.zeros(count, dtype=torch.bool)
        return FloatingState(**vars(body), seed=seeds, lost=nothing, near=nothing.long())

    def step(self, body, action, obstacles=None):
        """A metre, and what the wind adds."""
        moves = torch.tensor([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]).double()
        wind = torch.tensor(self.settings.wind).double() * self.settings.control_timestep
        position = body.position + moves[action] + wind
        near = body.near
        if obstacles is not None:
            away = (obstacles.centers - position[:, None]).abs()
            near = near + (away <= torch.tensor(obstacles.half_sizes)).all(-1).sum(-1)
        lost = body.lost | (position[:, 1] > 5.0)
        return dataclasses.replace(body, position=position, lost=lost, near=near)


def floating(monkeypatch):
    """Lets all that is told to fly fly so."""
    monkeypatch.setattr("drone_rl.sim.dynamics.dynamics.Quadrotor", Floating)
