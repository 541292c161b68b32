import numpy as np
import pytest
import torch

from drone_rl.config import TaskSettings
from drone_rl.explanations.hooks import probabilities
from drone_rl.explanations.scenes import DARK_GROUND, Region, empty_scene, place_target
from drone_rl.explanations.truth import OTHER_TARGETS, _patches, intervene, to_the_middle
from drone_rl.sim.entities import FLOOR_COLOR
from drone_rl.sim.rendering.scene import SemanticClass


def test_only_what_was_changed_changes(scenes, world):
    state = place_target(scenes, torch.tensor([5.0, 8.0]), torch.tensor([2.0, -1.0]))
    regions, before = scenes.regions(state), scenes.frames(state)
    changes = {c.name: c for c in intervene(scenes, world[2], state, regions)}
    cube = regions == Region.NEXT_TARGET
    away = changes["target taken away"]
    torch.testing.assert_close(away.frames, scenes.frames(empty_scene(scenes)).expand_as(before))
    for name in ("target recolored", "ground patch changed"):
        changed = (changes[name].frames != before).any(-1)
        assert torch.equal(changed, changes[name].area), name
    assert torch.equal(changes["target recolored"].area, cube)
    patch = changes["ground patch changed"].area
    assert patch.any() and (regions[patch] == Region.GROUND).all()
    moved = changes["target moved"]
    assert torch.equal((moved.frames != before).any(-1), moved.area)


def test_the_effect_is_the_distance_of_the_probabilities(scenes, world):
    network = world[2]
    state = place_target(scenes, torch.tensor([5.0, 8.0]), torch.tensor([2.0, -1.0]))
    changes = intervene(scenes, network, state, scenes.regions(state))
    before = probabilities(network, scenes.observe(state))
    for change in changes:
        after = probabilities(network, scenes.transform(change.frames))
        expected = 0.5 * (after - before).abs().sum(-1)
        np.testing.assert_allclose(change.effect, expected, atol=1e-6)
    assert changes[0].effect.min() > 1e-3


def test_without_a_cube_there_is_nothing_to_change(scenes, world):
    state = empty_scene(scenes)
    for change in intervene(scenes, world[2], state, scenes.regions(state)):
        assert np.isnan(change.effect).all()


@pytest.mark.parametrize(
    ("lateral", "moved"), [(5.0, 3.0), (-5.0, -3.0), (0.5, 0.0), (-0.5, 0.0), (2.0, 0.0)]
)
def test_a_cube_is_moved_to_the_middle_and_never_away_from_it(scenes, lateral, moved):
    state = place_target(scenes, torch.tensor([9.0]), torch.tensor([lateral]))
    state.drone[:, 1] += 7.0
    state.cubes[..., 1] += 7.0
    after = to_the_middle(scenes, state)
    assert after.cubes[0, 0, 1].item() == pytest.approx(7.0 + moved)
    assert torch.equal(after.cubes[0, 1:], state.cubes[0, 1:])
    assert state.cubes[0, 0, 1] == 7.0 + lateral


def test_a_patch_of_ground_is_a_square_of_about_as_many_pixels():
    ground = torch.ones(60, 20, 30, dtype=torch.bool)
    patches = _patches(ground, torch.full((60,), 25), seed=0)
    for patch in patches:
        rows, columns = patch.any(1).nonzero()[:, 0], patch.any(0).nonzero()[:, 0]
        assert patch.sum() == len(rows) * len(columns)  # all of it
        for found, end in ((rows, 20), (columns, 30)):
            cut = found[0] == 0 or found[-1] == end - 1  # by the border of the picture
            assert (3 <= len(found) <= 5) if cut else len(found) == 5
    assert len({tuple(patch.nonzero()[0].tolist()) for patch in patches}) > 50  # anywhere
    assert [int(p.sum()) for p in _patches(ground[:2], torch.tensor([1, 0]), 0)] == [1, 0]
    ground[:, :, 15:] = False
    patches = _patches(ground, torch.full((60,), 49), seed=0)
    assert not (patches & ~ground).any() and patches.flatten(1).any(1).all()
    assert torch.equal(patches, _patches(ground, torch.full((60,), 49), seed=0))


def test_other_colors_are_colors_unlike_the_cubes_and_the_grounds():
    yellow, dark = (
        OTHER_TARGETS.colors[SemanticClass.TARGET],
        DARK_GROUND.colors[SemanticClass.GROUND],
    )
    for other, usual in ((yellow, TaskSettings().cube_color), (dark, FLOOR_COLOR)):
        assert all(0.0 <= part <= 1.0 for part in other)
        assert max(abs(a - b) for a, b in zip(other, usual, strict=True)) > 0.2
    red, green, blue = yellow
    assert min(red, green) > 0.5 > blue
