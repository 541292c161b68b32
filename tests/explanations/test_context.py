import numpy as np
import torch

from drone_rl.config import TaskSettings
from drone_rl.explanations.context import Context
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import ExternalNetwork
from drone_rl.sim.actions import MOVES

SMALL = ExplainSettings(frames=60, perplexity=5, seed=3)


def test_episodes_do_not_depend_on_earlier_rollouts(make_pipeline):
    flown = []
    for first in ("flights", "restart"):
        env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
        context = Context(env, actor.module[0].module, SMALL)
        if first == "restart":
            policy = context.restart()
            for _ in range(2):  # somebody flies
                env.rollout(50, policy)
        flown.append(context.flights)
    cubes = [flights.arrays["state/places"] for flights in flown]
    np.testing.assert_array_equal(*cubes)
    np.testing.assert_array_equal(flown[0].actions, flown[1].actions)


def test_a_function_has_no_features(make_pipeline):
    env, _ = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 25, 64), MOVES)
    context = Context(env, network, SMALL)
    assert context.layer is None and "features" not in " ".join(context.dataset.arrays)


def test_frames_are_steps_of_the_episodes(make_pipeline):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    context = Context(env, actor.module[0].module, SMALL)
    data, flights = context.dataset, context.flights
    assert len(np.unique(flights.episode)) == len(np.unique(data.episode)) == 30
    assert len(data) == len(data.actions) == 60
    every = zip(flights.episode, flights.step, strict=True)
    step = {(int(e), int(s)): t for t, (e, s) in enumerate(every)}
    rows = [step[int(e), int(s)] for e, s in zip(data.episode, data.step, strict=True)]
    np.testing.assert_array_equal(data.actions, flights.actions[rows])
    assert context.dataset is data


def test_a_copy_for_a_thread_shares_data_and_copies_the_network(make_pipeline):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = actor.module[0].module
    context = Context(env, network, SMALL)
    twin = context.copied_for_thread()
    assert twin.dataset is context.dataset and twin.film is context.film
    assert twin.network is not network and twin.explainer.network is twin.network
    met = []
    handle = network.register_forward_hook(lambda *_: met.append("hook"))
    seen = context.dataset.tensor("observations")
    assert torch.equal(twin.network(seen), network(seen))
    handle.remove()
    assert met == ["hook"]
