"""Chances by hand, by a second programme, and by flights of the simulator."""

import dataclasses
import math
from collections import defaultdict

import pytest
import torch
from tensordict.nn import TensorDictModule
from torch import nn

from drone_rl.collectors.complete_episodes import run_episodes
from drone_rl.config import TaskSettings
from drone_rl.policies import make_actor
from drone_rl.policies.zoo import parse, policy_path, read_policy
from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.trust.metrics import summarise
from drone_rl.verification.prover import markov_chain
from drone_rl.verification.prover.lattice import explore
from drone_rl.verification.prover.markov_chain import NEGLIGIBLE, NodeEvaluator, Outcomes, propagate


def constant(settings, cubes, *probs):
    """The outcomes of a policy that sees nothing."""
    graph = explore(settings, cubes)
    probs = torch.tensor(probs, dtype=torch.float64)
    return propagate(graph, lambda nodes: probs.expand(len(nodes), 3))


def test_forward_alone_collects_what_stands_ahead(place):
    settings = TaskSettings()
    done = constant(settings, place(settings, [0.0, 0.0, 0.0], [0.0, 1.7, 0.0]), 1.0, 0.0, 0.0)
    assert done.success.tolist() == [1.0, 0.0]
    assert done.failure.tolist() == [0.0, 1.0]
    assert done.collected.tolist() == [[1.0, 1.0, 1.0], [1.0, 0.0, 1.0]]
    assert done.cubes.tolist() == [3.0, 2.0]
    assert done.ends[1, EndReason.FRONT_BOUNDARY, 0b101] == 1.0
    assert done.steps.tolist() == [32.0, 45.0]  # 33 - 32 < 1.65 metres; 45 > 44
    assert done.undecided.tolist() == [0.0, 0.0]


def test_left_alone_ends_at_the_side(place):
    settings = TaskSettings()
    done = constant(settings, place(settings, [0.0, 0.0, 0.0]), 0.0, 1.0, 0.0)
    assert done.ends[0, EndReason.SIDE_BOUNDARY, 0] == 1.0
    assert done.steps.tolist() == [27.0]


def test_a_random_walk_solved_by_hand(small, place):
    """s0 = 1/3 + 2/3 s1 and s1 = 1/3 + 1/3 s0; e0 = 1 + 2/3 e1 and e1 = 1 + 1/3 e0."""
    done = constant(small, place(small, [0.0]), 1 / 3, 1 / 3, 1 / 3)
    assert float(done.success[0]) == pytest.approx(5 / 7, abs=1e-14)
    assert float(done.reasons[0, EndReason.SIDE_BOUNDARY]) == pytest.approx(2 / 7, abs=1e-14)
    assert float(done.steps[0]) == pytest.approx(15 / 7, abs=1e-13)
    assert 0 < float(done.undecided[0]) < NEGLIGIBLE


def test_what_is_dropped_at_several_steps_adds_up(small, place, monkeypatch):
    """Forward 0.4, left 0.5, right 0.1, and nodes with a mass of at most 0.2 are dropped.

    The place on the right is dropped each time that it is reached: first with 0.1, then with 0.05
    of that (left and back), and so on: 0.1 / (1 - 0.05).
    """
    monkeypatch.setattr(markov_chain, "MIN_PROBABILITY", 0.2)
    done = constant(small, place(small, [0.0]), 0.4, 0.5, 0.1)
    assert float(done.undecided[0]) == pytest.approx(0.1 / 0.95, abs=1e-12)
    assert float(done.success[0]) == pytest.approx(0.4 * 1.5 / 0.95, abs=1e-12)
    assert float(done.steps[0]) == pytest.approx(1.5 / 0.95, abs=1e-12)


def test_the_step_limit_by_hand(small, place):
    settings = small.replace(step_limit=2)
    done = constant(settings, place(settings, [0.0]), 1 / 3, 1 / 3, 1 / 3)
    expected = [0.0, 5 / 9, 0.0, 2 / 9, 2 / 9, 0.0]  # nobody loses control
    assert done.reasons[0].tolist() == pytest.approx(expected, abs=1e-15)
    assert float(done.steps[0]) == pytest.approx(1 + 2 / 3)
    assert float(done.undecided[0]) == 0.0


def test_back_and_forth_for_ever_is_the_step_limit(small, place):
    graph = explore(small, place(small, [0.0]))
    probs = torch.tensor([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).double()
    done = propagate(graph, lambda nodes: probs[nodes])
    assert done.ends[0, EndReason.STEP_LIMIT, 0] == 1.0
    assert done.steps.tolist() == [300.0]


def walked(settings, y, probs):
    """The same of one cube, written anew: a dictionary of places, floats and plain ifs."""
    now, ends, steps = {(0, 0, False): 1.0}, defaultdict(float), 0.0
    for step in range(1, settings.step_limit + 1):
        later = defaultdict(float)
        steps += sum(now.values())
        for (i, j, got), mass in now.items():
            for (di, dj), p in zip([(1, 0), (0, 1), (0, -1)], probs, strict=True):
                a, b = i + di, j + dj
                is_near = abs(a - settings.first_distance) <= 1.65 and abs(b - y) <= 1.65
                gets = got or (is_near and i <= settings.first_distance)
                if gets:
                    ends["all_cubes"] += mass * p
                elif a > settings.first_distance + settings.front_margin:
                    ends["front_boundary"] += mass * p
                elif abs(b) > settings.lateral_bound + settings.side_margin:
                    ends["side_boundary"] += mass * p
                elif step == settings.step_limit:
                    ends["step_limit"] += mass * p
                else:
                    later[a, b, gets] += mass * p
        now = later
    return ends, steps


@pytest.mark.parametrize("probs", [(1 / 3, 1 / 3, 1 / 3), (0.05, 0.5, 0.45), (0.7, 0.05, 0.25)])
def test_one_cube_against_a_programme_written_anew(place, probs):
    settings = TaskSettings(num_cubes=1, side_margin=3.0, step_limit=60)
    ends, steps = walked(settings, 2.3, probs)
    done = constant(settings, place(settings, [2.3]), *probs)
    for reason in list(EndReason)[1:]:
        found = float(done.reasons[0, reason])
        assert found == pytest.approx(ends[reason.name.lower()], abs=1e-14), reason
    assert float(done.steps[0]) == pytest.approx(steps, abs=1e-11)
    assert float(done.reasons.sum() + done.undecided.sum()) == pytest.approx(1.0, abs=1e-14)


def test_placements_are_joined_and_stay_apart(place):
    settings = TaskSettings(num_cubes=2)
    alone = [
        constant(settings, place(settings, y), 0.6, 0.1, 0.3) for y in ([1.0, 2.0], [-4.0, 0.0])
    ]
    both = constant(settings, place(settings, [1.0, 2.0], [-4.0, 0.0]), 0.6, 0.1, 0.3)
    assert torch.allclose(Outcomes.joined(alone).ends, both.ends, rtol=0, atol=1e-14)
    assert len(both) == 2


class Hotter(nn.Module):
    """A network whose probs are less decided, so that all that can happen does."""

    def __init__(self, network, factor):
        super().__init__()
        self.network, self.factor = network, factor

    def forward(self, pixels):
        return self.factor * self.network(pixels)


def flying(name, num_envs, factor, num_cubes=3):
    """A policy of the package, hotter, and worlds in which it flies."""
    state = read_policy(policy_path(name))
    described = parse(state["description"])
    task = described.task.replace(num_cubes=num_cubes)
    described = dataclasses.replace(described, task=task)
    network = described.build_network()
    network.load_state_dict(state["policy"])
    return described.build_env(num_envs, seed=0, device="cpu"), Hotter(network, factor)


def test_flights_of_the_simulator_with_drawn_actions_agree(place, monkeypatch):
    env, network = flying("good", 500, factor=0.1, num_cubes=2)
    task, flights = env.base_env.worlds.task, 2000
    cubes = place(task.settings, [4.0, -3.0])
    graph = explore(task.settings, cubes)
    done = propagate(graph, NodeEvaluator(env, network).on(graph))
    monkeypatch.setattr(task, "sample", lambda random_state: cubes[0])
    actor = make_actor(network, env.action_spec, torch.Generator().manual_seed(0))
    flown = run_episodes(env, actor, flights, greedy=False)
    env.close()
    share = float(done.success[0])
    assert 0.05 < share < 0.95
    sigma = math.sqrt(share * (1 - share) / flights)
    assert abs(summarise(flown)["success"]["share"] - share) < 5 * sigma
    assert float(flown.length.double().mean()) == pytest.approx(float(done.steps[0]), rel=0.05)
    for reason in EndReason:
        p = float(done.reasons[0, reason])
        found = float((flown.end_reason == reason).double().mean())
        assert abs(found - p) <= 5 * math.sqrt(p * (1 - p) / flights) + 1e-9, reason


def test_greedy_flights_end_as_a_policy_does_that_is_sure_of_itself():
    env, network = flying("right_and_forward", 20, factor=1e9)
    actor = make_actor(network, env.action_spec)
    assert isinstance(actor.module[0], TensorDictModule)
    flown = run_episodes(env, actor, 20)
    settings = env.base_env.worlds.task.settings
    cubes = flown.goals.world.view(20, settings.num_cubes, 3).double()
    graph = explore(settings, cubes)
    done = propagate(graph, NodeEvaluator(env, network).on(graph))
    env.close()
    assert torch.equal(done.reasons.argmax(-1), flown.end_reason)
    assert torch.equal(done.collected, flown.goals.reached.double())
    assert torch.equal(done.steps, flown.length.double())


def test_what_is_all_but_impossible_is_not_asked_for_and_told_as_undecided(place):
    settings = TaskSettings(num_cubes=1)
    graph = explore(settings, place(settings, [0.0]))
    asked = []

    def ask(nodes):
        asked.append(nodes)
        return torch.tensor([1.0 - 1e-10, 1e-10, 0.0], dtype=torch.float64).expand(len(nodes), 3)

    done = propagate(graph, ask)
    nodes = torch.cat(asked)
    assert (
        len(nodes) == len(nodes.unique()) == 2 * 14
    )  # 14 steps to the cube: straight, or one left
    assert graph.nodes.aside[nodes].unique().tolist() == [0, 1]
    twice_left = 1e-20 * sum(range(1, 15))  # the first left any time before the second one
    assert float(done.undecided[0]) == pytest.approx(twice_left, rel=1e-6)
    assert float(done.success[0]) == pytest.approx(1.0, abs=1e-15)
