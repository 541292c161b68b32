import torch

from drone_rl.explain.alternatives import (
    PLACEMENTS,
    Repainted,
    alternatives,
    cubes_elsewhere,
    without_cubes,
)
from drone_rl.explain.scenes import Region, empty_scene, place_cube


def test_what_the_simulator_draws_otherwise(scenes, world):
    state = world[0].base_env.worlds.state
    world[0].reset()
    state = scenes.worlds.state
    before = state.passed.clone()
    found = alternatives(scenes, state)
    assert len(found) == PLACEMENTS + 3
    x, empty = scenes.observe(state), scenes.observe(empty_scene(scenes))
    torch.testing.assert_close(found["no cubes"], empty.expand_as(x))
    assert (found["darker"][:, 0, -1] < x[:, 0, -1]).all()  # the ground
    assert (found["darker"][:, 0, 0] < x[:, 0, 0]).all()  # the sky
    assert (found["brighter"][:, 0, -1] > x[:, 0, -1]).all()
    assert not torch.equal(found["cubes elsewhere 0"], found["cubes elsewhere 1"])
    assert torch.equal(state.passed, before)
    torch.testing.assert_close(scenes.observe(state), x)  # the worlds are as they were
    again = alternatives(scenes, state)
    assert all(torch.equal(found[name], again[name]) for name in found)


def test_cubes_elsewhere_are_in_view(scenes):
    state = without_cubes(place_cube(scenes, torch.full((80,), 9.0), torch.zeros(80)))
    state.drone[:, 1] = 11.0
    moved = cubes_elsewhere(scenes, state, torch.Generator().manual_seed(0))
    regions = scenes.regions(moved)
    seen = (regions == Region.NEXT_CUBE) | (regions == Region.OTHER_CUBE)
    assert seen.flatten(1).any(1).all()
    columns = seen.any(1).float().mean(0)
    assert (columns > 0.1).all()  # everywhere in the picture
    assert moved.present.all() and state.passed.all()


def test_only_the_named_colours_change(scenes):
    state = place_cube(scenes, torch.tensor([6.0]), torch.tensor([2.0]))
    painted = Repainted(scenes, {"floor": (0.1, 0.1, 0.1)})
    regions, before, after = scenes.regions(state), scenes.frames(state), painted.frames(state)
    painted.close()
    changed = (before != after).any(-1)
    ground = (regions == Region.GROUND) | (regions == Region.HORIZON)
    assert changed[regions == Region.GROUND].all()
    assert not changed[~ground].any()
    assert torch.equal(scenes.frames(state), before)
