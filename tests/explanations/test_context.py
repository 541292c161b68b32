import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch

from drone_rl.config import TaskSettings
from drone_rl.explanations.context import Context
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies import ExternalNetwork
from drone_rl.sim.actions import MOVES

SMALL = ExplainSettings(frames=60, perplexity=5, seed=3)


def test_worlds_and_actions_start_afresh_whoever_asked_first(make_pipeline):
    flown = []
    for first in ("flights", "restart"):
        env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
        context = Context(env, actor.module[0].module, SMALL)
        if first == "restart":
            policy = context.restart()
            for _ in range(2):  # somebody flies
                env.rollout(50, policy)
        flown.append(context.flights)
    np.testing.assert_array_equal(flown[0].cubes, flown[1].cubes)
    np.testing.assert_array_equal(flown[0].actions, flown[1].actions)


def test_of_a_function_no_layers_are_recorded(make_pipeline):
    env, _ = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = ExternalNetwork(lambda x: x.flatten(1)[:, :3], (1, 25, 64), MOVES)
    context = Context(env, network, SMALL)
    assert context.layer is None and context.dataset.features == {}


def test_frames_are_of_the_flights_and_maps_of_the_frames(make_pipeline):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    context = Context(env, actor.module[0].module, SMALL)
    data, flights = context.dataset, context.flights
    assert len(np.unique(flights.episode)) == len(np.unique(data.episode)) == 30
    assert len(data) == len(data.actions) == 60
    every = zip(flights.episode, flights.step, strict=True)
    step = {(int(e), int(s)): t for t, (e, s) in enumerate(every)}
    rows = [step[int(e), int(s)] for e, s in zip(data.episode, data.step, strict=True)]
    np.testing.assert_array_equal(data.actions, flights.actions[rows])
    assert context.dataset is data and context.maps is context.maps  # made once
    first = context.explainer.saliency(data.tensor("observations")[:2], data.tensor("actions")[:2])
    torch.testing.assert_close(context.maps["saliency"][:2], first)
    assert set(context.maps) == set(context.frame_maps)


def test_another_thread_has_the_same_data_and_a_network_of_its_own(make_pipeline):
    env, actor = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = actor.module[0].module
    context = Context(env, network, SMALL)
    twin = context.copied_for_thread()
    assert twin.dataset is context.dataset and twin.film is context.film
    assert twin.maps is context.maps and context.frame_maps is twin.frame_maps
    assert twin.network is not network and twin.explainer.network is twin.network
    met = []
    handle = network.register_forward_hook(lambda *_: met.append("hook"))
    seen = context.dataset.tensor("observations")
    assert torch.equal(twin.network(seen), network(seen))
    handle.remove()
    assert met == ["hook"]


def test_what_has_no_gradients_is_shared_with_another_thread(make_pipeline):
    env, _ = make_pipeline(num_envs=30, task=TaskSettings(num_cubes=1))
    network = ExternalNetwork(lambda x: x.detach().flatten(1)[:, :3], (1, 25, 64), MOVES)
    assert Context(env, network, SMALL).copied_for_thread().network is network


def test_the_first_thread_computes_a_shared_value_and_others_wait(context):
    threads = []

    def compute():
        threads.append(threading.get_ident())
        time.sleep(0.05)
        return object()

    with ThreadPoolExecutor(4) as pool:
        got = list(pool.map(lambda _: context.shared("a test", compute), range(8)))
    assert len(threads) == 1 and all(one is got[0] for one in got)
