import torch

from drone_rl.explanations.scenes import (
    BRIGHT,
    DARK,
    DARK_GROUND,
    Region,
    alternatives,
    empty_scene,
    place_target,
)
from drone_rl.sim.entities import FLOOR_COLOR, SKY_COLOR
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass


def test_what_the_simulator_draws_otherwise(scenes, world):
    state = world[0].base_env.worlds.state
    world[0].reset()
    state = scenes.worlds.state
    before = state.passed.clone()
    found = alternatives(scenes, state)
    assert list(found) == [
        "no targets", "targets elsewhere 0", "targets elsewhere 1", "targets elsewhere 2",
        "darker", "brighter",
    ]  # fmt: skip
    x, empty = scenes.observe(state), scenes.observe(empty_scene(scenes))
    torch.testing.assert_close(found["no targets"], empty.expand_as(x))
    assert (found["darker"][:, 0, -1] < x[:, 0, -1]).all()  # the ground
    assert (found["darker"][:, 0, 0] < x[:, 0, 0]).all()  # the sky
    assert (found["brighter"][:, 0, -1] > x[:, 0, -1]).all()
    assert not torch.equal(found["targets elsewhere 0"], found["targets elsewhere 1"])
    assert torch.equal(state.passed, before)
    torch.testing.assert_close(scenes.observe(state), x)  # the worlds are as they were
    again = alternatives(scenes, state)
    assert all(torch.equal(found[name], again[name]) for name in found)


def test_other_colors_are_darker_and_brighter_than_the_arenas():
    assert DARK_GROUND.colors == {SemanticClass.GROUND: DARK.colors[SemanticClass.GROUND]}
    for thing, color in ((SemanticClass.GROUND, FLOOR_COLOR), (SemanticClass.SKY, SKY_COLOR)):
        for low, middle, high in zip(DARK.colors[thing], color, BRIGHT.colors[thing], strict=True):
            assert 0.2 < low < middle < high < 1.0  # still grounds and skies, no black or white


def test_cubes_elsewhere_are_in_view(scenes):
    state = place_target(scenes, torch.full((80,), 9.0), torch.zeros(80))
    state = scenes.task.without_targets(state)
    state.drone[:, 1] = 11.0
    moved = scenes.task.elsewhere(state, scenes.worlds.camera, torch.Generator().manual_seed(0))
    regions = scenes.regions(moved)
    seen = (regions == Region.NEXT_TARGET) | (regions == Region.OTHER_TARGET)
    assert seen.flatten(1).any(1).all()
    columns = seen.any(1).float().mean(0)
    assert (columns > 0.1).all()  # everywhere in the picture
    assert moved.present.all() and state.passed.all()


def test_only_the_named_colors_change(scenes):
    state = place_target(scenes, torch.tensor([6.0]), torch.tensor([2.0]))
    regions, before = scenes.regions(state), scenes.frames(state)
    after = scenes.frames(state, Appearance(colors={SemanticClass.GROUND: (0.1, 0.1, 0.1)}))
    changed = (before != after).any(-1)
    ground = (regions == Region.GROUND) | (regions == Region.HORIZON)
    assert changed[regions == Region.GROUND].all()
    assert not changed[~ground].any()
    assert torch.equal(scenes.frames(state), before)
