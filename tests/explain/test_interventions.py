import numpy as np
import torch

from drone_rl.explain.interventions import Intervention, agreement, claim, intervene
from drone_rl.explain.scenes import Region, empty_scene, place_cube


def test_only_what_was_changed_changes(scenes, world):
    state = place_cube(scenes, torch.tensor([5.0, 8.0]), torch.tensor([2.0, -1.0]))
    regions, before = scenes.regions(state), scenes.frames(state)
    changes = {c.name: c for c in intervene(scenes, world[2], state, regions)}
    cube = regions == Region.NEXT_CUBE
    away = changes["cube taken away"]
    torch.testing.assert_close(away.frames, scenes.frames(empty_scene(scenes)).expand_as(before))
    for name in ("cube recoloured", "ground patch changed"):
        changed = (changes[name].frames != before).any(-1)
        assert torch.equal(changed, changes[name].area), name
    assert torch.equal(changes["cube recoloured"].area, cube)
    patch = changes["ground patch changed"].area
    assert patch.any() and (regions[patch] == Region.GROUND).all()
    moved = changes["cube moved"]
    assert torch.equal((moved.frames != before).any(-1), moved.area)
    assert all(np.isfinite(c.effect).all() for c in changes.values())


def test_without_a_cube_there_is_nothing_to_change(scenes, world):
    state = empty_scene(scenes)
    for change in intervene(scenes, world[2], state, scenes.regions(state)):
        assert np.isnan(change.effect).all()


def test_a_claim_is_the_areas_share_of_the_heat():
    maps = torch.tensor([[[3.0, 1.0]], [[0.0, 0.0]]])
    area = torch.tensor([[[True, False]], [[True, False]]])
    found = claim(maps, area)
    assert found[0] == 0.75 and np.isnan(found[1])


def test_agreement_of_a_true_and_of_a_false_map():
    areas = torch.eye(4, dtype=torch.bool)[:, None]  # frame t: pixel t was changed
    effect = np.array([0.1, 0.2, 0.3, 0.4])
    change = Intervention("x", areas, effect, torch.zeros(4, 1, 4, 3))
    honest = torch.tensor(effect).expand(4, 4)[:, None]
    assert agreement(honest, [change], np.arange(4))["correlation"] == 1.0
    assert agreement(honest.flip(-1), [change], np.arange(4))["correlation"] == -1.0
    assert agreement(torch.ones(4, 1, 4), [change], np.arange(4))["correlation"] is None
