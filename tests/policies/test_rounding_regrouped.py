import pytest
import torch

from drone_rl.policies.external_network import ExternalNetwork
from drone_rl.policies.rounding import Regrouped
from drone_rl.sim.actions import MOVES


@pytest.mark.parametrize("groups", ["single", "mixed"])
def test_grouping_does_not_change_a_function_of_the_frame(groups):
    sizes = []

    def logits(pixels):
        sizes.append(len(pixels))
        return pixels.flatten(1) * torch.tensor([1.0, 2.0, 3.0])

    network = ExternalNetwork(logits, (1, 1, 3), MOVES)
    pixels = torch.rand(20, 1, 1, 3)
    sizes.clear()
    assert torch.equal(Regrouped(network, groups)(pixels), pixels.flatten(1) * torch.arange(1, 4))
    assert set(sizes) == {1} if groups == "single" else len(set(sizes)) > 1


def test_dependence_on_the_batch_is_detected():
    network = ExternalNetwork(lambda x: torch.full((len(x), 3), float(len(x))), (1, 1, 3), MOVES)
    pixels = torch.rand(20, 1, 1, 3)
    assert not torch.equal(Regrouped(network, "mixed")(pixels), network(pixels))
    assert not torch.equal(Regrouped(network, "single")(pixels), network(pixels))
