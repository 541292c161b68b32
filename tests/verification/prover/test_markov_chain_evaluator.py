"""What a policy is shown of a node is what its camera shows it there."""

import torch

from drone_rl.config import TaskSettings
from drone_rl.verification.prover.lattice import explore
from drone_rl.verification.prover.markov_chain import NodeEvaluator


def test_wishes_are_those_of_the_same_pictures_in_flight(make_pipeline):
    env, actor = make_pipeline(3, task=TaskSettings(num_cubes=2))
    network = actor.module[0].module
    now = env.reset()
    task = env.base_env.worlds.task.settings
    cubes = env.base_env.worlds.state.cubes.clone()
    graph, sight = explore(task, cubes), NodeEvaluator(env, network)
    ask, node = sight.on(graph), torch.arange(3)
    probs = ask(torch.arange(len(graph.nodes)))
    assert sight.num_images == len(graph.images()[0])
    assert torch.equal(ask(torch.tensor([7, 3, 7])), probs[[7, 3, 7]])
    assert sight.num_images == len(graph.images()[0])  # no more than before
    random = torch.Generator().manual_seed(0)
    for _ in range(20):
        with torch.no_grad():
            expected = network(now["pixels"]).double().softmax(-1)
        assert torch.allclose(probs[node], expected, atol=1e-6, rtol=0)
        action = torch.randint(0, 3, (3,), generator=random) * (torch.arange(3) % 2)  # one wanders
        node = graph.target[node, action]
        now = env.step(now.set("action", action))["next"]
    assert len(probs) == len(graph.nodes)
    assert torch.allclose(probs.sum(-1), torch.ones(len(probs)).double())
