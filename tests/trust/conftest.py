"""Episodes made by hand: what is offered and what is collected, without flying."""

import pytest
import torch

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import CollectCubes
from drone_rl.sim.tasks.collect_cubes import CubeGoals, CubesEnd, Side
from drone_rl.trust.baselines import BASELINES

METRES = {Side.LEFT: 4.0, Side.AHEAD: 0.0, Side.RIGHT: -4.0}


@pytest.fixture
def make_episodes():
    """Episodes from one row of sides and one of hits an episode."""

    def make(sides, collected, end=None, task=None):
        side, hit = torch.tensor(sides), torch.tensor(collected, dtype=torch.bool)
        metres = torch.tensor([METRES[s] for s in Side], dtype=torch.float64)
        lateral = torch.where(side < 0, torch.nan, metres[side.clamp(min=0)])
        missed = torch.tensor(CubesEnd.FRONT_BOUNDARY if end is None else end)
        return CompleteEpisodes(
            task=task or CollectCubes(),
            goals=CubeGoals(
                reached=hit,
                stratum=side,
                world=lateral[:, :1],
                lateral=lateral,
                height=torch.zeros_like(lateral),
            ),
            end_reason=torch.where(hit.all(-1), CubesEnd.ALL_CUBES.value, missed),
            length=torch.full((len(side),), 40),
        )

    return make


@pytest.fixture
def make_baselines(make_episodes):
    """Baselines in the worlds of some episodes: the oracle gets everything, straight on `ahead`."""

    def make(episodes):
        goals = episodes.goals
        sides = goals.stratum[:, :1].expand_as(goals.stratum)
        nothing = torch.zeros_like(goals.reached)
        hits = {"oracle": ~nothing, "forward": goals.stratum == Side.AHEAD}
        return {
            name: make_episodes(sides.tolist(), hits.get(name, nothing).tolist())
            for name in BASELINES
        }

    return make
