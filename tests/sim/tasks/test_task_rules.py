"""Requirements of simulators that every task meets."""

import torch

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


def test_every_prop_has_a_position_and_a_geom(worlds, task):
    props = task.make_props()
    assert task.places(worlds.state).shape == (5, len(props), 3)
    assert {p for p in worlds.scene.props if p >= 0} == set(range(len(props)))
    for number, prop in enumerate(props):
        meanings = {
            meaning
            for meaning, of in zip(worlds.scene.semantic_classes, worlds.scene.props, strict=True)
            if of == number
        }
        assert meanings == {prop.semantic_class}


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


def test_drone_starts_at_the_origin_of_the_task(worlds, task):
    assert worlds.state.body.position.tolist() == [list(task.origin)] * 5
    assert not worlds.state.end_reason.any() and task.drone_size > 0
