"""Small user-defined dynamics with five actions: no code may depend on the built-in ones."""

import dataclasses
import math

import torch

from drone_rl.sim.actions import DiscreteActions
from drone_rl.sim.dynamics import BodyState, Dynamics

TURN = math.pi / 2
SPEED = 2.0
"""Metres per second; a step takes 0.1 s."""


class Turning(Dynamics):
    """Dynamics that turn the drone and fly in its heading, so attitude and velocities matter."""

    actions = DiscreteActions(
        names=("fly", "turn left", "turn right", "turn round", "hover"),
        mirrored=(0, 2, 1, 3, 4),
        opposite=(0, 2, 1, 3, 4),
        left=1,
        order=(1, 0, 3, 4, 2),
        arrows=((0, 1), (-1, 0), (1, 0), (0, -1), (0, 0)),
        colors=((0, 0, 0),) * 5,
    )

    def start(self, position, seeds=None):
        """Start with velocity SPEED."""
        body = BodyState.at_rest(position)
        body.velocity[:, 0] = SPEED
        return body

    def step(self, body, action, obstacles=None):
        """Turn by 0, 90 or 180 degrees, then fly for 0.1 s."""
        yaw = 2 * torch.atan2(body.attitude[:, 3], body.attitude[:, 0])
        rate = torch.tensor([0.0, TURN, -TURN, 2 * TURN, 0.0], dtype=torch.float64)[action]
        yaw = yaw + rate
        zero = torch.zeros_like(yaw)
        speed = torch.where(action == 4, 0.0, SPEED)
        velocity = torch.stack([yaw.cos() * speed, yaw.sin() * speed, zero], -1)
        return dataclasses.replace(
            body,
            position=body.position + 0.1 * velocity,
            attitude=torch.stack([(yaw / 2).cos(), zero, zero, (yaw / 2).sin()], -1),
            velocity=velocity,
            angular_velocity=torch.stack([zero, zero, rate / 0.1], -1),
        )
