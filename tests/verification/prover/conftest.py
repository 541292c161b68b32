"""A graph that a person can count, and placements by their metres to the left."""

import pytest
import torch

from drone_rl.config import TaskSettings

SMALL = TaskSettings(
    num_cubes=1,
    first_distance=2.0,
    lateral_bound=0.0,
    cube_size=1.2,  # touches up to 1 m away, so wherever the drone has gone one step forward
    front_margin=1.0,
    side_margin=1.0,
)


@pytest.fixture
def small():
    return SMALL


@pytest.fixture
def place():
    def place(settings, *placements):
        """Cubes at these y, level with the drone. Shape: (P, C, 3)."""
        y = torch.tensor(placements, dtype=torch.float64)
        x = settings.first_distance + settings.spacing * torch.arange(y.shape[1]).double()
        return torch.stack([x.expand_as(y), y, torch.full_like(y, settings.altitude)], -1)

    return place
