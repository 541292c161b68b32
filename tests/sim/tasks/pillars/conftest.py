"""Fields by hand: rows at x = 9, 16, ...; drone and pillars touch up to 1 m on each axis."""

import pytest
import torch

from drone_rl.config import PillarsSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.pillars import rules


@pytest.fixture
def settings():
    """Two rows of two pillars, at x = 9 and 16; the line is at x = 20."""
    return PillarsSettings(num_rows=2, density=0.125, width=1.2, collision_penalty=0.0)


@pytest.fixture
def field(settings):
    """Makes one world of the y of its pillars, row by row, and a drone at rest somewhere."""

    def make(*rows, x=0.0, y=0.0):
        return rules.start(settings, torch.tensor([rows], dtype=torch.float64), body(x, y))

    return make


def body(x, y):
    """One drone at rest."""
    return BodyState.at_rest(torch.tensor([[x, y, 2.5]], dtype=torch.float64))
