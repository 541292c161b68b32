"""Requirements of simulators, verdicts and explanations that every task meets."""

import torch

from drone_rl.sim.tasks import Goals
from drone_rl.sim.tasks.common import Side
from drone_rl.utils.seeding import world_random_state


def tensors(state):
    """Return all tensors of a state, including those of its body."""
    flat = dict(vars(state))
    body = flat.pop("body")
    return {**flat, **vars(body)}


def test_info_matches_the_entries(worlds, task):
    info = task.info(worlds.state)
    assert set(info) == set(task.entries)
    for name, entry in task.entries.items():
        assert info[name].shape == (5, *entry.shape), name
        assert info[name].dtype == entry.dtype, name
        if entry.low is not None:
            assert entry.low <= info[name].min() and info[name].max() <= entry.high, name
    assert set(task.observed) <= set(task.entries)


def test_random_stream_determines_episodes(task):
    def drawn():
        stream = world_random_state(4, 2)
        return [task.sample(stream) for _ in range(4)]

    first, again = drawn(), drawn()
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True))
    assert len({one.shape for one in first}) == 1
    assert any(not torch.equal(first[0], other) for other in first[1:])


def test_judge_does_not_modify_its_input(worlds, task):
    before = {name: value.clone() for name, value in tensors(worlds.state).items()}
    body = worlds.dynamics.step(worlds.state.body, torch.zeros(5, dtype=torch.int64))
    after, reward = task.step(worlds.state, body)
    for name, value in tensors(worlds.state).items():
        torch.testing.assert_close(value, before[name], equal_nan=True, rtol=0, atol=0)
    assert reward.shape == (5,) and reward.dtype == torch.float64
    assert torch.equal(after.steps, before["steps"] + 1)


def test_environments_are_independent(worlds, task):
    action = torch.tensor([0, 1, 2, 0, 1])
    together, rewards = worlds.advance(worlds.state, action)
    for i in range(5):
        one = torch.tensor([i])
        alone, reward = worlds.advance(worlds.state[one], action[one])
        assert reward.item() == rewards[i].item()
        for name, value in tensors(alone).items():
            found = tensors(together[one])[name]
            torch.testing.assert_close(found, value, equal_nan=True, rtol=0, atol=0, msg=name)


def test_episodes_end_with_a_named_reason(worlds, task):
    """Moving left and right is truncated, with at most the largest reward."""
    state, earned = worlds.state, torch.zeros(5, dtype=torch.float64)
    for step in range(400):
        if (state.end_reason != 0).all():
            break
        state, reward = worlds.advance(state, torch.full((5,), 1 + step % 2))
        earned += reward
    assert {task.ends(int(end)) for end in state.end_reason} == {task.ends(task.truncation)}
    assert (earned <= task.largest_reward).all() and task.ends(0).name == "RUNNING"


def test_goals_need_only_the_scored_entries(task, truth):
    goals = task.score({name: truth[name] for name in task.scored})
    assert isinstance(goals, Goals) and len(goals) == 5
    assert goals.reached.dtype == torch.bool and goals.reached.shape == goals.stratum.shape
    assert goals.stratum.min() >= -1 and goals.stratum.max() < len(task.strata)
    assert goals[:2].world.shape[0] == 2


def test_goals_identify_scenes_not_behavior(worlds, task, truth):
    before = task.score({name: truth[name] for name in task.scored}).world
    state, _ = worlds.advance(worlds.state, torch.tensor([0, 1, 2, 0, 1]))
    later = {**task.info(state), "drone": state.body.position.float()}
    assert torch.equal(task.score({name: later[name] for name in task.scored}).world, before)
    assert len(before.unique(dim=0)) > 1


def test_classes_are_named_subsets_of_goals(task, truth):
    goals = task.score({name: truth[name] for name in task.scored})
    found = list(task.classes(goals))
    assert found
    assert len({(by, value) for by, value, _ in found}) == len(found)
    for by, value, of in found:
        assert by and value and of.dtype == torch.bool and of.shape == goals.reached.shape


def test_oracle_reaches_every_goal(worlds, task):
    rule, state = task.oracle, worlds.state
    done = torch.zeros(5, dtype=torch.bool)
    for _ in range(100):
        info = {**task.info(state), "drone": state.body.position.float()}
        moved, _ = worlds.advance(state, rule.act(*(info[name] for name in rule.reads)))
        going = (~done).nonzero()[:, 0]
        state[going] = moved[going]
        done |= state.end_reason != 0
    info = {**task.info(state), "drone": state.body.position.float()}
    assert task.score({name: info[name] for name in task.scored}).reached.all()
    assert (state.end_reason == task.success_end).all()


def poses(worlds, state):
    """Return the poses of everything that is rendered."""
    return torch.cat([state.body.position[:, None], worlds.task.places(state)], 1)


def test_one_target_is_placed_at_the_offset(worlds, task):
    away = torch.tensor([[5.0, 2.0, 0.0], [7.0, -1.0, 0.0]], dtype=torch.float64)
    state = task.edits.one_target(worlds.bodies(2), away)
    torch.testing.assert_close(task.edits.next_offset(state), away)
    gone = task.edits.without_next(state)
    assert task.edits.next_offset(gone).isnan().all()
    props = torch.tensor([*worlds.scene.props, -1])
    seen = worlds.render(state, worlds.view(modality="segmentation")).long()
    assert ((props[seen] >= 0).flatten(1).any(1)).all()
    seen = worlds.render(gone, worlds.view(modality="segmentation")).long()
    assert (props[seen] < 0).all()
    assert task.edits.next_offset(state)[0, 0] == 5.0  # the input is unchanged


def test_next_moved_moves_only_the_next_target(worlds, task):
    before, target = poses(worlds, worlds.state), task.edits.next_target(worlds.state)
    moved = task.edits.next_moved(worlds.state, torch.full((5,), 1.5).double())
    expected = before.clone()
    expected[torch.arange(5), 1 + target, 1] += 1.5  # the drone's pose is first
    torch.testing.assert_close(poses(worlds, moved), expected, rtol=0, atol=0)
    assert torch.equal(poses(worlds, worlds.state), before)


def test_elsewhere_places_all_targets_in_view(worlds, task):
    generator = torch.Generator().manual_seed(0)
    other = task.edits.elsewhere(worlds.state, worlds.camera, generator)
    assert not torch.equal(poses(worlds, other), poses(worlds, worlds.state))
    props = torch.tensor([*worlds.scene.props, -1])
    seen = worlds.render(other, worlds.view(modality="segmentation")).long()
    assert (props[seen] >= 0).flatten(1).any(1).all()


def test_is_behind_after_the_drone_has_passed(worlds, task):
    state = task.edits.one_target(worlds.bodies(1), torch.tensor([[3.0, 0.0, 0.0]]).double())
    target = task.edits.next_target(state)
    assert not task.edits.is_behind(state, target) and not task.edits.is_reached(state, target)
    state.body.position[:, 0] += 4.0
    assert task.edits.is_behind(state, target)


def test_grid_and_needed_actions_are_symmetric(worlds, task):
    height, forward, lateral = task.edits.grid(4, 5)
    assert (len(forward), len(lateral)) == (4, 5) and 0.0 in height
    torch.testing.assert_close(lateral, -lateral.flip(0))
    assert (forward > 0).all() and (lateral.diff() < 0).all()  # from left to right
    zero = torch.zeros(5).double()
    offset = torch.stack([zero + forward[0], lateral, zero], -1)
    needed, mirrored = task.edits.needed(offset), task.edits.needed(offset.flip(0))
    sides = lateral != 0
    turned = torch.tensor(worlds.dynamics.actions.mirrored)[needed]
    assert torch.equal(turned[sides], mirrored[sides])
    strata = task.edits.stratum_at(offset)
    assert torch.equal(strata[sides], Side.LEFT + Side.RIGHT - strata.flip(0)[sides])
    assert strata.unique().numel() > 1
