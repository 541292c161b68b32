import copy

import torch
from torch import nn

from drone_rl.policies.actor import RandomSource


def test_copy_shares_the_stream():
    module = nn.Module()
    module.source = RandomSource(torch.Generator().manual_seed(0))
    other = copy.deepcopy(module)
    assert other is not module and other.source is module.source
