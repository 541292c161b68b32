"""Requirements of verdicts that every task meets."""

import torch

from drone_rl.sim.tasks import Goals


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


def test_blind_baselines_are_random_or_valid_actions(worlds, task):
    assert set(task.blind_baselines) - {"random"} <= set(worlds.dynamics.actions.names)
    assert "oracle" not in task.blind_baselines and task.expected_end != task.success_end
