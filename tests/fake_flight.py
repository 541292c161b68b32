"""Fake vehicle dynamics with wind, seeds, obstacles, tilt and divergence."""

import dataclasses

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.dynamics import BodyState

FLIGHT = DynamicsSettings(mode="simple_flight")
"""Settings that create `Floating` once `floating` has patched `Quadrotor`."""


@dataclasses.dataclass
class FloatingState(BodyState):
    """A body, its episode's seed, whether it is lost, and how often it was near an obstacle."""

    seed: torch.Tensor
    lost: torch.Tensor
    near: torch.Tensor

    @property
    def is_lost(self):
        """See `BodyState`."""
        return self.lost


class Floating:
    """Dynamics that execute moves, add the wind, and lose a drone beyond y = 5 m."""

    actions = MOVES

    def __init__(self, settings, actions, *, needs_obstacles=True):
        """Accept the arguments of `Quadrotor`."""
        self.settings, self.action_settings = settings, actions
        self.mount = settings.camera_mount
        self.is_random = settings.gusts > 0
        self.needs_obstacles = needs_obstacles

    def start(self, position, seeds=None):
        """Start with a roll of 0.2 radians and a heading of 90 degrees."""
        body = BodyState.at_rest(position)
        count = len(position)
        roll, half = torch.tensor([0.1]).double(), torch.tensor([0.5]).double().sqrt()
        c, s = roll.cos() * half, roll.sin() * half
        body.attitude = torch.cat([c, s, s, c]).expand(count, 4).clone()
        seeds = torch.zeros(count, dtype=torch.int64) if seeds is None else seeds
        none = torch.zeros(count, dtype=torch.bool)
        return FloatingState(**vars(body), seed=seeds, lost=none, near=none.long())

    def step(self, body, action, obstacles=None):
        """Move by 1 m and by the wind."""
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
    """Replace `Quadrotor` by `Floating`."""
    monkeypatch.setattr("drone_rl.sim.dynamics.dynamics.Quadrotor", Floating)
