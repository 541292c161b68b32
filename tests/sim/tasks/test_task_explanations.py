"""Requirements of explanations that every task meets."""

import torch


def poses(worlds, state):
    """Return the poses of everything that is rendered."""
    return torch.cat([state.body.position[:, None], worlds.task.places(state)], 1)


def test_recall_restores_recorded_scenes(worlds, task, truth):
    state = worlds.state
    kept = task.remember(truth)
    assert set(kept) == set(task.remembered) and "next_target" in kept
    again = task.recall({**kept, "step": state.steps}, state.body)
    torch.testing.assert_close(poses(worlds, again), poses(worlds, state), rtol=0, atol=1e-5)
    assert torch.equal(task.next_target(again), kept["next_target"])


def test_one_target_is_placed_at_the_offset(worlds, task):
    away = torch.tensor([[5.0, 2.0, 0.0], [7.0, -1.0, 0.0]], dtype=torch.float64)
    state = task.one_target(worlds.bodies(2), away)
    torch.testing.assert_close(task.next_offset(state), away)
    gone = task.without_next(state)
    assert task.next_offset(gone).isnan().all()
    props = torch.tensor([*worlds.scene.props, -1])
    seen = worlds.render(state, worlds.view(modality="segmentation")).long()
    assert ((props[seen] >= 0).flatten(1).any(1)).all()
    for nothing in (gone, task.without_targets(state)):
        seen = worlds.render(nothing, worlds.view(modality="segmentation")).long()
        assert (props[seen] < 0).all()
    assert task.next_offset(state)[0, 0] == 5.0  # the input is unchanged


def test_next_moved_moves_only_the_next_target(worlds, task):
    before, target = poses(worlds, worlds.state), task.next_target(worlds.state)
    moved = task.next_moved(worlds.state, torch.full((5,), 1.5).double())
    expected = before.clone()
    expected[torch.arange(5), 1 + target, 1] += 1.5  # the drone's pose is first
    torch.testing.assert_close(poses(worlds, moved), expected, rtol=0, atol=0)
    assert torch.equal(poses(worlds, worlds.state), before)


def test_elsewhere_places_all_targets_in_view(worlds, task):
    generator = torch.Generator().manual_seed(0)
    other = task.elsewhere(worlds.state, worlds.camera, generator)
    assert not torch.equal(poses(worlds, other), poses(worlds, worlds.state))
    props = torch.tensor([*worlds.scene.props, -1])
    seen = worlds.render(other, worlds.view(modality="segmentation")).long()
    assert (props[seen] >= 0).flatten(1).any(1).all()


def test_is_behind_after_the_drone_has_passed(worlds, task):
    state = task.one_target(worlds.bodies(1), torch.tensor([[3.0, 0.0, 0.0]]).double())
    target = task.next_target(state)
    assert not task.is_behind(state, target) and not task.is_reached(state, target)
    state.body.position[:, 0] += 4.0
    assert task.is_behind(state, target)


def test_grid_and_needed_actions_are_symmetric(worlds, task):
    height, forward, lateral = task.grid(4, 5)
    assert (len(forward), len(lateral)) == (4, 5) and 0.0 in height
    torch.testing.assert_close(lateral, -lateral.flip(0))
    assert (forward > 0).all() and (lateral.diff() < 0).all()  # from left to right
    zero = torch.zeros(5).double()
    offset = torch.stack([zero + forward[0], lateral, zero], -1)
    needed, mirrored = task.needed(offset), task.needed(offset.flip(0))
    sides = lateral != 0
    turned = torch.tensor(worlds.dynamics.actions.mirrored)[needed]
    assert torch.equal(turned[sides], mirrored[sides])
    strata = task.stratum_at(offset)
    assert torch.equal(strata[sides], len(task.strata) - 1 - strata.flip(0)[sides])
    assert strata.unique().numel() > 1
