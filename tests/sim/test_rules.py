import itertools

import numpy as np
import torch

from drone_rl.sim import rules
from drone_rl.sim.rules import Action, EndReason, Side
from drone_rl.sim.settings import TaskSettings

SETTINGS = TaskSettings()  # drone and cubes touch up to 1.65 m on each axis


def at(*ys, settings=SETTINGS):
    """One world whose cubes stand at these y."""
    x = settings.first_distance + settings.spacing * torch.arange(len(ys))
    cubes = torch.stack([x, torch.tensor(ys), torch.full((len(ys),), settings.altitude)], -1)
    return rules.start(settings, cubes.double()[None])


def fly(state, x, y, settings=SETTINGS):
    return rules.judge(settings, state, torch.tensor([[x, y, settings.altitude]]).double())


def test_cubes_are_drawn_within_their_bounds_and_uniformly():
    settings = TaskSettings(vertical_bound=1.0, altitude=5.0)
    draws = torch.stack([rules.draw_cubes(settings, np.random.RandomState(i)) for i in range(2000)])
    assert draws[..., 0].unique().tolist() == [15.0, 24.0, 33.0]
    assert draws[..., 1].abs().max() <= 6.0
    assert (draws[..., 2] - 5.0).abs().max() <= 1.0
    assert abs(float(draws[..., 1].mean())) < 0.15  # 6 / sqrt(3) / sqrt(6000) = 0.045
    assert abs(float(draws[..., 1].std()) - 6 / 3**0.5) < 0.1


def test_codes_are_those_of_recorded_files():
    assert [(a.name, a.value) for a in Action] == [("FORWARD", 0), ("LEFT", 1), ("RIGHT", 2)]
    assert [(s.name, s.value) for s in Side] == [("LEFT", 0), ("AHEAD", 1), ("RIGHT", 2)]
    ends = ("RUNNING", "ALL_CUBES", "FRONT_BOUNDARY", "SIDE_BOUNDARY", "STEP_LIMIT")
    assert [(e.name, e.value) for e in EndReason] == [(n, i) for i, n in enumerate(ends)]


def test_a_cube_stands_until_it_is_collected_or_passed_and_the_next_is_the_first_that_stands():
    flags = torch.tensor(list(itertools.product([False, True], repeat=6)))
    state = rules.start(SETTINGS, torch.zeros(64, 3, 3).double())
    state.collected, state.passed = flags[:, :3], flags[:, 3:]
    for collected, passed, present, following in zip(
        state.collected.tolist(),
        state.passed.tolist(),
        state.present.tolist(),
        state.next_cube.tolist(),
        strict=True,
    ):
        stands = [not (c or p) for c, p in zip(collected, passed, strict=True)]
        assert present == stands
        assert following == ([*stands, True].index(True))


def test_a_start_is_at_the_origin_with_everything_to_come():
    settings = TaskSettings(altitude=4.0)
    cubes = rules.draw_cubes(settings, np.random.RandomState(0))
    state = rules.start(settings, [cubes, cubes + 1.0])
    assert state.drone.tolist() == [[0.0, 0.0, 4.0]] * 2
    assert torch.equal(state.cubes[1], cubes + 1.0)
    assert not state.collected.any() and not state.passed.any()
    assert state.steps.tolist() == state.end_reason.tolist() == [0, 0]
    state.collected[0, 0] = True
    assert not state.passed.any()  # no two fields share memory


def test_moves_are_one_metre_forward_left_and_right():
    moves = rules.displacement(SETTINGS, torch.tensor([Action.FORWARD, Action.LEFT, Action.RIGHT]))
    assert moves.tolist() == [[1, 0, 0], [0, 1, 0], [0, -1, 0]]
    half = rules.displacement(TaskSettings(step_length=0.5), torch.tensor([Action.LEFT]))
    assert half.tolist() == [[0, 0.5, 0]]


def test_touching_collects_and_is_worth_one():
    state, reward = fly(at(1.0, 0.0, 0.0), 14.0, 0.0)
    assert reward.tolist() == [1.0]
    assert reward.dtype == torch.float64
    assert state.steps.tolist() == [1]
    assert state.collected.tolist() == [[True, False, False]]
    assert state.next_cube.tolist() == [1]
    _, again = fly(state, 14.0, 1.0)
    assert again.tolist() == [0.0]


def test_touch_distance_is_exact():
    near, reward = fly(at(1.65, 0.0, 0.0), 14.0, 0.0)
    assert reward.item() == 1.0
    far, reward = fly(at(1.66, 0.0, 0.0), 14.0, 0.0)
    assert reward.item() == 0.0
    assert not far.collected.any()
    assert near.collected.any()


def test_passed_cubes_vanish_without_reward():
    state, _ = fly(at(5.0, 0.0, 0.0), 15.0, 0.0)
    assert state.present.tolist() == [[True, True, True]]  # level with it is not past it
    state, reward = fly(state, 16.0, 0.0)
    assert reward.item() == 0.0
    assert state.passed.tolist() == [[True, False, False]]
    assert state.present.tolist() == [[False, True, True]]
    _, reward = fly(state, 16.0, 5.0)
    assert reward.item() == 0.0  # bumping into a vanished cube is worth nothing


def test_side_is_where_the_cube_stood_when_it_became_next():
    state = at(5.0, -5.0, 0.5)
    assert state.side.tolist() == [[Side.LEFT, -1, -1]]
    state, _ = fly(state, 14.0, 5.0)  # collects the first; the second is 10 m to the right
    assert state.side.tolist() == [[Side.LEFT, Side.RIGHT, -1]]
    state, _ = fly(state, 25.0, 1.0)  # passes the second
    assert state.side.tolist() == [[Side.LEFT, Side.RIGHT, Side.AHEAD]]
    assert state.lateral.tolist() == [[5.0, -10.0, -0.5]]  # metres to the left, at that moment


def test_lateral_offset_is_unknown_until_a_cube_is_the_next_one():
    state = at(5.0, -5.0, 0.5)
    assert state.lateral[0, 0] == 5.0
    assert state.lateral[0, 1:].isnan().all()


def test_ends_in_the_order_of_algorithm_3():
    state = at(0.0, 0.0, 0.0)
    assert fly(state, 44.0, 0.0)[0].end_reason.item() == EndReason.RUNNING
    assert fly(state, 45.0, 0.0)[0].end_reason.item() == EndReason.FRONT_BOUNDARY
    assert fly(state, 0.0, 26.0)[0].end_reason.item() == EndReason.RUNNING
    assert fly(state, 0.0, 27.0)[0].end_reason.item() == EndReason.SIDE_BOUNDARY
    assert fly(state, 0.0, -27.0)[0].end_reason.item() == EndReason.SIDE_BOUNDARY
    state.collected[:, :2] = True
    done, _ = fly(state, 33.0, 0.0)
    assert done.end_reason.item() == EndReason.ALL_CUBES
    state.steps[:] = 299
    assert fly(state, 0.0, 0.0)[0].end_reason.item() == EndReason.STEP_LIMIT
    assert fly(state, 33.0, 0.0)[0].end_reason.item() == EndReason.ALL_CUBES


def test_always_left_leaves_after_27_steps_as_in_the_chapter():
    state, steps = at(0.0, 0.0, 0.0), 0
    while state.end_reason.item() == EndReason.RUNNING:
        drone = state.drone + rules.displacement(SETTINGS, torch.tensor([Action.LEFT]))
        state, _ = rules.judge(SETTINGS, state, drone)
        steps += 1
    assert (steps, state.end_reason.item()) == (27, EndReason.SIDE_BOUNDARY)


def test_judge_leaves_its_input_alone():
    state = at(1.0, 0.0, 0.0)
    fly(state, 14.0, 0.0)
    assert not state.collected.any()
    assert state.steps.tolist() == [0]
    assert state.drone[0, 0] == 0.0


def test_select_and_overwrite_worlds():
    states = rules.start(SETTINGS, torch.zeros(3, 3, 3).double())
    part = states[torch.tensor([2])]
    part.steps += 7
    assert states.steps.tolist() == [0, 0, 0]
    states[torch.tensor([2])] = part
    assert states.steps.tolist() == [0, 0, 7]
