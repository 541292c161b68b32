"""Fixtures for tests that every task must pass."""

import pytest
import torch

from drone_rl.config import PillarsSettings, TaskSettings
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import world_random_state
from tests.second_task import Posts

TASKS = (
    CollectCubes(),
    CollectCubes(TaskSettings(num_cubes=2, vertical_bound=0.5)),
    Pillars(),
    Pillars(PillarsSettings(num_rows=2, density=0.4, width=0.6)),
    Posts(),
)


@pytest.fixture(params=TASKS, ids=("cubes", "two cubes", "pillars", "thin pillars", "posts"))
def worlds(request):
    """Return five environments of each task, each with its own episode."""
    worlds = Worlds(5, request.param)
    worlds.reset(torch.arange(5), [world_random_state(0, i) for i in range(5)])
    yield worlds
    worlds.close()


@pytest.fixture
def task(worlds):
    return worlds.task


@pytest.fixture
def truth(worlds):
    """Return the info of the environments."""
    body = worlds.state.body
    pose = {"drone": body.position.float(), "attitude": body.attitude.float()}
    return {**worlds.task.info(worlds.state), **pose}
