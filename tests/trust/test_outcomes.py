import torch

import drone_rl
from drone_rl.envs.direct_renderer import DirectRenderer
from drone_rl.policies.rounding import Decisions
from drone_rl.sim.actions import Move
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.trust.outcomes import MAX_BRANCHES, enumerate_outcomes


def ends(possible):
    with drone_rl.load_policy("good").flying(3, seed=0) as (env, _):
        env.reset()
        renderer = DirectRenderer.try_create(env, ("pixels",), ())

        def decide(pixels):
            return Decisions(torch.zeros(len(pixels), 3), possible(pixels))

        return enumerate_outcomes(renderer, decide, torch.tensor([0, 2]))


def test_one_possible_action_gives_one_end():
    found = ends(lambda x: torch.tensor([[False, True, False]]).expand(len(x), 3))
    assert found.owner.tolist() == [0, 1]
    assert found.episodes.end_reason.tolist() == [EndReason.SIDE_BOUNDARY] * 2
    assert not found.is_open.any()


def then_left(*first):
    """What is possible: these actions at the first steps, then every branch goes on to the left."""
    steps = iter(first)

    def possible(pixels):
        made = torch.zeros(len(pixels), 3, dtype=torch.bool)
        made[:, next(steps, [Move.LEFT])] = True
        return made

    return possible


def test_two_possible_first_actions_give_all_ends_of_both():
    found = ends(then_left([Move.LEFT, Move.RIGHT]))
    assert sorted(found.owner.tolist()) == [0, 0, 1, 1]
    assert (found.episodes.end_reason == EndReason.SIDE_BOUNDARY).all()
    assert len(set(found.episodes.length.tolist())) == 2


def test_ways_to_one_state_are_one_branch():
    """Forward and left in either order lead to one state, though cubes ahead have no distance."""
    found = ends(then_left(*[[Move.FORWARD, Move.LEFT]] * 2))
    assert sorted(found.owner.tolist()) == [0, 0, 0, 1, 1, 1]


def test_too_many_branches_are_left_open():
    found = ends(lambda x: torch.ones(len(x), 3, dtype=torch.bool))
    assert found.is_open.all()
    assert len(found.owner) <= 4 * MAX_BRANCHES
