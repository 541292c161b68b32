"""Arrays that kernels fly are the worlds' own, and begin anew with each batch."""

import torch
import warp as wp

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.tasks import CollectCubes, Pillars
from drone_rl.sim.tasks.collect_cubes.flying import FlyingCubes
from drone_rl.sim.tasks.collect_cubes.kernel import STANDS
from drone_rl.sim.worlds import Worlds

start_warp("cpu")


def test_begins_where_worlds_are_and_leaves_them_alone():
    settings = TaskSettings(num_cubes=2, altitude=3.0, vertical_bound=0.5)
    worlds = Worlds(2, settings)
    cubes = torch.tensor([[[15.0, 1.0, 3.0], [24.0, -2.0, 3.5]], [[15.0, 0.0, 3.0]] * 2])
    worlds.state = worlds.start(cubes.double())
    flying = FlyingCubes(worlds.task, worlds.dynamics, 3)
    for values in (flying.steps, flying.end_reasons, wp.to_torch(flying.flights.fates)):
        values.fill_(1)  # of a batch before
    flying.begin(worlds.state)
    assert wp.to_torch(flying.flights.drones)[:2].tolist() == [[0.0, 0.0, 3.0]] * 2
    assert torch.equal(wp.to_torch(flying.flights.cubes)[:2], cubes.double())
    assert (wp.to_torch(flying.flights.fates)[:2] == STANDS).all()
    assert flying.steps.tolist() == flying.end_reasons.tolist() == [0, 0, 1]
    wp.to_torch(flying.flights.drones).fill_(7.0)
    assert worlds.state.drone[0].tolist() == [0.0, 0.0, 3.0]
    assert wp.to_torch(flying.poses.attitudes)[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_other_rules_and_other_moves_are_not_known():
    class Windy(ComputerVision):
        pass

    class Strict(CollectCubes):
        pass

    assert FlyingCubes.find(CollectCubes(), ComputerVision(), 1) is not None
    assert FlyingCubes.find(CollectCubes(), Windy(), 1) is None
    assert FlyingCubes.find(Strict(), ComputerVision(), 1) is None
    assert FlyingCubes.find(Pillars(), ComputerVision(), 1) is None
