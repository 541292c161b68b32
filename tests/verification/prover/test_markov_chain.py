"""Probabilities by hand, by a second program and by sampled episodes."""

import math
from collections import defaultdict

import pytest
import torch
from torch import nn

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import TaskSettings
from drone_rl.policies import make_actor
from drone_rl.policies.zoo import policy_path, read_policy
from drone_rl.policies.zoo.description import TaskDescription
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.trust.metrics import summarise
from drone_rl.verification.prover import markov_chain
from drone_rl.verification.prover.lattice import explore
from drone_rl.verification.prover.markov_chain import NEGLIGIBLE, NodeEvaluator, propagate


def constant(settings, cubes, *probs):
    """The outcomes of a policy that sees nothing."""
    graph = explore(settings, cubes)
    probs = torch.tensor(probs, dtype=torch.float64)
    return propagate(graph, lambda nodes: probs.expand(len(nodes), 3))


def test_random_walk_by_hand(small, place):
    """s0 = 1/3 + 2/3 s1 and s1 = 1/3 + 1/3 s0; e0 = 1 + 2/3 e1 and e1 = 1 + 1/3 e0."""
    done = constant(small, place(small, [0.0]), 1 / 3, 1 / 3, 1 / 3)
    assert float(done.success[0]) == pytest.approx(5 / 7, abs=1e-14)
    assert float(done.reasons[0, CubesEnd.SIDE_BOUNDARY]) == pytest.approx(2 / 7, abs=1e-14)
    assert float(done.steps[0]) == pytest.approx(15 / 7, abs=1e-13)
    assert 0 < float(done.undecided[0]) < NEGLIGIBLE


def test_improbable_nodes_are_undecided(small, place, monkeypatch):
    """Forward 0.4, left 0.5, right 0.1, and nodes with a mass of at most 0.2 are dropped.

    The place on the right is dropped each time that it is reached: first with 0.1, then with 0.05
    of that (left and back), and so on: 0.1 / (1 - 0.05).
    """
    monkeypatch.setattr(markov_chain, "MIN_PROBABILITY", 0.2)
    done = constant(small, place(small, [0.0]), 0.4, 0.5, 0.1)
    assert float(done.undecided[0]) == pytest.approx(0.1 / 0.95, abs=1e-12)
    assert float(done.success[0]) == pytest.approx(0.4 * 1.5 / 0.95, abs=1e-12)
    assert float(done.steps[0]) == pytest.approx(1.5 / 0.95, abs=1e-12)


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
def test_one_cube_against_a_second_program(place, probs):
    settings = TaskSettings(num_cubes=1, side_margin=3.0, step_limit=60)
    ends, steps = walked(settings, 2.3, probs)
    done = constant(settings, place(settings, [2.3]), *probs)
    for reason in list(CubesEnd)[1:]:
        found = float(done.reasons[0, reason])
        assert found == pytest.approx(ends[reason.name.lower()], abs=1e-14), reason
    assert float(done.steps[0]) == pytest.approx(steps, abs=1e-11)
    assert float(done.reasons.sum() + done.undecided.sum()) == pytest.approx(1.0, abs=1e-14)


class Hotter(nn.Module):
    """A network whose probs are less decided, so that all that can happen does."""

    def __init__(self, network, factor):
        super().__init__()
        self.network, self.factor = network, factor

    def forward(self, pixels):
        return self.factor * self.network(pixels)


def flying(name, num_envs, factor, num_cubes=3):
    """Return an environment and a shipped policy with scaled logits."""
    state = read_policy(policy_path(name))
    task = TaskDescription.of(state.description.task.parameters.replace(num_cubes=num_cubes))
    described = state.description.replace(task=task)
    network = described.build_network()
    network.load_state_dict(state.weights)
    return described.build_env(num_envs, seed=0, device="cpu"), Hotter(network, factor)


def test_sampled_episodes_agree(place, monkeypatch):
    env, network = flying("good", 400, factor=0.1, num_cubes=2)
    task, flights = env.base_env.worlds.task, 800
    cubes = place(task.settings, [4.0, -3.0])
    graph = explore(task.settings, cubes)
    done = propagate(graph, NodeEvaluator(env, network).on(graph))
    monkeypatch.setattr(task, "sample", lambda random_state: cubes[0])
    actor = make_actor(network, env.action_spec, torch.Generator().manual_seed(0))
    flown = rollout(actor, env, flights, greedy=False)
    env.close()
    share = float(done.success[0])
    assert 0.05 < share < 0.95
    sigma = math.sqrt(share * (1 - share) / flights)
    assert abs(summarise(flown).success.share - share) < 5 * sigma
    assert float(flown.length.double().mean()) == pytest.approx(float(done.steps[0]), rel=0.05)
    for reason in CubesEnd:
        p = float(done.reasons[0, reason])
        found = float((flown.end_reason == reason).double().mean())
        assert abs(found - p) <= 5 * math.sqrt(p * (1 - p) / flights) + 1e-9, reason


def test_greedy_episodes_agree():
    env, network = flying("right_and_forward", 20, factor=1e9)
    actor = make_actor(network, env.action_spec)
    flown = rollout(actor, env, 20)
    settings = env.base_env.worlds.task.settings
    cubes = flown.goals.world.view(20, settings.num_cubes, 3).double()
    graph = explore(settings, cubes)
    done = propagate(graph, NodeEvaluator(env, network).on(graph))
    env.close()
    assert torch.equal(done.reasons.argmax(-1), flown.end_reason)
    assert torch.equal(done.collected, flown.goals.reached.double())
    assert torch.equal(done.steps, flown.length.double())
